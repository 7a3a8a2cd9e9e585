"""The moments of one soft-thresholded region, and whether it is an ellipse.

The moments up to the third order show whether the region is a whole ellipse; its grey
rim shows its blur, whose effect on area and variances is taken out.
"""

from collections.abc import Mapping
from math import pi
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from lightpen.detection.edge_fit import EdgeFit

# Narrower than this samples the rim too coarsely: 20 to 80 % doubles the error.
LOW = 0.1
HIGH = 0.9
MIN_AREA = 12.0  # px^2; hot pixels are smaller
MIN_VARIANCE = 0.1  # px^2, along each axis; a streak one pixel wide has none

# Of a Gaussian edge with standard deviation 1, cut at LOW and HIGH: its rise from 10 to
# 90 %, and the integral of f (1 - f) across it.
GAUSSIAN_RISE = 2.563
GAUSSIAN_GREY = 0.381
# Blur pulls the half level of a convex rim inwards, and the ramp of f spreads the
# variance: their sum to second order, in terms of pi sigma^2 and of sigma^2.
AREA_LOSS = 0.56
VARIANCE_GAIN = 0.30

# How far a whole ellipse strays from roundness 1 and skewness 0 by sampling, blur and
# noise, found on rendered discs of 6 to 100 px at signal-to-noise ratios down to 12.
ROUNDNESS_LOSS = 0.004
ROUNDNESS_LOSS_BY_BLUR = 0.1
SKEWNESS = 0.004
SKEWNESS_BY_SAMPLING = 0.1
SKEWNESS_BY_NOISE = 25.0
TINY = 1e-9  # px^2


Value: TypeAlias = Any  # a float, or of several regions an array (N,)


class DiscMoments(NamedTuple):
    """Area, centroid and central moments of a region, px, or arrays of several.

    `roundness` is the area over that of the ellipse with the same second moments: 1 for
    an ellipse, less for all else. `skewness` is the norm of the third moments of the
    whitened region: 0 for an ellipse; a small piece missing at the rim of a disc, a
    fraction e of its area, makes it 2 e.
    """

    area: Value
    x: Value
    y: Value
    var_x: Value
    cov_xy: Value
    var_y: Value
    roundness: Value
    skewness: Value
    edge_width: Value

    @property
    def are_enough(self) -> Value:
        """Whether the region is neither a hot pixel nor a streak."""
        narrow = np.minimum(self.var_x, self.var_y) < MIN_VARIANCE
        return (self.area >= MIN_AREA) & ~narrow

    @property
    def radius(self) -> Value:
        """Of the circle of the same area, px."""
        return np.sqrt(self.area / pi)

    @property
    def rim_width(self) -> Value:
        """Width of the rim over its whole height, px."""
        return self.edge_width / (HIGH - LOW)

    @property
    def axes(self) -> tuple[Value, Value]:
        """Semi-axes of the ellipse with the same second moments, the longer first."""
        half_trace = (self.var_x + self.var_y) / 2.0
        half_span = np.hypot((self.var_x - self.var_y) / 2.0, self.cov_xy)
        longer, shorter = (
            2.0 * np.sqrt(np.maximum(square, 0.05))
            for square in (half_trace + half_span, half_trace - half_span)
        )
        return longer, shorter


def is_ellipse(moments: DiscMoments, relative_noise: Value) -> Value:
    """Return whether sampling, blur and noise explain the deviation from an ellipse."""
    return ellipse_misfit(moments, relative_noise) < 1.0


def ellipse_misfit(moments: DiscMoments, relative_noise: Value) -> Value:
    """Return the deviation from an ellipse over what sampling, blur and noise make."""
    radius = moments.radius
    _, minor = moments.axes
    loss = ROUNDNESS_LOSS + ROUNDNESS_LOSS_BY_BLUR * (moments.edge_width / minor) ** 2
    skewness = (
        SKEWNESS
        + SKEWNESS_BY_SAMPLING / radius
        + SKEWNESS_BY_NOISE * relative_noise / radius**1.5
    )
    return np.maximum((1.0 - moments.roundness) / loss, moments.skewness / skewness)


def moments_of_rim(rim: EdgeFit) -> DiscMoments:
    """Return the moments of the ellipse within a fitted rim."""
    (var_x, cov_xy), (_, var_y) = rim.shape.tolist()
    area = 4.0 * pi * np.sqrt(var_x * var_y - cov_xy**2)
    x, y = rim.center.tolist()
    edge_width = GAUSSIAN_RISE * rim.sigma
    return DiscMoments(area, x, y, var_x, cov_xy, var_y, 1.0, 0.0, edge_width)


def moments_by_sums(
    m: Mapping[str, Value], squares: Value, left: Value, top: Value, ramp: Value
) -> DiscMoments:
    """Return the moments of regions by the sums over their pixels.

    Sums ``m``, above 0, are named as `cv2.moments` names them, ``squares`` are those of
    squared pixels; ``left`` and ``top`` are the corners of the windows, px.
    """
    area = m["m00"] / 255.0
    var_x, cov_xy, var_y = (m[k] / m["m00"] for k in ("mu20", "mu11", "mu02"))
    narrower = np.maximum(np.minimum(var_x, var_y), TINY)
    grey = area - squares / 255.0**2
    perimeter = 2.0 * pi * np.sqrt(2.0 * np.maximum(var_x + var_y, TINY))
    sigma = grey / (perimeter * GAUSSIAN_GREY) * (HIGH - LOW) / ramp
    # Blur must not make a small disc vanish.
    spread = np.minimum(VARIANCE_GAIN * sigma**2, 0.2 * narrower)
    var_x, var_y = var_x - spread, var_y - spread
    area = area + np.minimum(AREA_LOSS * pi * sigma**2, 0.2 * area)

    both = np.maximum(var_x, TINY) * np.maximum(var_y, TINY)
    determinant = np.maximum(var_x * var_y - cov_xy**2, 1e-9 * both)
    return DiscMoments(
        area,
        left + m["m10"] / m["m00"],
        top + m["m01"] / m["m00"],
        var_x,
        cov_xy,
        var_y,
        area / (4.0 * pi * np.sqrt(determinant)),
        _skewness(m, np.maximum(var_x, TINY), cov_xy, determinant),
        GAUSSIAN_RISE * sigma,
    )


def _skewness(
    m: Mapping[str, Value], var_x: Value, cov_xy: Value, determinant: Value
) -> Value:
    """Norm of the third moments after whitening, the root of Mardia's skewness."""
    slope, vx, vy = cov_xy / var_x, var_x, determinant / var_x
    m30, m21, m12, m03 = (m[k] / m["m00"] for k in ("mu30", "mu21", "mu12", "mu03"))
    # Of x, and of y less slope times x, which does not vary with x.
    n21 = m21 - slope * m30
    n12 = m12 - slope * (m21 + n21)
    n03 = m03 - slope * (2 * m12 + n12 - slope * m21)
    squares = m30 * m30 / (vx * vx) + 3 * n21 * n21 / (vx * vy)
    squares = squares + 3 * n12 * n12 / (vy * vy)
    return np.sqrt(squares / vx + n03 * n03 / (vy * vy * vy))
