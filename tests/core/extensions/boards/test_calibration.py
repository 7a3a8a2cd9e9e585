"""Tests of intrinsics by a board: what is chosen, refused and remarked."""

from collections.abc import Callable
from dataclasses import replace
from datetime import date

import numpy as np
import pytest

from lightpen.errors import CalibrationError
from lightpen.formats.camera_checks import LARGEST_FOLD
from lightpen.model.camera import Camera
from lightpen_extensions.boards.calibration import (
    MIN_VIEWS,
    CameraCalibration,
    calibrate_camera,
)
from lightpen_extensions.boards.distortion import (
    choose_distortion,
    fit_camera,
    map_uncertainty,
)
from lightpen_extensions.boards.observing import Views
from lightpen_extensions.boards.report import residuals_by_region
from lightpen_extensions.boards.start import start_camera

MakeViews = Callable[..., Views]
NOISE = 0.03  # px, of `make_views`


@pytest.fixture(scope="module")
def found(make_views: MakeViews) -> CameraCalibration:
    return calibrate_camera(make_views(), date(2026, 3, 1))


@pytest.fixture(scope="module")
def few(make_views: MakeViews) -> CameraCalibration:
    return calibrate_camera(make_views(n_views=6))


@pytest.mark.slow
def test_the_truth_lies_within_the_intervals(
    found: CameraCalibration, camera: Camera
) -> None:
    assert found.camera.covariance is not None
    sigmas = np.sqrt(np.diag(found.camera.covariance))

    assert np.all(np.abs(found.camera.intrinsics - camera.intrinsics) < 3 * sigmas)
    assert found.camera.calibrated_on == date(2026, 3, 1)
    assert not found.remarks


def test_five_coefficients_are_kept_where_eight_gain_nothing(
    found: CameraCalibration,
) -> None:
    assert found.choice.n_coefficients == 5


@pytest.mark.slow
def test_eight_coefficients_are_taken_where_the_lens_needs_them(
    make_views: MakeViews,
) -> None:
    lens = Camera(
        *(640, 480, 300.0, 300.0, 320.0, 240.0),
        distortion=np.array([3.0, 1.6, 2e-3, -1e-3, 0.05, 3.4, 2.4, 0.35]),
    )
    views = make_views(of=lens, n_views=24)
    fitted = fit_camera(views, start_camera(views, 5))
    choice, _ = choose_distortion(views, fitted, lambda fraction: None)

    assert choice.n_coefficients == 8
    assert "Brown's lens model with 8 coefficients" in str(choice.message)


@pytest.mark.slow
def test_a_lens_that_the_views_leave_open_is_a_finding(make_views: MakeViews) -> None:
    """The corners, which no view reaches, are extrapolated by a rational function."""
    lens = Camera(
        *(640, 480, 420.0, 420.0, 320.0, 240.0),
        distortion=np.array([1.2, 0.6, 2e-3, -1e-3, 0.05, 1.6, 1.1, 0.35]),
    )

    found = calibrate_camera(make_views(of=lens, n_views=24))
    assert "intrinsics.uncertain" in {remark.code for remark in found.remarks}


def test_views_left_out_are_met_nearly_as_well_as_those_fitted(
    found: CameraCalibration,
) -> None:
    assert found.adjustment.rms < found.held_out_rms < 1.2 * found.adjustment.rms


@pytest.mark.slow
def test_views_left_out_are_met_by_the_board_as_it_is_bent(
    make_views: MakeViews,
) -> None:
    bent = make_views(shape=np.array([0, 0, 0.3, -0.1, 0.15]))
    found = calibrate_camera(bent)

    assert found.held_out_rms < 1.2 * found.adjustment.rms


@pytest.mark.slow
def test_a_view_that_fits_no_other_is_left_out(make_views: MakeViews) -> None:
    views = make_views()
    pixels = views.pixels.copy()
    pixels[3, 0] += np.random.default_rng(1).normal(0, 2, pixels[3, 0].shape)
    found = calibrate_camera(replace(views, pixels=pixels))

    assert found.left_out == ("view_04.png",)


def test_a_view_that_shows_one_row_is_left_out(make_views: MakeViews) -> None:
    views = make_views()
    pixels = views.pixels.copy()
    pixels[3, :, 9:] = np.nan
    found = calibrate_camera(replace(views, pixels=pixels))

    assert found.left_out == (views.names[3],)


@pytest.mark.slow
def test_a_misplaced_point_is_left_out(make_views: MakeViews) -> None:
    views = make_views()
    pixels = views.pixels.copy()
    pixels[3, 0, 7] += 0.6
    found = calibrate_camera(replace(views, pixels=pixels))

    assert found.n_points_left_out == 1
    assert not found.left_out


