"""The centres and shapes of bright discs from soft-threshold moments.

Intensities are cut to ``f = clip((I - low) / (high - low), 0, 1)`` with `low` near
the background and `high` near the plateau of the disc. The interior becomes constant,
so its noise is gone, and the background zero; only the rim is grey. The centroid of f
is then as precise as a fit of the rim, at the cost of one pass over a small window.

The moments up to the third order show whether a region is a whole ellipse; its grey rim
shows its blur, whose effect on area and variances is taken out.
"""

from collections.abc import Callable, Sequence
from math import pi, sqrt
from typing import Any, NamedTuple, TypeAlias, TypeVar

import cv2
import numpy as np
from cv2.typing import MatLike

from lightpen.arrays import BoolArray, FloatArray, Image, IntArray
from lightpen.detection.edge_fit import EdgeFits, EdgeStarts, fit_edges

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

MIN_SIZE = 3  # px, of the box of a region

# The shading of a disc is measured where its radius is so many widths of its rim, and
# on its inner pixels without those beside the rim.
LEAST_SHADED = 4.0
LEAST_INNER = 0.3  # of the area

# Beyond these the light of a disc shows that it is not evenly lit.
UNEVEN_AMOUNT = 0.1  # of the light that its area would have at the level of its plateau
FLAT = 0.5  # width of the rim over the radius up to which a disc has a plateau
UNEVEN_CENTER = 0.002  # of the radius: the outline is 0.01 px off at a sharp rim
CORRECTED_CENTER = 0.007  # of the radius, where shading is corrected to first order
NOISE_SIGMAS = 3.0
SHARPER = 0.7  # times as wide is a rim that light of the inside widens
MIN_OUTLINE = 0.97  # of the area of an ellipse with the same second moments

Table = TypeVar("Table", bound=tuple[Any, ...])  # of arrays (N, ...), or other tables


def chosen_rows(table: Table, rows: BoolArray | IntArray | list[int]) -> Table:
    """Return some rows of all arrays of a named tuple."""
    make: Any = type(table)
    chosen = (
        chosen_rows(each, rows) if isinstance(each, tuple) else each[rows]
        for each in table
    )
    made: Table = make(*chosen)
    return made


def joined(tables: Sequence[Table]) -> Table:
    """Return one or more tables below each other."""
    if len(tables) == 1:
        return tables[0]
    make: Any = type(tables[0])
    columns = (
        joined(each) if isinstance(each[0], tuple) else np.concatenate(each)
        for each in zip(*tables, strict=True)
    )
    made: Table = make(*columns)
    return made


class DiscMoments(NamedTuple):
    """Areas, centroids and central moments of N regions, px, (N,) each.

    `roundness` is the area over that of the ellipse with the same second moments: 1 for
    an ellipse, less for all else. `skewness` is the norm of the third moments of the
    whitened region: 0 for an ellipse; a small piece missing at the rim of a disc, a
    fraction e of its area, makes it 2 e.
    """

    area: FloatArray
    x: FloatArray
    y: FloatArray
    var_x: FloatArray
    cov_xy: FloatArray
    var_y: FloatArray
    roundness: FloatArray
    skewness: FloatArray
    edge_width: FloatArray

    @property
    def are_enough(self) -> BoolArray:
        """Whether the regions are neither hot pixels nor streaks."""
        least = np.minimum(self.var_x, self.var_y)
        return np.asarray((self.area >= MIN_AREA) & (least >= MIN_VARIANCE))

    @property
    def radius(self) -> FloatArray:
        """Of the circle of the same area, px."""
        return np.asarray(np.sqrt(self.area / pi))

    @property
    def rim_width(self) -> FloatArray:
        """Width of the rim over its whole height, px."""
        return self.edge_width / (HIGH - LOW)

    @property
    def axes(self) -> tuple[FloatArray, FloatArray]:
        """Semi-axes of the ellipse with the same second moments, the longer first."""
        half_trace = (self.var_x + self.var_y) / 2.0
        half_span = np.hypot((self.var_x - self.var_y) / 2.0, self.cov_xy)
        longer, shorter = (
            2.0 * np.sqrt(np.maximum(square, 0.05))
            for square in (half_trace + half_span, half_trace - half_span)
        )
        return longer, shorter


