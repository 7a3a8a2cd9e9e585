"""Poses of single images: exact on exact data, honest about noise, robust."""

import numpy as np
import pytest
from tests.simulated_centers import (
    displace_centers,
    drop_centers,
    simulate_centers,
    swap_centers,
)

from lightpen.arrays import FloatArray
from lightpen.detection.pose import fit_paper_poses, fit_poses, start_poses
from lightpen.detection.robust_residuals import disc_residuals
from lightpen.model.pen import Pen
from lightpen.model.rigid import rotation_from_vector, vector_from_rotation
from lightpen_extensions.simulator.swings import (
    Swing,
    paper_camera,
    paper_pen,
    select_frames,
    swing_poses,
)

CAMERA = paper_camera()
PEN = paper_pen()


def swing(n_frames: int = 40, seed: int = 0) -> Swing:
    return swing_poses(n_frames, np.random.default_rng(seed))


def centers(of: Swing, sigma: float, seed: int = 1, pen: Pen = PEN) -> FloatArray:
    rng = np.random.default_rng(seed)
    return simulate_centers(CAMERA, pen, of.rotations, of.translations, sigma, rng)


def projected(of: Swing) -> FloatArray:
    """Return the images of the LED centres, which the paper takes for the centres."""
    points = PEN.leds @ np.swapaxes(of.rotations, 1, 2) + of.translations[:, None]
    return CAMERA.project(points)


def test_exact_ellipse_centres_give_the_exact_poses() -> None:
    truth = swing()
    pixels = centers(truth, 0.0)

    fit = fit_poses(CAMERA, PEN, pixels, *start_poses(CAMERA, PEN, pixels))

    np.testing.assert_allclose(fit.rotations, truth.rotations, atol=1e-9)
    np.testing.assert_allclose(fit.translations, truth.translations, atol=1e-5)


def test_the_papers_method_is_exact_on_exact_projected_centres() -> None:
    truth = swing()
    pixels = projected(truth)

    fit = fit_paper_poses(CAMERA, PEN, pixels, truth.rotations, truth.translations)

    np.testing.assert_allclose(fit.rotations, truth.rotations, atol=1e-9)
    np.testing.assert_allclose(fit.translations, truth.translations, atol=1e-5)


def test_the_papers_linear_start_needs_no_start_of_ours() -> None:
    truth = swing()
    nowhere = np.tile(np.eye(3), (len(truth), 1, 1))

    fit = fit_paper_poses(
        CAMERA, PEN, projected(truth), nowhere, np.zeros((len(truth), 3))
    )

    np.testing.assert_allclose(fit.translations, truth.translations, atol=1e-5)


def test_the_papers_method_starts_from_the_given_pose_where_leds_are_too_few() -> None:
    truth = swing()
    pixels = drop_centers(projected(truth), 5, np.random.default_rng(3))
    start = start_poses(CAMERA, PEN, pixels)

    fit = fit_paper_poses(CAMERA, PEN, pixels, *start)

    np.testing.assert_allclose(fit.translations, truth.translations, atol=1e-4)


def test_the_derivative_of_disc_images_agrees_with_differences() -> None:
    truth = swing(3)
    lever = PEN.leds @ np.swapaxes(truth.rotations, 1, 2)
    there = lever + truth.translations[:, None]
    normals = PEN.normals @ np.swapaxes(truth.rotations, 1, 2)
    nothing = np.zeros((3, PEN.n_leds, 2))
    _, J = disc_residuals(CAMERA, lever, there, normals, 0.0, nothing)

    step = 1e-5
    for k in range(6):
        moved = []
        for sign in (1, -1):
            theta, shift = np.zeros(3), np.zeros(3)
            (theta if k < 3 else shift)[k % 3] = sign * step
            turned = lever @ rotation_from_vector(theta).T + shift
            moved.append(CAMERA.project(turned + truth.translations[:, None]))
        numeric = (moved[0] - moved[1]) / (2 * step)
        np.testing.assert_allclose(J[..., k], numeric, rtol=1e-6, atol=1e-4)


def test_the_covariance_agrees_with_the_scatter_of_many_fits() -> None:
    truth = swing(1)
    repeated = Swing(
        truth.postures,
        np.repeat(truth.rotations, 2000, axis=0),
        np.repeat(truth.translations, 2000, axis=0),
        truth.tip_pen,
        truth.cone_cam,
        truth.tips_cam,
    )
    fit = fit_poses(
        CAMERA, PEN, centers(repeated, 0.05), repeated.rotations, repeated.translations
    )
    turns = vector_from_rotation(fit.rotations @ truth.rotations[0].T)
    errors = np.hstack([turns, fit.translations - truth.translations[0]])

    ratio = errors.std(axis=0) / np.sqrt(
        np.diagonal(fit.covariances, axis1=1, axis2=2).mean(axis=0)
    )

    # 2000 draws fix a standard deviation to 1.6 %; the loss costs up to 3 %.
    np.testing.assert_allclose(ratio, 1.0, atol=0.08)


