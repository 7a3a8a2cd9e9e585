"""From Start to Accept through the whole wizard, as an operator walks it."""

import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractItemView,
    QApplication,
    QComboBox,
    QFileDialog,
    QLineEdit,
    QTabBar,
)
from tests.app.walks import (
    FEW,
    NAMES,
    Run,
    calibrated,
    page_text,
    read_out,
    result_on_disk,
    set_up,
    watch_the_swing,
)

from lightpen.live.sources import SourceEnvironment
from lightpen.model.limits import SwingLimits
from lightpen.model.names import Origin
from lightpen.record.swings.header import Names
from lightpen.swing.preparation import SourceChoice
from lightpen_app.application import page_titles
from lightpen_app.work.settings import Preferences, Settings, Station, StoredCamera
from lightpen_extensions.simulator.simulator import SceneSimulator

if TYPE_CHECKING:
    from tests.app.conftest import OpenWizard, Walker

Key = Qt.Key
HANDLES = (QAbstractButton, QAbstractItemView, QComboBox, QLineEdit, QTabBar)
WHOLE = (QAbstractItemView, QComboBox)  # the Tab key passes parts by
PATH = re.compile(r"\S*/\S*")
TOO_SLOW = "Processing cannot keep up"  # an error of the core, for the clock is hasty
WORD = re.compile(r"[A-Za-z]{2,}")
SAME_EVERYWHERE = {
    *("Mono", "LED", "LEDs", "px", "mm", "dB", "ms", "fx", "fy"),
    *("CSV", "JSON", "PNG", "OpenCV", "ROS", "Kalibr", "MATLAB"),
    *("Enter", "Space", "Delete", "Insert", "Home", "Shift", "Tab"),
    *("Lightpen", "Qt", "paper"),  # the last: the layout of the simulated pen
}
# A swing shown by the images of a recording has this truth, in the frame of its file.
BEST_FIT = "tip_in_leds_csv_frame_bestfit"


@pytest.mark.slow
def test_the_simulated_pen_by_the_keys_alone(walker: "Walker") -> None:
    _check_round(walker)
    set_up(walker)
    _check_round(walker)
    for name, text in {**NAMES, **FEW}.items():
        walker.enter(name, text)
    walker.press(Key.Key_Return)  # takes the last number over
    walker.press(Key.Key_Return)

    walker.until_shows("Camera")
    assert walker.tells("Choose your camera.")
    assert not walker.tells("SIMULATED")
    walker.tab_to("Image source")
    walker.press(Key.Key_Down)
    walker.until_says("Live")
    walker.until(walker.main_button().isEnabled)
    _check_round(walker)
    walker.press(Key.Key_PageDown)

    walker.until_says("10 of 10 LEDs")
    _check_round(walker)
    walker.press(Key.Key_PageDown)

    walker.until_says("Hold the pen in view")
    _check_round(walker)
    walker.tab_to("Let the simulated operator swing")
    walker.press(Key.Key_Return)
    watch_the_swing(walker)
    walker.press(Key.Key_PageDown)

    assert walker.says("PASS: Within limits")
    walker.until(walker.main_button().isEnabled)
    _check_round(walker)
    walker.tab_to("Accept")
    walker.press(Key.Key_Return)

    walker.until_says("PRACTICE SAVED")
    assert result_on_disk(walker).names.operator == "Ann"
    assert walker.workbench.settings.station("Hall 2").heading == 0.0
    walker.until(walker.main_button().isEnabled)
    assert walker.main_button().text() == "Swing tip T-10"
    walker.click_step("Start")
    walker.until_says("Today")


def _begin_with_images(walker: "Walker", folder: Path) -> None:
    """Choose recorded images in the first view; only pen and tip are asked."""
    walker.until(lambda: bool(walker.workbench.selection.preparation.names.station))
    walker.click("Calibrate from recorded images")
    (dialog,) = walker.window.findChildren(QFileDialog)
    dialog.fileSelected.emit(str(folder))
    dialog.close()
    walker.take_window()
    walker.until_says("Set up station")
    for name in ("Pen serial number", "Probe tip"):
        walker.click_into(name, NAMES[name])
    walker.press(Key.Key_Return)
    walker.until_shows("Camera")


