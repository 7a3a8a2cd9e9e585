"""Tests of the camera model."""

from collections.abc import Callable

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.model.camera import Camera

BROWN = np.array([-0.082, 0.105, 3e-4, -2e-4, 0.01])
RATIONAL = np.array([0.31, -0.12, 3e-4, -2e-4, 0.04, 0.39, -0.2, 0.05])
BARREL = np.array([-0.5, 0.0, 0.0, 0.0, 0.0])  # folds at r = 0.816

both_models = pytest.mark.parametrize(
    "distortion", [BROWN, RATIONAL], ids=["5 coefficients", "8 coefficients"]
)


def camera(distortion: FloatArray, focal_length: float = 4638.0) -> Camera:
    return Camera(
        2448, 2048, focal_length + 0.2, focal_length - 0.9, 1219.6, 1031.3, distortion
    )


def points_in_view(n: int, seed: int = 1) -> FloatArray:
    rng = np.random.default_rng(seed)
    depth = rng.uniform(600, 1800, n)
    return np.stack(
        [
            rng.uniform(-0.26, 0.26, n) * depth,
            rng.uniform(-0.22, 0.22, n) * depth,
            depth,
        ],
        axis=-1,
    )


def test_only_images_of_the_calibrated_size_fit() -> None:
    calibrated = camera(BROWN)

    assert calibrated.image_size == (2448, 2048)
    assert calibrated.fits(np.zeros((2048, 2448), np.uint8))
    assert not calibrated.fits(np.zeros((2448, 2048), np.uint8))
    assert not calibrated.fits(np.zeros((1024, 1224), np.uint8))


def pixels_in_image(seed: int = 2) -> FloatArray:
    rng = np.random.default_rng(seed)
    return rng.uniform([0, 0], [2447, 2047], (200, 2))


def central_difference(
    function: Callable[[FloatArray], FloatArray], at: FloatArray, step: float
) -> FloatArray:
    """Return d function / d at, shape (N, 2, k), for N points at (N, k)."""
    columns = []
    for k in range(at.shape[-1]):
        shift = np.zeros(at.shape[-1])
        shift[k] = step
        columns.append((function(at + shift) - function(at - shift)) / (2 * step))
    return np.stack(columns, axis=-1)


@both_models
def test_projection_agrees_with_opencv(distortion: FloatArray) -> None:
    cam, points = camera(distortion), points_in_view(200)
    expected, _ = cv2.projectPoints(
        points, np.zeros(3), np.zeros(3), cam.matrix, distortion
    )
    # 1e-9 px is 2000 px times the rounding of a double, times a few operations
    np.testing.assert_allclose(cam.project(points), expected[:, 0], atol=1e-9, rtol=0)


@both_models
def test_unprojection_agrees_with_opencv(distortion: FloatArray) -> None:
    cam, pixels = camera(distortion), pixels_in_image()
    expected = cv2.undistortPoints(pixels[:, None], cam.matrix, distortion)
    np.testing.assert_allclose(cam.unproject(pixels), expected[:, 0], atol=1e-9, rtol=0)


@both_models
def test_jacobian_by_the_point_agrees_with_central_differences(
    distortion: FloatArray,
) -> None:
    cam, points = camera(distortion), points_in_view(50)
    map_ = cam.project_with_jacobian(points)
    np.testing.assert_allclose(map_.points, cam.project(points), atol=1e-11, rtol=0)
    # Differences over 2e-3 mm of pixels known to 4e-13 leave 1e-9 px/mm.
    expected = central_difference(cam.project, points, 1e-3)
    np.testing.assert_allclose(map_.jacobian, expected, atol=5e-9, rtol=0)


@both_models
def test_jacobian_by_the_normalised_point_agrees_with_central_differences(
    distortion: FloatArray,
) -> None:
    cam = camera(distortion)
    normalised = np.random.default_rng(3).uniform(-0.27, 0.27, (50, 2))
    map_ = cam.pixels_with_jacobian(normalised)
    np.testing.assert_array_equal(map_.points, cam.pixels(normalised))
    expected = central_difference(cam.pixels, normalised, 1e-5)
    np.testing.assert_allclose(map_.jacobian, expected, rtol=1e-8, atol=1e-5)


