"""Radial function of the fisheye model of Kannala and Brandt [1]_.

A direction at the angle a from the axis is imaged at the distance

    d(a) = a (1 + k1 a^2 + k2 a^4 + k3 a^6 + k4 a^8)

times the focal length from the principal point. With r = tan a the distance in the
normalised plane, this is a gain d(a) / r like that of Brown's model. As points are
normalised by their depth, directions reach to 88 degrees.

References
----------
.. [1] J. Kannala, S. S. Brandt, "A generic camera model and calibration method for
   conventional, wide-angle, and fish-eye lenses", IEEE PAMI 28 (2006) 1335-1340;
   OpenCV, module ``fisheye``; Kalibr, distortion model ``equidistant``.
"""

import numpy as np

from lightpen.arrays import BoolArray, FloatArray

N_COEFFICIENTS = 4
WIDEST = np.radians(88.0)  # from the axis
NEAR_AXIS = 1e-5  # of r^2, below which the series is exact to rounding
STEPS = 30
STEPS_TO_FOLD = 181
TOLERANCE = 1e-12  # rad


def gain(coefficients: FloatArray, r2: FloatArray) -> FloatArray:
    """Return d(a) / r at the squared distances r2."""
    k1, k2 = coefficients[:2].tolist()
    r = np.sqrt(np.maximum(r2, NEAR_AXIS))
    series = 1 + (k1 - 1 / 3) * r2 + (0.2 - k1 + k2) * r2**2
    gains = _distance(coefficients, np.arctan(r)) / r
    return np.asarray(np.where(r2 < NEAR_AXIS, series, gains))


def gain_slope(
    coefficients: FloatArray, r2: FloatArray, gains: FloatArray
) -> FloatArray:
    """Return the derivative of `gain` by r2."""
    k1, k2 = coefficients[:2].tolist()
    safe = np.maximum(r2, NEAR_AXIS)
    angle = np.arctan(np.sqrt(safe))
    slope = (_distance_slope(coefficients, angle) / (1 + safe) - gains) / (2 * safe)
    series = k1 - 1 / 3 + 2 * (0.2 - k1 + k2) * r2
    return np.asarray(np.where(r2 < NEAR_AXIS, series, slope))


def gain_jacobian(r2: FloatArray) -> FloatArray:
    """Return the derivative of `gain` by k1 to k4, (..., 4)."""
    r = np.sqrt(r2)
    angle = np.arctan(r)
    first = np.where(r2 < NEAR_AXIS, 1 - r2 / 3, angle / np.where(r > 0, r, 1.0))
    powers = 2 * np.arange(1, N_COEFFICIENTS + 1)
    return np.asarray(first[..., None] * angle[..., None] ** powers)


def angles(coefficients: FloatArray, distances: FloatArray) -> FloatArray:
    """Return the angles from the axis that are imaged at distances, both (...).

    Farther than `WIDEST` they are that; NaN where the coefficients fold the image.
    """
    grid = np.linspace(0.0, WIDEST, STEPS_TO_FOLD)
    at = _distance(coefficients, grid)
    fold = np.flatnonzero(_distance_slope(coefficients, grid) <= 0)
    last = len(grid) - 1 if len(fold) == 0 else max(int(fold[0]) - 1, 0)
    start = np.interp(distances, at[: last + 1], grid[: last + 1])
    beyond = distances > at[last]
    found = start
    with np.errstate(all="ignore"):
        for _ in range(STEPS):
            step = (distances - _distance(coefficients, found)) / _distance_slope(
                coefficients, found
            )
            step = np.where(beyond, 0.0, step)
            found = np.clip(found + step, 0.0, WIDEST)
            if not np.any(np.abs(step) > TOLERANCE):
                break
    outside = WIDEST if len(fold) == 0 else np.nan
    return np.asarray(np.where(beyond, outside, found))


def is_within(coefficients: FloatArray, distances: FloatArray) -> BoolArray:
    """Tell which distances belong to directions up to `WIDEST`.

    All do if the coefficients fold the image before that; see `angles`.
    """
    if np.any(
        _distance_slope(coefficients, np.linspace(0.0, WIDEST, STEPS_TO_FOLD)) <= 0
    ):
        return np.ones(np.shape(distances), dtype=np.bool_)
    return np.asarray(distances <= _distance(coefficients, np.array(WIDEST)))


def _distance(coefficients: FloatArray, angle: FloatArray) -> FloatArray:
    a2 = angle * angle
    k1, k2, k3, k4 = coefficients.tolist()
    return np.asarray(angle * (1 + a2 * (k1 + a2 * (k2 + a2 * (k3 + a2 * k4)))))


def _distance_slope(coefficients: FloatArray, angle: FloatArray) -> FloatArray:
    a2 = angle * angle
    k1, k2, k3, k4 = coefficients.tolist()
    return np.asarray(1 + a2 * (3 * k1 + a2 * (5 * k2 + a2 * (7 * k3 + a2 * 9 * k4))))
