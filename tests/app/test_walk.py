"""From Start to Accept through the whole wizard, as an operator walks it."""

import json
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from subprocess import CompletedProcess
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractItemView,
    QAbstractSpinBox,
    QComboBox,
    QLineEdit,
    QTabBar,
)

from lightpen.arrays import FloatArray
from lightpen.live.sources import Surroundings
from lightpen.model.origin import Origin
from lightpen.record.reading import open_record
from lightpen.record.results import Result
from lightpen.record.unfinished import find_unfinished
from lightpen.simulator.scenes import Scene
from lightpen_app.look.languages import Language
from lightpen_app.work.settings import Preferences, Settings, Station

if TYPE_CHECKING:
    from tests.app.conftest import OpenWizard, Walker

Key = Qt.Key
Run = Callable[..., CompletedProcess[str]]
NAMES = {
    "Station": "Hall 2",
    "Operator": "Ann",
    "Pen, serial number": "LP-04",
    "Probe tip": "T-10",
    "Cone": "C-1",
}
FEW = {"U (k = 2) at most": "0.01", "Images at least": "20", "Images at most": "150"}
AT_FIRST = {
    "Start": "now",
    "Camera": "closed",
    "LEDs": "closed",
    "Swing": "closed",
    "Review": "closed",
    "Verify": "closed",
    "History": "to do",
}
HANDLES = (
    QAbstractButton,
    QAbstractItemView,
    QAbstractSpinBox,
    QComboBox,
    QLineEdit,
    QTabBar,
)
WHOLE = (QAbstractItemView, QAbstractSpinBox, QComboBox)  # the Tab key passes parts by
PATH = re.compile(r"\S*/\S*")
TOO_SLOW = "This computer is too slow"  # an error of the core, for the clock is hasty
WORD = re.compile(r"[A-Za-z]{2,}")
SAME_EVERYWHERE = {
    *("Mono", "LED", "LEDs", "px", "mm", "dB", "ms", "fx", "fy"),
    *("CSV", "JSON", "PNG", "OpenCV", "ROS", "Kalibr", "MATLAB"),
    *("Enter", "Space", "Delete", "Insert", "Home", "Shift", "Tab"),
    *("Lightpen", "Qt"),
}
# A swing shown by the images of a recording has this truth, in the frame of its file.
BEST_FIT = "tip_in_leds_csv_frame_bestfit"


@dataclass(frozen=True)
class ReadOut:
    """The tip and its U (k = 2) as they are shown, x y z each, mm."""

    numbers: tuple[str, ...]

    @property
    def tip(self) -> FloatArray:
        return np.array(self.numbers[:3], dtype=np.float64)

    @property
    def u(self) -> FloatArray:
        return np.array(self.numbers[3:], dtype=np.float64)


def test_the_simulated_pen_by_the_mouse(walker: "Walker", lightpen: Run) -> None:
    assert walker.title() == "Start"
    assert walker.steps() == AT_FIRST
    assert walker.says("Enter the name of the station.")
    assert not walker.main_button().isEnabled()
    for name, text in {**NAMES, **FEW}.items():
        walker.click_into(name, text)
    walker.until_says("Pen LP-04\nTip T-10\nCone C-1")
    assert walker.says("SIMULATED")
    walker.click("Continue to the camera")

    assert walker.title() == "Camera"
    walker.until_says("Live")
    walker.until_tells("10 of 10 LEDs")
    assert walker.tells("Fits the live images: 1224 x 1024")
    walker.click("Continue to the LEDs")

    assert walker.title() == "LEDs"
    walker.until_says("10 of 10 LEDs")
    walker.until(lambda: _misfit(walker) < 0.1)
    assert walker.steps()["LEDs"] == "now"
    walker.click("Continue to the swing")

    assert walker.title() == "Swing"
    assert walker.main_button().text() == "Finish early"
    assert walker.says("No image is kept yet.")
    walker.swing()
    _watch_the_swing(walker)
    n_inputs = walker.n_inputs
    walker.operator.hold()
    walker.operator.lean(0.0, 0.0, 0.0)  # upright and still: on to the review
    walker.until_shows("Review")
    assert walker.n_inputs == n_inputs

    assert walker.says("PASS: Good")
    walker.until(walker.main_button().isEnabled)
    shown = _read_out(walker)
    # Four standard deviations: U is two.
    assert (
        np.abs(shown.tip - walker.workbench.around.scene.tip_pen) <= 2 * shown.u
    ).all()
    walker.click("Accept")

    walker.until_says("PRACTICE KEPT")
    steps = walker.steps()
    assert steps.pop("Verify") == "to do"
    assert set(steps.values()) == {"done", "now"}
    result = _result_on_disk(walker)
    assert result.grade == "pass"
    np.testing.assert_allclose(result.tip_pen, shown.tip, atol=1e-4)
    record = open_record(Path(result.record))
    assert record.verdict == "pass"
    assert find_unfinished(record.folder.parent).interrupted == ()
    assert _calibrated(lightpen, record.folder) == result.tip_pen.tolist()
    walker.until(walker.main_button().isEnabled)
    walker.click("Start the next calibration")

    assert walker.title() == "Start"
    walker.until_says("Today")
    assert walker.says("PASS")
    assert all(walker.says(number) for number in shown.numbers)
    assert walker.steps()["Swing"] == "to do"


