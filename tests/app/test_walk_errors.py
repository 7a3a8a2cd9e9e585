"""What can go wrong on the way through the wizard is reported, and loses nothing."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QApplication

from lightpen.model.limits import SwingLimits
from lightpen.record.swings.header import Names
from lightpen.swing.preparation import SourceChoice
from lightpen_app.work.settings import Settings, Station, StoredCamera

if TYPE_CHECKING:
    from tests.app.conftest import OpenWizard, Walker

# Of raising a window and grabbing the keyboard, which menus do.
pytestmark = pytest.mark.qt_log_ignore("^This plugin does not support ")

Key = Qt.Key
STATION = "Hall 2"
LONG = Station(
    Names("", "Ann", "LP-04", "T-10", "C-1"),
    camera=StoredCamera(SourceChoice()),
    limits=SwingLimits(max_uncertainty=1e-4, min_images=300),
)
N_MASHED = 150  # keys and clicks
KEYS = (
    *(Key.Key_Tab, Key.Key_Return, Key.Key_Space, Key.Key_Escape, Key.Key_Backspace),
    *(Key.Key_PageDown, Key.Key_PageUp, Key.Key_Home, Key.Key_End),
    *(Key.Key_Up, Key.Key_Down, Key.Key_Left, Key.Key_Right),
    *(Key.Key_Insert, Key.Key_Delete, Key.Key_F1, Key.Key_F10, Key.Key_F11),
    *(Key.Key_0, Key.Key_5, Key.Key_9, Key.Key_Comma, Key.Key_Period, Key.Key_Minus),
    *(Key.Key_A, Key.Key_B, Key.Key_Plus),
)


@pytest.fixture
def prepared(
    settings: Settings, open_wizard: "OpenWizard", monkeypatch: pytest.MonkeyPatch
) -> "Walker":
    """The program at a station that is known; a swing there would go on and on.

    It begins a second after the tip was seated; whole swings are walked elsewhere.
    """
    rules, view = "lightpen.swing.capture.rules", "lightpen_app.steps.swing.words"
    for module in (rules, view):
        monkeypatch.setattr(f"{module}.COUNTDOWN", 1.0)
    settings.set_station(STATION, LONG)
    settings.set_last(station=STATION)
    return open_wizard()


def go_to(walker: "Walker", title: str) -> None:
    """Click a step in the list, or press the main button until it is open."""
    while walker.title() != title:
        if walker.steps().get(title, "closed") != "closed":
            walker.click_step(title)
            continue
        walker.until(walker.main_button().isEnabled)
        walker.click_on(walker.main_button())


def keep_on(walker: "Walker", n_more: int = 3) -> None:
    """Wait until the swing has kept some more images."""
    run = walker.workbench.run
    walker.until(lambda: run.status.state is not None)
    n_before = n_kept(walker)
    walker.until(lambda: n_kept(walker) >= n_before + n_more)


def n_kept(walker: "Walker") -> int:
    state = walker.workbench.run.status.state
    assert state is not None
    return state.n_kept


# The window


@pytest.mark.slow
def test_about_tells_the_versions_and_licences_and_opens_the_log(
    prepared: "Walker", monkeypatch: pytest.MonkeyPatch
) -> None:
    reported: list[str] = []
    opened: list[Path] = []
    place = "lightpen_app.application.open_folder"

    def note(folder: Path) -> str:
        opened.append(folder)
        return ""

    monkeypatch.setattr(place, note)

    def read_and_close() -> None:
        about = QApplication.activeModalWidget()
        if about is not None and about.isActiveWindow():
            reported.extend(prepared.texts(about))
            prepared.click_on(prepared.control("Open the log", about))
            prepared.press(Key.Key_Escape)

    timer = QTimer(prepared.window, interval=20)
    timer.timeout.connect(read_and_close)
    timer.start()
    prepared.press(Key.Key_F10)
    prepared.choose("About Lightpen")
    timer.stop()

    for part in ("PySide6 ", "Qt, PySide6 and psycopg: LGPL 3", "FFmpeg", "Noto Sans"):
        assert any(part in text for text in reported), part
    assert opened == [prepared.workbench.folder / "logs"]


# Anything else


@pytest.mark.slow
@pytest.mark.parametrize("step", ["Start", "Camera", "LEDs", "Swing"])
def test_any_keys_and_clicks_leave_a_window_that_answers(
    prepared: "Walker", tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: str
) -> None:
    monkeypatch.chdir(tmp_path)  # a dialog may be made to save something
    rng = np.random.default_rng(len(step))
    go_to(prepared, step)
    if step == "Swing":
        prepared.swing()
        keep_on(prepared)
    window = prepared.window
    leaving = QTimer(window, interval=50)
    leaving.timeout.connect(leave_dialog)
    leaving.start()
    for _ in range(N_MASHED):
        if rng.random() < 0.6:
            prepared.press(KEYS[rng.integers(len(KEYS))])
        else:
            prepared.click_anywhere(*rng.integers((window.width(), window.height())))
        QApplication.processEvents()
    leaving.stop()
    while (popup := QApplication.activePopupWidget()) is not None:
        popup.close()
    for other in QApplication.topLevelWidgets():
        if other is not window:
            other.close()
    prepared.take_window()

    assert window.isVisible()
    prepared.click_step("Start")
    assert prepared.title() == "Start"
    if prepared.offers("Set up station..."):
        prepared.click("Set up station...")
    prepared.enter("Operator", "Bob")
    prepared.until(
        lambda: prepared.workbench.selection.preparation.names.operator == "Bob"
    )


def leave_dialog() -> None:
    dialog = QApplication.activeModalWidget()
    if dialog is not None:
        dialog.close()
