"""Posture coverage: where the pen leant, and which direction hardly turned."""

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.model.coverage import (
    DIRECTION_NAMES,
    MIN_SPREAD,
    measure_coverage,
    posture_spread,
    require_spread,
)
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.simulator.swings import swing_poses

UPRIGHT = np.diag([1.0, -1.0, -1.0])  # pen's y up in the image, z to the camera


def leaning(direction: float, tilt: float) -> FloatArray:
    """Return the upright pen leant by ``tilt`` towards a direction of the camera."""
    lean = np.array([np.cos(direction), 0.0, np.sin(direction)])
    axis = np.cross([0.0, -1.0, 0.0], lean)
    return rotation_from_vector(tilt * axis) @ UPRIGHT


def test_each_direction_is_counted_under_its_name() -> None:
    for k, name in enumerate(DIRECTION_NAMES):
        one = measure_coverage(leaning(k * np.pi / 4, np.radians(15))[None])
        far = measure_coverage(leaning(k * np.pi / 4, np.radians(30))[None])

        assert one.counts[0, k] == 1
        assert far.counts[1, k] == 1
        assert name not in one.missing
        assert len(one.missing) == 7


@pytest.mark.parametrize("degrees", [-20, 20])
def test_a_lean_between_two_directions_counts_for_the_nearer(degrees: int) -> None:
    for k in range(len(DIRECTION_NAMES)):
        direction = k * np.pi / 4 + np.radians(degrees)
        one = measure_coverage(leaning(direction, np.radians(15))[None])

        assert one.counts[0, k] == 1


def test_right_is_right_in_the_image_and_away_is_away_from_the_camera() -> None:
    right = leaning(0.0, 0.5)[:, 1]
    away = leaning(np.pi / 2, 0.5)[:, 1]

    assert right[0] > 0.4
    assert away[2] > 0.4


def test_upright_is_upright() -> None:
    coverage = measure_coverage(UPRIGHT[None])

    assert coverage.n_upright == 1
    assert coverage.tilts[0] < 1e-6


def test_a_turn_about_the_pens_own_axis_is_measured() -> None:
    turns = np.radians([-20.0, 0.0, 20.0])
    R = UPRIGHT @ rotation_from_vector(turns[:, None] * [0.0, 1.0, 0.0])

    np.testing.assert_allclose(measure_coverage(R).turns, turns, atol=1e-9)


def test_the_axis_of_a_swing_has_no_spread() -> None:
    axis = np.array([0.6, 0.0, 0.8])
    R = rotation_from_vector(np.linspace(-0.5, 0.5, 50)[:, None] * axis)

    spread, axes = posture_spread(R)

    assert spread[0] < 1e-6
    np.testing.assert_allclose(np.abs(axes[0] @ axis), 1.0, atol=1e-9)


def test_a_good_swing_misses_no_direction() -> None:
    swing = swing_poses(300, np.random.default_rng(0))

    assert measure_coverage(swing.rotations).missing == []


def test_a_pen_that_hardly_moved_and_one_turned_about_one_axis_differ() -> None:
    def turned(about: FloatArray, rms: float) -> FloatArray:
        vectors = np.concatenate([rms * about, -rms * about])
        return rotation_from_vector(np.sqrt(len(about)) * vectors)

    two, one = np.eye(3)[1:], np.eye(3)[:1]
    # Of two axes, the direction at right angles to both turns by 1.4 times as much.
    with pytest.raises(CalibrationError) as hardly:
        require_spread(turned(two, 0.9 * MIN_SPREAD))
    with pytest.raises(CalibrationError) as about_one:
        require_spread(turned(one, 1.1 * MIN_SPREAD))
    require_spread(turned(two, 1.1 * MIN_SPREAD))

    assert hardly.value.message.code == "coverage.hardly-moved"
    assert about_one.value.message.code == "coverage.one-axis"
