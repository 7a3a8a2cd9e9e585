"""Images of discs: centres, shapes, and centroids under distortion."""

import json
from pathlib import Path

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.model.camera import Camera, LensModel
from lightpen.model.ellipse import (
    centers_from_centroids,
    disc_centroids,
    disc_images,
    ellipse_centers,
)
from lightpen_extensions.simulator.swings import (
    leds_in_camera,
    paper_camera,
    paper_pen,
    swing_poses,
)

CAMERA = paper_camera()
PEN = paper_pen()
SWING = swing_poses(20, np.random.default_rng(0))
CENTERS, NORMALS = leds_in_camera(PEN, SWING.rotations, SWING.translations)


def rims(
    camera: Camera, centers: FloatArray = CENTERS, normals: FloatArray = NORMALS
) -> FloatArray:
    """Return 720 points on the image of each rim, (20, L, 720, 2)."""
    a = np.cross(normals, [1.0, 0.2, 0.0])
    a /= np.linalg.norm(a, axis=-1, keepdims=True)
    b = np.cross(normals, a)
    angles = np.linspace(0, 2 * np.pi, 720, endpoint=False)[:, None]
    radius = PEN.diameter / 2
    return camera.project(
        centers[:, :, None]
        + radius * (np.cos(angles) * a[:, :, None] + np.sin(angles) * b[:, :, None])
    )


def area_centroids(outline: FloatArray) -> FloatArray:
    """Return the centroids of polygons (..., K, 2) by Green's theorem."""
    x, y = np.moveaxis(outline - outline.mean(axis=-2, keepdims=True), -1, 0)
    x1, y1 = np.roll(x, -1, -1), np.roll(y, -1, -1)
    cross = x * y1 - x1 * y
    area = cross.sum(-1) / 2
    offset = np.stack([((x + x1) * cross).sum(-1), ((y + y1) * cross).sum(-1)], -1)
    centroids: FloatArray = outline.mean(axis=-2) + offset / (6 * area[..., None])
    return centroids


def test_without_distortion_the_centre_is_that_of_the_rims_ellipse() -> None:
    ideal = Camera(2448, 2048, 4638.2, 4637.1, 1219.6, 1031.3)
    images = disc_images(ideal, CENTERS, NORMALS, PEN.diameter / 2)

    # The centre of an ellipse is its area centroid.
    np.testing.assert_allclose(images.centers, area_centroids(rims(ideal)), atol=1e-4)
    offsets = rims(ideal) - images.centers[:, :, None]
    inverse = np.linalg.inv(images.shapes)
    distances = np.einsum("...ki,...ij,...kj->...k", offsets, inverse, offsets)
    np.testing.assert_allclose(distances, 4.0, rtol=1e-9)


def test_the_centre_lies_off_the_projected_centre_by_hundredths_of_a_pixel() -> None:
    offsets = ellipse_centers(CAMERA, CENTERS, NORMALS, 5.0) - CAMERA.project(CENTERS)
    lengths = np.linalg.norm(offsets, axis=-1)

    assert 0.02 < lengths.mean() < 0.06


def test_a_point_is_its_own_centre() -> None:
    np.testing.assert_allclose(
        ellipse_centers(CAMERA, CENTERS, NORMALS, 0.0),
        CAMERA.project(CENTERS),
        atol=1e-9,
    )


def test_the_centroid_of_a_distorted_disc_leads_back_to_its_centre() -> None:
    strong = Camera(
        2448,
        2048,
        4638.2,
        4637.1,
        1219.6,
        1031.3,
        np.array([-0.3, 0.2, 1e-3, -1e-3, 0]),
    )
    images = disc_images(strong, CENTERS, NORMALS, 5.0)
    centroids = area_centroids(rims(strong))

    found = centers_from_centroids(strong, centroids, images.shapes)

    assert np.abs(centroids - images.centers).max() > 5e-3
    np.testing.assert_allclose(found, images.centers, atol=1e-4)


def test_the_centroid_before_a_fisheye_is_far_from_the_image_of_the_centre() -> None:
    fisheye = Camera(
        *(960, 720, 506.0, 506.0, 480.0, 360.0),
        distortion=np.array([-0.02, 0.01, 0.0, 0.0]),
        lens=LensModel.KANNALA_BRANDT,
    )
    centers = np.array([[[120.0, 20.0, 250.0], [-200.0, 40.0, 200.0]]])
    normals = np.array([[[0.1, 0.3, -0.95], [0.0, 0.0, -1.0]]])
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    truth = area_centroids(rims(fisheye, centers, normals))
    of_centers = ellipse_centers(fisheye, centers, normals, PEN.diameter / 2)

    found = disc_centroids(fisheye, centers, normals, PEN.diameter / 2)
    np.testing.assert_allclose(found, truth, atol=1e-3)
    assert np.linalg.norm(of_centers - truth, axis=-1).min() > 0.05


def test_an_led_that_was_not_seen_stays_unseen() -> None:
    images = disc_images(CAMERA, CENTERS, NORMALS, 5.0)
    centroids = images.centers.copy()
    centroids[3, 4] = np.nan

    found = centers_from_centroids(CAMERA, centroids, images.shapes)

    assert np.isnan(found[3, 4]).all()
    assert np.isfinite(np.delete(found.reshape(-1, 2), 34, axis=0)).all()


def test_centres_agree_with_the_truth_of_an_independent_renderer(
    shared_data: Path,
) -> None:
    truth = json.loads((shared_data / "swing-clean" / "truth.json").read_text())
    leds = [led for frame in truth["frames"] for led in frame["leds"]]
    images = disc_images(
        CAMERA,
        np.array([led["xyz_cam"] for led in leds]),
        np.array([led["normal_cam"] for led in leds]),
        truth["pen"]["disc_radius_mm"],
    )
    semi_axes = 2 * np.sqrt(np.linalg.eigvalsh(images.shapes)[:, ::-1])

    # The truth has six decimals, its coordinates in mm too.
    for key, values in (("ellipse_center", images.centers), ("semi_axes", semi_axes)):
        np.testing.assert_allclose(values, [led[key] for led in leds], atol=2e-4)
    found = centers_from_centroids(
        CAMERA, np.array([led["centroid"] for led in leds]), images.shapes
    )
    assert np.abs(found - images.centers).max() == pytest.approx(0, abs=1e-5)
