"""Reprojection errors of LEDs as discs, their robust weights and normal equations.

The loss is Cauchy's: a residual of `CAUCHY_WIDTH` standard deviations counts half. The
standard deviation is taken from the median length of the residuals.
"""

import math

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.model.camera import Camera
from lightpen.model.ellipse import ellipse_centers_with_jacobian
from lightpen.model.rigid import with_turns

CAUCHY_WIDTH = 4.0  # standard deviations at which a residual counts half
MEDIAN_LENGTH = math.sqrt(2 * math.log(2))  # of a standard normal vector in 2-D
NOISE_FLOOR = 1e-6  # px; keeps exact data from dividing by zero


def disc_residuals(
    camera: Camera,
    lever: FloatArray,
    centers_cam: FloatArray,
    normals_cam: FloatArray,
    radius: float,
    pixels: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return reprojection errors of discs and the derivative of their images.

    Parameters
    ----------
    lever : (N, L, 3) array
        From the centre of rotation to the LEDs, camera frame, mm.
    centers_cam, normals_cam : (N, L, 3) array
        Centres, mm, and normals of the discs in the camera frame.
    radius : float
        Radius of the discs, mm; 0 takes the projected centres.
    pixels : (N, L, 2) array
        Observed centres, px.

    Returns
    -------
    residuals : (N, L, 2) array
        Observed minus modelled, px.
    jacobian : (N, L, 2, 6) array
        Of the modelled centres, by a rotation vector about the centre of rotation,
        rad, and a translation, mm.
    """
    imaged = ellipse_centers_with_jacobian(camera, centers_cam, normals_cam, radius)
    return pixels - imaged.points, with_turns(imaged.jacobian, lever)


def robust_sigma(residuals: FloatArray, n_unknowns_per_image: float) -> float:
    """Return the standard deviation of one image coordinate from median residuals, px.

    Fitted unknowns make ``residuals`` (N, L, 2), px, smaller than errors; they are NaN
    where an LED was not seen.
    """
    lengths = np.hypot(residuals[..., 0], residuals[..., 1])
    return _sigma_of(lengths, n_unknowns_per_image)


def _sigma_of(lengths: FloatArray, n_unknowns_per_image: float) -> float:
    seen = np.sort(lengths[np.isfinite(lengths)])
    return sigma_of_lengths(seen, n_unknowns_per_image * len(lengths))


def sigma_of_lengths(lengths: FloatArray, n_unknowns: float) -> float:
    """Return the standard deviation of a coordinate by sorted lengths (N,), px."""
    n = len(lengths)
    # np.median takes eight times as long on the ten LEDs of one image.
    median = float(lengths[(n - 1) // 2] + lengths[n // 2]) / 2 / MEDIAN_LENGTH
    return max(median * math.sqrt(2 * n / max(2 * n - n_unknowns, 1)), NOISE_FLOOR)


def cauchy_weights(residuals: FloatArray, sigma: float | FloatArray) -> FloatArray:
    """Return the Cauchy weights (N, L) of residuals (N, L, 2), px; 0 where not seen.

    ``sigma`` is the standard deviation of one image coordinate, px, common to all
    images or one for each, (N,).
    """
    squares = np.einsum("...i,...i->...", residuals, residuals)
    width = CAUCHY_WIDTH * np.reshape(sigma, (-1, 1))
    return np.where(np.isnan(squares), 0.0, 1 / (1 + squares / width**2))


def image_sigmas(residuals: FloatArray) -> FloatArray:
    """Return the common noise or each image's own scatter, the larger, px, (N,).

    This admits an image whose start is spoilt by one wrong LED.
    """
    lengths = np.hypot(residuals[..., 0], residuals[..., 1])
    common = _sigma_of(lengths, 6)
    n_seen = np.isfinite(lengths).sum(axis=1)
    middle = np.sort(lengths, axis=1)[np.arange(len(lengths)), n_seen // 2]
    return np.asarray(np.maximum(middle / MEDIAN_LENGTH, common))


def normal_equations(
    J: FloatArray, residuals: FloatArray, weights: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return J^T W J, (N, k, k), and J^T W r, (N, k), of each image.

    J is (N, L, 2, k). Where an LED was not seen, residuals (N, L, 2) are NaN and
    weights (N, L) 0.
    """
    n_images, n_leds, _, n_unknowns = J.shape
    rows = J.reshape(n_images, 2 * n_leds, n_unknowns)
    weighted = (J * weights[..., None, None]).reshape(rows.shape)
    transposed = np.swapaxes(weighted, 1, 2)
    errors = np.where(np.isnan(residuals), 0.0, residuals)
    return transposed @ rows, (transposed @ errors.reshape(*rows.shape[:2], 1))[..., 0]
