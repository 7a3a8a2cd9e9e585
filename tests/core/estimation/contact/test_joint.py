"""The joint fit: exact, at the Cramer-Rao bound, honest, robust."""

import numpy as np
import pytest
from tests.simulated_centers import displace_centers, drop_centers, simulate_centers

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.contact.joint import (
    ContactModel,
    JointFit,
    fit_contact,
    inliers,
    reduce,
)
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.simulator.swings import (
    Swing,
    paper_camera,
    paper_pen,
    select_frames,
    swing_poses,
)

CAMERA = paper_camera()
PEN = paper_pen()


def swing(n_frames: int, seed: int = 0) -> Swing:
    return swing_poses(n_frames, np.random.default_rng(seed))


def centers(of: Swing, sigma: float, seed: int = 1) -> FloatArray:
    rng = np.random.default_rng(seed)
    return simulate_centers(CAMERA, PEN, of.rotations, of.translations, sigma, rng)


def fit(of: Swing, pixels: FloatArray) -> JointFit:
    """Fit from a start a degree and some tenths of a millimetre off."""
    turns = 0.01 * np.random.default_rng(9).standard_normal((len(of), 3))
    return fit_contact(
        ContactModel.of(CAMERA, PEN, pixels),
        rotation_from_vector(turns) @ of.rotations,
        of.tip_pen + np.array([0.3, -0.2, 0.1]),
        of.cone_cam + np.array([0.1, 0.2, -0.4]),
    )


def test_exact_centres_give_the_exact_tip() -> None:
    truth = swing(40)
    result = fit(truth, centers(truth, 0.0))

    np.testing.assert_allclose(result.tip_pen, truth.tip_pen, atol=1e-7)
    np.testing.assert_allclose(result.cone_cam, truth.cone_cam, atol=1e-6)
    np.testing.assert_allclose(result.translations, truth.translations, atol=1e-6)
    assert result.used.all()


def test_the_derivative_of_the_contact_model_agrees_with_differences() -> None:
    truth = swing(4)
    model = ContactModel.of(CAMERA, PEN, np.zeros((4, PEN.n_leds, 2)))
    R, x0, u0 = truth.rotations, truth.tip_pen, truth.cone_cam
    state = model.at(R, x0, u0)
    by_place = state.jacobian[..., 3:] @ state.by_tip_and_cone[:, None]
    J = np.concatenate([state.jacobian[..., :3], by_place], axis=3)

    h = 1e-4
    for k in range(9):
        step = np.zeros(9)
        step[k] = h
        there, back = (
            model.at(
                rotation_from_vector(s * step[:3]) @ R,
                x0 + s * step[3:6],
                u0 + s * step[6:],
            ).residuals
            for s in (1, -1)
        )
        # The ellipse's centre moves with the projected one to some parts in 1000.
        scale = np.abs(J[..., k]).max()
        np.testing.assert_allclose(
            J[..., k], (back - there) / (2 * h), atol=5e-3 * scale
        )


@pytest.mark.slow
def test_the_scatter_is_at_the_cramer_rao_bound_and_covered_by_the_intervals() -> None:
    truth = swing(60)
    sigma = 0.05
    bound = fit(truth, centers(truth, 0.0))
    bound_std = np.sqrt(np.diag(bound.covariance)) * sigma / bound.sigma

    fits = [fit(truth, centers(truth, sigma, seed)) for seed in range(400)]
    errors = np.array(
        [
            np.hstack([f.tip_pen - truth.tip_pen, f.cone_cam - truth.cone_cam])
            for f in fits
        ]
    )
    predicted = np.array([np.sqrt(np.diag(f.covariance)) for f in fits])

    # 400 draws fix a standard deviation to 3.5 %, a coverage of 95 % to 1.1 %.
    np.testing.assert_allclose(errors.std(axis=0) / bound_std, 1.0, atol=0.11)
    covered = (np.abs(errors) < 1.96 * predicted).mean(axis=0)
    assert ((covered > 0.917) & (covered < 0.983)).all()


def test_the_noise_is_found_however_few_the_images() -> None:
    truth = swing(6)
    variances = []
    for seed in range(30):
        rng = np.random.default_rng([seed, 1])
        pixels = drop_centers(centers(truth, 0.05, seed), 5, rng)
        variances.append(fit(truth, pixels).sigma ** 2)

    # 30 draws of 36 degrees of freedom fix a variance to 4 %.
    assert np.mean(variances) == pytest.approx(0.05**2, rel=0.1)


