"""The centre and shape of one bright disc from soft-threshold moments.

Intensities are cut to ``f = clip((I - low) / (high - low), 0, 1)`` with `low` near
the background and `high` near the plateau of the disc. The interior becomes constant,
so its noise is gone, and the background zero; only the rim is grey. The centroid of f
is then as precise as a fit of the rim, at the cost of one pass over a small window.
"""

from collections.abc import Callable, Mapping, Sequence
from math import pi, sqrt
from typing import NamedTuple, TypeAlias

import cv2
import numpy as np
from cv2.typing import MatLike

from lightpen.arrays import Image
from lightpen.detection.edge_fit import EdgeStart, fit_edges
from lightpen.detection.pixel_box import PixelBox
from lightpen.detection.region_moments import (
    GAUSSIAN_RISE,
    MIN_AREA,
    DiscMoments,
    Value,
    is_ellipse,
    moments_of_rim,
)

MIN_SIZE = 3  # px, of the box of a region
SAMPLES = 16  # per side of a window, to find background and plateau

# The shading of a disc is measured where its radius is so many widths of its rim, and
# on its inner pixels without those beside the rim.
LEAST_SHADED = 4.0
LEAST_INNER = 0.3  # of the area
BESIDE = np.ones((3, 3), np.uint8)

# Beyond these the light of a disc shows that it is not evenly lit.
UNEVEN_AMOUNT = 0.1  # of the light that its area would have at the level of its plateau
FLAT = 0.5  # width of the rim over the radius up to which a disc has a plateau
UNEVEN_CENTER = 0.002  # of the radius: the outline is 0.01 px off at a sharp rim
CORRECTED_CENTER = 0.007  # of the radius, where shading is corrected to first order
NOISE_SIGMAS = 3.0
SHARPER = 0.7  # times as wide is a rim that light of the inside widens
MIN_OUTLINE = 0.97  # of the area of an ellipse with the same second moments


class Levels(NamedTuple):
    """Intensities of a window that holds one bright region, digital numbers."""

    background: float
    plateau: float
    top: float  # the brightest tenth of the region exceeds it

    @property
    def contrast(self) -> float:
        """Plateau above the background."""
        return self.plateau - self.background


class Disc(NamedTuple):
    """A bright region measured as if it were a disc.

    `cut_level` is the intensity at its outline. `is_whole` shows that sampling, blur
    and noise explain how it differs from an ellipse; a sliver of 1 px off a disc of
    42 px, which shifts the centre by 0.13 px, is beyond that. `others` are further
    regions in the box that was requested. `is_even` shows that its light is as even as
    its outline supposes. `rim` is the start of the fit by which `with_rims` measures a
    disc whose outline may not show it.
    """

    moments: DiscMoments
    levels: Levels
    cut_level: float
    box: PixelBox
    is_whole: bool
    is_even: bool
    leaves_image: bool
    leaves_window: bool
    others: tuple[PixelBox, ...]
    rim: EdgeStart | None

    @property
    def cut_height(self) -> float:
        """Height of the outline, 0 at the background, 1 at the plateau."""
        return (self.cut_level - self.levels.background) / self.levels.contrast


Starts: TypeAlias = Callable[[], Sequence[EdgeStart]]  # at discs of the image before


def with_rims(image: Image, discs: Sequence[Disc], before: Starts = list) -> list[Disc]:
    """Return discs with those measured by their rims that need it and have one.

    Fits begin at the discs of the image ``before``.
    """
    found = list(discs)
    unclear = [i for i, disc in enumerate(discs) if disc.rim]
    starts = [disc.rim for disc in discs if disc.rim]
    if not starts:
        return found
    for i, rim in zip(
        unclear, fit_edges(image, _nearest(starts, before())), strict=True
    ):
        # An apparently blurred disc may be a sharp dome that is dark at its rim.
        wide = discs[i].moments.edge_width if discs[i].is_even else float("inf")
        if rim and rim.is_whole and GAUSSIAN_RISE * rim.sigma < SHARPER * wide:
            found[i] = discs[i]._replace(is_whole=True, moments=moments_of_rim(rim))
    return found


