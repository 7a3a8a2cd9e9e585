"""The pen is drawn as its operator sees it."""

import math

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from lightpen.model.rigid import Posture
from lightpen_app.widgets.pen_in_space import (
    DisplayedPosture,
    PenInSpace,
    seen_from_behind,
)
from lightpen_extensions.simulator.swings import paper_pen

PEN = paper_pen()
TIP = np.array([0.0, -90.0, -25.0])
UPRIGHT = Posture(0.0, 0.0, 0.0)
RIGHT = Posture(math.radians(30), 0.0, 0.0)


def middle(posture: Posture, heading: float = 0.0) -> tuple[float, float]:
    places = seen_from_behind(DisplayedPosture(PEN, TIP, heading=heading), posture)
    right, up = places.mean(axis=0).tolist()
    return right, up


def test_a_pen_that_leans_right_is_drawn_to_the_right() -> None:
    assert middle(RIGHT)[0] > middle(UPRIGHT)[0] + 50
    assert 0 < middle(RIGHT)[1] < middle(UPRIGHT)[1]


def test_who_faces_the_camera_sees_it_the_other_way_round() -> None:
    assert middle(RIGHT, math.pi)[0] == pytest.approx(-middle(RIGHT)[0], abs=1e-6)


def test_a_pen_that_leans_away_is_drawn_higher_than_one_that_leans_near() -> None:
    away, near = (Posture(0.5, angle, 0.0) for angle in (math.pi / 2, -math.pi / 2))

    assert middle(away)[1] > middle(near)[1] + 20


def test_pen_and_goal_are_drawn(qtbot: QtBot) -> None:
    view = PenInSpace()
    qtbot.addWidget(view)
    view.resize(200, 260)

    def drawn(stand: DisplayedPosture | None) -> bytes:
        view.set_value(stand)
        picture = view.grab().toImage()  # its bits are there as long as it is
        return bytes(picture.constBits())

    pictures = [
        drawn(stand)
        for stand in (
            None,
            DisplayedPosture(PEN, TIP),
            DisplayedPosture(PEN, TIP, UPRIGHT),
            DisplayedPosture(PEN, TIP, RIGHT),
            DisplayedPosture(PEN, TIP, UPRIGHT, RIGHT),
        )
    ]
    assert len(set(pictures)) == len(pictures)