def test_the_residuals_of_each_image_add_up_to_those_of_all() -> None:
    pixels = centers(swing(20), 0.05)
    pixels[4, 2] += 3.0
    pixels[11, 2:] = np.nan
    result = fit(swing(20), pixels)

    assert np.isnan(result.image_rms[11])
    others = np.delete(np.arange(20), 11)
    n_used, image_rms = result.used.sum(axis=1)[others], result.image_rms[others]
    assert np.average(image_rms**2, weights=n_used) == pytest.approx(result.rms**2)
    assert result.rms == pytest.approx(result.sigma * np.sqrt(2), rel=0.3)


def test_missing_leds_are_allowed() -> None:
    truth = swing(40)
    pixels = drop_centers(centers(truth, 0.0), 5, np.random.default_rng(2))

    result = fit(truth, pixels)

    np.testing.assert_allclose(result.tip_pen, truth.tip_pen, atol=1e-7)


def test_wrong_leds_are_left_out_and_cost_nothing_else() -> None:
    truth = swing(100)
    clean = centers(truth, 0.05)
    spoilt = displace_centers(clean, 0.3, 5.0, np.random.default_rng(3))

    result = fit(truth, spoilt)

    displaced = np.any(spoilt != clean, axis=2)
    np.testing.assert_array_equal(~result.used, displaced)
    error = np.abs(result.tip_pen - truth.tip_pen)
    assert (error < 4 * np.sqrt(np.diag(result.covariance)[:3])).all()


def test_an_image_without_a_usable_led_does_no_harm() -> None:
    truth = swing(40)
    pixels = centers(truth, 0.01)
    pixels[7] += 300.0

    result = fit(truth, pixels)

    assert not result.used[7].any()
    assert np.isfinite(result.covariance).all()
    assert np.abs(result.tip_pen - truth.tip_pen).max() < 0.01


@pytest.mark.parametrize("n_seen", [1, 2])
def test_an_image_of_one_or_two_leds_takes_no_part(n_seen: int) -> None:
    truth = swing(40)
    pixels = centers(truth, 0.05)
    others = np.delete(np.arange(40), 7)
    without = fit(select_frames(truth, others), pixels[others])
    pixels[7, n_seen:] = np.nan

    result = fit(truth, pixels)

    assert not result.used[7].any()
    assert result.sigma == pytest.approx(without.sigma, rel=1e-9)
    np.testing.assert_allclose(result.covariance, without.covariance, rtol=1e-6)


def test_what_each_image_says_adds_up_to_the_covariance() -> None:
    truth = swing(30)
    result = fit(truth, centers(truth, 0.05))

    np.testing.assert_allclose(
        np.linalg.inv(result.information.sum(axis=0)), result.covariance
    )
    residual_gradient = result.gradients.sum(axis=0) @ result.covariance
    assert np.abs(residual_gradient).max() < 1e-5  # mm: the fit has settled


def test_images_added_one_by_one_give_the_fit_of_all() -> None:
    truth = swing(45)
    pixels = centers(truth, 0.05)
    growing = fit_contact(
        ContactModel.of(CAMERA, PEN, pixels[:40]),
        truth.rotations[:40],
        truth.tip_pen,
        truth.cone_cam,
    )
    for n in range(41, 46):
        starts = np.concatenate([growing.rotations, truth.rotations[n - 1 : n]])
        growing = fit_contact(
            ContactModel.of(CAMERA, PEN, pixels[:n]),
            starts,
            growing.tip_pen,
            growing.cone_cam,
        )

    np.testing.assert_allclose(growing.tip_pen, fit(truth, pixels).tip_pen, atol=1e-6)


def test_an_image_of_three_leds_counts_and_one_of_two_does_not() -> None:
    residuals = 0.03 * np.random.default_rng(0).standard_normal((10, 8, 2))
    residuals[3, 3:] = np.nan
    residuals[4, 2:] = np.nan

    np.testing.assert_array_equal(
        inliers(residuals).sum(axis=1), [8, 8, 8, 3, 0, 8, 8, 8, 8, 8]
    )


