"""The dial shows where the pen leans as the operator sees it, and what is missing."""

import math

import numpy as np
import pytest
from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QColor, QImage
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot
from tests.simulated_pens import eight_led_pen

from lightpen.arrays import FloatArray, IntArray
from lightpen.model.coverage import measure_coverage
from lightpen.model.rigid import Posture, posture_of, rotations_of
from lightpen_app.look.theme import DARK, LIGHT, apply_theme
from lightpen_app.widgets.posture_dial import (
    BAR_SHARE,
    DialValue,
    PostureDial,
    field_of,
    place_of,
)

SIDE = 600
RIM = 0.435 * SIDE
RIGHT, AWAY, LEFT, TOWARDS = (quarter * math.pi / 2 for quarter in range(4))
FIRST = (0.35, 0.0)  # in a field, beside its number
WANTED: IntArray = np.full((2, 8), 6, dtype=np.int64)


@pytest.fixture
def dial(qtbot: QtBot) -> PostureDial:
    dial = PostureDial()
    qtbot.addWidget(dial)
    dial.resize(SIDE, round(SIDE * (1 + BAR_SHARE)))
    dial.show()
    return dial


def seen(dial: PostureDial) -> QImage:
    return dial.grab().toImage()


def color_at(image: QImage, x: float, y: float) -> str:
    """The colour at a place right and up of the middle, rim = 1."""
    place = QPointF(SIDE / 2 + x * RIM, SIDE / 2 - y * RIM).toPoint()
    return image.pixelColor(place).name()


@pytest.mark.parametrize(
    ("direction", "heading", "x", "y"),
    [
        (RIGHT, 0.0, 1, 0),
        (AWAY, 0.0, 0, 1),
        (LEFT, 0.0, -1, 0),
        (TOWARDS, 0.0, 0, -1),
        (RIGHT, math.pi, -1, 0),  # an operator who faces the camera
        (TOWARDS, math.pi, 0, 1),
    ],
)
def test_right_is_right_for_whoever_holds_the_pen(
    direction: float, heading: float, x: float, y: float
) -> None:
    place = place_of(Posture(math.radians(28), direction, 0.0), heading)

    length = math.hypot(*place)
    assert place == pytest.approx((x * length, y * length), abs=1e-9)
    assert 0.62 < length < 1


def test_the_upright_pen_is_drawn_in_the_middle() -> None:
    assert place_of(Posture(0.0, 1.0, 0.0), 0.0) == pytest.approx((0, 0))


def test_fields_are_those_that_the_core_counts() -> None:
    """Each posture is drawn in the field in which `measure_coverage` counts it."""
    rng = np.random.default_rng(3)
    pen = eight_led_pen()
    for _ in range(200):
        given = Posture(rng.uniform(0, 0.6), rng.uniform(0, 2 * math.pi), 0.0)
        rotation = rotations_of(
            pen, np.array([given.tilt]), np.array([given.direction]), np.zeros(1)
        )
        coverage = measure_coverage(rotation)
        ring, sector = field_of(posture_of(pen, rotation[0]))
        if ring == 0:
            assert coverage.n_upright == 1
        else:
            assert coverage.counts[ring - 1, sector] == 1


def test_a_full_field_is_filled_and_another_is_not(dial: PostureDial) -> None:
    counts = WANTED * 0
    counts[1, 2] = 6
    dial.set_value(DialValue(counts=counts, needed=WANTED))

    image = seen(dial)

    assert color_at(image, 0.0, 0.95) == DARK.good
    assert color_at(image, 0.0, -0.95) == DARK.raised


def test_a_field_fills_from_the_middle_outwards(dial: PostureDial) -> None:
    counts = WANTED * 0
    counts[1, 0] = 3
    dial.set_value(DialValue(counts=counts, needed=WANTED))

    image = seen(dial)

    assert color_at(image, 0.68, 0.1) == DARK.partial
    assert color_at(image, 0.95, 0.1) == DARK.raised


def test_the_drawing_turns_with_the_operator(dial: PostureDial) -> None:
    counts = WANTED * 0
    counts[1, 2] = 6
    dial.set_value(DialValue(counts=counts, needed=WANTED, heading=math.pi))

    assert color_at(seen(dial), 0.0, -0.95) == DARK.good