def test_the_worst_view_comes_first(found: CameraCalibration) -> None:
    rms = found.adjustment.view_rms[found.worst_first, 0]

    assert np.all(np.diff(rms) <= 0)


def test_too_few_views_are_refused(make_views: MakeViews) -> None:
    with pytest.raises(CalibrationError, match=f"{MIN_VIEWS - 1} images show"):
        calibrate_camera(make_views(n_views=MIN_VIEWS - 1))


def test_views_that_are_alike_are_refused_or_a_finding(make_views: MakeViews) -> None:
    views = make_views(n_views=8)
    rng = np.random.default_rng(2)
    one = np.repeat(views.pixels[:1], 8, axis=0)
    one = one + rng.uniform(-4, 4, (8, 1, 1, 2))
    alike = replace(views, pixels=one + rng.normal(0, 0.03, one.shape))

    with pytest.raises(CalibrationError, match=r"too similar"):
        calibrate_camera(alike)


@pytest.mark.slow
@pytest.mark.parametrize("shape", [(0.03, 0, 0, 0, 0), (0, 0, 1.5, 0, 0)])
def test_a_stretched_or_bent_board_is_estimated(
    make_views: MakeViews, shape: tuple[float, ...]
) -> None:
    fitted = calibrate_camera(make_views(shape=np.array(shape))).adjustment

    u = np.sqrt(np.diag(fitted.covariance))[-5:]
    assert (np.abs(fitted.state.shape - shape) < 4 * u).all()


def test_points_of_another_board_are_refused(make_views: MakeViews) -> None:
    views = make_views()
    shuffled = views.pixels[:, :, np.random.default_rng(1).permutation(54)]

    with pytest.raises(CalibrationError, match="its squares differ"):
        calibrate_camera(replace(views, pixels=shuffled))


def test_more_views_lessen_the_uncertainty_over_the_image(
    few: CameraCalibration, found: CameraCalibration
) -> None:
    assert few.camera.covariance is not None
    assert found.camera.covariance is not None

    before = map_uncertainty(few.camera, few.camera.covariance)
    after = map_uncertainty(found.camera, found.camera.covariance)
    assert after.typical < before.typical
    assert before.center < before.typical < before.worst


def test_residuals_are_reported_by_region(found: CameraCalibration) -> None:
    regions = residuals_by_region(found.views, found.adjustment.residuals)

    assert regions["points"].sum() == found.views.seen.sum()
    np.testing.assert_allclose(
        np.nansum(regions["points"] * regions["rms_px"] ** 2) / regions["points"].sum(),
        found.adjustment.rms**2,
    )


@pytest.mark.slow
def test_a_wide_lens_is_fitted_though_no_view_reaches_the_corners(
    make_views: MakeViews,
) -> None:
    """A polynomial that fits the middle folds the corners; a fisheye does not."""
    lens = Camera(
        *(640, 480, 282.0, 282.0, 325.0, 249.0),
        distortion=np.array([-0.23, 0.052, 0, 0, 0.0156, 0.033, -0.051, 0.045]),
    )
    views = make_views(of=lens, n_views=24)
    off = np.linalg.norm(views.pixels - [325.0, 249.0], axis=-1, keepdims=True)
    inner = replace(views, pixels=np.where(off < 300.0, views.pixels, np.nan))
    found = calibrate_camera(inner)

    assert found.adjustment.rms < 1.1 * NOISE * 2**0.5
    assert found.camera.covariance is not None
    assert np.isfinite(map_uncertainty(found.camera, found.camera.covariance).worst)


@pytest.mark.parametrize("seed", [2, 3])
def test_a_lens_is_not_folded_where_no_view_is(
    make_views: MakeViews, seed: int
) -> None:
    """The views reach a quarter of the way to the corners; what is beyond is open."""
    lens = Camera(
        *(640, 480, 357.0, 357.0, 325.0, 224.0),
        distortion=np.array([-0.39, 0.15, -1e-4, -6e-4, -0.02]),
    )
    views = make_views(of=lens, n_views=12, seed=seed)
    off = np.linalg.norm(views.pixels - [325.0, 224.0], axis=-1, keepdims=True)
    inner = replace(views, pixels=np.where(off < 110.0, views.pixels, np.nan))
    inner = inner.chosen(inner.seen.sum(axis=(1, 2)) >= 12)

    found = calibrate_camera(inner)

    assert found.camera.folded_share <= LARGEST_FOLD
    assert "intrinsics.uncertain" in {remark.code for remark in found.remarks}