def test_the_simulated_pen_by_the_keys_alone(walker: "Walker") -> None:
    _check_round(walker)
    for name, text in {**NAMES, **FEW}.items():
        walker.enter(name, text)
    walker.press(Key.Key_Return)

    walker.until_says("Live")
    walker.until(walker.main_button().isEnabled)
    _check_round(walker)
    walker.press(Key.Key_PageDown)

    walker.until_says("10 of 10 LEDs")
    _check_round(walker)
    walker.press(Key.Key_PageDown)

    walker.until_says("Show the pen")
    _check_round(walker)
    walker.tab_to("Let the simulated operator swing")
    walker.press(Key.Key_Return)
    _watch_the_swing(walker)
    walker.press(Key.Key_PageDown)

    assert walker.says("PASS: Good")
    walker.until(walker.main_button().isEnabled)
    _check_round(walker)
    walker.tab_to("Accept")
    walker.press(Key.Key_Return)

    walker.until_says("PRACTICE KEPT")
    assert _result_on_disk(walker).names.operator == "Ann"
    walker.until(walker.main_button().isEnabled)
    walker.press(Key.Key_PageDown)
    walker.until_says("Today")


def test_a_recorded_swing_gives_its_tip(
    open_wizard: "OpenWizard",
    around: Surroundings,
    shared_data: Path,
    truth: Callable[[Path], dict[str, Any]],
    lightpen: Run,
) -> None:
    folder = shared_data / "swing-clean"
    walker = open_wizard(replace(around, scene=Scene()))
    for name, text in NAMES.items():
        walker.click_into(name, text)
    walker.click("Continue to the camera")
    walker.tab_to("Source of the images")
    walker.press(Key.Key_Down)
    walker.until_tells("Choose the folder of the recorded images.")
    walker.click_into("Folder, record or video", str(folder))
    walker.press(Key.Key_Return)
    walker.until_says("RECORDED")
    # Those of the simulated pen are not.
    walker.until_says("Open the intrinsics file.")
    walker.until_says("Beside the images: camera.yaml and leds.csv")
    walker.click("Use both")
    walker.until_tells("Fits the live images: 2448 x 2048")
    walker.until(walker.main_button().isEnabled)
    assert not walker.offers("Use both")
    walker.click("Continue to the LEDs")
    walker.until_says("10 of 10 LEDs")
    walker.click("Continue to the swing")

    n_inputs = walker.n_inputs
    walker.until_says("READING")
    walker.until(lambda: bool(re.search(r"\d+ of 60 read", _told(walker))))
    assert not walker.tells("Lean")
    walker.until_says("Review")
    walker.until(walker.main_button().isEnabled)
    assert walker.n_inputs == n_inputs
    walker.click("Review")
    walker.until(walker.main_button().isEnabled)

    tip = _read_out(walker).tip
    true_tip = np.array(truth(folder)["pen"][BEST_FIT])
    # A solver that knows the images' model comes as near as 3.1 um.
    assert np.linalg.norm(tip - true_tip) <= 0.004
    walker.click("Accept")
    walker.until_says("IN FORCE")
    assert walker.says("RECORDED")
    result = _result_on_disk(walker)
    assert result.origin is Origin.RECORDED
    assert _calibrated(lightpen, Path(result.record)) == result.tip_pen.tolist()
    names = [frame["file"] for frame in result.calibration["frames"]]
    assert len(names) == 60


