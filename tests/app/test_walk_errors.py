"""What can go wrong on the way through the wizard is reported, and loses nothing."""

import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from PySide6.QtCore import Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QMessageBox
from tests.faulty_camera import FaultyCamera

from lightpen.cameras.protocol import ImageCamera
from lightpen.live.sources import SourceEnvironment, camera_of
from lightpen.model.limits import SwingLimits
from lightpen.record.results.result_folder import RESULTS, SIMULATED
from lightpen.record.swings.interrupted import find_unfinished
from lightpen.record.swings.names import Names
from lightpen.record.swings.reading import DISCARDED, open_record
from lightpen.swing.capture.state import Phase
from lightpen.swing.image_sources import SourceChoice
from lightpen_app.work.settings import Settings
from lightpen_app.work.stations import Station

if TYPE_CHECKING:
    from tests.app.conftest import OpenWizard, Walker

# Of raising a window and grabbing the keyboard, which menus do.
pytestmark = pytest.mark.qt_log_ignore("^This plugin does not support ")

Key = Qt.Key
STATION = "Hall 2"
LONG = Station(
    Names("", "Ann", "LP-04", "T-10", "C-1"),
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
    settings.set_last_station(STATION)
    return open_wizard()


@pytest.fixture
def capturing(prepared: "Walker") -> "Walker":
    """A swing of some images that goes on."""
    go_to(prepared, "Swing")
    prepared.swing()
    keep_on(prepared)
    return prepared


@pytest.fixture
def cameras(monkeypatch: pytest.MonkeyPatch) -> list[FaultyCamera]:
    """The simulated cameras that are opened, so that something can befall them."""
    opened: list[FaultyCamera] = []

    def noted(choice: SourceChoice, around: SourceEnvironment) -> ImageCamera:
        camera = camera_of(choice, around)
        assert isinstance(camera, FaultyCamera)
        opened.append(camera)
        return camera

    monkeypatch.setattr("lightpen.live.sources.SimulatedCamera", FaultyCamera)
    monkeypatch.setattr("lightpen.live.sources.camera_of", noted)
    return opened


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Callable[[int], None]]:
    """Put what the program writes on a disk of its own.

    Returns a function that leaves so much room there, bytes.
    """
    if not hasattr(os, "geteuid") or os.geteuid() != 0:
        pytest.skip("only root can mount a disk")
    place = tmp_path / "data"
    place.mkdir()

    def mount(options: str) -> bool:
        command = ("mount", "-t", "tmpfs", "-o", options, "tmpfs", str(place))
        return subprocess.run(command, capture_output=True, check=False).returncode == 0

    if not mount("size=64m"):
        pytest.skip("no disk can be mounted here")

    def leave(room: int) -> None:
        while not mount(f"remount,size={shutil.disk_usage(place).used + room}"):
            pass  # more was written meanwhile

    yield leave
    subprocess.run(("umount", "-l", str(place)), check=True)


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


def phase(walker: "Walker") -> Phase:
    state = walker.workbench.run.status.state
    assert state is not None
    return state.phase


def record_folder(walker: "Walker") -> Path:
    folder = walker.workbench.run.status.record_folder
    assert folder is not None
    return folder


# The pen


@pytest.mark.slow
def test_a_swing_with_too_little_tilt_is_refused_until_there_is_more(
    capturing: "Walker",
) -> None:
    first = record_folder(capturing)
    capturing.click("Finish early")
    assert capturing.tells("Not enough tilt ")
    assert capturing.tells(". Tilt the pen further. Images needed: about")
    unknown = "The images do not determine the tip yet."
    assert capturing.tells(unknown) or capturing.tells("U (k = 2) of the tip is ")
    assert capturing.tells("Images captured:")
    capturing.click("Continue swinging")
    keep_on(capturing, 20)
    assert phase(capturing) is Phase.CAPTURING

    finish_now(capturing)
    capturing.until_says("REPEAT")
    capturing.click("Review")
    assert capturing.tells("REPEAT: ")
    assert not capturing.offers("Accept...")
    assert capturing.control("Accept...").toolTip().startswith("Result not acceptable.")
    assert not list(capturing.workbench.folder.rglob("results"))

    n_before = n_kept(capturing)
    capturing.click("Capture more")
    capturing.until_shows("Swing")
    assert n_kept(capturing) == n_before
    keep_on(capturing, 8)
    finish_now(capturing)
    capturing.until(lambda: capturing.workbench.run.status.solution is not None)
    capturing.until(capturing.main_button().isEnabled)
    capturing.click("Review")

    capturing.click("Repeat swing")
    assert capturing.tells("Repeat the swing from the start?")
    capturing.click("Continue with these")
    assert capturing.title() == "Review"
    capturing.click("Repeat swing")
    (again,) = (w for w in capturing.seen() if capturing.names(w) == {"Repeat swing"})
    capturing.click_on(again)
    capturing.until_shows("Swing")
    capturing.until(
        lambda: capturing.workbench.run.status.record_folder not in (None, first)
    )
    assert open_record(first).verdict == DISCARDED
    assert len(open_record(first).images) >= n_before
    keep_on(capturing)


def finish_now(walker: "Walker") -> None:
    walker.click("Finish early")
    walker.click("Finish now")


# The disk


