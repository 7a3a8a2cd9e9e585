"""Poses in another convention or unit are refused, with what they look like."""

import numpy as np
import pytest
from tests.simulated_swings import swing_of_kind

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.pivot_calibration import (
    is_likely_inverted,
    require_usual_reading,
)
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.simulator.swings import swing_poses

SWING = swing_of_kind(60, np.random.default_rng(0), "operator")
R = SWING.rotations
T = SWING.translations + 0.2 * np.random.default_rng(1).standard_normal((60, 3))


def quaternions_read_as(order: tuple[int, int, int, int]) -> FloatArray:
    """Return the rotations whose quaternions (x, y, z, w) are read in an order."""
    vectors = np.random.default_rng(2).uniform(-0.5, 0.5, (60, 3))
    angles = np.linalg.norm(vectors, axis=1, keepdims=True)
    q = np.hstack([vectors / angles * np.sin(angles / 2), np.cos(angles / 2)])
    x, y, z, w = q[:, order].T
    angle = 2 * np.arctan2(np.linalg.norm([x, y, z], axis=0), w)
    axes = np.array([x, y, z]) / np.linalg.norm([x, y, z], axis=0)
    return rotation_from_vector((axes * angle).T)


def test_poses_as_documented_pass() -> None:
    require_usual_reading(R, T)


@pytest.mark.parametrize("n_poses", [6, 8, 12])
def test_few_noisy_poses_pass(n_poses: int) -> None:
    for seed in range(10):
        rng = np.random.default_rng(seed)
        swing = swing_poses(n_poses, rng)
        noise = rng.standard_normal((n_poses, 3))
        require_usual_reading(swing.rotations, swing.translations + noise)


def test_transposed_rotations_are_named() -> None:
    with pytest.raises(
        CalibrationError, match=r"seem transposed.*by 0\.\d* mm transposed"
    ):
        require_usual_reading(np.swapaxes(R, 1, 2), T)


def test_translations_of_the_inverse_are_named() -> None:
    of_inverse = -np.einsum("nji,nj->ni", R, T)
    with pytest.raises(CalibrationError, match="seem transposed"):
        require_usual_reading(R, of_inverse)


@pytest.mark.parametrize("order", [(3, 0, 1, 2), (1, 2, 3, 0)])
def test_quaternions_in_the_wrong_order_are_named(
    order: tuple[int, int, int, int],
) -> None:
    right = quaternions_read_as((0, 1, 2, 3))
    translations = np.array([10.0, 20.0, 800.0]) - right @ [2.0, -150.0, 1.0]
    require_usual_reading(right, translations)

    with pytest.raises(CalibrationError, match="quaternions in the wrong order"):
        require_usual_reading(quaternions_read_as(order), translations)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_an_axis_with_the_wrong_sign_is_named(axis: int) -> None:
    flipped = T * np.where(np.arange(3) == axis, -1.0, 1.0)
    with pytest.raises(CalibrationError, match=rf"sign of t{'xyz'[axis]} seems wrong"):
        require_usual_reading(R, flipped)


def test_metres_are_named() -> None:
    with pytest.raises(
        CalibrationError, match="The translations seem to be in metres:"
    ):
        require_usual_reading(R, T / 1000)


def test_micrometres_are_named() -> None:
    with pytest.raises(CalibrationError, match="millimetres are needed"):
        require_usual_reading(R, T * 1000)


@pytest.mark.parametrize("n_poses", [8, 60])
def test_poses_without_a_tip_are_refused(n_poses: int) -> None:
    shuffled = np.random.default_rng(3).uniform(-300, 300, (n_poses, 3))
    with pytest.raises(CalibrationError, match="have no common tip"):
        require_usual_reading(R[:n_poses], shuffled)


def test_a_tip_nearer_to_the_camera_than_to_its_pen_looks_inverted() -> None:
    assert not is_likely_inverted(SWING.tip_pen, SWING.cone_cam)
    assert is_likely_inverted(SWING.cone_cam, SWING.tip_pen)


