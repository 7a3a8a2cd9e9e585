"""Centres of LEDs as tests and benchmarks need them: noise, several cameras, faults."""

from pathlib import Path

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.detection.observations import Observations, observe_centers
from lightpen.estimation.calibrate import Calibration, calibrate
from lightpen.formats.observation_files import Centers
from lightpen.model.camera import Camera
from lightpen.model.ellipse import ellipse_centers
from lightpen.model.pen import Pen
from lightpen.model.rigid import Rig
from lightpen_extensions.simulator.swings import (
    Swing,
    faces_camera,
    inside_image,
    leds_in_camera,
    seen_from,
)


def simulate_centers(
    camera: Camera,
    pen: Pen,
    rotations: FloatArray,
    translations: FloatArray,
    sigma: float,
    rng: np.random.Generator,
) -> FloatArray:
    """Return measured centres (F, L, 2) of the LEDs, px, without rendering an image.

    The exact centre of each disc's elliptic image plus independent Gaussian noise,
    sigma px per coordinate. LEDs that face away or lie outside the image are NaN. The
    poses cam_from_pen are rotations (F, 3, 3) and translations (F, 3), mm.
    """
    leds_cam, normals_cam = leds_in_camera(pen, rotations, translations)
    centers = ellipse_centers(camera, leds_cam, normals_cam, pen.diameter / 2)
    seen = faces_camera(leds_cam, normals_cam) & inside_image(camera, centers)
    noise = sigma * rng.standard_normal(centers.shape)
    return np.where(seen[..., None], centers + noise, np.nan)


def correlated_noise(
    n_frames: int, correlation: float, rng: np.random.Generator
) -> FloatArray:
    """Return noise (F, 3) of unit variance that hangs together from frame to frame.

    Parameters
    ----------
    correlation : float
        Of neighbouring frames; that of others falls off by its powers.
    """
    noise = rng.standard_normal((n_frames, 3))
    fresh = np.sqrt(1 - correlation**2)
    for i in range(1, n_frames):
        noise[i] = correlation * noise[i - 1] + fresh * noise[i]
    return noise


def simulate_rig_centers(
    rig: Rig, pen: Pen, swing: Swing, sigma: float, rng: np.random.Generator
) -> FloatArray:
    """Return measured centres of the LEDs in the images of several cameras.

    Parameters
    ----------
    swing : Swing
        In the frame that the rig is given from, F frames.
    sigma : float
        As for `simulate_centers`.

    Returns
    -------
    (F, C, L, 2) array
        px; NaN where missing.
    """
    views = []
    stands = zip(rig.cameras, rig.rotations, rig.translations, strict=True)
    for camera, R, t in stands:
        there = seen_from(swing, R, t)
        poses = there.rotations, there.translations
        views.append(simulate_centers(camera, pen, *poses, sigma, rng))
    return np.stack(views, axis=1)


def drop_centers(
    centers: FloatArray, n_missing: int, rng: np.random.Generator
) -> FloatArray:
    """Return centres (F, L, 2) with random LEDs missing (NaN) in every frame."""
    order = np.argsort(rng.random(centers.shape[:-1]), axis=-1)
    return np.where((order < n_missing)[..., None], np.nan, centers)


def displace_centers(
    centers: FloatArray, fraction: float, distance: float, rng: np.random.Generator
) -> FloatArray:
    """Return centres (F, L, 2) with one LED displaced in a fraction of the frames.

    The distance is in px, in a random direction.
    """
    n_frames, n_leds, _ = centers.shape
    hit = rng.permutation(n_frames)[: round(fraction * n_frames)]
    angles = rng.uniform(0, 2 * np.pi, len(hit))
    displaced = centers.copy()
    displaced[hit, rng.integers(n_leds, size=len(hit))] += distance * np.stack(
        [np.cos(angles), np.sin(angles)], axis=-1
    )
    return displaced


def swap_centers(
    centers: FloatArray, fraction: float, rng: np.random.Generator
) -> FloatArray:
    """Return centres (F, L, 2) with two LEDs exchanged in a fraction of the frames."""
    n_frames, n_leds, _ = centers.shape
    swapped = centers.copy()
    for frame in rng.permutation(n_frames)[: round(fraction * n_frames)]:
        pair = rng.permutation(n_leds)[:2]
        swapped[frame, pair] = centers[frame, pair[::-1]]
    return swapped


def observe_pixels(pixels: FloatArray, camera: Camera, pen: Pen) -> Observations:
    """Return the observations of simulated LED centres (N, L, 2), px."""
    centers = Centers(np.arange(len(pixels)) + 1, pixels, Path("simulated"))
    return observe_centers(centers, camera, pen)


def calibrate_pixels(pixels: FloatArray, camera: Camera, pen: Pen) -> Calibration:
    """Calibrate by simulated LED centres (N, L, 2), px."""
    return calibrate(camera, pen, observe_pixels(pixels, camera, pen))