@pytest.mark.parametrize("weight", np.geomspace(1, 1e9, 40))
def test_an_image_of_one_led_leaves_the_fit_solvable(weight: float) -> None:
    """It turns freely about the line of sight of that LED."""
    rng = np.random.default_rng(5)
    swing = swing_poses(30, rng)
    pixels = simulate_centers(
        CAMERA, PEN, swing.rotations, swing.translations, 0.03, rng
    )
    model = ContactModel.of(CAMERA, PEN, pixels)
    state = model.at(swing.rotations, swing.tip_pen, swing.cone_cam)
    weights = np.ones(pixels.shape[:2])
    usual = reduce(state, weights).step()
    weights[0] = 0.0
    weights[0, 4] = weight
    step = reduce(state, weights).step()
    assert np.abs(step - usual).max() < 0.01


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_start_endlessly_far_does_not_settle() -> None:
    true, far = swing(8), np.array([0.0, 0.0, 1e120])
    pixels = centers(true, 0.0)
    with pytest.raises(CalibrationError, match="did not converge"):
        fit_contact(
            ContactModel.of(CAMERA, PEN, pixels), true.rotations, true.tip_pen, far
        )


@pytest.mark.parametrize(("scale", "limit"), [(0.03, 0.15), (1e-4, 0.025)])
def test_leds_are_left_out_beyond_five_standard_deviations(
    scale: float, limit: float
) -> None:
    """Of the least noise of centres at least; few images leave less of it."""
    residuals = np.zeros((12, 8, 2))
    residuals[..., 0] = scale * 1.17741 / np.sqrt(2 * 96 / (2 * 96 - 3 * 12))
    residuals[[1, 2, 3], 4] = [[0.0, 0.99 * limit], [0.0, 1.01 * limit], [np.nan] * 2]

    found = inliers(residuals)

    # One LED fewer is seen, which makes 3 in 10,000.
    assert found[1, 4]
    assert not found[[2, 3], 4].any()
    assert found.sum() == 12 * 8 - 2


def test_what_an_image_says_of_tip_and_cone_is_what_its_rotation_leaves() -> None:
    truth = swing(12)
    pixels = centers(truth, 0.05)
    pixels[3, 4:], pixels[7, 2] = np.nan, pixels[7, 2] + 3.0
    model = ContactModel.of(CAMERA, PEN, pixels)
    result = fit(truth, pixels)
    state = model.at(result.rotations, result.tip_pen, result.cone_cam)

    used = result.used
    assert used.sum() == 120 - 7
    squares = np.sum(result.residuals[used] ** 2)
    sigma = np.sqrt(squares / (2 * 113 - 3 * 12 - 6))
    assert result.sigma == pytest.approx(sigma)
    assert result.rms == pytest.approx(np.sqrt(squares / 113))
    of_images = np.where(used[..., None], result.residuals, 0.0) ** 2
    mean = np.sum(of_images, axis=(1, 2)) / used.sum(axis=1)
    np.testing.assert_allclose(result.image_rms, np.sqrt(mean))
    for i, R in enumerate(result.rotations):
        J = state.jacobian[i, used[i]].reshape(-1, 6) / sigma
        r = state.residuals[i, used[i]].ravel() / sigma
        turn, cone = J[:, :3], J[:, 3:]
        A = cone @ np.hstack([-R, np.eye(3)])
        free = np.eye(len(r)) - turn @ np.linalg.pinv(turn)
        information = A.T @ free @ A
        scale = np.abs(information).max()
        np.testing.assert_allclose(
            result.information[i], information, rtol=1e-5, atol=5e-6 * scale
        )
        np.testing.assert_allclose(
            result.gradients[i], A.T @ free @ r, rtol=1e-3, atol=1e-3 * np.sqrt(scale)
        )


def test_of_a_fit_of_no_led_nothing_is_told() -> None:
    truth = swing(12)
    result = fit(truth, centers(truth, 0.05))
    none = JointFit(**{**vars(result), "used": np.zeros_like(result.used)})

    assert np.isnan(none.image_rms).all()


def test_a_fit_that_starts_near_another_ends_as_that_of_any_start() -> None:
    """An LED far off is known at once, and the last step may be a micrometre."""
    truth = swing(30)
    pixels = centers(truth, 0.05)
    pixels[5, 3] += 40.0
    whole = fit(truth, pixels)
    near = fit_contact(
        ContactModel.of(CAMERA, PEN, pixels),
        whole.rotations,
        whole.tip_pen + 1e-3,
        whole.cone_cam - 1e-3,
        is_near=True,
    )

    np.testing.assert_array_equal(near.used, whole.used)
    np.testing.assert_allclose(near.tip_pen, whole.tip_pen, atol=2e-6)
    np.testing.assert_allclose(near.residuals, whole.residuals, atol=2e-3)
    assert near.sigma == pytest.approx(whole.sigma, rel=1e-5)
    scale = np.abs(whole.information).max()
    np.testing.assert_allclose(near.information, whole.information, atol=1e-4 * scale)
