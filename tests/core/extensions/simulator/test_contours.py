from statistics import NormalDist

import numpy as np
import pytest
from tests.simulated_lights import ellipse_contour
from tests.simulated_outlines import measure_insides

from lightpen.arrays import FloatArray
from lightpen_extensions.simulator.render import (
    Contours,
    Patch,
    blurred_insides,
    disc_contours,
)
from lightpen_extensions.simulator.swings import (
    Postures,
    leds_in_camera,
    paper_camera,
    paper_pen,
    swing_from_postures,
)

CAMERA = paper_camera()
PEN = paper_pen()
ROUNDED_NODES = 1e-4  # error of levels, as nodes are rounded to 1/4096 px


def pen_contours(sigma: float = 0.8) -> Contours:
    leds, normals = pen_in_camera()
    return disc_contours(CAMERA, leds, normals, PEN.diameter / 2, sigma)


def pen_in_camera() -> tuple[FloatArray, FloatArray]:
    posture = Postures(np.array([0.5]), np.array([0.7]), np.array([0.4]))
    swing = swing_from_postures(posture)
    return leds_in_camera(PEN, swing.rotations, swing.translations)


def centroid(patch: Patch) -> FloatArray:
    levels = patch.levels.astype(np.float64)
    rows, columns = np.indices(levels.shape)
    total = levels.sum()
    x = patch.left + (columns * levels).sum() / total
    y = patch.top + (rows * levels).sum() / total
    return np.array([x, y])


@pytest.mark.parametrize("sigma", [0.5, 0.8, 2.0])
def test_blurred_disc_is_disc_convolved_with_gaussian_and_pixel(sigma: float) -> None:
    center, semi_axes = np.array([20.37, 19.81]), (6.0, 4.8)
    [patch] = blurred_insides(ellipse_contour(center, semi_axes, 0.0, sigma), sigma)
    # The area itself, by Gauss quadrature in polar coordinates.
    radii, radial = np.polynomial.legendre.leggauss(60)
    radii, radial = (radii + 1) / 2, radial / 2
    angles = np.arange(240) * 2 * np.pi / 240
    x = center[0] + semi_axes[0] * np.outer(radii, np.cos(angles)).ravel()
    y = center[1] + semi_axes[1] * np.outer(radii, np.sin(angles)).ravel()
    area = semi_axes[0] * semi_axes[1] * 2 * np.pi / 240
    weights = area * np.repeat(radii * radial, 240)

    def pixel(offsets: FloatArray) -> FloatArray:
        edges = ((offsets + 0.5) / sigma, (offsets - 0.5) / sigma)
        right, left = (np.vectorize(NormalDist().cdf)(edge) for edge in edges)
        return np.asarray(right - left)

    height, width = patch.levels.shape
    rows = pixel(patch.top + np.arange(height)[:, None] - y)
    columns = pixel(patch.left + np.arange(width)[:, None] - x)
    np.testing.assert_allclose(
        patch.levels, (rows * weights) @ columns.T, atol=ROUNDED_NODES
    )


def test_centroids_of_rendered_discs_are_exact() -> None:
    contours = pen_contours()
    exact = measure_insides(contours)
    patches = blurred_insides(contours, 0.8)
    measured = np.stack([centroid(patch) for patch in patches])
    np.testing.assert_allclose(measured, exact.centroids, atol=1e-4)
    areas = [patch.levels.sum(dtype=np.float64) for patch in patches]
    np.testing.assert_allclose(areas, exact.areas, rtol=2e-5)


def test_areas_and_centroids_agree_with_a_polygon_of_many_corners() -> None:
    leds, normals = pen_in_camera()
    many = disc_contours(CAMERA, leds, normals, PEN.diameter / 2, sigma=0.005)
    x, y = np.moveaxis(many.nodes, -1, 0)
    x_next, y_next = np.roll(x, -1, axis=1), np.roll(y, -1, axis=1)
    cross = x * y_next - x_next * y
    areas = cross.sum(axis=1) / 2
    centroids = np.stack(
        [((x + x_next) * cross).sum(axis=1), ((y + y_next) * cross).sum(axis=1)],
        axis=-1,
    ) / (6 * areas[:, None])
    exact = measure_insides(pen_contours())
    # The polygon with 24 000 corners lacks 1e-8 of the area.
    np.testing.assert_allclose(exact.areas, np.abs(areas), rtol=1e-7)
    np.testing.assert_allclose(exact.centroids, centroids, atol=1e-6)


def test_shape_does_not_depend_on_the_place_within_a_pixel() -> None:
    totals = []
    for shift in np.linspace(0, 1, 7):
        contour = ellipse_contour(np.array([30 + shift, 30.0]), (3.0, 2.0), 0.0, 0.8)
        [patch] = blurred_insides(contour, 0.8)
        totals.append(patch.levels.sum(dtype=np.float64))
        assert centroid(patch)[0] == pytest.approx(30 + shift, abs=1e-4)
    np.testing.assert_allclose(totals, 6 * np.pi, rtol=1e-4)


def test_moving_disc_is_the_mean_of_its_places() -> None:
    leds, normals = pen_in_camera()
    moves = np.linspace(-1, 1, 5)[:, None, None] * np.array([1.0, 0.4, 0])
    radius = PEN.diameter / 2
    moving = disc_contours(
        CAMERA, leds + moves, np.repeat(normals, 5, axis=0), radius, 0.8
    )
    [blurred, *_] = blurred_insides(moving, 0.8)
    mean = np.zeros_like(blurred.levels)
    for move in moves:
        [still, *_] = blurred_insides(
            disc_contours(CAMERA, leds + move, normals, radius, 0.8), 0.8
        )
        top, left = still.top - blurred.top, still.left - blurred.left
        height, width = still.levels.shape
        mean[top : top + height, left : left + width] += still.levels / 5
    np.testing.assert_allclose(blurred.levels, mean, atol=ROUNDED_NODES)