def pivoting(n: int, tip: FloatArray, seed: int = 4) -> tuple[FloatArray, FloatArray]:
    """Return exact poses about a pivot 800 mm away."""
    rng = np.random.default_rng(seed)
    rotations = rotation_from_vector(rng.uniform(-0.6, 0.6, (n, 3)))
    return rotations, np.array([300.0, 20.0, 800.0]) - rotations @ tip


def code_of(rotations: FloatArray, translations: FloatArray) -> str:
    """Return the code of what is refused; empty if the poses pass."""
    try:
        require_usual_reading(rotations, translations)
    except CalibrationError as error:
        return error.message.code
    return ""


TIP = np.array([2.0, -1.0, 150.0])


@pytest.mark.parametrize(
    ("n_poses", "n_wrong", "code"),
    [(20, 2, ""), (20, 6, "poses.no-tip"), (21, 9, ""), (21, 12, "poses.no-tip")],
)
def test_half_of_the_poses_must_agree_and_most_of_a_few(
    n_poses: int, n_wrong: int, code: str
) -> None:
    """The median is of all: with 12 of 21 it is of those that do not agree."""
    R, t = pivoting(n_poses, TIP)
    t[:n_wrong] += np.random.default_rng(5).uniform(-400, 400, (n_wrong, 3))
    assert code_of(R, t) == code


@pytest.mark.parametrize(("size", "code"), [(9.9, "poses.in-metres"), (10.1, "")])
def test_translations_of_a_centimetre_are_in_metres(size: float, code: str) -> None:
    R, t = pivoting(30, TIP)
    t *= size / np.median(np.linalg.norm(t, axis=1))
    assert code_of(R, t) == code


@pytest.mark.parametrize(
    ("length", "code"), [(9900.0, ""), (10_100.0, "poses.in-micrometres")]
)
def test_a_tip_ten_metres_away_is_in_micrometres(length: float, code: str) -> None:
    R, t = pivoting(30, np.array([0.0, 0.0, -length]))
    assert code_of(R, t) == code
    if code:
        with pytest.raises(CalibrationError) as info:
            require_usual_reading(R, t)
        assert info.value.message.values["length"] == pytest.approx(length / 1000)


def scattered(R: FloatArray, t: FloatArray, size: float) -> FloatArray:
    """Return translations all of which miss the pivot by the same distance."""
    ways = np.random.default_rng(6).standard_normal(t.shape)
    return np.asarray(t + size * ways / np.linalg.norm(ways, axis=1, keepdims=True))


@pytest.mark.parametrize(
    ("length", "size", "code"),
    [
        (150.0, 18.0, ""),
        (150.0, 23.0, "poses.no-tip"),
        (20.0, 4.0, ""),  # the poses move by little more, but so may noise
        (12.0, 6.5, "poses.no-tip"),
        (60.0, 6.5, ""),
    ],
)
def test_a_tip_may_scatter_by_20_mm_unless_that_is_all_that_moves(
    length: float, size: float, code: str
) -> None:
    R, t = pivoting(200, np.array([0.0, 0.0, length]))
    assert code_of(R, scattered(R, t, size)) == code


def test_many_poses_are_judged_by_some_of_them() -> None:
    """Of 2000 poses 200 are looked at, from the first to the last."""
    R, t = pivoting(2000, TIP)
    some = np.unique(np.linspace(0, 1999, 200).round().astype(int))
    spoilt = t + 500.0 * np.random.default_rng(7).standard_normal(t.shape)
    spoilt[some] = t[some]
    assert code_of(R, spoilt) == ""


@pytest.mark.parametrize(("length", "code"), [(0.0015, ""), (0.0018, "poses.flipped")])
def test_scatter_of_a_millionth_of_the_translations_is_rounding(
    length: float, code: str
) -> None:
    """The flipped poses scatter by 0.0008 and 0.0009 mm, and 855 mm are usual."""
    R, t = pivoting(30, np.array([0.0, 0.0, length]))
    assert code_of(R, t * [-1.0, 1.0, 1.0]) == code
