"""The dial as a handle of the simulated pen."""

import math

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from lightpen.model.rigid import Posture
from lightpen_app.look.theme import DARK
from lightpen_app.steps.swing.simulator_controls import LeaningDial
from lightpen_app.widgets.posture_dial import (
    BAR_SHARE,
    RIM_SHARE,
    DialValue,
    place_of,
    posture_at,
)

Key = Qt.Key
SIDE = 600
RIM = RIM_SHARE * SIDE


@pytest.fixture
def dial(qtbot: QtBot) -> LeaningDial:
    dial = LeaningDial()
    qtbot.addWidget(dial)
    dial.resize(SIDE, round(SIDE * (1 + BAR_SHARE)))
    dial.set_interactive(True)
    dial.show()
    return dial


@pytest.fixture
def leaned(dial: LeaningDial) -> list[Posture]:
    leaned: list[Posture] = []
    dial.leaned.connect(leaned.append)
    return leaned


def at(x: float, y: float) -> QPoint:
    """A place right and up of the middle, rim = 1."""
    return QPointF(SIDE / 2 + x * RIM, SIDE / 2 - y * RIM).toPoint()


def press(
    dial: LeaningDial,
    place: QPoint,
    modifier: Qt.KeyboardModifier = Qt.KeyboardModifier.NoModifier,
) -> None:
    QTest.mousePress(dial, Qt.MouseButton.LeftButton, modifier, place)


def test_a_posture_is_found_where_it_is_drawn() -> None:
    rng = np.random.default_rng(2)
    for _ in range(100):
        tilt, direction, heading = rng.uniform(0.01, 0.6), *rng.uniform(0, 6.28, 2)
        drawn = place_of(Posture(tilt, direction, 0.3), heading)

        found = posture_at(drawn, 0.3, heading)

        assert (found.tilt, found.direction, found.turn) == pytest.approx(
            (tilt, direction, 0.3), abs=1e-9
        )


def test_the_pen_goes_where_it_is_dragged(
    dial: LeaningDial, leaned: list[Posture]
) -> None:
    press(dial, at(0, 0))
    QTest.mouseMove(dial, at(0.81, 0))

    assert leaned[0].tilt == pytest.approx(0, abs=0.01)
    assert leaned[-1].tilt == pytest.approx(math.radians(28), abs=0.01)
    assert leaned[-1].direction == pytest.approx(0, abs=0.01)


def test_right_is_right_for_an_operator_who_faces_the_camera(
    dial: LeaningDial, leaned: list[Posture]
) -> None:
    dial.set_value(DialValue(heading=math.pi))

    press(dial, at(0.81, 0))

    assert leaned[-1].direction == pytest.approx(math.pi, abs=0.01)


@pytest.mark.parametrize(
    ("place", "modifier"),
    [
        ((0.5, 0.5), Qt.KeyboardModifier.ShiftModifier),
        ((0.0, -1.2), Qt.KeyboardModifier.NoModifier),  # on the bar
    ],
)
def test_a_drag_with_shift_or_of_the_bar_turns_the_pen(
    dial: LeaningDial,
    leaned: list[Posture],
    place: tuple[float, float],
    modifier: Qt.KeyboardModifier,
) -> None:
    held = Posture(0.2, 1.0, 0.0)
    dial.set_value(DialValue(posture=held))
    x, y = place

    press(dial, at(x, y), modifier)
    QTest.mouseMove(dial, at(x + 0.4, y))

    assert leaned[-1].turn == pytest.approx(0.4 * math.radians(75), abs=0.01)
    assert (leaned[-1].tilt, leaned[-1].direction) == (held.tilt, held.direction)


def test_the_wheel_turns_the_pen_and_goes_no_further_than_the_bar(
    dial: LeaningDial, leaned: list[Posture]
) -> None:
    for _ in range(20):
        event = QWheelEvent(
            QPointF(at(0, 0)),
            QPointF(at(0, 0)),
            QPoint(),
            QPoint(0, 120),
            Qt.MouseButton.NoButton,
            Qt.KeyboardModifier.NoModifier,
            Qt.ScrollPhase.NoScrollPhase,
            False,
        )
        QApplication.sendEvent(dial, event)

    assert leaned[0].turn == pytest.approx(math.radians(5))
    assert leaned[-1].turn == pytest.approx(math.radians(75))


def test_the_keys_lean_turn_and_put_upright(
    dial: LeaningDial, leaned: list[Posture]
) -> None:
    for key, x, y in (
        (Key.Key_Right, 1, 0),
        (Key.Key_Up, 0, 1),
        (Key.Key_Left, -1, 0),
        (Key.Key_Down, 0, -1),
    ):
        QTest.keyClick(dial, Key.Key_Home)
        QTest.keyClick(dial, key)
        right, up = place_of(leaned[-1], 0.0)
        assert (right, up) == pytest.approx((0.08 * x, 0.08 * y), abs=1e-9)
    QTest.keyClick(dial, Key.Key_Period)
    QTest.keyClick(dial, Key.Key_Period)
    QTest.keyClick(dial, Key.Key_Comma)
    assert leaned[-1].turn == pytest.approx(math.radians(5))


def test_the_keys_begin_where_the_pen_is_after_somebody_else_led_it(
    dial: LeaningDial, leaned: list[Posture]
) -> None:
    QTest.keyClick(dial, Key.Key_Home)
    dial.set_value(DialValue(posture=Posture(math.radians(20), 0.0, 0.0)))
    QTest.keyClick(dial, Key.Key_Right)
    assert leaned[-1].tilt < math.radians(10)

    dial.forget_target()
    QTest.keyClick(dial, Key.Key_Right)

    assert leaned[-1].tilt > math.radians(20)


def test_a_dial_that_only_shows_has_the_focus_and_leaves_mouse_and_keys(
    dial: LeaningDial, leaned: list[Posture]
) -> None:
    dial.set_interactive(False)

    press(dial, at(0.5, 0))
    QTest.keyClick(dial, Key.Key_Right)

    assert leaned == []
    assert dial.focusPolicy() == Qt.FocusPolicy.StrongFocus  # a button must not
    assert dial.toolTip() == ""


def test_the_focus_is_seen(qtbot: QtBot, dial: LeaningDial) -> None:
    dial.activateWindow()
    dial.setFocus()
    qtbot.waitUntil(dial.hasFocus)

    place = at(1.02, 0)
    color = dial.grab().toImage().pixelColor(place).name()

    assert color == DARK.accent
