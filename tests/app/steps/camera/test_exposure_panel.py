"""What the panel of the exposure advises."""

from dataclasses import replace

from PySide6.QtWidgets import QLabel
from pytestqt.qtbot import QtBot

from lightpen.cameras.protocol import CameraCapabilities, CameraSettings, Range
from lightpen.detection.inspection import AutoExposure, Exposure, ExposureState
from lightpen_app.steps.camera.exposure_panel import ExposurePanel
from lightpen_app.work.workbench import Workbench


def said(panel: ExposurePanel) -> list[str]:
    return [label.text() for label in panel.findChildren(QLabel)]


def test_what_an_adjustment_came_to_is_said_as_long_as_it_is_true(
    qtbot: QtBot, workbench: Workbench
) -> None:
    settings = CameraSettings(exposure_us=900.0)
    panel = ExposurePanel(workbench.live)
    qtbot.addWidget(panel)
    panel.set_camera(
        CameraCapabilities(200, 160, ("Mono8",), Range(10.0, 1e5)), settings
    )
    begun = AutoExposure.begun(settings)
    panel.set_value(Exposure((0.8, 0.7)))
    panel.set_adjustment(replace(begun, outcome=ExposureState.DONE, level=0.8))
    assert "Exposure set. Brightest LED: 80 %; none saturated." in said(panel)

    panel.set_value(Exposure((1.0, 0.9)))
    assert not any("none saturated" in text for text in said(panel))

    panel.set_adjustment(replace(begun, outcome=ExposureState.NO_LEDS))
    assert not any("No LEDs detected." in text for text in said(panel))
