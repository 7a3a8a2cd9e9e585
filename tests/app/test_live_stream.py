"""Other programs follow the pen where the user lets them, and the window says so."""

import re
import socket
from typing import TYPE_CHECKING

import pytest
from benchmarks.postgres_server import free_port
from pyigtl import OpenIGTLinkClient
from PySide6.QtCore import Qt
from pytestqt.qtbot import QtBot
from tests.accepted_tip import accept_tip
from tests.app.typed_numbers import type_number

from lightpen.swing.preparation import SourceChoice
from lightpen_app.widgets.number_field import NumberField
from lightpen_app.widgets.state_banner import SignLabel
from lightpen_app.work.settings import Settings
from lightpen_app.work.workbench import Workbench
from lightpen_app_extensions.stream.service import (
    KEY,
    StreamChoice,
    StreamDialog,
    StreamService,
)
from lightpen_extensions.stream.server import LOOPBACK, StreamPlace

if TYPE_CHECKING:
    from tests.app.conftest import Walker

ANY = StreamPlace(port=0)


@pytest.mark.slow
@pytest.mark.qt_log_ignore(
    "^This plugin does not support (raise|grabbing)", extend=True
)
def test_who_listens_follows_the_pen_and_every_page_says_so(
    walker: "Walker", settings: Settings
) -> None:
    chosen = free_port()
    assert not walker.tells("Live stream at")
    walker.press(Qt.Key.Key_F10)
    walker.choose("Live stream...")
    (dialog,) = walker.window.findChildren(StreamDialog)
    walker.until(dialog.isVisible)
    (port,) = dialog.findChildren(NumberField)
    type_number(port, chosen)
    walker.click_on(walker.control("Stream pose and tip", dialog))

    walker.until_tells(f"Live stream at {LOOPBACK}:{chosen}, clients: 0")
    assert settings.of_extension(KEY, StreamChoice()).is_on
    assert any("Active at" in text for text in walker.texts(dialog))
    dialog.close()
    selection = walker.workbench.selection
    selection.set_preparation(selection.preparation.with_source(SourceChoice()))
    walker.workbench.files.use_samples()
    walker.until(lambda: walker.workbench.live.operator is not None)
    walker.operator.seat()
    client = OpenIGTLinkClient(port=chosen)
    walker.until_tells("clients: 1")
    walker.until(lambda: client.wait_for_message("PenToCamera", timeout=0) is not None)
    client.stop()
    walker.until_tells("clients: 0")


def test_the_tip_in_force_is_streamed_and_one_that_comes_into_force(
    workbench: Workbench, qtbot: QtBot
) -> None:
    streaming = StreamService(workbench).streaming
    streaming.want(ANY)
    qtbot.waitUntil(lambda: streaming.status.place is not None)
    assert not streaming.has_tip

    accept_tip(workbench.folder, workbench.selection.preparation)
    streaming.read_tip()

    qtbot.waitUntil(lambda: streaming.has_tip)


def test_a_taken_port_is_reported_until_another_place_is_chosen(
    workbench: Workbench, qtbot: QtBot
) -> None:
    streaming = StreamService(workbench).streaming
    with socket.create_server((LOOPBACK, 0)) as other:
        port = other.getsockname()[1]
        streaming.want(StreamPlace(port=port))
        qtbot.waitUntil(lambda: bool(streaming.fault))
    assert re.match(f"Port {port} is in use already", streaming.fault)

    streaming.want(ANY)

    qtbot.waitUntil(lambda: streaming.status.place is not None)
    assert streaming.fault == ""


def test_a_stream_that_is_wanted_no_more_ends(
    workbench: Workbench, qtbot: QtBot
) -> None:
    streaming = StreamService(workbench).streaming
    streaming.want(ANY)
    qtbot.waitUntil(lambda: streaming.status.place is not None)

    streaming.want(None)

    qtbot.waitUntil(lambda: streaming.status.place is None)


def test_an_address_beyond_this_computer_is_warned_of(qtbot: QtBot) -> None:
    dialog = StreamDialog()
    qtbot.addWidget(dialog)

    def warns() -> bool:
        remarks = (each.value().text for each in dialog.findChildren(SignLabel))
        return any(
            "Every computer in this network can receive the data without signing in."
            in text
            for text in remarks
        )

    dialog.set_value(is_on=False, place=StreamPlace())
    assert not warns()
    dialog.set_value(is_on=False, place=StreamPlace("0.0.0.0"))
    assert warns()
