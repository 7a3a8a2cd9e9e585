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

from lightpen.arrays import FloatArray
from lightpen.cameras.protocol import ImageCamera
from lightpen.formats.decoding import encode_png
from lightpen.formats.pen_files import write_pen
from lightpen.live.sources import SourceEnvironment, camera_of
from lightpen.model.limits import SwingLimits
from lightpen.record.results.result_folder import RESULTS, SIMULATED
from lightpen.record.swings.interrupted import find_unfinished
from lightpen.record.swings.names import Names
from lightpen.record.swings.reading import DISCARDED, open_record
from lightpen.simulator.samples import eight_led_pen
from lightpen.simulator.scene_files import write_sample_files
from lightpen.simulator.scenes import Scene
from lightpen.simulator.swings import paper_pen
from lightpen.swing.capture.state import Phase
from lightpen.swing.image_sources import SourceChoice
from lightpen_app.work.settings import Settings
from lightpen_app.work.stations import Station

if TYPE_CHECKING:
    from tests.app.conftest import OpenWizard, SolvingOn, Walker

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


def give_path(walker: "Walker", name: str, path: Path) -> None:
    """Click into the field of a path, type another one, and press Enter."""
    walker.click_into(name, str(path))
    walker.press(Key.Key_Return)


def picture_in(folder: Path) -> Path:
    path = folder / "picture.png"
    path.write_bytes(encode_png(np.zeros((8, 8), np.uint8)))
    return path


# Wrong files


@pytest.mark.slow
def test_a_picture_is_refused_as_intrinsics(prepared: "Walker", tmp_path: Path) -> None:
    go_to(prepared, "Camera")
    workbench = prepared.workbench
    prepared.until(lambda: not workbench.selection.preparation.camera_missing_inputs())
    before = workbench.selection.preparation.camera_file

    give_path(prepared, "Intrinsics file", picture_in(tmp_path))

    prepared.until_tells("picture.png is not text")
    assert workbench.selection.preparation.camera_file is before


@pytest.mark.slow
def test_intrinsics_of_another_size_are_reported_and_close_the_next_steps(
    prepared: "Walker", tmp_path: Path
) -> None:
    go_to(prepared, "Camera")
    prepared.until(prepared.main_button().isEnabled)
    whole = write_sample_files(Scene(), tmp_path / "whole")

    give_path(prepared, "Intrinsics file", whole.camera)

    prepared.until_tells("Image size is 1224 x 1024; the intrinsics file is for")
    assert not prepared.main_button().isEnabled()
    assert prepared.says(
        "The intrinsics file is for another image size. Open the file of this camera."
    )
    assert prepared.steps()["LEDs"] == "closed"
    prepared.press(Key.Key_PageDown)
    assert prepared.title() == "Camera"

    prepared.click("Use its files")
    prepared.until(prepared.main_button().isEnabled)


@pytest.mark.slow
def test_a_letter_in_the_led_file_is_reported_with_its_line(
    prepared: "Walker", tmp_path: Path
) -> None:
    go_to(prepared, "LEDs")
    path = tmp_path / "leds.csv"
    path.write_text("led,x_mm,y_mm,z_mm\n1,0,0,-30\n2,0,60,-30\n3,12,4O,-30\n4,0,9,1\n")

    give_path(prepared, "LED file", path)

    prepared.until_tells("ine 4 of leds.csv")
    assert prepared.tells("4O")
    assert prepared.tells("(letter O)")


@pytest.mark.slow
def test_exchanged_leds_are_named(prepared: "Walker", tmp_path: Path) -> None:
    leds = paper_pen().leds.copy()
    leds[[5, 8]] = leds[[8, 5]]
    go_to(prepared, "LEDs")

    give_path(prepared, "LED file", pen_in(tmp_path, leds))

    prepared.until_tells("LEDs 6 and 9 are swapped")
    assert prepared.tells("Correct the LED table first (see the message above).")
    assert prepared.steps()["Swing"] == "closed"


@pytest.mark.slow
def test_a_displaced_led_is_named(prepared: "Walker", tmp_path: Path) -> None:
    leds = paper_pen().leds.copy()
    leds[5] += (0.0, 0.8, 0.0)
    go_to(prepared, "LEDs")

    give_path(prepared, "LED file", pen_in(tmp_path, leds))
    prepared.operator.swing()

    prepared.until_tells("LED 6 is 0.80 mm from its file position")


def pen_in(folder: Path, leds: FloatArray) -> Path:
    """Write a table of LEDs (N, 3), mm, and return its path."""
    path = folder / "pen.csv"
    write_pen(replace(paper_pen(), leds=leds, name="", nominal_tip=None), path)
    return path


@pytest.mark.slow
def test_the_file_of_another_pen_is_reported(
    prepared: "Walker", tmp_path: Path
) -> None:
    path = tmp_path / "another.json"
    write_pen(eight_led_pen(), path)
    go_to(prepared, "LEDs")

    give_path(prepared, "LED file", path)

    prepared.until_says("Pen not found")


@pytest.mark.slow
def test_a_folder_without_images_can_be_tried_again(
    prepared: "Walker", tmp_path: Path
) -> None:
    empty = tmp_path / "empty"
    empty.mkdir()
    go_to(prepared, "Camera")
    prepared.tab_to("Image source")
    prepared.press(Key.Key_Down)

    give_path(prepared, "Folder, record or video", empty)

    prepared.until(lambda: prepared.offers("Try again"))
    assert prepared.says("Not connected")
    assert prepared.tells("). Choose the folder with the images.")
    assert not prepared.main_button().isEnabled()
    assert prepared.says("No image received from the camera yet.")

    picture_in(empty)
    prepared.click("Try again")
    prepared.until_tells("8 x 8 px")


