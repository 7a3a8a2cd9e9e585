"""A pivot calibration tells what the poses leave in doubt."""

from pathlib import Path

import numpy as np
import pytest
from tests.simulated_centers import correlated_noise
from tests.simulated_swings import swing_of_kind

from lightpen.arrays import BoolArray, FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.pivot_calibration import calibrate_pivot
from lightpen.formats.observation_files import read_poses
from lightpen.messages import message
from lightpen_extensions.simulator.swings import swing_poses

N_POSES = 200


def poses(correlation: float = 0.0, seed: int = 0) -> tuple[FloatArray, FloatArray]:
    """Return poses of an operator's swing with noise of 0.3 mm."""
    rng = np.random.default_rng(seed)
    swing = swing_of_kind(N_POSES, rng, "operator")
    noise = 0.3 * correlated_noise(N_POSES, correlation, rng)
    return swing.rotations, swing.translations + noise


def with_other_pivot(others: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Return poses of which some rest 5 mm beside."""
    R, t = poses()
    return R, t + others[:, None] * [5.0, 0.0, 0.0]


def test_drifting_poses_leave_more_doubt_than_independent_ones() -> None:
    white, drifting = calibrate_pivot(*poses()), calibrate_pivot(*poses(0.95))

    assert white.correlation_factor == pytest.approx(1.0, abs=0.5)
    assert drifting.correlation_factor > 5


def test_exact_poses_give_the_exact_tip() -> None:
    swing = swing_poses(60, np.random.default_rng(0))

    found = calibrate_pivot(swing.rotations, swing.translations)

    np.testing.assert_allclose(found.fit.tip_pen, swing.tip_pen, atol=1e-8)
    assert found.expanded_uncertainty.max() < 1e-8
    assert not found.warnings


def test_quarters_of_a_real_tracker_agree_with_the_whole_by_their_uncertainty(
    shared_data: Path,
) -> None:
    table = read_poses(shared_data / "pivot-poses" / "optical-tracker.csv")
    R, t = table.rotations, table.translations
    whole = calibrate_pivot(R, t).fit.tip_pen
    for part in np.array_split(np.arange(len(R)), 4):
        quarter = calibrate_pivot(R[part], t[part])
        away = np.abs(quarter.fit.tip_pen - whole)
        assert np.all(away < 2 * quarter.expanded_uncertainty[:3])


def test_a_minority_elsewhere_is_left_out_and_named() -> None:
    others = np.arange(N_POSES) >= 150
    found = calibrate_pivot(*with_other_pivot(others))

    assert not found.fit.used[others].any()
    assert found.fit.used[~others].all()
    (warning,) = found.warnings
    assert "50 of 200 poses are outliers and were excluded: 151-200." in str(warning)


@pytest.mark.parametrize(("step", "named"), [(1, ["excluded: 101-107."]), (9, [])])
def test_a_few_are_named_if_they_are_a_stretch(step: int, named: list[str]) -> None:
    others = np.isin(np.arange(N_POSES), 100 + step * np.arange(7))
    found = calibrate_pivot(*with_other_pivot(others))

    assert np.array_equal(found.fit.used, ~others)
    assert [str(each).split(" were ")[1][:18] for each in found.warnings] == named


def test_all_poses_alike_are_taken_if_requested() -> None:
    others = np.arange(N_POSES) >= 100
    found = calibrate_pivot(*with_other_pivot(others), robust=False)

    assert found.fit.used.all()
    assert not found.warnings


def test_two_equal_groups_are_refused_with_all_their_poses() -> None:
    others = np.arange(N_POSES) % 2 == 1
    with pytest.raises(CalibrationError, match="Only 100 of 200 poses agree") as caught:
        calibrate_pivot(*with_other_pivot(others))

    named = caught.value.message.values["others"]
    assert str(named).endswith((", 195, 197, 199", ", 196, 198, 200"))


def test_scattered_outliers_are_named() -> None:
    R, t = poses()
    rng = np.random.default_rng(1)
    t[10:40] += rng.uniform(20, 200, (30, 3)) * rng.choice([-1.0, 1.0], (30, 3))

    (warning,) = calibrate_pivot(R, t).warnings

    assert "30 of 200 poses are outliers and were excluded:" in str(warning)
    assert "11-40" in str(warning)


def test_inverted_poses_are_reported() -> None:
    R, t = poses()
    inverse = np.swapaxes(R, 1, 2)

    found = calibrate_pivot(inverse, -np.einsum("nij,nj->ni", inverse, t))

    (warning,) = found.warnings
    assert "This indicates inverted poses" in str(warning)
    assert warning.values == {
        "tip": pytest.approx(np.linalg.norm(found.fit.tip_pen)),
        "pivot": pytest.approx(np.linalg.norm(found.fit.pivot_cam)),
    }


def test_stated_covariances_are_a_floor_to_the_uncertainty() -> None:
    R, t = poses()
    covariances = np.zeros((N_POSES, 6, 6))
    covariances[:, :3, :3] = 1e-12 * np.eye(3)
    covariances[:, 3:, 3:] = 0.3**2 * np.eye(3)

    honest = calibrate_pivot(R, t, covariances)
    cautious = calibrate_pivot(R, t, 100 * covariances)

    ratio = cautious.expanded_uncertainty / honest.expanded_uncertainty
    # Those of the honest one are raised a little by what its scatter leaves open.
    assert np.all((ratio > 7) & (ratio < 11))


@pytest.mark.parametrize(("n_wrong", "is_warned"), [(20, False), (21, True)])
def test_more_than_a_tenth_of_the_poses_left_out_is_warned_of(
    n_wrong: int, is_warned: bool
) -> None:
    R, t = poses()
    wrong = 3 * np.arange(n_wrong) + 1
    rng = np.random.default_rng(1)
    ways = rng.standard_normal((n_wrong, 3))
    t[wrong] += 150 * ways / np.linalg.norm(ways, axis=1, keepdims=True)
    found = calibrate_pivot(R, t)

    np.testing.assert_array_equal(np.flatnonzero(~found.fit.used), wrong)
    assert bool(found.warnings) == is_warned
    if is_warned:
        (warning,) = found.warnings
        named = ", ".join(str(place + 1) for place in wrong[:10])
        assert warning == message(
            *("pivot.many-left-out",),
            n_left_out=21,
            n_poses=N_POSES,
            poses=f"{named}, ...",
        )


@pytest.mark.parametrize(("n_others", "is_refused"), [(78, False), (82, True)])
def test_two_fifths_of_the_poses_may_be_a_minority(
    n_others: int, is_refused: bool
) -> None:
    others = np.arange(N_POSES) >= N_POSES - n_others
    if is_refused:
        with pytest.raises(CalibrationError) as info:
            calibrate_pivot(*with_other_pivot(others))
        assert info.value.message.code == "pivot.no-majority"
        return
    found = calibrate_pivot(*with_other_pivot(others))
    (warning,) = found.warnings
    assert warning.code == "pivot.many-left-out"


@pytest.mark.parametrize(("n_runs", "dots"), [(10, ""), (11, ", ...")])
def test_ten_runs_of_poses_are_named(n_runs: int, dots: str) -> None:
    R, t = poses()
    starts = 7 * np.arange(n_runs)
    t[(starts[:, None] + np.arange(3)).ravel()] += np.random.default_rng(1).uniform(
        50, 200, (3 * n_runs, 3)
    )
    (warning,) = calibrate_pivot(R, t).warnings

    runs = ", ".join(f"{start + 1}-{start + 3}" for start in starts[:10])
    assert warning.values["poses"] == runs + dots


def test_a_tip_that_is_elsewhere_from_one_pose_on_is_refused_with_it() -> None:
    R, t = poses()
    t[120:] += R[120:] @ [0.0, -1.0, 0.0]
    with pytest.raises(CalibrationError) as caught:
        calibrate_pivot(R, t)

    found = caught.value.message
    assert found.code == "pivot.step"
    assert abs(int(str(found.values["pose"])) - 121) <= 3
    assert found.values["tip"] == pytest.approx(1.0, abs=0.6)