LEAST_CONTRAST = 1e-3  # of what has none


class Levels(NamedTuple):
    """Intensities of windows of one bright region each, digital numbers, (N,)."""

    background: FloatArray
    plateau: FloatArray
    top: FloatArray  # the brightest tenth of the region exceeds it

    @property
    def contrast(self) -> FloatArray:
        """Plateau above the background, at least `LEAST_CONTRAST`."""
        return np.maximum(self.plateau - self.background, LEAST_CONTRAST)


class Discs(NamedTuple):
    """N bright regions measured as if they were discs."""

    moments: DiscMoments
    levels: Levels
    cut_levels: FloatArray  # (N,), intensities at the outlines
    boxes: IntArray  # (N, 4), left, top, right and bottom, ends excluded, px
    # (N,), whether sampling, blur and noise explain how it differs from an ellipse; a
    # sliver of 1 px off a disc of 42 px, which shifts the centre by 0.13 px, is beyond.
    are_whole: BoolArray
    are_even: BoolArray  # (N,), whether the light is as even as the outline supposes
    leave_image: BoolArray  # (N,)
    leave_window: BoolArray  # (N,)
    # Starts of the fits by which `with_rims` measures discs whose outlines may not show
    # them; NaN elsewhere.
    rims: EdgeStarts

    @property
    def cut_heights(self) -> FloatArray:
        """Heights of the outlines, 0 at the background, 1 at the plateau."""
        return (self.cut_levels - self.levels.background) / self.levels.contrast


_none, _nowhere = np.zeros(0), np.zeros((0, 2))
_no: BoolArray = np.zeros(0, dtype=bool)
NO_DISCS = Discs(
    *(DiscMoments(*9 * (_none,)), Levels(*3 * (_none,)), _none),
    np.zeros((0, 4), dtype=np.int64),
    *(_no, _no, _no, _no),
    EdgeStarts.anew(_nowhere, np.zeros((0, 2, 2))),
)

Starts: TypeAlias = Callable[[], EdgeStarts]  # at discs of the image before


def with_rims(image: Image, discs: Discs, before: Starts | None = None) -> Discs:
    """Return discs with those measured by their rims that need it and have one.

    Fits begin at the discs of the image ``before``.
    """
    unclear = np.flatnonzero(np.isfinite(discs.rims.centers[:, 0]))
    if not len(unclear):
        return discs
    starts = chosen_rows(discs.rims, unclear)
    if before is not None:
        starts = _nearest(starts, before())
    fits = fit_edges(image, starts)
    # An apparently blurred disc may be a sharp dome that is dark at its rim.
    wide = np.where(discs.are_even, discs.moments.edge_width, np.inf)[unclear]
    good = fits.are_whole & (GAUSSIAN_RISE * fits.sigmas < SHARPER * wide)
    by_rim = unclear[good]
    moments, are_whole = np.stack(discs.moments), discs.are_whole.copy()
    moments[:, by_rim] = moments_of_rims(chosen_rows(fits, good))
    are_whole[by_rim] = True
    return discs._replace(moments=DiscMoments(*moments), are_whole=are_whole)


def _nearest(starts: EdgeStarts, before: EdgeStarts) -> EdgeStarts:
    """Return the starts of edge fits: as the nearest previous discs, if any."""
    if not len(before.centers):
        return starts
    gaps = np.linalg.norm(starts.centers[:, None] - before.centers, axis=2)
    near = chosen_rows(before, gaps.argmin(axis=1))
    reach = 2 * np.sqrt(near.shapes[:, 0, 0] + near.shapes[:, 1, 1])
    known = gaps.min(axis=1) <= reach
    return starts._replace(
        centers=np.where(known[:, None], starts.centers - near.offsets, starts.centers),
        shapes=np.where(known[:, None, None], near.shapes, starts.shapes),
        sigmas=np.where(known, near.sigmas, np.nan),
    )


