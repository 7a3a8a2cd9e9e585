from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QImage
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot
from tests.simulated_pens import fanned_pen

from lightpen_app.widgets.pen_view import PenPicture, PenView
from lightpen_extensions.simulator.swings import paper_pen

LEFT = Qt.MouseButton.LeftButton
PEN = paper_pen()
FAR_OFF = np.array([400.0, 300.0, 2000.0])
TIP = np.array([0.0, -90.0, -25.0])


@pytest.fixture
def view(qtbot: QtBot) -> PenView:
    view = PenView()
    qtbot.addWidget(view)
    view.resize(320, 400)
    view.set_value(PenPicture(PEN, TIP))
    view.show()
    return view


def press(view: PenView, key: Qt.Key) -> None:
    QTest.keyClick(view, key)


def picture(view: PenView) -> QImage:
    return view.grab().toImage()


def test_every_led_is_drawn_within_the_view_from_all_sides(view: PenView) -> None:
    for _ in range(12):
        for led in range(1, 11):
            assert view.rect().contains(view.place_of(led).toPoint())
        for _ in range(5):
            press(view, Qt.Key.Key_Right)
            press(view, Qt.Key.Key_Down)


def test_up_is_y_and_right_is_x(view: PenView) -> None:
    assert view.place_of(4).y() < view.place_of(1).y()
    assert view.place_of(5).x() < view.place_of(8).x()


def test_the_arrow_keys_turn_it_and_0_puts_it_back(view: PenView) -> None:
    start, at_first = picture(view), view.place_of(7)
    press(view, Qt.Key.Key_Left)
    press(view, Qt.Key.Key_Up)

    assert picture(view) != start

    press(view, Qt.Key.Key_0)

    assert view.place_of(7) == at_first


def test_dragging_turns_it(view: PenView) -> None:
    yaw, pitch = view._yaw, view._pitch
    QTest.mousePress(view, LEFT, pos=QPoint(100, 100))
    QTest.mouseMove(view, QPoint(140, 80))
    QTest.mouseRelease(view, LEFT, pos=QPoint(140, 80))

    turned = view._yaw - yaw, view._pitch - pitch
    assert turned == pytest.approx((0.349, -0.175), abs=1e-3)


def test_it_cannot_be_turned_over(view: PenView) -> None:
    for _ in range(40):
        press(view, Qt.Key.Key_Down)

    assert view._pitch < np.pi / 2


def test_a_click_on_an_led_chooses_it(view: PenView, qtbot: QtBot) -> None:
    place = view.place_of(7).toPoint()

    with qtbot.waitSignal(view.led_chosen) as chosen:
        QTest.mouseClick(view, LEFT, pos=place)

    assert chosen.args == [7]


def test_a_click_beside_the_pen_chooses_nothing(view: PenView, qtbot: QtBot) -> None:
    with qtbot.assertNotEmitted(view.led_chosen):
        QTest.mouseClick(view, LEFT, pos=QPoint(5, 200))


def test_the_chosen_led_and_marked_ones_look_different(view: PenView) -> None:
    plain = picture(view)
    view.set_chosen(3)
    chosen = picture(view)
    view.set_value(PenPicture(PEN, TIP, frozenset({3})))

    assert plain != chosen
    assert picture(view) != chosen


@pytest.mark.parametrize(
    "value",
    [
        PenPicture(),
        PenPicture(PEN),
        PenPicture(fanned_pen(), TIP),
        PenPicture(replace(PEN, leds=PEN.leds + FAR_OFF)),
        PenPicture(replace(PEN, leds=PEN.leds * 1e305)),
        PenPicture(replace(PEN, leds=PEN.leds * 0.0)),
        PenPicture(replace(PEN, leds=PEN.leds[:1], normals=PEN.normals[:1])),
    ],
    ids=["none", "no tip", "fanned", "far off", "too far", "one place", "one LED"],
)
def test_any_pen_can_be_drawn(view: PenView, value: PenPicture) -> None:
    view.set_value(value)

    picture(view)


def test_it_says_how_many_leds_it_shows(view: PenView) -> None:
    assert view.accessibleName() == "The LEDs in space"
    assert view.accessibleDescription() == "10 LEDs"
