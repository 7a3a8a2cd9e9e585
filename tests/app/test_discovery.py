"""The way to the window in which pen and camera are found without files."""

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QPushButton
from pytestqt.qtbot import QtBot
from tests.simulated_stations import random_station

from lightpen_app.steps.camera.intrinsics_panel import IntrinsicsPanel
from lightpen_app.steps.leds.file_panel import LedFilePanel
from lightpen_app.widgets.pen_view import PenView
from lightpen_app.work.workbench import Workbench
from lightpen_app_extensions.discover.discovery_run import DiscoveryRun
from lightpen_app_extensions.discover.window import DiscoveryWindow


def test_both_panels_without_a_file_ask_for_the_swing(qtbot: QtBot) -> None:
    for panel in (IntrinsicsPanel(), LedFilePanel()):
        qtbot.addWidget(panel)
        button = next(
            each
            for each in panel.findChildren(QPushButton)
            if each.text() == "I have no such file..."
        )
        with qtbot.waitSignal(panel.discovery_requested, timeout=1000):
            button.click()


def test_two_clicks_in_the_picture_choose_the_frame_of_the_pen(
    workbench: Workbench, qtbot: QtBot
) -> None:
    window = DiscoveryWindow(workbench)
    qtbot.addWidget(window)
    window.show()
    found = random_station(6, 60).discovered()
    window.findChildren(DiscoveryRun)[0].take(found)
    (pen,) = window.findChildren(PenView)
    for led in 3, 9:
        QTest.mouseClick(
            pen, Qt.MouseButton.LeftButton, pos=pen.place_of(led).toPoint()
        )

    shown = pen.value()
    assert shown.pen is not None
    assert shown.tip is not None
    np.testing.assert_allclose(shown.pen.leds[2], 0, atol=1e-9)
    np.testing.assert_allclose(shown.pen.leds[8, [0, 2]], 0, atol=1e-9)
    assert shown.pen.normals[:, 2].min() > 0.5
    lengths = np.linalg.norm(found.pen.leds - found.tip_pen, axis=1)
    np.testing.assert_allclose(
        np.linalg.norm(shown.pen.leds - shown.tip, axis=1), lengths, atol=1e-9
    )