def _nearest(starts: list[EdgeStart], before: Sequence[EdgeStart]) -> list[EdgeStart]:
    """Return the starts of edge fits: as the nearest previous discs, if any."""
    if not before:
        return starts
    here, there = (
        np.array([start.center for start in some]) for some in (starts, before)
    )
    gaps = np.linalg.norm(here[:, None] - there, axis=2)
    for i, nearest in enumerate(gaps.argmin(axis=1).tolist()):
        near = before[nearest]
        if gaps[i, nearest] <= 2 * sqrt(near.shape[0, 0] + near.shape[1, 1]):
            starts[i] = near._replace(center=starts[i].center - near.offset)
    return starts


def assessed(
    moments: DiscMoments,
    inner: Mapping[str, Value],
    weighted: Mapping[str, Value],
    light: Mapping[str, Value],
    frame: PixelBox,
    levels: Levels,
    relative_noise: Value,
) -> tuple[DiscMoments, Value, Value, Value]:
    """Return moments without shading; whether discs are whole, even and balanced.

    An LED is less bright seen from the side, so one side of a leaning disc is brighter
    than the other. If the brightness rises by the share g from the centre to the rim,
    the outline lies further out there by g / 2 times the width of the rim, the mean of
    all levels; the centroid of the inner pixels shows g. A whole disc is an ellipse,
    and the light of an even one has the centroid and the amount of its area.

    Sums are over windows at ``frame``: of the inside without pixels beside the rim,
    of its light, and of the light of the region above the background.
    """
    radius, reach = moments.radius, moments.rim_width * moments.radius
    area = inner["m00"]
    is_flat = radius >= LEAST_SHADED * moments.rim_width  # shows its shading
    is_shown = is_flat & (area >= LEAST_INNER * moments.area)
    factor = 2.0 * pi * reach / np.maximum(area, 1.0)
    factor = np.where(is_shown, factor * levels.plateau / levels.contrast, 0.0)
    weight, place = (np.maximum(each["m00"], 1.0) for each in (weighted, inner))
    x = moments.x - factor * (weighted["m10"] / weight - inner["m10"] / place)
    y = moments.y - factor * (weighted["m01"] / weight - inner["m01"] / place)
    moments = moments._replace(x=x, y=y)

    total = np.maximum(light["m00"], 1.0)
    amount = total / (moments.area * levels.contrast)
    off = np.hypot(
        frame.left + light["m10"] / total - x, frame.top + light["m01"] / total - y
    )
    # Where the brightness rises by the share g from the centre to the rim, the light's
    # centroid is g / 4 radii off, the outline g / 2 times the width of the rim.
    allowed = np.where(is_flat, CORRECTED_CENTER, UNEVEN_CENTER)
    allowed = allowed + NOISE_SIGMAS * relative_noise / (2.0 * np.sqrt(moments.area))
    is_even = (np.abs(amount - 1) <= UNEVEN_AMOUNT) | (
        moments.rim_width >= FLAT * radius
    )
    is_whole = is_ellipse(moments, relative_noise)
    is_balanced = off < allowed * radius
    return moments, is_whole, is_even & is_balanced, is_balanced


def rim_start(contour: MatLike, corner: tuple[int, int]) -> EdgeStart | None:
    """Return the start of the edge fit of a region, if it is like an ellipse.

    Its contour is in px from a corner.
    """
    m = cv2.moments(contour)
    if m["m00"] < MIN_AREA:
        return None
    xx, xy, yy = (m[k] / m["m00"] for k in ("mu20", "mu11", "mu02"))
    determinant = xx * yy - xy**2
    if determinant <= 0 or m["m00"] < MIN_OUTLINE * 4 * pi * sqrt(determinant):
        return None
    center = np.array([m["m10"] / m["m00"], m["m01"] / m["m00"]]) + corner
    return EdgeStart(center, np.array([[xx, xy], [xy, yy]]))


def window_levels(window: Image, level: float) -> Levels:
    """Split the intensities in two classes and return their medians."""
    step = max(1, min(window.shape) // SAMPLES)
    samples = np.sort(window[::step, ::step], axis=None)
    n = samples.size
    split = int(level)
    background, plateau, n_dark = 0, 0, 0
    for _ in range(2):
        n_dark = int(samples.searchsorted(split, side="right"))
        background = int(samples[n_dark // 2])
        plateau = int(samples[min((n_dark + n) // 2, n - 1)])
        split = (background + plateau) // 2
    top = int(samples[min((n_dark + 9 * n) // 10, n - 1)])
    return Levels(background, plateau, top)
