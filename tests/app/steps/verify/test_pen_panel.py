"""What is reported of the pen is of the pen that is chosen now."""

from dataclasses import replace
from threading import Event
from typing import TYPE_CHECKING

import pytest
from PySide6.QtCore import QCoreApplication, Qt, QThreadPool
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot
from tests.accepted_tip import accept_tip

from lightpen_app.steps.verify.pen_panel import PenPanel
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.sign_label import SignLabel
from lightpen_app.work.workbench import Workbench

if TYPE_CHECKING:
    from tests.app.conftest import HoldBack


@pytest.fixture
def slow_machine(hold_back: "HoldBack") -> Event:
    """LED files are improved once this is set."""
    return hold_back("lightpen_app.steps.verify.pen_panel.improve_led_file")


def words(panel: PenPanel) -> str:
    labels = panel.findChildren(SignLabel)
    reported = (each.value().text for each in labels if each.isVisible())
    return " ".join(filter(None, reported))


def button(panel: PenPanel, text: str) -> PushButton:
    return next(b for b in panel.findChildren(PushButton) if b.text() == text)


def test_what_comes_of_the_pen_before_is_not_shown_for_the_next_one(
    qtbot: QtBot, workbench: Workbench, slow_machine: Event
) -> None:
    for seed in (3, 4, 5, 6):
        accept_tip(workbench.folder, workbench.selection.preparation, seed=seed)
    panel = PenPanel(workbench)
    qtbot.addWidget(panel)
    panel.show()
    improve = button(panel, "Improve the LED file")
    qtbot.waitUntil(improve.isEnabled)
    QTest.mouseClick(improve, Qt.MouseButton.LeftButton)
    assert button(panel, "Cancel").isVisible()

    now = workbench.selection.preparation
    workbench.selection.set_preparation(
        replace(now, names=replace(now.names, pen="LP-05"))
    )
    assert not button(panel, "Cancel").isVisible()
    slow_machine.set()
    QThreadPool.globalInstance().waitForDone()
    QCoreApplication.processEvents()

    assert words(panel) == (
        "Two accepted swings of pen LP-05 with this LED file are needed; so far: 0."
    )


def test_swings_are_said_to_be_read_only_as_long_as_they_are(
    qtbot: QtBot, workbench: Workbench
) -> None:
    panel = PenPanel(workbench)
    qtbot.addWidget(panel)
    panel.show()
    assert words(panel) == "Reading the swings of the pen."
    QThreadPool.globalInstance().waitForDone()
    QCoreApplication.processEvents()
    assert words(panel).startswith("Two accepted swings")
    panel.resize(900, 400)  # the words stay with their sign, not in the middle
    verdict = panel.findChild(SignLabel)
    assert isinstance(verdict, SignLabel)
    assert verdict.height() <= verdict.heightForWidth(verdict.width())

    workbench.selection.set_preparation(
        replace(workbench.selection.preparation, pen_file=None)
    )

    assert not words(panel)
    panel.shut_down()