def assessed(
    moments: DiscMoments,
    sums: FloatArray,
    x: FloatArray,
    y: FloatArray,
    levels: Levels,
    relative_noise: FloatArray,
) -> tuple[DiscMoments, BoolArray, BoolArray, BoolArray]:
    """Return moments without shading; whether discs are whole, even and balanced.

    An LED is less bright seen from the side, so one side of a leaning disc is brighter
    than the other. If the brightness rises by the share g from the centre to the rim,
    the outline lies further out there by g / 2 times the width of the rim, the mean of
    all levels; the centroid of the inner pixels shows g. A whole disc is an ellipse,
    and the light of an even one has the centroid and the amount of its area.

    Sums (4, 4, 3, N) by the powers of y and x from origins, px, are of the inside
    without pixels beside the rim, of its light, and of the light of the region above
    the background.
    """
    radius, rim_width = moments.radius, moments.rim_width
    inner = sums[0, 0, 0]
    areas = np.maximum(sums[0, 0], 1.0)
    (x_inner, x_light, x_lit), (y_inner, y_light, y_lit) = (
        sums[0, 1] / areas,
        sums[1, 0] / areas,
    )
    is_flat = radius >= LEAST_SHADED * rim_width  # shows its shading
    is_shown = is_flat & (inner >= LEAST_INNER * moments.area)
    contrast = levels.contrast
    factor = 2.0 * pi * rim_width * radius / areas[0] * levels.plateau / contrast
    factor = np.where(is_shown, factor, 0.0)
    moments = moments._replace(
        x=moments.x - factor * (x_light - x_inner),
        y=moments.y - factor * (y_light - y_inner),
    )
    off = np.hypot(x + x_lit - moments.x, y + y_lit - moments.y)
    # Where the brightness rises by the share g from the centre to the rim, the light's
    # centroid is g / 4 radii off, the outline g / 2 times the width of the rim.
    allowed = np.where(is_flat, CORRECTED_CENTER, UNEVEN_CENTER)
    allowed += NOISE_SIGMAS * relative_noise / (2.0 * np.sqrt(moments.area))
    amount = areas[2] / (moments.area * contrast)
    is_even = (np.abs(amount - 1) <= UNEVEN_AMOUNT) | (rim_width >= FLAT * radius)
    is_whole = ellipse_misfits(moments, relative_noise) < 1.0
    is_balanced = off < allowed * radius
    return moments, is_whole, is_even & is_balanced, is_balanced


def rim_start(contour: MatLike) -> tuple[float, ...]:
    """Return the start of the edge fit of a region, if it is like an ellipse, else NaN.

    It is the centre, px, and the covariance xx, xy, yy of the contour, px^2.
    """
    m = cv2.moments(contour)
    if m["m00"] >= MIN_AREA:
        xx, xy, yy = (m[k] / m["m00"] for k in ("mu20", "mu11", "mu02"))
        determinant = xx * yy - xy**2
        if determinant > 0 and m["m00"] >= MIN_OUTLINE * 4 * pi * sqrt(determinant):
            return m["m10"] / m["m00"], m["m01"] / m["m00"], xx, xy, yy
    return (np.nan,) * 5


def ellipse_misfits(moments: DiscMoments, relative_noise: FloatArray) -> FloatArray:
    """Return the deviations from ellipses over what sampling, blur and noise make."""
    radius = moments.radius
    _, minor = moments.axes
    loss = ROUNDNESS_LOSS + ROUNDNESS_LOSS_BY_BLUR * (moments.edge_width / minor) ** 2
    by_sampling = SKEWNESS_BY_SAMPLING / radius
    by_noise = SKEWNESS_BY_NOISE * relative_noise / (radius * np.sqrt(radius))
    skewness = SKEWNESS + by_sampling + by_noise
    return np.maximum((1.0 - moments.roundness) / loss, moments.skewness / skewness)