# The camera


@pytest.mark.slow
def test_a_camera_that_is_gone_is_reported_and_comes_back(
    cameras: list[FaultyCamera], prepared: "Walker"
) -> None:
    go_to(prepared, "Camera")
    prepared.until_says("Live")

    cameras[-1].unplug()
    prepared.until_says("Lost, reconnecting")
    assert prepared.tells("). Check cable and power.")
    cameras[-1].plug_in()
    prepared.until_says("Live")

    go_to(prepared, "Swing")
    prepared.swing()
    keep_on(prepared)
    cameras[-1].unplug()
    prepared.until_says("NO IMAGES")
    assert prepared.tells("The camera sends no images.")
    n_before = n_kept(prepared)
    cameras[-1].plug_in()
    keep_on(prepared)

    assert n_kept(prepared) > n_before
    assert len(open_record(record_folder(prepared)).used_images) >= n_kept(prepared)


# The pen


@pytest.mark.slow
def test_what_befalls_the_pen_is_reported_and_the_swing_goes_on(
    capturing: "Walker",
) -> None:
    n_inputs = capturing.n_inputs

    capturing.operator.cover()
    capturing.until_says("PEN LOST")
    assert capturing.tells("Turn the LEDs towards the camera.")
    capturing.operator.uncover()
    keep_on(capturing)

    capturing.operator.lift()
    capturing.until_says("LIFTED")
    assert capturing.tells("The pen is lifted.")
    capturing.swing()
    keep_on(capturing)

    n_before = n_kept(capturing)
    capturing.operator.slip(0.5, 1.5)
    capturing.until_says("TIP SLIPPED")
    assert capturing.tells("Images rejected:")
    keep_on(capturing)
    assert n_kept(capturing) >= n_before - 5
    assert capturing.n_inputs == n_inputs


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


@pytest.mark.slow
def test_computing_is_cancelled_and_begun_again(
    capturing: "Walker", solving_on: "SolvingOn"
) -> None:
    keep_on(capturing, 20)
    with solving_on():
        finish_now(capturing)
        capturing.until(lambda: capturing.offers("Stop computing"))
        capturing.click("Stop computing")
        capturing.until_says("STOPPED")
    assert capturing.says("Tip not computed yet")

    capturing.click("Compute again")
    capturing.until(lambda: capturing.workbench.run.status.solution is not None)
    capturing.until(capturing.main_button().isEnabled)
    capturing.click("Review")

    n_images = n_kept(capturing)
    capturing.until_tells(f"{n_images} of {n_images} images included")
    capturing.click("Exclude")
    capturing.until_tells(f"{n_images - 1} of {n_images} images included")
    capturing.until(lambda: capturing.offers("Include"))
    capturing.click("Include")
    capturing.until_tells(f"{n_images} of {n_images} images included")


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
def test_going_back_and_forth_pauses_the_swing_and_goes_on(capturing: "Walker") -> None:
    folder = record_folder(capturing)
    for title in ("LEDs", "Camera", "Start"):
        capturing.press(Key.Key_PageUp)
        assert capturing.title() == title
    capturing.until(lambda: phase(capturing) is Phase.PAUSED)
    n_before = n_kept(capturing)
    go_to(capturing, "Swing")
    keep_on(capturing)

    capturing.click_step("Camera")
    assert capturing.title() == "Camera"
    assert capturing.tells("A swing is in progress.")
    capturing.click_step("Swing")
    keep_on(capturing)
    capturing.click_step("Review")
    assert capturing.title() == "Swing"
    assert capturing.says("Swing the pen first.")

    for _ in range(3):
        capturing.press(Key.Key_Escape)
    keep_on(capturing)
    assert capturing.title() == "Swing"
    assert phase(capturing) is Phase.CAPTURING
    assert record_folder(capturing) == folder
    assert n_kept(capturing) >= n_before


@pytest.mark.slow
def test_space_pauses_and_starting_over_asks(capturing: "Walker") -> None:
    first = record_folder(capturing)
    capturing.press(Key.Key_Space)
    capturing.until_says("PAUSED")
    n_images = n_kept(capturing)
    capturing.press(Key.Key_Space)
    keep_on(capturing)

    capturing.click("Start over")
    assert capturing.tells("Start over? The images of this swing (")
    capturing.click("Restart swing")
    capturing.until(
        lambda: capturing.workbench.run.status.record_folder not in (None, first)
    )
    capturing.until(lambda: open_record(first).verdict == DISCARDED)
    assert len(open_record(first).images) >= n_images
    keep_on(capturing)


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


@pytest.mark.slow
def test_the_operator_view_leads_the_swing_by_its_keys(capturing: "Walker") -> None:
    view = capturing.window.operator_view
    capturing.press(Key.Key_F11)
    capturing.until(view.isActiveWindow)
    capturing.until(lambda: "CAPTURING" in capturing.texts(view))

    capturing.press(Key.Key_Space)
    capturing.until(lambda: "PAUSED" in capturing.texts(view))
    capturing.press(Key.Key_Space)
    keep_on(capturing)
    for key in (Key.Key_PageUp, Key.Key_PageDown, Key.Key_Return):
        capturing.press(key)  # nothing goes on behind the view
    assert capturing.title() == "Swing"
    assert "CAPTURING" in capturing.texts(view)
    capturing.press(Key.Key_B)
    capturing.press(Key.Key_F11)
    capturing.until(lambda: not view.isVisible())
    assert capturing.says("Sounds are off.")
    keep_on(capturing)


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
