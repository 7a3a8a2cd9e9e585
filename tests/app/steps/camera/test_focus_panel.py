"""The width of the rims: a number, a verdict, and what to do."""

import math

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from lightpen.detection.inspection import Exposure, Inspection
from lightpen_app.steps.camera.exposure_panel import FocusPanel
from lightpen_app.widgets.state_banner import SignLabel

NONE = np.zeros(0, np.int64)


@pytest.fixture
def panel(qtbot: QtBot) -> FocusPanel:
    panel = FocusPanel()
    qtbot.addWidget(panel)
    return panel


@pytest.mark.parametrize(
    ("widths", "verdict", "number"),
    [
        ((), "No LED detected", ""),
        ((2.0, math.nan), "No LED detected", ""),
        ((6.0, 2.14), "In focus", "2.1 px, best 2.1 px"),
        ((2.0, math.nan, 3.6), "Out of focus", "3.6 px, best 2.0 px"),
    ],
)
def test_the_last_width_is_judged(
    panel: FocusPanel, widths: tuple[float, ...], verdict: str, number: str
) -> None:
    for width in widths:
        panel.add(Inspection(Exposure(), width, NONE))

    assert panel.findChildren(SignLabel)[0].value().text == verdict
    assert panel._number.text() == number


def test_saturated_leds_are_not_called_sharp(panel: FocusPanel) -> None:
    panel.add(Inspection(Exposure((1.0,)), 0.8, NONE))

    assert panel.findChildren(SignLabel)[0].value().text == "Saturated"
