"""Every dialog fits a screen of 1280 x 800 at 150 %, and clips no words."""

from collections.abc import Callable
from pkgutil import resolve_name

import pytest
from PySide6.QtCore import QSize
from PySide6.QtWidgets import QApplication, QPushButton, QWidget
from pytestqt.qtbot import QtBot
from tests.app.room import clipped_words, scrolled_sideways

from lightpen.record.library.tip_library import ItemKind
from lightpen_app.shell.menus import About, HelpWindow
from lightpen_app.steps.camera.intrinsics_panel import PartDialog
from lightpen_app.steps.start.library_dialog import LibraryDialog
from lightpen_app.steps.start.limits_dialog import AssumptionsDialog, LimitsDialog
from lightpen_app.widgets.fitting import FRAME, DialogScroll, fitted_place
from lightpen_app.work.workbench import Workbench
from lightpen_extensions.simulator.swings import paper_camera

SMALL = QSize(853, 533)  # 1280 x 800 at 150 %
Made = Callable[[Workbench], QWidget]


def library(_: Workbench) -> LibraryDialog:
    return LibraryDialog()


def library_form(workbench: Workbench) -> LibraryDialog:
    dialog = library(workbench)
    dialog.add("T-7", ItemKind.TIP)
    return dialog


def made(name: str, *given: object) -> QWidget:
    dialog: QWidget = resolve_name(f"lightpen_app_extensions.{name}")(*given)
    return dialog


MADE: dict[str, Made] = {
    "about": lambda _: About({"Python": "3.11", "Qt": "6.11"}),
    "stream": lambda _: made("stream.service:StreamDialog"),
    "help": lambda _: HelpWindow(),
    "board": lambda workbench: made(
        "boards.window:BoardWindow", workbench.live, workbench.save_place
    ),
    "laboratory": lambda _: made("exports.laboratory_dialog:LaboratoryDialog", None),
    "part of the sensor": lambda _: PartDialog(paper_camera()),
    "assumptions": lambda _: AssumptionsDialog(),
    "limits": lambda _: LimitsDialog(),
    "library": library,
    "library form": library_form,
}


@pytest.mark.parametrize("name", MADE)
def test_a_dialog_fits_a_small_screen_and_clips_no_words(
    qtbot: QtBot, workbench: Workbench, name: str
) -> None:
    dialog = MADE[name](workbench)
    qtbot.addWidget(dialog)
    dialog.show()
    available = dialog.screen().availableGeometry()
    available.setSize(SMALL)
    place = fitted_place(dialog.geometry(), available)

    dialog.setGeometry(place)
    QApplication.processEvents()

    # Else it cannot be made so small.
    assert dialog.size().boundedTo(SMALL - FRAME) == dialog.size()
    assert clipped_words(dialog) == ()
    assert scrolled_sideways(dialog) == ()
    dialog.close()


def test_all_limits_are_seen_without_scrolling_where_the_screen_has_room(
    qtbot: QtBot,
) -> None:
    dialog = LimitsDialog()
    qtbot.addWidget(dialog)
    dialog.show()

    scroll = dialog.findChild(DialogScroll)
    assert isinstance(scroll, DialogScroll)
    room = dialog.screen().availableGeometry().size()
    assert room.height() <= 800
    qtbot.waitUntil(lambda: scroll.verticalScrollBar().maximum() == 0)
    assert dialog.size().boundedTo(room - FRAME) == dialog.size()
    buttons = dialog.findChildren(QPushButton)
    assert all(button.icon().isNull() for button in buttons)
