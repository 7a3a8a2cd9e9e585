"""Two tips or two pivots in one series of poses are found, and one is left alone."""

import numpy as np
import pytest
from tests.simulated_centers import correlated_noise

from lightpen.arrays import BoolArray
from lightpen.estimation.pivot.pivot import fit_pivot
from lightpen.estimation.pivot.pivot_groups import PoseGroups, find_groups
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.simulator.swings import SwingKind, swing_poses

N_POSES = 200
HALF = np.arange(N_POSES) >= N_POSES // 2


def groups_of(
    *,
    kind: SwingKind = "operator",
    noise: float = 0.3,
    correlation: float = 0.0,
    other_tip: float = 0.0,
    other_pivot: float = 0.0,
    others: BoolArray = HALF,
    seed: int = 0,
) -> PoseGroups | None:
    """Find groups where some poses have another tip along y, or pivot along u, mm."""
    rng = np.random.default_rng(seed)
    swing = swing_poses(N_POSES, rng, kind)
    moved = swing.rotations @ [0.0, -other_tip, 0.0] + [other_pivot, 0.0, 0.0]
    translations = swing.translations + others[:, None] * moved
    translations += noise * correlated_noise(N_POSES, correlation, rng)
    used = fit_pivot(swing.rotations, translations).used
    return find_groups(swing.rotations, translations, used)


def test_a_tip_exchanged_halfway_is_found_with_the_pose_it_happened_at() -> None:
    groups = groups_of(other_tip=5.0)

    assert groups is not None
    assert groups.has_two_tips
    assert groups.tip_distance == pytest.approx(5.0, abs=0.5)
    assert set(groups.group[:100]) == {1}
    assert set(groups.group[100:]) == {2}


def test_a_cone_that_moved_halfway_is_found() -> None:
    groups = groups_of(other_pivot=2.0)

    assert groups is not None
    assert not groups.has_two_tips
    assert groups.pivot_distance == pytest.approx(2.0, abs=0.5)
    assert groups.tip_distance < 0.5


@pytest.mark.parametrize("distance", [10.0, 15.0])
@pytest.mark.parametrize("kind", ["field", "operator"])
def test_a_third_of_the_poses_that_agree_elsewhere_is_distinguished(
    kind: SwingKind, distance: float
) -> None:
    others = np.random.default_rng(1).random(N_POSES) < 0.3
    groups = groups_of(kind=kind, noise=1.8, other_pivot=distance, others=others)

    assert groups is not None
    # Gaussian noise of 1.8 mm puts 0.3 % of the poses nearer to what is 10 mm away.
    assert np.mean((groups.group == 2) != others) < 0.02
    assert groups.minor_share == pytest.approx(others.mean(), abs=0.02)


@pytest.mark.parametrize("correlation", [0.0, 0.9, 0.98])
@pytest.mark.parametrize("kind", ["field", "operator"])
def test_poses_of_one_tip_are_one_group_however_they_drift(
    kind: SwingKind, correlation: float
) -> None:
    for seed in range(5):
        assert groups_of(kind=kind, correlation=correlation, seed=seed) is None


def test_exact_poses_are_one_group() -> None:
    assert groups_of(noise=0.0) is None


@pytest.mark.parametrize(("step", "is_told"), [(0.4, True), (0.2, False)])
def test_a_tip_exchanged_at_a_pose_is_told_by_the_order_of_the_poses(
    step: float, is_told: bool
) -> None:
    """By less than the noise, which each side has to itself."""
    rng = np.random.default_rng(2)
    rotations = rotation_from_vector(rng.uniform(-0.6, 0.6, (150, 3)))
    translations = np.array([10.0, 20.0, 800.0]) - rotations @ [2.0, -1.0, 150.0]
    translations[90:, 0] += step
    translations += 0.2 * rng.standard_normal((150, 3))
    used = np.arange(150) % 10 != 3
    groups = find_groups(rotations, translations, used)

    assert (groups is not None) == is_told
    if groups is not None:
        expected = np.where(np.arange(150) < 90, 1, 2) * used
        assert np.sum(groups.group != expected) <= 2
        assert groups.pivot_distance == pytest.approx(step, abs=0.1)


@pytest.mark.parametrize(("turn", "is_told"), [(0.6, True), (0.02, False)])
@pytest.mark.parametrize("least_first", [True, False])
def test_poses_that_hardly_turn_make_no_group(
    turn: float, is_told: bool, least_first: bool
) -> None:
    rng = np.random.default_rng(3)
    sizes = np.where((np.arange(100) < 40) == least_first, turn, 0.6)
    rotations = rotation_from_vector(sizes[:, None] * rng.uniform(-1, 1, (100, 3)))
    others = sizes == turn if turn < 0.6 else np.arange(100) < 40
    translations = np.array([10.0, 20.0, 800.0]) - rotations @ [2.0, -1.0, 150.0]
    translations += 5.0 * others[:, None] + 0.1 * rng.standard_normal((100, 3))

    groups = find_groups(rotations, translations, np.ones(100, bool))
    assert (groups is not None) == is_told


@pytest.mark.parametrize(
    ("n_poses", "n_others", "is_told"),
    [(200, 20, True), (200, 19, False), (40, 6, True), (40, 5, False)],
)
def test_a_group_has_a_tenth_of_the_poses_and_six(
    n_poses: int, n_others: int, is_told: bool
) -> None:
    """Beside them are poses of no group, so that more disagree with the first."""
    rng = np.random.default_rng(4)
    rotations = rotation_from_vector(rng.uniform(-0.6, 0.6, (n_poses, 3)))
    translations = np.array([10.0, 20.0, 800.0]) - rotations @ [2.0, -1.0, 150.0]
    translations += 0.1 * rng.standard_normal((n_poses, 3))
    order = rng.permutation(n_poses)
    others, alone = order[:n_others], order[n_others : n_others + 3]
    translations[others] += [20.0, 0.0, 0.0]
    translations[alone] += rng.uniform(100.0, 300.0, (3, 3))
    used = ~np.isin(np.arange(n_poses), order[: n_others + 3])

    groups = find_groups(rotations, translations, used)
    assert (groups is not None) == is_told
    if groups is not None:
        np.testing.assert_array_equal(np.flatnonzero(groups.group == 2), sorted(others))