@pytest.mark.parametrize("times", [2.0, 3.0, 5.0])
def test_an_image_noisier_than_the_others_promises_less(times: float) -> None:
    truth = swing(200)
    noisy = np.arange(200) % 10 == 3
    sigmas = np.where(noisy, 0.03 * times, 0.03)[:, None, None]
    errors = np.random.default_rng(1).standard_normal((200, PEN.n_leds, 2))
    pixels = centers(truth, 0.0) + sigmas * errors

    fit = fit_poses(CAMERA, PEN, pixels, truth.rotations, truth.translations)

    turns = vector_from_rotation(fit.rotations @ np.swapaxes(truth.rotations, 1, 2))
    off = np.hstack([turns, fit.translations - truth.translations])
    squares = np.einsum("ni,nij,nj->n", off, np.linalg.inv(fit.covariances), off)
    # Chi-square of 6: 20 draws fix the mean to 13 %. It may promise too little.
    assert np.mean(squares[noisy]) < 9
    assert np.mean(squares[~noisy]) == pytest.approx(6, abs=1.5)


def test_a_wrong_led_does_not_count_as_noise_of_its_image() -> None:
    truth = swing(20)
    clean = centers(truth, 0.03)
    spoilt = clean.copy()
    spoilt[3, 4, 0] += 30.0

    one, other = (
        fit_poses(CAMERA, PEN, pixels, truth.rotations, truth.translations)
        for pixels in (clean, spoilt)
    )

    # An LED less, and what the loss leaves of it; 30 px as noise would make it 400.
    ratios = np.diag(other.covariances[3]) / np.diag(one.covariances[3])
    assert (np.sqrt(ratios) < 3).all()


def test_the_noise_is_found() -> None:
    truth = swing(200)
    fit = fit_poses(
        CAMERA, PEN, centers(truth, 0.05), truth.rotations, truth.translations
    )

    assert fit.sigma == pytest.approx(0.05, rel=0.06)


@pytest.mark.parametrize("distance", [40.0, 600.0])
def test_one_wrong_led_does_not_move_the_pose(distance: float) -> None:
    every = swing(60)
    spoilt = displace_centers(
        centers(every, 0.02), 1.0, distance, np.random.default_rng(5)
    )
    # A start that one LED has put behind the camera is none.
    started = np.isfinite(start_poses(CAMERA, PEN, spoilt)[1][:, 0])
    assert started.sum() > 50
    truth, pixels = select_frames(every, np.flatnonzero(started)), spoilt[started]

    fit = fit_poses(CAMERA, PEN, pixels, *start_poses(CAMERA, PEN, pixels))

    depth_errors = fit.translations - truth.translations
    assert np.abs(depth_errors).max() < 6 * 0.05  # mm, as without the wrong LED


def test_a_pose_spoilt_by_exchanged_leds_distrusts_most_of_them() -> None:
    truth = swing(200)
    pixels = swap_centers(centers(truth, 0.02), 0.2, np.random.default_rng(6))

    fit = fit_poses(CAMERA, PEN, pixels, *start_poses(CAMERA, PEN, pixels))

    wrong = np.abs(fit.translations - truth.translations).max(axis=1) > 0.5
    assert wrong.mean() < 0.06
    assert ((fit.weights[wrong] > 0.2).sum(axis=1) <= 5).all()


def test_no_pose_starts_behind_the_camera() -> None:
    anything = np.random.default_rng(0).uniform(0, 2000, (40, PEN.n_leds, 2))

    rotations, translations = start_poses(CAMERA, PEN, anything)

    none = np.isnan(translations[:, 0])
    assert 0 < none.sum() < 40
    assert np.isnan(rotations[none]).all()
    assert (translations[~none, 2] > 0).all()


def test_an_image_with_three_leds_is_a_mistake_of_the_caller() -> None:
    truth = swing(5)
    pixels = drop_centers(centers(truth, 0.0), 7, np.random.default_rng(0))

    with pytest.raises(ValueError, match="needs 4 LEDs, one has 3"):
        fit_poses(CAMERA, PEN, pixels, truth.rotations, truth.translations)