def test_in_chinese_no_english_word_is_left(
    settings: Settings, open_wizard: "OpenWizard"
) -> None:
    settings.set_preferences(Preferences(language=Language.CHINESE))
    station = Station("\u738b", "4", "10", "1", max_uncertainty=0.02, min_images=20)
    settings.set_station("2\u53f7", station)
    settings.set_last_station("2\u53f7")
    walker = open_wizard()
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
    while walker.window.page().key != "camera":
        read_and_go_on()

    assert set(left) == {"start", "camera", "leds", "swing", "review"}
    assert not any(left.values()), left


def _all_words(walker: "Walker") -> Iterator[str]:
    """Yield all that is said in the window, in tips, and in the operator view."""
    yield walker.window.windowTitle()
    yield from walker.texts()
    for widget in walker.seen():
        yield widget.toolTip()
    view = walker.window.operator_view()
    value = view.value()
    yield from (value.instruction, value.hint, value.count)
    yield from (value.state.word, value.state.detail)


def _english_in(text: str) -> str:
    """A text that has English words in it; else nothing."""
    bare = PATH.sub("", text)
    words = set(WORD.findall(bare)) - SAME_EVERYWHERE
    return text if words and not text.startswith(TOO_SLOW) else ""


@pytest.mark.parametrize(
    ("text", "is_english"),
    [
        ("\u8fdb\u884c\u4e2d", False),
        ("10 / 10 LED, 0.03 px; U (k = 2)", False),
        ("\u6587\u4ef6 /home/ann/leds.csv", False),
        ("Camera, \u8fdb\u884c\u4e2d", True),
    ],
)
def test_the_search_for_english_words_finds_them(text: str, is_english: bool) -> None:
    assert bool(_english_in(text)) is is_english


def _watch_the_swing(walker: "Walker") -> None:
    """See a swing go by itself from the seat to a good verdict."""
    n_inputs = walker.n_inputs
    walker.until_tells("Starts in ")
    walker.until_says("Lean RIGHT")
    walker.until(lambda: bool(re.search(r"\d+ kept, \d+ to go", _told(walker))))
    walker.until_says("CAPTURING")
    walker.until_tells("10 of 10 LEDs, ")
    assert walker.main_button().isEnabled()
    walker.until_says("PASS")
    assert walker.main_button().text() == "Review"
    assert walker.steps()["Swing"] == "now"
    assert walker.n_inputs == n_inputs


def _told(walker: "Walker") -> str:
    return "\n".join(walker.texts())


def _misfit(walker: "Walker") -> float:
    """The misfit that is told with the LEDs, px."""
    return float(re.findall(r"misfit (\S+) px", _told(walker))[0])


def _read_out(walker: "Walker") -> ReadOut:
    told = _told(walker)
    tip = re.findall(r"^[xyz] = (\S+) mm$", told, re.MULTILINE)
    u = re.findall(r"^\u00b1 (\S+) mm$", told, re.MULTILINE)
    assert len(tip) == len(u) == 3
    return ReadOut((*tip, *u))


def _result_on_disk(walker: "Walker") -> Result:
    archive, folder = walker.workbench.run.archive, walker.workbench.folder
    assert len(list(folder.rglob("results/*.json"))) == 1
    is_simulated = walker.workbench.preparation.origin is Origin.SIMULATED
    pen, tip = NAMES["Pen, serial number"], NAMES["Probe tip"]
    result = archive.in_force(pen, tip, is_simulated=is_simulated)
    assert result is not None
    return result


def _calibrated(lightpen: Run, record: Path) -> list[float]:
    """The tip that the command line makes of a record."""
    file = record.parent / "calibration.json"
    outcome = lightpen("calibrate", record, "--json", file)
    assert outcome.returncode == 0, outcome.stderr
    tip: list[float] = json.loads(file.read_text(encoding="utf-8"))["tip_pen_mm"]
    return tip


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
