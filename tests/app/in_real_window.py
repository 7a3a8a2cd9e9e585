"""What `test_real_window.py` runs under an X server: windows on a real screen."""

import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtGui import QGuiApplication, QImage
from tests.app.walks import (
    FEW,
    NAMES,
    Run,
    calibrated,
    page_text,
    read_out,
    result_on_disk,
    watch_the_swing,
)

from lightpen.arrays import Image
from lightpen.record.swings.interrupted import find_unfinished
from lightpen.record.swings.names import Names
from lightpen.record.swings.reading import open_record
from lightpen_app.work.settings import Settings
from lightpen_app.work.stations import Station

if TYPE_CHECKING:
    from tests.app.conftest import OpenWizard, Walker

Key = Qt.Key
STATION = "Hall 2"
MOVING = 0.05  # of the pixels: the dial goes on meanwhile
AT_FIRST = {
    "Start": "now",
    "Camera": "closed",
    "LEDs": "closed",
    "Swing": "closed",
    "Review": "closed",
    "Verify": "closed",
    "Measure": "closed",
    "History": "to do",
}


def test_the_operator_view_fills_the_screen(
    settings: Settings, open_wizard: "OpenWizard"
) -> None:
    assert QGuiApplication.platformName() == "xcb"
    settings.set_station(STATION, Station(Names("", "Ann", "LP-04", "T-10", "C-1")))
    settings.set_last_station(STATION)
    walker = open_wizard()
    while walker.title() != "Swing":
        walker.until(walker.main_button().isEnabled)
        walker.press(Key.Key_PageDown)
    walker.swing()
    walker.until_says("CAPTURING")

    walker.press(Key.Key_F11)
    view = walker.window.operator_view
    walker.until(view.isActiveWindow)
    walker.until(lambda: on_screen(walker).shape == (view.height(), view.width()))

    walker.until(lambda: is_shown(walker))


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
    assert walker.tells("Matches the live images: 1224 x 1024")
    walker.click("Continue to the LEDs")

    assert walker.title() == "LEDs"
    walker.until_says("10 of 10 LEDs")
    walker.until(lambda: _misfit(walker) < 0.1)
    assert walker.steps()["LEDs"] == "now"
    walker.click("Continue to the swing")

    assert walker.title() == "Swing"
    assert walker.main_button().text() == "Finish early"
    assert walker.says("No image captured yet")
    walker.swing()
    watch_the_swing(walker)
    n_inputs = walker.n_inputs
    walker.operator.hold()
    walker.operator.lean(0.0, 0.0, 0.0)  # upright and still: on to the review
    walker.until_shows("Review")
    assert walker.n_inputs == n_inputs

    assert walker.says("PASS: Within limits")
    walker.until(walker.main_button().isEnabled)
    shown = read_out(walker)
    # Four standard deviations: U is two.
    assert (
        np.abs(shown.tip - walker.workbench.around.scene.tip_pen) <= 2 * shown.u
    ).all()
    walker.click("Accept")

    walker.until_says("PRACTICE SAVED")
    steps = walker.steps()
    assert steps.pop("Verify") == steps.pop("Measure") == "to do"
    assert set(steps.values()) == {"done", "now"}
    result = result_on_disk(walker)
    assert result.grade == "pass"
    # The value is shown to the digit of its U.
    np.testing.assert_allclose(
        result.tip_pen, shown.tip, atol=5e-4
    )  # to the digit of U
    record = open_record(Path(result.record))
    assert record.verdict == "pass"
    assert find_unfinished(record.folder.parent).interrupted == ()
    assert calibrated(lightpen, record.folder) == result.tip_pen.tolist()
    walker.until(walker.main_button().isEnabled)
    walker.click_step("Start")

    assert walker.title() == "Start"
    walker.until_says("Today")
    assert walker.says("PASS")
    assert all(walker.says(number) for number in shown.numbers)
    assert walker.steps()["Swing"] == "done"


def is_shown(walker: "Walker") -> bool:
    """Whether the screen shows what the operator view draws."""
    view = walker.window.operator_view
    screen, drawn = on_screen(walker), pixels_of(view.grab().toImage())
    if screen.shape != drawn.shape or screen.std() < 10:
        return False
    return bool((screen != drawn).mean() < MOVING)


def on_screen(walker: "Walker") -> Image:
    """All that the screen shows, in grey levels."""
    return pixels_of(walker.window.screen().grabWindow(0).toImage())


def pixels_of(image: QImage) -> Image:
    """The grey levels of a picture, (H, W)."""
    grey = image.convertToFormat(QImage.Format.Format_Grayscale8)
    rows = np.frombuffer(grey.constBits(), np.uint8).reshape(grey.height(), -1)
    return rows[:, : grey.width()].copy()


def _misfit(walker: "Walker") -> float:
    """The RMS residual shown with the LEDs, px."""
    return float(re.findall(r"RMS residual (\S+) px", page_text(walker))[0])