@pytest.mark.slow
@pytest.mark.parametrize("begins_by_card", [False, True])
def test_a_recorded_swing_gives_its_tip(
    open_wizard: "OpenWizard",
    around: SourceEnvironment,
    shared_data: Path,
    truth: Callable[[Path], dict[str, Any]],
    lightpen: Run,
    begins_by_card: bool,
) -> None:
    folder = shared_data / "swing-clean"
    walker = open_wizard(replace(around, simulator=SceneSimulator()))
    if begins_by_card:
        _begin_with_images(walker, folder)
    else:
        set_up(walker)
        for name, text in NAMES.items():
            walker.click_into(name, text)
        walker.click("Continue to the camera")
        walker.tab_to("Image source")
        walker.press(Key.Key_Down)
        walker.press(Key.Key_Down)
        walker.until_tells("Choose the folder of the recorded images.")
        walker.click_into("Folder, record or video", str(folder))
        walker.press(Key.Key_Return)
    walker.until_says("RECORDED")
    # Those of the simulated pen are not.
    walker.until_says("Open the intrinsics file.")
    walker.until_says("Found with the images: camera.yaml and leds.csv")
    walker.click("Use both files")
    walker.until_tells("Size fits: 2448 x 2048")
    walker.until(walker.main_button().isEnabled)
    assert not walker.offers("Use both files")
    walker.click("Continue to the LEDs")
    walker.until_says("10 of 10 LEDs")
    walker.click("Continue to the swing")

    n_inputs = walker.n_inputs
    walker.until_says("READING")
    walker.until(lambda: bool(re.search(r"\d+ of 60 images loaded", page_text(walker))))
    assert not walker.tells("Tilt")
    walker.until(lambda: walker.main_button().text() == "Review")
    walker.until(walker.main_button().isEnabled)
    assert walker.n_inputs == n_inputs
    walker.click_on(walker.main_button())
    walker.until_shows("Review")
    walker.until(walker.main_button().isEnabled)

    tip = read_out(walker).tip
    true_tip = np.array(truth(folder)["pen"][BEST_FIT])
    # A solver that knows the images' model comes as near as 3.1 um.
    assert np.linalg.norm(tip - true_tip) <= 0.004
    walker.click("Accept")
    walker.until_says("ACCEPTED")
    assert walker.says("RECORDED")
    result = result_on_disk(walker)
    assert result.origin is Origin.RECORDED
    assert calibrated(lightpen, Path(result.record)) == result.tip_pen.tolist()
    names = [frame.file for frame in result.calibration.frames]
    assert len(names) == 60


@pytest.mark.slow
def test_reading_300_images_can_be_ended_and_leaves_the_tips_as_before(
    open_wizard: "OpenWizard", around: SourceEnvironment, shared_data: Path
) -> None:
    walker = open_wizard(replace(around, simulator=SceneSimulator()))
    _begin_with_images(walker, shared_data / "swing-full")
    walker.until_says("Found with the images: camera.yaml and leds.csv")
    walker.click("Use both files")
    walker.until(walker.main_button().isEnabled)
    walker.click("Continue to the LEDs")
    walker.until_says("10 of 10 LEDs")
    walker.click("Continue to the swing")
    walker.until(lambda: bool(re.search(r"[1-9]\d of 300", page_text(walker))))
    results = walker.workbench.folder / "results"
    before = walker.workbench.run.status.record_folder
    tips = sorted(results.rglob("*"))

    walker.click("Start over")
    walker.click("Restart swing")

    # The images read so far are set aside; it reads from the first image.
    walker.until(lambda: walker.workbench.run.status.record_folder != before)
    assert before is not None
    assert len(list(before.glob("images/*.png"))) >= 10
    walker.until(lambda: bool(re.search(r"\b\d of 300", page_text(walker))))
    assert sorted(results.rglob("*")) == tips
    walker.click("Back")
    walker.until_shows("LEDs")


@pytest.mark.slow
def test_no_english_word_is_left_after_a_change_to_chinese(
    settings: Settings, open_wizard: "OpenWizard"
) -> None:
    names = Names("", "\u738b", "4", "10", "1")
    station = Station(
        names,
        camera=StoredCamera(SourceChoice()),
        limits=SwingLimits(0.02, min_images=20),
    )
    settings.set_station("2\u53f7", station)
    settings.set_last(station="2\u53f7")
    walker = open_wizard()
    walker.until(
        lambda: len(walker.window.pages()) == len(page_titles(walker.services))
    )
    walker.window.preferences_changed.emit(Preferences(language="zh_CN"))
    QApplication.processEvents()
    left: dict[str, set[str]] = {}

    def read() -> None:
        key = walker.window.page().key
        found = set(map(_english_in, _all_words(walker))) - {""}
        left.setdefault(key, set()).update(found)

    def read_and_go_on() -> None:
        button = walker.main_button()
        walker.until(button.isEnabled)
        read()
        before = button.text()
        walker.click_on(button)
        walker.until(lambda: button.text() != before)

    for _ in ("start", "camera", "leds"):
        read_and_go_on()
    reading = QTimer(walker.window, interval=500)
    reading.timeout.connect(read)
    reading.start()
    walker.swing()
    walker.until(lambda: walker.workbench.run.status.solution is not None)
    reading.stop()
    for _ in ("swing", "review"):
        read_and_go_on()
    walker.until(lambda: walker.workbench.run.status.result is not None)
    read()

    assert set(left) == {"start", "camera", "leds", "swing", "review"}
    assert not any(left.values()), left


def _all_words(walker: "Walker") -> Iterator[str]:
    """Yield all that is said in the window, in tips, and in the operator view."""
    yield walker.window.windowTitle()
    yield from walker.texts()
    for widget in walker.seen():
        yield widget.toolTip()
    view = walker.window.operator_view
    value = view.value()
    yield from (value.instruction, value.hint, value.count)
    yield from (value.state.word, value.state.detail)


def _english_in(text: str) -> str:
    """A text that has English words in it; else nothing."""
    bare = PATH.sub("", text)
    words = set(WORD.findall(bare)) - SAME_EVERYWHERE
    return text if words and not text.startswith(TOO_SLOW) else ""


def _check_round(walker: "Walker") -> None:
    """Check that the Tab key leads to every control that can be used, each named."""
    visited = walker.tab_round()
    missed = [
        control
        for control in walker.seen()
        if isinstance(control, HANDLES) and control.isEnabled()
        if not isinstance(control.parent(), WHOLE) and control not in visited
    ]
    assert not missed, missed
    nameless = [control for control in visited if not walker.names(control)]
    assert not nameless, nameless