@pytest.mark.slow
def test_a_full_disk_pauses_the_swing_until_there_is_room(
    small_disk: Callable[[int], None], prepared: "Walker"
) -> None:
    go_to(prepared, "Swing")
    prepared.swing()
    keep_on(prepared)

    small_disk(300_000)
    prepared.until_says("PAUSED")
    prepared.until_tells("cannot be written: the disk is full.")
    prepared.until_tells("then press Space")
    n_before = n_kept(prepared)
    assert len(open_record(record_folder(prepared)).used_images) == n_before

    small_disk(50_000_000)
    prepared.press(Key.Key_Space)
    keep_on(prepared, 4)
    assert len(open_record(record_folder(prepared)).used_images) >= n_before + 4
    prepared.until(lambda: not prepared.tells("the disk is full"))


# Back and forth


@pytest.mark.slow
def test_a_swing_closed_in_the_middle_is_resumed_at_the_next_start(
    capturing: "Walker", open_wizard: "OpenWizard"
) -> None:
    folder = record_folder(capturing)
    with capturing.answering(QMessageBox.ButtonRole.RejectRole) as asked:
        capturing.window.close()
    assert "Swing not finished." in asked[0]
    assert capturing.window.isVisible()
    keep_on(capturing)

    with capturing.answering():
        capturing.window.close()
    assert not capturing.window.isVisible()
    n_recorded = len(open_record(folder).used_images)
    assert n_recorded >= n_kept(capturing)

    again = open_wizard()
    again.until_tells(f"{n_recorded} images")
    assert again.says("Interrupted swing")
    for name in ("LP-04", "T-10", "C-1"):
        again.until_tells(name)
    again.click("Resume")
    again.until_shows("Swing")
    assert n_kept(again) == n_recorded
    again.swing()
    keep_on(again)
    assert record_folder(again) == folder
    again.click_step("Start")
    again.until(lambda: not again.says("Interrupted swing"))
    found = find_unfinished(folder.parent)
    assert [each.folder for each in found.under_way] == [folder]


# The window


@pytest.mark.slow
def test_language_theme_size_and_windows_change_in_a_step_and_during_capture(
    prepared: "Walker",
) -> None:
    window = prepared.window
    for title in ("Start", "Swing"):
        go_to(prepared, title)
        if title == "Swing":
            prepared.swing()
            keep_on(prepared)
        _use_all_windows(prepared, title)
        size = window.size()
        window.resize(window.minimumSizeHint())
        QApplication.processEvents()
        prepared.until(prepared.main_button().isEnabled)
        assert not prepared.main_button().visibleRegion().isEmpty()
        window.resize(size)
    keep_on(prepared)
    assert phase(prepared) is Phase.CAPTURING


def _use_all_windows(walker: "Walker", title: str) -> None:
    """Open all that the function keys open, and change language and appearance."""
    help_window = walker.window.help_window
    walker.press(Key.Key_F1)
    walker.until(help_window.isActiveWindow)
    assert max(map(len, walker.texts(help_window))) > 100
    walker.press(Key.Key_Escape)
    assert not help_window.isVisible()
    walker.take_window()

    for word, choice, seen in (
        ("Language", "\u7b80\u4f53\u4e2d\u6587", "\u5e2e\u52a9"),
        ("\u8bed\u8a00", "English", "Help"),
    ):
        walker.press(Key.Key_F10)
        walker.choose(word, choice)
        walker.until_says(seen)
    assert walker.title() == title
    for choice in ("Light", "Dark"):
        walker.press(Key.Key_F10)
        walker.choose("Appearance", choice)
    if title == "Swing":  # elsewhere the letter may go into a field
        walker.press(Key.Key_B)
        assert walker.says("Sounds are off.")

    walker.press(Key.Key_F11)
    view = walker.window.operator_view
    walker.until(view.isActiveWindow)
    walker.press(Key.Key_Escape)
    assert not view.isVisible()
    walker.take_window()


@pytest.mark.slow
def test_about_tells_the_versions_and_licences(prepared: "Walker") -> None:
    reported: list[str] = []

    def read_and_close() -> None:
        about = QApplication.activeModalWidget()
        if about is not None and about.isActiveWindow():
            reported.extend(prepared.texts(about))
            prepared.press(Key.Key_Escape)

    timer = QTimer(prepared.window, interval=20)
    timer.timeout.connect(read_and_close)
    timer.start()
    prepared.press(Key.Key_F10)
    prepared.choose("About Lightpen")
    timer.stop()

    for part in ("PySide6 ", "Qt, PySide6 and psycopg: LGPL 3", "FFmpeg", "Noto Sans"):
        assert any(part in text for text in reported), part


# Anything else


@pytest.mark.slow
def test_pressing_enter_again_and_again_accepts_once(
    settings: Settings, open_wizard: "OpenWizard"
) -> None:
    short = replace(LONG, limits=SwingLimits(0.02, 20, 150))
    settings.set_station(STATION, short)
    settings.set_last_station(STATION)
    walker = open_wizard()
    go_to(walker, "LEDs")
    now = walker.workbench.selection.preparation
    limits = replace(now.limits, min_per_field=0)  # few images will do
    walker.workbench.selection.set_preparation(replace(now, limits=limits))
    go_to(walker, "Swing")
    walker.swing()
    walker.until(lambda: walker.workbench.run.status.solution is not None)
    walker.until(walker.main_button().isEnabled)
    walker.click("Review")
    button = walker.main_button()
    walker.until(button.isEnabled)
    place = button.mapTo(walker.window, button.rect().center())
    results = walker.workbench.folder / SIMULATED / RESULTS

    QTest.mouseDClick(
        walker.window.windowHandle(),
        Qt.MouseButton.LeftButton,
        Qt.KeyboardModifier.NoModifier,
        place,
    )
    walker.until(lambda: walker.workbench.run.status.result is not None)
    walker.window.close()  # which waits for all that is under way

    assert len(list(results.glob("*.json"))) == 1


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
