"""Tests of the fisheye model of Kannala and Brandt."""

import cv2
import numpy as np
import pytest

from lightpen.errors import CalibrationError
from lightpen.model.camera import Camera, LensModel
from lightpen.model.ellipse import disc_images

FISHEYE = Camera(
    *(1280, 800, 380.0, 381.0, 645.0, 396.0),
    distortion=np.array([-0.02, 0.01, -0.006, 0.001]),
    lens=LensModel.KANNALA_BRANDT,
)
GRID = np.stack(np.meshgrid(np.linspace(0, 1279, 9), np.linspace(0, 799, 7)), axis=-1)


def points() -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """Return points up to 80 degrees off the axis, one on it, (40, 3), mm."""
    rng = np.random.default_rng(1)
    angle = np.radians(np.linspace(0, 80, 40))
    about = rng.uniform(0, 2 * np.pi, 40)
    unit = [np.sin(angle) * np.cos(about), np.sin(angle) * np.sin(about), np.cos(angle)]
    return np.asarray(300 * np.stack(unit, axis=-1))


def test_points_are_projected_as_opencv_does() -> None:
    expected, _ = cv2.fisheye.projectPoints(
        points()[:, None], np.zeros(3), np.zeros(3), FISHEYE.matrix, FISHEYE.distortion
    )

    np.testing.assert_allclose(FISHEYE.project(points()), expected[:, 0], atol=1e-9)


def test_undistortion_undoes_the_projection() -> None:
    pixels = FISHEYE.project(points())
    found = FISHEYE.unproject(pixels)

    np.testing.assert_allclose(
        found, points()[:, :2] / points()[:, 2:], rtol=1e-9, atol=1e-9
    )
    again = FISHEYE.pixels(FISHEYE.unproject(GRID))
    np.testing.assert_allclose(again[FISHEYE.sees(GRID)], GRID[FISHEYE.sees(GRID)])


def test_the_jacobians_agree_with_differences() -> None:
    at, step = points(), 1e-4
    J = FISHEYE.project_with_jacobian(at).jacobian
    for k in range(3):
        shift = step * np.eye(3)[k]
        there = FISHEYE.project(at + shift) - FISHEYE.project(at - shift)
        np.testing.assert_allclose(J[..., k], there / (2 * step), atol=1e-6)
    normalised = at[:, :2] / at[:, 2:]
    K = FISHEYE.intrinsics_jacobian(normalised)
    for k in range(8):
        shift = 1e-5 * np.eye(8)[k]
        more, less = (
            FISHEYE.with_intrinsics(FISHEYE.intrinsics + sign * shift).pixels(
                normalised
            )
            for sign in (1, -1)
        )
        np.testing.assert_allclose(K[..., k], (more - less) / 2e-5, atol=1e-5)


def test_the_centre_of_a_disc_is_that_of_its_outline() -> None:
    """Of a small disc, whose outline is an ellipse in the image, too."""
    center, normal, radius = np.array([160.0, 60.0, 120.0]), np.array([0.3, 0.1, -1]), 2
    normal /= np.linalg.norm(normal)
    across = np.cross(normal, [1.0, 0, 0])
    across /= np.linalg.norm(across)
    turns = np.linspace(0, 2 * np.pi, 720, endpoint=False)[:, None]
    other = np.cross(normal, across)
    rim = center + radius * (np.cos(turns) * across + np.sin(turns) * other)
    outline = FISHEYE.project(rim)
    x, y = outline.T
    doubled = x * np.roll(y, -1) - np.roll(x, -1) * y
    area = doubled.sum() / 2
    centroid = np.array(
        [np.sum((x + np.roll(x, -1)) * doubled), np.sum((y + np.roll(y, -1)) * doubled)]
    ) / (6 * area)
    found = disc_images(FISHEYE, center[None], normal[None], float(radius))

    np.testing.assert_allclose(found.centers[0], centroid, atol=0.01)


def test_corners_beyond_the_lens_are_known_as_such() -> None:
    wide = Camera(
        *(640, 640, 190.0, 190.0, 320.0, 320.0),
        distortion=np.zeros(4),
        lens=LensModel.KANNALA_BRANDT,
    )
    seen = wide.sees(np.array([[320.0, 320.0], [320.0, 10.0], [5.0, 5.0]]))

    assert seen.tolist() == [True, False, False]
    assert np.isfinite(wide.unproject(np.array([5.0, 5.0]))).all()


def test_coefficients_that_fold_the_image_are_refused() -> None:
    folding = FISHEYE.with_intrinsics(
        np.append(FISHEYE.intrinsics[:4], [-0.3, 0.0, 0.0, 0.0])
    )

    with pytest.raises(CalibrationError, match="fold"):
        folding.unproject(GRID)
