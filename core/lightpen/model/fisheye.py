"""Lenses beyond Brown's model: fisheyes, and smooth fields of displacement."""

from dataclasses import dataclass, field
from functools import cached_property
from math import ceil

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


# The residual field of a lens: smooth residuals of its distortion model.
#
# A camera observes a point at ``pixels(point) + field``. Each component of the field is
# a Gaussian process with the covariance ``a^2 exp(-d^2 / (2 l^2))`` of two pixels at
# the distance d [1]_, with amplitude a and correlation length l. Its values at the
# nodes of a grid over the image represent it; between them it is the conditional mean.
#
# References
# ----------
# .. [1] C. E. Rasmussen, C. K. I. Williams, "Gaussian processes for machine learning",
#    MIT Press (2006), equations 2.16 and 2.23-2.26.


SPACING = 0.75  # of nodes, in correlation lengths: 1 % of the amplitude is left
FEWEST, MOST = 3, 10  # nodes along a side
ROUNDING = 1e-8  # of a variance, so that covariances can be inverted


@dataclass(frozen=True, eq=False)
class LensField:
    """Prior of the residual field of a lens."""

    width: int  # image size, px
    height: int
    columns: int  # nodes along each side; the first and last lie in the corner pixels
    rows: int
    amplitude: float  # standard deviation of each component before any measurement, px
    length: float  # correlation length, px
    # (M, 2), mean of (u, v) at the M nodes, row by row, px; 0 where not measured
    values: FloatArray = field(repr=False)
    # (M, M), of each component at the nodes, px^2; the two are independent
    covariance: FloatArray = field(repr=False)
    # (4 + n, 4 + n), of the camera's intrinsics without what of their errors goes with
    # the field: ``covariance`` contains that, as the two cancel in the image. None
    # where the errors are independent
    intrinsics_covariance: FloatArray | None = field(default=None, repr=False)

    @classmethod
    def of(
        cls, width: int, height: int, amplitude: float, length: float
    ) -> "LensField":
        """Return the prior field before any measurement, its mean 0."""
        columns, rows = (
            min(max(ceil((side - 1) / (SPACING * length)) + 1, FEWEST), MOST)
            for side in (width, height)
        )
        nodes = _grid(width, height, columns, rows)
        covariance = amplitude**2 * correlation(nodes, nodes, length)
        values = np.zeros((len(nodes), 2))
        return cls(width, height, columns, rows, amplitude, length, values, covariance)

    @cached_property
    def nodes(self) -> FloatArray:
        """Pixels of the nodes, (M, 2), row by row."""
        return _grid(self.width, self.height, self.columns, self.rows)

    def basis(self, pixels: FloatArray) -> FloatArray:
        """Return the weights of the nodes' values at pixels (..., 2), (..., M)."""
        return correlation(pixels, self.nodes, self.length) @ self.node_information

    def at(self, pixels: FloatArray) -> FloatArray:
        """Return the mean of the field at pixels, both (..., 2), px; NaN gives NaN."""
        return np.asarray(self.basis(pixels) @ self.values)

    def covariance_at(self, pixels: FloatArray) -> FloatArray:
        """Return the covariance of each component at pixels (K, 2), (K, K), px^2."""
        weights = self.basis(pixels)
        nodes = correlation(self.nodes, self.nodes, self.length)
        own = correlation(pixels, pixels, self.length) - weights @ nodes @ weights.T
        return np.asarray(
            weights @ self.covariance @ weights.T + self.amplitude**2 * own
        )

    @cached_property
    def node_information(self) -> FloatArray:
        """Information of a component at the nodes before any measurement, (M, M).

        For an amplitude of 1 px.
        """
        nodes = correlation(self.nodes, self.nodes, self.length)
        return np.asarray(np.linalg.inv(nodes + ROUNDING * np.eye(len(nodes))))


def correlation(one: FloatArray, other: FloatArray, length: float) -> FloatArray:
    """Return the correlation of a field at pixels (..., 2) and (M, 2), (..., M)."""
    u = one[..., None, 0] - other[:, 0]
    v = one[..., None, 1] - other[:, 1]
    return np.asarray(np.exp((u * u + v * v) * (-0.5 / length**2)))


def _grid(width: int, height: int, columns: int, rows: int) -> FloatArray:
    u, v = np.meshgrid(
        np.linspace(0.0, width - 1.0, columns), np.linspace(0.0, height - 1.0, rows)
    )
    return np.stack([u.ravel(), v.ravel()], axis=1)
