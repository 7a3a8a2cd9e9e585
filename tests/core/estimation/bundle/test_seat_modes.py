import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.image_fields import (
    axes_of_cone,
    drift_modes,
    tilt_modes,
)
from lightpen.model.rigid import rotation_from_vector, rotations_of
from lightpen_extensions.simulator.swings import paper_pen, swing_poses

PEN = paper_pen()
ANGLES = np.linspace(0, 2 * np.pi, 60, endpoint=False)
ROUND = rotations_of(PEN, np.full(60, 0.4), ANGLES, np.zeros(60))


def test_forms_of_the_seat_say_nothing_of_where_it_is_on_average() -> None:
    forms = tilt_modes(swing_poses(60, np.random.default_rng(0)).rotations)

    np.testing.assert_allclose(forms.mean(axis=0), 0, atol=1e-12)
    np.testing.assert_allclose(np.mean(forms**2, axis=0), 1)


def test_a_drift_in_time_says_nothing_of_where_the_cone_is_on_average() -> None:
    (in_time,) = drift_modes(7).T

    assert in_time.mean() == pytest.approx(0)
    assert np.ptp(in_time) == pytest.approx(1)


def test_a_camera_that_looks_down_sees_the_same_seat() -> None:
    looking = rotation_from_vector(np.array([0.6, 0.0, 0.0]))

    np.testing.assert_allclose(
        tilt_modes(looking @ ROUND), tilt_modes(ROUND), atol=1e-12
    )


def test_a_seat_has_forms_before_a_camera_that_lies_on_its_side() -> None:
    on_its_side = rotation_from_vector(np.array([0.0, 0.0, np.pi / 2]))
    forms = tilt_modes(on_its_side @ ROUND)

    # Waves round the cone are independent of each other where the lean goes round.
    np.testing.assert_allclose(forms[:, :6].T @ forms[:, :6] / 60, np.eye(6), atol=1e-9)


def test_a_pen_that_keeps_its_lean_has_no_forms() -> None:
    upright = np.tile(np.eye(3), (5, 1, 1))

    assert not tilt_modes(upright).any()


@pytest.mark.parametrize(
    ("lean", "axes"),
    [
        # Less than 15 degrees off is upright, either way up.
        ((0.0, 1.0, 0.25), [[1, 0, 0], [0, 0, -1], [0, 1, 0]]),
        ((0.25, -1.0, 0.0), [[1, 0, 0], [0, 0, 1], [0, -1, 0]]),
        # Else the cone opens along the pen; the first axis lies across it.
        ((0.0, 4.0, 3.0), [[1, 0, 0], [0, 0.6, -0.8], [0, 0.8, 0.6]]),
        ((3.0, 0.0, 4.0), [[0, 1, 0], [-0.8, 0, 0.6], [0.6, 0, 0.8]]),
        ((4.0, 3.0, 0.0), [[0, 0, 1], [0.6, -0.8, 0], [0.8, 0.6, 0]]),
        (
            (1.0, 2.0, 2.0),
            [
                np.array([4, -1, -1]) / np.sqrt(18),
                np.array([0, 1, -1]) / np.sqrt(2),
                np.array([1, 2, 2]) / 3,
            ],
        ),
    ],
)
def test_the_axes_of_a_cone_are_right_away_and_along_the_pens(
    lean: tuple[float, float, float], axes: list[FloatArray]
) -> None:
    along = np.array(lean) / np.linalg.norm(lean)
    x = np.cross(along, [0.48, 0.6, 0.64])
    x /= np.linalg.norm(x)
    rotations = np.stack([x, along, np.cross(x, along)], axis=1)[None]

    np.testing.assert_allclose(axes_of_cone(rotations), axes, atol=1e-12)


def test_the_cone_drifts_in_time_and_along_the_shifts_of_lamps_that_move() -> None:
    shifts = np.array([[1.0, 5.0, -2.0], [3.0, 5.0, 0.0], [2.0, 5.0, 2.0]])

    found = drift_modes(3, shifts)

    expected = [[-0.5, 0.5, -0.5], [0.0, 1.5, 0.0], [0.5, 1.0, 0.5]]
    np.testing.assert_allclose(found, expected)
    assert drift_modes(0, np.zeros((0, 2))).shape == (0, 1)


def test_the_modes_are_waves_round_the_cone_and_the_tilt() -> None:
    rng = np.random.default_rng(3)
    rotations = swing_poses(20, rng).rotations
    right, away = rotations[:, 0, 1], rotations[:, 2, 1]
    radius, angle = np.hypot(right, away), np.arctan2(away, right)
    weight = radius / (radius + 0.15)  # half of it at a sine of 0.15
    waves = [f(n * angle) * weight for n in (1, 2, 3) for f in (np.cos, np.sin)]
    forms = np.stack([*waves, weight**2], axis=1)
    forms -= forms.mean(axis=0)

    np.testing.assert_allclose(tilt_modes(rotations), forms / forms.std(axis=0))