def moments_of_rims(rims: EdgeFits) -> DiscMoments:
    """Return the moments of the ellipses within fitted rims."""
    x, y = rims.centers.T
    var_x, cov_xy, _, var_y = rims.shapes.reshape(-1, 4).T
    area = 4.0 * pi * np.sqrt(var_x * var_y - cov_xy**2)
    widths, ones = GAUSSIAN_RISE * rims.sigmas, np.ones(len(x))
    return DiscMoments(area, x, y, var_x, cov_xy, var_y, ones, 0 * ones, widths)


def moments_by_sums(
    sums: FloatArray,
    squares: FloatArray,
    x: FloatArray,
    y: FloatArray,
    ramps: FloatArray,
) -> DiscMoments:
    """Return the moments of regions by the sums over their pixels.

    Parameters
    ----------
    sums : (4, 4, N) array
        Of the light, of which the plateau is 255, by the powers of y and of x.
    squares : (N,) array
        Of the light squared.
    x, y : (N,) array
        Origins of the powers, px.
    ramps : (N,) array
        Height from the foot to the plateau, over the contrast.
    """
    m00 = np.maximum(sums[0, 0], TINY)
    m = sums / m00
    u, v = m[0, 1], m[1, 0]
    uu, vv = u * u, v * v
    var_x, cov_xy, var_y = m[0, 2] - uu, m[1, 1] - u * v, m[2, 0] - vv
    thirds = (
        m[0, 3] - u * (3 * var_x + uu),
        m[1, 2] - 2 * u * cov_xy - v * (var_x + uu),
        m[2, 1] - 2 * v * cov_xy - u * (var_y + vv),
        m[3, 0] - v * (3 * var_y + vv),
    )
    area = m00 / 255.0
    grey = area - squares / 255.0**2
    perimeter = 2.0 * pi * np.sqrt(2.0 * np.maximum(var_x + var_y, TINY))
    sigma = grey / (perimeter * GAUSSIAN_GREY) * (HIGH - LOW) / ramps
    variance = sigma * sigma
    # Blur must not make a small disc vanish.
    narrower = np.maximum(np.minimum(var_x, var_y), TINY)
    spread = np.minimum(VARIANCE_GAIN * variance, 0.2 * narrower)
    var_x, var_y = var_x - spread, var_y - spread
    area = area + np.minimum(AREA_LOSS * pi * variance, 0.2 * area)

    wide_x = np.maximum(var_x, TINY)
    both = wide_x * np.maximum(var_y, TINY)
    determinant = np.maximum(var_x * var_y - cov_xy * cov_xy, 1e-9 * both)
    return DiscMoments(
        area,
        x + u,
        y + v,
        var_x,
        cov_xy,
        var_y,
        area / (4.0 * pi * np.sqrt(determinant)),
        _skewness(thirds, wide_x, cov_xy, determinant),
        GAUSSIAN_RISE * sigma,
    )


def _skewness(
    thirds: tuple[FloatArray, ...],
    var_x: FloatArray,
    cov_xy: FloatArray,
    determinant: FloatArray,
) -> FloatArray:
    """Norm of the third moments after whitening, the root of Mardia's skewness."""
    slope, vx, vy = cov_xy / var_x, var_x, determinant / var_x
    m30, m21, m12, m03 = thirds
    # Of x, and of y less slope times x, which does not vary with x.
    n21 = m21 - slope * m30
    n12 = m12 - slope * (m21 + n21)
    n03 = m03 - slope * (2 * m12 + n12 - slope * m21)
    squares = m30 * m30 / (vx * vx) + 3 * n21 * n21 / (vx * vy)
    squares = squares + 3 * n12 * n12 / (vy * vy)
    return np.asarray(np.sqrt(squares / vx + n03 * n03 / (vy * vy * vy)))
