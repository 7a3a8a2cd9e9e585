"""Whether the tip rests: by the images of the last second."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulated_centers import simulate_centers

from lightpen.arrays import FloatArray
from lightpen.detection.pen_detection import detect_from_centers
from lightpen.swing.capture.rules import (
    in_place,
    offset,
    rests_in_place,
    seat_of,
    steady_seat,
)
from lightpen.swing.capture.state import (
    RecentDetection,
    SwingSetup,
    SwingState,
    start_swing,
)
from lightpen_extensions.simulator.swings import (
    PAPER_CONE,
    Postures,
    paper_camera,
    paper_pen,
    swing_from_postures,
)

CAMERA, PEN = paper_camera(), paper_pen()
STILL = np.zeros((21, 3))


def state_after(moves: FloatArray, seat: bool = False) -> SwingState:
    """Return a swing that saw a tip off the cone by ``moves`` (N, 3), mm, at 20 Hz."""
    rng = np.random.default_rng(0)
    n = len(moves)
    postures = Postures(
        np.radians(10 + 0.2 * rng.standard_normal(n)), np.zeros(n), np.zeros(n)
    )
    swing = swing_from_postures(postures, tips_cam=PAPER_CONE + moves)
    pixels = simulate_centers(
        CAMERA, PEN, swing.rotations, swing.translations, 0.05, rng
    )
    recent_detections = tuple(
        RecentDetection(
            0.05 * i,
            detect_from_centers(
                CAMERA, PEN, pixels[i], swing.rotations[i], swing.translations[i]
            ),
        )
        for i in range(n)
    )
    state = replace(
        start_swing(SwingSetup(CAMERA, PEN)),
        recent=recent_detections,
        time=0.05 * (n - 1),
    )
    return replace(state, seat=steady_seat(PEN, state)) if seat else state


def test_a_tip_that_rests_has_a_seat() -> None:
    assert steady_seat(PEN, state_after(STILL)) is not None


@pytest.mark.parametrize("drift", [0.5, 2.0])
def test_a_tip_that_drifts_has_none(drift: float) -> None:
    path = np.linspace(0, 1, 21)[:, None] * [drift, 0, 0]
    assert steady_seat(PEN, state_after(path)) is None


def test_half_a_second_is_not_enough() -> None:
    assert steady_seat(PEN, state_after(STILL[:11])) is None


def test_a_still_pen_without_a_nominal_tip_has_none() -> None:
    unknown = replace(PEN, nominal_tip=None)
    assert steady_seat(unknown, state_after(STILL)) is None


def test_images_out_of_the_seat_are_distinguished_from_those_in_it() -> None:
    state = state_after(STILL, seat=True)
    assert seat_of(state) is not None
    assert in_place(state, state.recent).all()
    assert rests_in_place(state, 0.5)
    assert offset(state, 1.0) < 0.3

    moves = STILL.copy()
    moves[15:] = [0.0, 3.0, 0.0]
    moved = replace(state_after(moves), seat=state.seat)
    np.testing.assert_array_equal(in_place(moved, moved.recent), np.arange(21) < 15)
    assert not rests_in_place(moved, 0.5)
    assert offset(moved) == pytest.approx(3.0, abs=0.3)


def test_a_tip_that_has_just_come_back_does_not_rest_yet() -> None:
    state = state_after(STILL, seat=True)
    moves = STILL.copy()
    moves[:18] = [0.0, 3.0, 0.0]
    back = replace(state_after(moves), seat=state.seat)

    assert in_place(back, back.recent[-1:]).all()
    assert not rests_in_place(back, 0.5)


@pytest.mark.parametrize("which", [12, 20])
def test_one_bad_image_does_not_tell_where_the_tip_is(which: int) -> None:
    state = state_after(STILL, seat=True)
    moves = STILL.copy()
    moves[which] = [0.0, 3.0, 0.0]
    jumping = replace(state_after(moves), seat=state.seat)

    assert offset(jumping, 1.0) < 0.3


def test_without_a_seat_nothing_is_in_place() -> None:
    state = state_after(STILL)
    assert not in_place(state, state.recent).any()
    assert offset(state) == 0.0
