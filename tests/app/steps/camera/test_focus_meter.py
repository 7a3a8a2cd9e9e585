"""The width of the rims: a number, a verdict, and how it went."""

import math

import pytest
from PySide6.QtGui import QColor
from pytestqt.qtbot import QtBot

from lightpen_app.look.theme import DARK
from lightpen_app.steps.camera.live_panel import N_TRACED, FocusMeter


@pytest.fixture
def meter(qtbot: QtBot) -> FocusMeter:
    meter = FocusMeter()
    qtbot.addWidget(meter)
    meter.resize(320, meter.sizeHint().height())
    meter.show()
    return meter


@pytest.mark.parametrize(
    ("widths", "verdict", "number"),
    [
        ((), "No LED detected", ""),
        ((2.0, math.nan), "No LED detected", ""),
        ((6.0, 2.14), "In focus", "2.1 px"),
        ((2.0, 3.6), "Out of focus", "3.6 px"),
    ],
)
def test_the_last_width_is_judged(
    meter: FocusMeter, widths: tuple[float, ...], verdict: str, number: str
) -> None:
    meter.set_value(widths)

    assert meter.verdict() == verdict
    assert meter.number() == number
    assert meter.accessibleDescription() == f"{verdict} {number}".strip()


def test_saturated_leds_are_not_called_sharp(meter: FocusMeter) -> None:
    meter.set_value((0.8,), is_saturated=True)

    assert meter.verdict() == "Saturated"


def test_only_the_last_seconds_are_kept(meter: FocusMeter) -> None:
    meter.set_value([2.0] * 3 * N_TRACED)

    assert len(meter.value()) == N_TRACED


def traced(meter: FocusMeter) -> list[int]:
    """Columns of the widget in which the trace is drawn."""
    image = meter.grab().toImage()
    accent = QColor(DARK.accent)
    return [
        x
        for x in range(image.width())
        if any(
            image.pixelColor(x, y).blue() > 0.7 * accent.blue()
            and image.pixelColor(x, y).red() < 0.6 * accent.blue()
            for y in range(28, image.height())
        )
    ]


def test_the_trace_ends_with_the_present_image(meter: FocusMeter) -> None:
    meter.set_value([2.0] * N_TRACED)
    whole = traced(meter)
    meter.set_value([2.0] * (N_TRACED // 2))
    half = traced(meter)

    assert max(whole) == max(half) >= meter.width() - 3
    assert len(half) == pytest.approx(len(whole) / 2, abs=6)


def test_an_image_without_leds_leaves_a_gap(meter: FocusMeter) -> None:
    meter.set_value([2.0] * N_TRACED)
    whole = len(traced(meter))
    widths = [2.0] * N_TRACED
    widths[40:60] = [math.nan] * 20
    meter.set_value(widths)

    assert len(traced(meter)) < 0.9 * whole
