"""What `test_real_window.py` runs under an X server: windows on a real screen."""

from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtGui import QGuiApplication, QImage

from lightpen.arrays import Image
from lightpen.record.swings.header import Names
from lightpen.swing.preparation import SourceChoice
from lightpen_app.work.settings import Settings, Station, StoredCamera

if TYPE_CHECKING:
    from tests.app.conftest import OpenWizard, Walker

Key = Qt.Key
STATION = "Hall 2"
MOVING = 0.05  # of the pixels: the dial goes on meanwhile


def test_the_operator_view_fills_the_screen(
    settings: Settings, open_wizard: "OpenWizard"
) -> None:
    assert QGuiApplication.platformName() == "xcb"
    settings.set_station(
        STATION,
        Station(
            Names("", "Ann", "LP-04", "T-10", "C-1"),
            camera=StoredCamera(SourceChoice()),
        ),
    )
    settings.set_last(station=STATION)
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
