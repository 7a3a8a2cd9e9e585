"""Rotations by two cameras: which moments go together, and how late one is."""

import numpy as np
import numpy.typing as npt
import pytest

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.rigs.rig_poses import (
    PenRotations,
    RelativeRotation,
    measure_lag,
    relative_turn,
    require_same_moments,
)
from lightpen.model.rigid import rotation_from_vector

BETWEEN = rotation_from_vector(np.array([0.1, -0.7, 0.2]))  # of the two cameras
USUAL = 0.02  # rad^2, of both cameras together
MEDIAN = 1.538172  # length of a standard normal vector of three, in the median


def random_vectors(n: int, size: float, seed: int = 0) -> FloatArray:
    return size * np.random.default_rng(seed).standard_normal((n, 3))


def of_vectors(vectors: FloatArray, variance: float = USUAL / 2) -> PenRotations:
    n = len(vectors)
    return PenRotations(
        rotation_from_vector(vectors), np.full(n, variance), np.ones(n, bool)
    )


def off_by(vectors: FloatArray, usual: float = 1e-3) -> RelativeRotation:
    return RelativeRotation(np.eye(3), np.arange(len(vectors)), vectors, usual)


def along_x(values: npt.ArrayLike) -> FloatArray:
    return np.outer(np.asarray(values, dtype=np.float64), [1.0, 0.0, 0.0])


def test_what_one_camera_missed_the_other_completes() -> None:
    pen = rotation_from_vector(random_vectors(3, 1.0))
    one = PenRotations(pen, np.full(3, 1.0), np.array([True, False, False]))
    other = PenRotations(BETWEEN @ pen, np.full(3, 2.0), np.array([True, True, False]))
    both = one.completed(other, BETWEEN)

    assert both.known.tolist() == [True, True, False]
    assert both.variances[:2].tolist() == [1.0, 2.0]
    np.testing.assert_allclose(both.rotations, pen)


def test_the_relative_rotation_is_that_of_most_moments() -> None:
    pen, off = random_vectors(40, 1.0), np.zeros((40, 3))
    off[:12] = random_vectors(12, 0.5, 1)
    one, other = of_vectors(pen), of_vectors(pen)
    other = PenRotations(
        BETWEEN @ rotation_from_vector(off) @ other.rotations,
        np.where(np.arange(40) < 30, USUAL / 2, 1.0),
        np.arange(40) != 20,
    )
    found = relative_turn(one, other)

    np.testing.assert_allclose(found.rotation, BETWEEN, atol=1e-12)
    assert found.pairs.tolist() == np.delete(np.arange(40), 20).tolist()
    np.testing.assert_allclose(found.off, np.delete(off, 20, axis=0), atol=1e-9)
    assert found.usual == pytest.approx(np.sqrt(USUAL / 3) * MEDIAN, rel=1e-5)
    assert (
        found.apart.tolist()
        == np.flatnonzero(np.linalg.norm(off, axis=1) > 8 * found.usual).tolist()
    )


@pytest.mark.parametrize(
    ("most", "usual", "limit"),
    [(0.01, 0.0, 0.08), (0.01, 0.02, 0.16), (0.0, 0.0, 2e-4)],
)
def test_moments_are_apart_beyond_eight_times_what_is_usual(
    most: float, usual: float, limit: float
) -> None:
    off = np.full(20, most)
    off[[3, 7, 11]] = 0.99 * limit, 1.01 * limit, 2 * limit
    found = off_by(along_x(off), usual)

    assert found.scatter == pytest.approx(most)
    assert found.apart.tolist() == [7, 11]


@pytest.mark.parametrize(
    ("n", "n_fast", "fast", "is_told"),
    [
        (22, 0, 0.0, True),  # but for the first and the last, 20 moments
        (21, 0, 0.0, False),
        (60, 28, 0.29, True),
        (60, 30, 0.31, True),  # half of them are slow
        (60, 31, 0.31, False),
    ],
)
def test_a_lag_is_told_by_twenty_slow_moments_and_half_of_all(
    n: int, n_fast: int, fast: float, is_told: bool
) -> None:
    steps = np.full(n, 0.1)
    steps[:n_fast] = fast
    turns = along_x(np.cumsum(steps))
    speeds = np.gradient(turns, axis=0)
    found = measure_lag(of_vectors(turns), off_by(0.2 * speeds))

    assert (found is not None) == is_told
    if found is not None:
        assert found.value == pytest.approx(0.2)
        slow = speeds[1:-1][speeds[1:-1, 0] < 0.3]
        turn = 0.2 * np.sqrt(np.mean(np.sum(slow**2, axis=1)))
        assert found.turn == pytest.approx(turn)


