"""Pivot fit: exact, published, robust, honest, and refusing what fixes no tip."""

from pathlib import Path

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.pivot.pivot import (
    agreeing_solution,
    contact_matrix,
    fit_pivot,
    tip_covariances,
)
from lightpen.formats.observation_files import PoseTable, read_poses
from lightpen.model.coverage import require_spread
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.simulator.swings import swing_poses

TIP_PEN = np.array([2.0, -1.0, 150.0])
PIVOT_CAM = np.array([10.0, 20.0, 800.0])


def pivoting_poses(
    n_poses: int = 60, *, noise: float = 0.0, seed: int = 0, max_tilt: float = 0.6
) -> tuple[FloatArray, FloatArray]:
    """Return cam_from_pen of a pen tilted at random about the pivot."""
    rng = np.random.default_rng(seed)
    rotations = rotation_from_vector(rng.uniform(-max_tilt, max_tilt, (n_poses, 3)))
    translations = PIVOT_CAM - rotations @ TIP_PEN
    return rotations, translations + noise * rng.standard_normal((n_poses, 3))


@pytest.fixture
def tracker_poses(shared_data: Path) -> PoseTable:
    """Return real poses of a tracked pointer swung on its tip."""
    return read_poses(shared_data / "pivot-poses" / "optical-tracker.csv")


@pytest.mark.parametrize("robust", [True, False])
def test_exact_poses_give_the_exact_tip(robust: bool) -> None:
    fit = fit_pivot(*pivoting_poses(), robust=robust)

    np.testing.assert_allclose(fit.tip_pen, TIP_PEN, atol=1e-8)
    np.testing.assert_allclose(fit.pivot_cam, PIVOT_CAM, atol=1e-8)
    assert fit.used.all()


def test_plain_least_squares_gives_the_published_tip(tracker_poses: PoseTable) -> None:
    fit = fit_pivot(tracker_poses.rotations, tracker_poses.translations, robust=False)

    np.testing.assert_allclose(fit.tip_pen, [-14.476, 395.143, -7.558], atol=6e-4)
    np.testing.assert_allclose(fit.pivot_cam, [-805.285, -85.448, -2112.066], atol=6e-4)
    assert fit.rms == pytest.approx(1.838, abs=6e-4)


def test_gross_outliers_leave_the_tip_where_the_rest_puts_it(
    tracker_poses: PoseTable,
) -> None:
    rng = np.random.default_rng(1)
    R, t = tracker_poses.rotations, tracker_poses.translations
    wrong = rng.random(len(t)) < 0.3
    spoilt = t + wrong[:, None] * rng.uniform(100, 500, t.shape)

    fit = fit_pivot(R, spoilt)

    rest = fit_pivot(R[~wrong], t[~wrong])
    assert not fit.used[wrong].any()
    np.testing.assert_allclose(fit.tip_pen, rest.tip_pen, atol=1e-6)


def test_known_covariances_weigh_the_poses() -> None:
    rng = np.random.default_rng(2)
    R, t = pivoting_poses(300)
    sigma = np.where(np.arange(300) % 2, 0.01, 1.0)
    noisy = t + sigma[:, None] * rng.standard_normal(t.shape)
    covariances = np.zeros((300, 6, 6))
    covariances[:, 3:, 3:] = sigma[:, None, None] ** 2 * np.eye(3)

    fit = fit_pivot(R, noisy, covariances)

    assert np.abs(fit.tip_pen - TIP_PEN).max() < 4 * 0.01 / np.sqrt(150) / 0.3
    assert np.sqrt(fit.covariance[0, 0]) < 0.01


@pytest.mark.slow
def test_the_covariance_agrees_with_the_scatter_of_many_fits() -> None:
    fits = [fit_pivot(*pivoting_poses(noise=0.1, seed=seed)) for seed in range(400)]
    errors = np.array([fit.tip_pen - TIP_PEN for fit in fits])
    predicted = np.array([np.diag(fit.covariance)[:3] for fit in fits]).mean(axis=0)

    # The variance of 400 draws is itself known to sqrt(2 / 400) = 7 %.
    np.testing.assert_allclose(errors.var(axis=0), predicted, rtol=0.25)


@pytest.mark.parametrize(("stated", "factor"), [(0.05, 4.0), (0.1, 1.0), (0.2, 1.0)])
def test_covariances_that_promise_too_much_are_raised_to_the_scatter(
    stated: float, factor: float
) -> None:
    R, t = pivoting_poses(300, noise=0.1)
    covariances = np.zeros((300, 6, 6))
    covariances[:, 3:, 3:] = stated**2 * np.eye(3)

    fit = fit_pivot(R, t, covariances)

    A = contact_matrix(R).reshape(-1, 6)
    promised = stated**2 * np.linalg.inv(A.T @ A)
    # 900 equations fix a variance to 5 %.
    np.testing.assert_allclose(fit.covariance, factor * promised, rtol=0.15)


