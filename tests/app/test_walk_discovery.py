"""From "I have no such file" to the accepted tip, with the simulated pen."""

import re
from typing import TYPE_CHECKING

import numpy as np
import pytest
from PySide6.QtCore import QRect, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QWidget
from tests.app.walks import NAMES, page_text, read_out, result_on_disk, set_up
from tests.faulty_camera import scene_of

from lightpen.record.swings.solving import files_beside
from lightpen_app.widgets.number_field import NumberField
from lightpen_app.widgets.pen_view import PenView
from lightpen_app_extensions.discover.discovery_run import DISCOVERIES
from lightpen_app_extensions.discover.window import DiscoveryWindow

if TYPE_CHECKING:
    from tests.app.conftest import Walker

FRAME_RATE = 20.0  # a hand that moves farther from image to image cannot be followed
NO_KEY = Qt.KeyboardModifier.NoModifier
SAVE = "Save both files and calibrate the tip"


@pytest.mark.qt_log_ignore("^This plugin does not support ")
@pytest.mark.slow
@pytest.mark.parametrize("step", ["Camera", "LEDs"])
def test_a_pen_without_a_file_becomes_an_accepted_tip(
    walker: "Walker", monkeypatch: pytest.MonkeyPatch, step: str
) -> None:
    monkeypatch.setattr(
        "lightpen_extensions.simulator.camera.USUAL_FRAME_RATE", FRAME_RATE
    )
    find_and_accept(walker, step)

    assert result_on_disk(walker).names.pen == NAMES["Pen serial number"]
    images = walker.workbench.selection.preparation.source.place
    assert DISCOVERIES in images
    assert files_beside(images).pen is not None


def find_and_accept(walker: "Walker", step: str) -> None:
    """Find pen and camera without files, and accept the tip by the same images."""
    set_up(walker)
    for name, text in NAMES.items():
        walker.click_into(name, text)
    # The swing is as the clock has it: without files U is near the usual limit.
    walker.enter("Max. expanded uncertainty U (k = 2)", "0.03")
    walker.click("Continue to the camera")
    walker.tab_to("Image source")
    walker.press(Qt.Key.Key_Down)
    walker.until_says("Live")
    if step == "LEDs":  # the camera is known
        walker.click("Use its files")
        walker.until(walker.main_button().isEnabled)
        walker.click("Continue to the LEDs")
        walker.until_shows("LEDs")
    walker.click("I have no such file...")
    window = walker.window.findChild(DiscoveryWindow)
    assert window is not None
    begin = walker.control("Start", window)
    walker.click_on(begin)
    (pen,) = window.findChildren(PenView)
    walker.until(lambda: len(pen.value().marked) == 2)  # by the images so far
    if step == "Camera":  # without it the tip needs all images
        walker.until(begin.isEnabled)
    elif not begin.isEnabled():  # else it has all images already
        walker.click_on(walker.control("Stop", window))

    leds = scene_of(walker.workbench.around).pen.leds
    length = window.findChildren(NumberField)[0].value()
    assert length == np.linalg.norm(leds[:, None] - leds, axis=2).max()
    walker.click_on(walker.control("Find pen and camera", window))
    walker.click_on(walker.control("Cancel", window))
    assert not walker.control(SAVE, window).isEnabled()
    walker.click_on(walker.control("Find pen and camera", window))
    walker.until(walker.control(SAVE, window).isEnabled)
    found = "\n".join(walker.texts(window))
    assert re.search(r"LEDs: 10, U \(k = 2\) up to \S+ µm", found)
    assert re.search(r"Focal length: \S+ ± \S+ px", found)
    walker.click_on(walker.control(SAVE, window))
    walker.until(lambda: not window.isVisible())

    walker.take_window()
    walker.until(lambda: walker.main_button().text() == "Review")
    walker.until(walker.main_button().isEnabled)
    walker.click_on(walker.main_button())
    walker.until_shows("Review")
    walker.until(walker.main_button().isEnabled)
    assert walker.says("PASS: Within limits"), page_text(walker)
    shown, true = read_out(walker), scene_of(walker.workbench.around).tip_pen
    assert (np.abs(shown.tip - true) < 1.5 * shown.u).all()
    walker.click("Accept")
    walker.until(lambda: walker.workbench.run.status.result is not None)


def click(widget: QWidget, place: QRect, keys: Qt.KeyboardModifier = NO_KEY) -> None:
    """Click the centre of a part of a widget."""
    QTest.mouseClick(widget, Qt.MouseButton.LeftButton, keys, place.center())