@pytest.mark.parametrize(("times", "counts"), [(3.9, True), (4.1, False)])
@pytest.mark.parametrize("usual", [0.01, 2e-4])
def test_a_lag_is_of_moments_that_agree(
    times: float, counts: bool, usual: float
) -> None:
    turns = along_x(0.1 * np.arange(40))
    off = np.full(40, 0.01 if usual == 0.01 else 1e-6)
    off[17] = times * usual
    found = measure_lag(of_vectors(turns), off_by(along_x(off)))

    some = off[1:-1] if counts else np.delete(off, 17)[1:-1]
    assert found is not None
    assert found.value == pytest.approx(np.mean(some) / 0.1)
    # The other two axes show no turn, and count as observations all the same.
    left = np.sum((some - np.mean(some)) ** 2) / (3 * len(some) - 1)
    sigma = np.sqrt(left / (0.01 * len(some)))
    assert found.sigma == pytest.approx(sigma, abs=1e-9)


def test_a_moment_whose_neighbours_are_missing_tells_no_lag() -> None:
    turns = along_x(0.1 * np.arange(40))
    seen = of_vectors(turns)
    known = seen.known.copy()
    known[20] = False
    off = np.full(40, 0.01)
    off[[0, 19, 21, 39]] = 0.03
    found = measure_lag(
        PenRotations(seen.rotations, seen.variances, known), off_by(along_x(off))
    )

    assert found is not None
    assert found.value == pytest.approx(0.1)


def refused(one: PenRotations, other: PenRotations) -> dict[str, object]:
    with pytest.raises(CalibrationError) as info:
        require_same_moments(one, other, "right")
    return {"code": info.value.message.code, **info.value.message.values}


def test_six_moments_in_common_are_needed() -> None:
    pen = of_vectors(random_vectors(9, 1.0))
    few = PenRotations(pen.rotations, pen.variances, np.arange(9) < 5)
    enough = PenRotations(pen.rotations, pen.variances, np.arange(9) < 6)

    assert refused(pen, few) == {
        "code": "rig.few-pairs", "n_pairs": 5, "n_moments": 9, "camera": "right",
        "needed": 6,
    }  # fmt: skip
    assert len(require_same_moments(pen, enough, "right").pairs) == 6


@pytest.mark.parametrize(("scatter", "passes"), [(0.019, True), (0.021, False)])
def test_poses_that_scatter_more_than_any_file_makes_are_of_other_moments(
    scatter: float, passes: bool
) -> None:
    pen, ways = random_vectors(40, 1.0), random_vectors(40, 1.0, 1)
    off = scatter * ways / np.linalg.norm(ways, axis=1, keepdims=True)
    seen = rotation_from_vector(off) @ rotation_from_vector(pen)
    other = PenRotations(seen, np.full(40, USUAL / 2), np.ones(40, bool))

    if passes:
        require_same_moments(of_vectors(pen), other, "right")
    else:
        found = refused(of_vectors(pen), other)
        assert (found["code"], found["n_pairs"]) == ("rig.other-moments", 40)


@pytest.mark.parametrize(("n_apart", "passes"), [(10, True), (11, False)])
def test_a_quarter_of_the_moments_may_be_apart(n_apart: int, passes: bool) -> None:
    pen, off = random_vectors(40, 1.0), np.zeros((40, 3))
    off[:n_apart] = along_x(np.full(n_apart, 0.5))
    seen = rotation_from_vector(off) @ rotation_from_vector(pen)
    one = of_vectors(pen, 1e-6)
    other = PenRotations(seen, np.full(40, 1e-6), np.ones(40, bool))

    if passes:
        assert len(require_same_moments(one, other, "right").apart) == n_apart
    else:
        assert refused(one, other) == {
            "code": "rig.other-moments", "camera": "right", "n_apart": n_apart,
            "n_pairs": 40,
        }  # fmt: skip