def test_pen_arrow_and_frame_show_where_to_go(dial: PostureDial) -> None:
    here = Posture(math.radians(14), LEFT, 0.0)
    there = Posture(math.radians(28), RIGHT, 0.0)
    dial.set_value(DialValue(needed=WANTED, posture=here, target=there))
    x, y = place_of(here, 0.0)

    image = seen(dial)

    assert color_at(image, x, y) == DARK.text
    assert color_at(image, 0.3, 0.0) == DARK.pointer  # the shaft
    assert color_at(image, 0.99, 0.0) == DARK.pointer  # the frame of the field
    assert color_at(image, 0.81, -0.14) == DARK.raised  # the number stays free


def test_no_pen_no_arrow(dial: PostureDial) -> None:
    there = Posture(math.radians(28), RIGHT, 0.0)
    dial.set_value(DialValue(needed=WANTED, target=there))

    assert color_at(seen(dial), 0.3, 0.0) != DARK.pointer


def test_the_bar_shows_the_turn(dial: PostureDial) -> None:
    def at(share: float) -> str:
        image = seen(dial)
        x = SIDE / 2 + share * RIM
        y = SIDE + 0.25 * BAR_SHARE * SIDE
        return image.pixelColor(round(x), round(y)).name()

    quarter = math.radians(75) / 2
    dial.set_value(DialValue(turns=(-quarter, 0.1), turns_needed=(-0.5, 0.5)))
    assert at(-0.25) == DARK.partial
    assert at(0.75) == DARK.raised

    dial.set_value(DialValue(turns=(-quarter, quarter), turns_needed=(-0.5, 0.5)))
    assert at(0.25) == DARK.good


def test_the_dial_counts_its_fields_for_screen_readers(dial: PostureDial) -> None:
    counts = WANTED * 0
    counts[0] = 6
    dial.set_value(
        DialValue(counts=counts, needed=WANTED, n_upright=4, n_upright_needed=4)
    )

    assert dial.accessibleDescription() == "9 of 17 postures complete"


def test_the_camera_is_drawn_where_it_stands(dial: PostureDial) -> None:
    for heading, y in ((0.0, -1.085), (math.pi, 1.085)):
        dial.set_value(DialValue(needed=WANTED, heading=heading))
        assert color_at(seen(dial), 0.0, y) == QColor(DARK.muted).name()


def test_the_fields_are_drawn_anew_for_what_else_changes_them(
    dial: PostureDial, dressed: QApplication
) -> None:
    dial.set_value(DialValue(needed=WANTED, n_upright_needed=6))
    dark = seen(dial)
    apply_theme(dressed, LIGHT)
    light = seen(dial)

    assert color_at(dark, *FIRST) == DARK.raised
    assert color_at(light, *FIRST) == LIGHT.raised

    dial.resize(SIDE // 2, round(SIDE // 2 * (1 + BAR_SHARE)))
    place = QPointF(0.5 + FIRST[0] * 0.435, 0.5 - FIRST[1] * 0.435) * (SIDE // 2)
    assert seen(dial).pixelColor(place.toPoint()).name() == LIGHT.raised


def n_muted(image: QImage) -> float:
    """Return how much is drawn in the colour of quiet words, in whole pixels."""
    ground, ink = (QColor(each).red() for each in (DARK.line, DARK.muted))
    return float(np.sum(np.clip((reds(image) - ground) / (ink - ground), 0, 1)))


def reds(image: QImage) -> FloatArray:
    """Return the red of all pixels."""
    rgb = image.convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(rgb.constBits(), np.uint8).reshape(rgb.height(), -1)
    return rows[:, : 3 * rgb.width() : 3].astype(float)


def test_the_focus_is_seen(qtbot: QtBot, dial: PostureDial) -> None:
    dial.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
    dial.activateWindow()
    dial.setFocus()
    qtbot.waitUntil(dial.hasFocus)

    assert color_at(seen(dial), 1.02, 0.0) == DARK.accent