@both_models
def test_jacobian_by_the_intrinsics_agrees_with_central_differences(
    distortion: FloatArray,
) -> None:
    cam = camera(distortion)
    normalised = np.random.default_rng(4).uniform(-0.27, 0.27, (50, 2))
    J = cam.intrinsics_jacobian(normalised)
    for k in range(len(cam.intrinsics)):
        step = 1e-2 if k < 4 else 1e-5  # px, coefficient
        shift = np.zeros(len(cam.intrinsics))
        shift[k] = step
        ahead = cam.with_intrinsics(cam.intrinsics + shift).pixels(normalised)
        behind = cam.with_intrinsics(cam.intrinsics - shift).pixels(normalised)
        # The pixels are known to 4e-13 px; the step divides that by 2e-5.
        np.testing.assert_allclose(
            J[..., k], (ahead - behind) / (2 * step), rtol=1e-7, atol=1e-6
        )


@both_models
def test_jacobian_of_unprojection_is_the_inverse_of_that_of_the_projection(
    distortion: FloatArray,
) -> None:
    cam = camera(distortion)
    back = cam.unproject_with_jacobian(pixels_in_image())
    there = cam.pixels_with_jacobian(back.points)
    product = back.jacobian @ there.jacobian
    np.testing.assert_allclose(
        product, np.broadcast_to(np.eye(2), product.shape), atol=1e-9
    )


@given(
    k1=st.floats(-0.2, 0.2),
    k2=st.floats(-0.1, 0.1),
    p1=st.floats(-1e-3, 1e-3),
    p2=st.floats(-1e-3, 1e-3),
)
def test_projecting_undoes_unprojecting_for_any_mild_lens(
    k1: float, k2: float, p1: float, p2: float
) -> None:
    cam, pixels = camera(np.array([k1, k2, p1, p2, 0.0])), pixels_in_image()
    np.testing.assert_allclose(
        cam.pixels(cam.unproject(pixels)), pixels, atol=1e-8, rtol=0
    )


def test_a_rational_camera_without_denominator_is_the_five_coefficient_one() -> None:
    points = points_in_view(50)
    padded = camera(np.concatenate([BROWN, np.zeros(3)]))
    np.testing.assert_array_equal(padded.project(points), camera(BROWN).project(points))


def test_leading_axes_are_kept() -> None:
    cam, points = camera(BROWN), points_in_view(60)
    frames = points.reshape(5, 12, 3)
    np.testing.assert_array_equal(
        cam.project(frames).reshape(60, 2), cam.project(points)
    )
    assert cam.project_with_jacobian(frames).jacobian.shape == (5, 12, 2, 3)
    assert cam.unproject(cam.project(frames)).shape == (5, 12, 2)
    assert cam.intrinsics_jacobian(frames[..., :2] / 1e4).shape == (5, 12, 2, 9)


def test_the_optical_axis_meets_the_principal_point() -> None:
    np.testing.assert_array_equal(
        camera(BROWN).project(np.array([0.0, 0.0, 900.0])), [1219.6, 1031.3]
    )


def test_missing_points_stay_missing_when_unprojected() -> None:
    pixels = pixels_in_image()
    pixels[[3, 17]] = np.nan
    normalised = camera(BROWN).unproject(pixels)
    assert np.array_equal(np.isnan(normalised), np.isnan(pixels))


@pytest.mark.parametrize(
    ("distortion", "point"),
    [
        (BARREL, (0.45, 0.33)),  # r = 0.558, just outside the image of the fold: 0.544
        (BARREL, (-1.27, -1.11)),  # solved by a point on the opposite side
        (np.array([-5.0, 30.0, 0.0, 0.0, -200.0]), (0.7, 0.5)),
    ],
)
def test_a_pixel_past_the_fold_of_the_lens_is_refused(
    distortion: FloatArray, point: tuple[float, float]
) -> None:
    cam = camera(distortion, 1200.0)
    pixel = np.array([[cam.cx + point[0] * cam.fx, cam.cy + point[1] * cam.fy]])
    with pytest.raises(CalibrationError, match="fold the image"):
        cam.unproject(pixel)


def test_a_pixel_within_the_fold_of_the_lens_is_unprojected() -> None:
    cam = camera(BARREL, 1200.0)
    pixel = np.array([[cam.cx + 0.53 * cam.fx, cam.cy]])
    assert 0.53 < cam.unproject(pixel)[0, 0] < np.sqrt(2 / 3)