def test_the_covariance_of_a_tip_follows_that_of_its_pose() -> None:
    rng = np.random.default_rng(4)
    R, t = pivoting_poses(1)
    # The tip is 150 mm away, which makes turn and shift of like size.
    root = np.diag([1e-3] * 3 + [0.15] * 3) @ rng.standard_normal((6, 6))
    draws = rng.standard_normal((20000, 6)) @ root.T
    tips = rotation_from_vector(draws[:, :3]) @ R[0] @ TIP_PEN + t[0] + draws[:, 3:]

    predicted = tip_covariances(R, (root @ root.T)[None], TIP_PEN)[0]

    # 20000 draws fix a covariance to 0.7 % of both deviations.
    np.testing.assert_allclose(np.cov(tips.T), predicted, rtol=0.05, atol=0.01)


def test_five_poses_are_too_few() -> None:
    with pytest.raises(CalibrationError, match=r"5 poses .* at least 6"):
        fit_pivot(*pivoting_poses(5))


def test_a_tip_that_wanders_is_refused() -> None:
    R, t = pivoting_poses(60)
    steps = np.random.default_rng(0).uniform(-3, 3, t.shape)
    covariances = np.tile(1e-4 * np.eye(6), (60, 1, 1))

    with pytest.raises(CalibrationError, match=r"The tip moved by .* mm \(RMS\)"):
        fit_pivot(R, t + np.cumsum(steps, axis=0), covariances)


def test_a_pen_that_hardly_moved_is_refused() -> None:
    with pytest.raises(CalibrationError, match="hardly moved"):
        fit_pivot(*pivoting_poses(max_tilt=0.01))


@pytest.mark.parametrize(
    ("axis", "advice"),
    [(0, "left and right"), (1, "Tilt the pen"), (2, "towards and away")],
)
def test_a_swing_about_one_axis_is_refused_with_what_is_missing(
    axis: int, advice: str
) -> None:
    vectors = np.zeros((40, 3))
    vectors[:, axis] = np.linspace(-0.6, 0.6, 40)

    with pytest.raises(CalibrationError, match="one axis") as caught:
        require_spread(rotation_from_vector(vectors))

    assert f"the pen's {'xyz'[axis]} axis" in str(caught.value)
    assert advice in str(caught.value)


@pytest.mark.parametrize("slip", [0.09, 0.3])
def test_slipped_poses_are_found_by_their_covariances(slip: float) -> None:
    """Chance moves one pose in 100,000 by more than 0.07 mm."""
    swing = swing_poses(100, np.random.default_rng(0))
    slipped = np.arange(100) % 25 == 3
    t = swing.translations + slipped[:, None] * [slip, 0.0, 0.0]
    covariances = np.tile(1e-8 * np.eye(6), (100, 1, 1))
    covariances[:, 3:, 3:] = 1e-4 * np.eye(3)

    fit = fit_pivot(swing.rotations, t, covariances)

    np.testing.assert_array_equal(~fit.used, slipped)


def test_a_slipped_pose_is_found_among_seven() -> None:
    covariances = np.tile(1e-8 * np.eye(6), (7, 1, 1))
    covariances[:, 3:, 3:] = 0.05**2 * np.eye(3)
    for seed in range(60):
        R, t = pivoting_poses(7, noise=0.05, seed=seed)
        t[3] += [1.0, 0.0, 0.0]
        used = fit_pivot(R, t, covariances).used
        np.testing.assert_array_equal(np.flatnonzero(~used), [3])


def test_without_covariances_outliers_are_reported_by_the_scatter_of_the_rest() -> None:
    R, t = pivoting_poses(200, noise=0.1)
    slipped = np.arange(200) % 50 == 7
    t[slipped] += [1.2, 0.0, 0.0]

    np.testing.assert_array_equal(~fit_pivot(R, t).used, slipped)


def test_the_solution_of_a_share_of_the_poses_is_that_of_the_nearest_ones() -> None:
    R, t = pivoting_poses(noise=0.3, seed=8)
    t[:24] += R[:24] @ [0.0, 5.0, 0.0]  # another tip

    solution = agreeing_solution(R, t, 0.5)

    offs = np.linalg.norm(R @ solution[:3] + t - solution[3:], axis=1)
    nearest = np.argsort(offs)[:30]
    again = fit_pivot(R[nearest], t[nearest], robust=False)
    np.testing.assert_allclose(again.tip_pen, solution[:3], atol=1e-9)
    np.testing.assert_allclose(again.pivot_cam, solution[3:], atol=1e-9)


def test_the_covariance_of_few_poses_is_not_too_small() -> None:
    """Six poses leave twelve of eighteen equations to tell the noise."""
    R, exact = pivoting_poses(6)
    rng = np.random.default_rng(5)
    draws = 0.1 * rng.standard_normal((600, *exact.shape))
    found = [fit_pivot(R, exact + draw, robust=False).covariance for draw in draws]

    A = contact_matrix(R).reshape(-1, 6)
    # The mean of 600 variances of twelve degrees of freedom is known to 2 %.
    np.testing.assert_allclose(
        np.mean(found, axis=0)[:3, :3], 0.01 * np.linalg.inv(A.T @ A)[:3, :3], rtol=0.1
    )
