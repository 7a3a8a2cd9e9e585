import numpy as np
import pytest
from tests.simulated_swings import draw_postures

from lightpen_extensions.simulator.swings import (
    MAX_TILT,
    Postures,
    operator_postures,
    random_postures,
)


def test_upright_pen_points_up_and_faces_the_camera() -> None:
    upright = Postures(np.zeros(1), np.zeros(1), np.zeros(1))
    np.testing.assert_allclose(
        upright.rotations[0], np.diag([1.0, -1.0, -1.0]), atol=1e-15
    )


def test_tilt_and_direction_say_where_the_pen_points() -> None:
    tilts, directions = np.radians([20.0, 30.0]), np.radians([0.0, 140.0])
    R = Postures(tilts, directions, np.radians([10.0, -25.0])).rotations
    expected = np.stack(
        [
            np.sin(tilts) * np.cos(directions),
            -np.cos(tilts),
            np.sin(tilts) * np.sin(directions),
        ],
        axis=-1,
    )
    np.testing.assert_allclose(R[:, :, 1], expected, atol=1e-14)
    np.testing.assert_allclose(R @ R.swapaxes(1, 2), [np.eye(3)] * 2, atol=1e-14)


def test_random_postures_fill_the_disc_of_tilts_evenly() -> None:
    tilts = random_postures(20_000, np.random.default_rng(1)).tilts
    inner_half = np.mean(tilts < MAX_TILT / np.sqrt(2))
    # Binomial standard deviation 0.0035.
    assert inner_half == pytest.approx(0.5, abs=0.014)


def test_operator_continues_the_same_movement_for_the_same_seed() -> None:
    early = operator_postures(np.array([1.0, 2.0]), seed=4)
    late = operator_postures(np.array([2.0, 3.0]), seed=4)
    other = operator_postures(np.array([2.0, 3.0]), seed=5)
    np.testing.assert_array_equal(early.rotations[1], late.rotations[0])
    assert np.abs(other.rotations - late.rotations).max() > 0.01


def test_operator_moves_smoothly() -> None:
    times = np.arange(0, 30, 1e-3)
    R = operator_postures(times, seed=2).rotations
    step = np.linalg.norm(R[1:] - R[:-1], axis=(1, 2)) / np.sqrt(2)
    # A hand turns the pen at less than 100 degrees per second.
    assert step.max() < np.radians(100) * 1e-3
    assert operator_postures(times, seed=2).tilts.max() < np.radians(33)


def test_one_axis_swing_turns_about_one_axis_only() -> None:
    R = draw_postures(20, np.random.default_rng(3), "one-axis").rotations
    turns = R[1:] @ R[:-1].swapaxes(1, 2)
    axes = np.stack(
        [
            turns[:, 2, 1] - turns[:, 1, 2],
            turns[:, 0, 2] - turns[:, 2, 0],
            turns[:, 1, 0] - turns[:, 0, 1],
        ],
        axis=-1,
    )
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    np.testing.assert_allclose(np.abs(axes @ axes[0]), 1, atol=1e-12)


def test_upright_swing_hardly_tilts() -> None:
    tilts = draw_postures(50, np.random.default_rng(3), "upright").tilts
    assert tilts.max() < np.radians(2)
