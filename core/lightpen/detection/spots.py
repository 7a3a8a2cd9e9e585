"""Bright spots in an image: centres, shapes and flaws.

Every fourth pixel of every fourth row shows where something is bright; only windows
around that are read in full. A region that is no whole disc is examined again at
higher levels, which parts discs that touch and finds LEDs in front of something bright.
What never becomes a disc is dropped, or kept and flagged if it resembles one.
"""

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import IntFlag
from math import ceil, sqrt
from statistics import median
from typing import Self, TypeVar

import cv2
import numpy as np
from cv2.typing import MatLike

from lightpen.arrays import BoolArray, FloatArray, Image, IntArray
from lightpen.detection.disc_moments import (
    FLAT,
    GAUSSIAN_RISE,
    HIGH,
    LOW,
    MIN_SIZE,
    Disc,
    PixelBox,
    bounding_box,
    measure_disc,
    with_rims,
)
from lightpen.detection.edge_fit import EdgeStart
from lightpen.detection.pose import MIN_POSE_LEDS
from lightpen.detection.small_spots import LARGEST_RADIUS, measure_small, widths_of_tiny
from lightpen.formats.decoding import bits_of
from lightpen.model.quantiles import normal_quantile

NumberArray = TypeVar("NumberArray", FloatArray, IntArray)

MAX_SPOTS = 64
MAX_BOXES = 128  # the smallest of more are clutter
MAX_REGIONS = 1024  # examined in one image
MAX_CONTOURS = 4000

MOVED = 0.5  # of a spot's size; a hand that holds still trembles by less
CHANGED = 0.1  # of the mean area and contrast of all spots
NOISE_SAMPLES = 48  # per side of the image
NOISE_QUANTILE = 0.84  # of differences of neighbours; texture may cover the rest
BACKGROUND_QUANTILE = 0.2  # a bright window may fill most of the image
MIN_NOISE = 0.5  # rounding, digital numbers
LEVEL_SIGMAS = 8.0
LEVEL_OF_PEAK = 0.03  # far below an LED at a tenth of the brightest lamp
LEVEL_STEP = 0.2  # from level to level, fraction of the height above the background
LEVEL_STEP_OF_PEAK = 0.06  # at most
MAX_LEVELS_AT_ONCE = 3  # while a region hardly shrinks
HIDDEN = 2.0  # times as high above the background is light that faint light hides
CROWDED = 0.03  # fraction of bright samples above which single ones are ignored
TEXTURED = 0.08  # changes from sample to sample; there is no use in listing regions
SPECK = np.ones((2, 2), np.uint8)  # regions that do not hold it are ignored
FINE_SIZE = 256  # px; smaller regions are parted at full resolution
MAX_DIAMETER = 0.5  # of the shorter side of the image

MIN_ROUNDNESS = 0.85  # half a disc has 0.95, a square 0.955, two touching discs 0.89
MAX_AXIS_RATIO = 4.0
MIN_RELATIVE_CONTRAST = 0.15  # less is the texture of something bright

SMEARED_FRACTIONS = (2e-4, 0.2)  # of the image: more than hot pixels, less than a wall

HARDLY_AREA = 18.0  # px^2, usual, of spots of which some may be too small
FEWEST_TINY = 4
FOUND_TINY = 0.75  # of as many tiny ones, that are found where LEDs are large enough
LEAST_OF_USUAL = 0.3  # of the height of others, above which tiny ones are counted
HEAD = 0.4  # of the height of the brightest

BELL_RADIUS = 6.0  # px; blur leaves less no even inside
ALIKE_RADIUS = 8.0  # px, of a spot that is measured as many others are
LIT = 0.25  # of the spots with foreign light
RAISED = 0.35  # height of the outline above which the foot of a disc is not its own
MERGED_LEVEL = 0.5  # parted only above half its height, a disc holds foreign light
SATURATED_LEVEL = 0.99  # of the full scale
BLURRED_EDGE = 5.0  # px; a sharp image has 2 to 3
DIM_SIGMAS = 16.0
EXACT_SIGMA = 0.01  # px; lens errors exceed smaller ones


class SpotFlaw(IntFlag):
    """Flaws of a spot against a clean, whole LED disc."""

    NONE = 0
    MERGED = 1  # touches another bright thing
    CUT = 2  # partly hidden, or leaves the image
    SATURATED = 4  # clipped at the top of the range
    BLURRED = 8  # smeared by defocus or motion
    DIM = 16  # hardly above the noise


@dataclass(frozen=True, eq=False)
class Spots:
    """The candidate spots of an image, brightest first."""

    centers: FloatArray  # (N, 2), centres, px
    # (N, 2, 2), covariance of the area of each spot, px^2; a full ellipse with semi-
    # axes a and b has the eigenvalues a^2 / 4 and b^2 / 4.
    shapes: FloatArray
    areas: FloatArray  # (N,), area at half level, px^2
    # (N,), peak above the local background, fraction of the full range.
    contrasts: FloatArray
    # (N,), width of the rim from dark to bright, px; blur widens it.
    edge_widths: FloatArray
    flaws: IntArray  # (N,), `SpotFlaw` of each spot
    # (N,), standard deviation of one coordinate of each centre, px, by the estimator
    # that found it; `EXACT_SIGMA` for discs that are wide enough to have a rim.
    sigmas: FloatArray
    # (N, 2), by how much the centre of the bright region is off that of the disc, px
    offsets: FloatArray
    # Whether there is light, but no spot: discs moved by many times their size during
    # the exposure leave streaks, a dark image leaves nothing.
    has_smears: bool = False
    # Usual width, px, of spots too small for a centre, if most are; else NaN.
    tiny_width: float = float("nan")

    @classmethod
    def none(cls) -> Self:
        """Return the spots of an image without any."""
        nothing = np.zeros(0)
        return cls(
            centers=np.zeros((0, 2)),
            shapes=np.zeros((0, 2, 2)),
            areas=nothing,
            contrasts=nothing,
            edge_widths=nothing,
            flaws=np.zeros(0, dtype=np.int64),
            sigmas=nothing,
            offsets=np.zeros((0, 2)),
        )

    def __len__(self) -> int:
        return len(self.centers)

    def rims(self, corner: FloatArray) -> list[EdgeStart]:
        """Return the search regions of these spots in the next image.

        Merged spots, and those that the border cuts, are left out. ``corner`` (2,) is
        the pixel of this image where the next one, a part of the sensor, begins, px.
        """
        return [
            EdgeStart(center - corner, shape, width / GAUSSIAN_RISE, offset)
            for center, shape, width, offset, flaws in zip(
                *(self.centers, self.shapes, self.edge_widths.tolist()),
                *(self.offsets, self.flaws.tolist()),
                strict=True,
            )
            if not flaws & (SpotFlaw.MERGED | SpotFlaw.CUT)
        ]

    @property
    def are_small(self) -> BoolArray:
        """Whether a spot is so small that blur leaves it no even inside."""
        radii = np.sqrt(self.areas / np.pi)
        rims = self.edge_widths / (HIGH - LOW)
        is_bell = (radii < BELL_RADIUS) | (rims > FLAT * radii)
        return np.asarray((radii < LARGEST_RADIUS) & is_bell)

    @property
    def are_blurred(self) -> bool:
        """Whether most of the spots are blurred, or all light is smeared to none."""
        if len(self) == 0:
            return self.has_smears
        return bool(np.mean((self.flaws & SpotFlaw.BLURRED) > 0) > 0.5)


def have_moved(before: Spots, now: Spots) -> bool:
    """Return whether spots have moved or changed by more than noise."""
    if len(before) != len(now):
        return True
    if not len(now):
        return False
    moves = np.linalg.norm(before.centers[:, None] - now.centers, axis=2).min(axis=0)
    looks = (
        (before.areas.mean(), now.areas.mean()),
        (before.contrasts.mean(), now.contrasts.mean()),
    )
    return bool((moves > MOVED * np.sqrt(now.areas)).any()) or any(
        abs(one - other) > CHANGED * one for one, other in looks
    )


def detect_spots(
    image: Image,
    mask: FloatArray | None = None,
    *,
    full_scale: int | None = None,
    window: PixelBox | None = None,
    before: Spots | None = None,
) -> Spots:
    """Return the bright discs of an image, the brightest first, at most `MAX_SPOTS`.

    The centre is the centroid of the soft-thresholded disc, for LEDs of 6 px and more.
    It estimates the centroid of the imaged disc, which differs from the centre of its
    rim by the curvature of the distortion only (0.001 px for a disc of 43 px). Foreign
    lamps that look like LEDs are kept.

    Parameters
    ----------
    image : (H, W) array
        Grey image, 8 or 16 bit; any other raises `ValueError`.
    mask : (M, 3) array, optional
        Circles of stray light to leave out: centre x, y and radius, px.
    full_scale : int, optional
        Brightest value a pixel can have. Taken as 255, 4095 or 65535 if not given; see
        `lightpen.formats.decoding.bits_of`.
    window : PixelBox, optional
        All of the image that is read; what reaches out of it is cut.
    before : Spots, optional
        Of the image before, whose rims are about these.
    """
    if image.ndim != 2 or image.dtype not in (np.uint8, np.uint16):
        raise ValueError(
            "`image` must be a 2-D array of uint8 or uint16, "
            f"got shape {image.shape} of {image.dtype}."
        )
    if min(image.shape) < MIN_SIZE:
        return Spots.none()
    if full_scale is None:
        full_scale = 2 ** bits_of(image) - 1
    stride = 4 if min(image.shape) >= 1024 else 2 if min(image.shape) >= 512 else 1
    corner = np.zeros(2)
    if window is not None:
        corner += (window.left, window.top)
        image = image[window.top : window.bottom, window.left : window.right]
        if mask is not None:
            mask = np.asarray(mask) - np.append(corner, 0)
    starts = [] if before is None else before.rims(corner)
    spots = _spots_of(image, mask, stride, full_scale, starts)
    return replace(spots, centers=spots.centers + corner)


def _spots_of(
    image: Image,
    mask: FloatArray | None,
    stride: int,
    full_scale: int,
    before: Sequence[EdgeStart],
) -> Spots:
    budget = iter(range(MAX_REGIONS))
    scene = _survey(image, mask, stride)
    discs = _find_discs(scene, budget, before)
    # Too few for a pose are worth a closer look.
    if len(discs) < MIN_POSE_LEDS and stride > 1:
        scene = _survey(image, mask, stride // 2)
        discs = _find_discs(scene, budget)
    has_smears = False
    if len(discs) < MIN_POSE_LEDS or next(budget, None) is None:
        flat = _survey(_flattened(image, full_scale), mask, stride)
        flat_discs = _find_discs(flat, iter(range(MAX_REGIONS)))
        if len(flat_discs) > len(discs):
            scene, discs = flat, flat_discs
        has_smears = not discs and _has_smears(flat)
    discs = sorted(discs, key=lambda disc: disc.levels.contrast, reverse=True)
    discs = discs[:MAX_SPOTS]
    spots = _as_spots(discs, full_scale, scene.noise)
    if len(spots) < MIN_POSE_LEDS or np.median(spots.areas) < HARDLY_AREA:
        spots = replace(spots, tiny_width=_tiny_width(scene, spots, full_scale))
    if len(spots) and np.median(spots.areas) < np.pi * LARGEST_RADIUS**2:
        spots = _with_small(spots, discs, image, scene.noise, full_scale)
    return replace(spots, has_smears=has_smears)


def _tiny_width(scene: "_Survey", spots: Spots, full_scale: int) -> float:
    """Return the usual width of spots too small for a centre; NaN where few are."""
    rise = max(LEVEL_SIGMAS * scene.noise, LEVEL_OF_PEAK * full_scale)
    if len(spots):
        usual = float(np.median(spots.contrasts)) * full_scale
        rise = max(rise, LEAST_OF_USUAL * usual)
    # Blur joins the feet of small LEDs, but not their heads.
    for height in (rise, max(rise, HEAD * (scene.peak - scene.background))):
        level = scene.background + height
        widths = widths_of_tiny(scene.image, level, scene.background)
        if len(widths) >= FEWEST_TINY and len(spots) < FOUND_TINY * len(widths):
            return float(np.median(widths))
    return float("nan")


@dataclass(frozen=True, eq=False)
class _Survey:
    """An image, every `stride`-th pixel of it, its background and noise."""

    image: Image
    thinned: MatLike
    stride: int
    background: float
    noise: float
    peak: float

    def hides_light(self, box: PixelBox, level: float) -> bool:
        """Return whether a region that is hardly brighter than a level holds more."""
        window = self.image[box.top : box.bottom, box.left : box.right]
        rise = level - self.background
        return bool(window.max() > self.background + HIDDEN * rise)

    def higher(self, level: float) -> float:
        """Return the next level to search."""
        step = LEVEL_STEP * (level - self.background)
        longest = LEVEL_STEP_OF_PEAK * (self.peak - self.background)
        return level + max(min(step, longest), 1.0)


def _survey(image: Image, mask: FloatArray | None, stride: int) -> _Survey:
    thinned = _thinned(image, stride)
    step = max(min(thinned.shape) // NOISE_SAMPLES, 1)
    few: MatLike = np.ascontiguousarray(thinned[::step, ::step])
    background = _quantile(few, BACKGROUND_QUANTILE)

    beside: MatLike = np.ascontiguousarray(image[:: step * stride, 1 :: step * stride])
    n = min(few.shape[1], beside.shape[1])
    difference = _quantile(cv2.absdiff(few[:, :n], beside[:, :n]), NOISE_QUANTILE)
    deviation = sqrt(2) * normal_quantile((1 - NOISE_QUANTILE) / 2)
    noise = max(difference / deviation, MIN_NOISE)

    if mask is not None and len(mask):
        thinned = thinned.copy()
        for x, y, radius in np.asarray(mask) / stride:
            center = (round(x), round(y))
            cv2.circle(thinned, center, ceil(radius), background, cv2.FILLED)
    return _Survey(image, thinned, stride, background, noise, float(thinned.max()))


def _quantile(values: MatLike, share: float) -> int:
    """Return the value that is larger than that share of all."""
    rank = int(share * values.size)
    return int(np.partition(values, rank, axis=None)[rank])


def _has_smears(scene: _Survey) -> bool:
    """Return whether an image without spots or background gradient shows light."""
    level = scene.background + LEVEL_SIGMAS * scene.noise
    lit = cv2.countNonZero(cv2.threshold(scene.thinned, level, 1, cv2.THRESH_BINARY)[1])
    low, high = SMEARED_FRACTIONS
    return low < lit / scene.thinned.size < high


def _flattened(image: Image, full_scale: int) -> Image:
    """Return the image without its uneven background.

    That is the median of the neighbourhood in a coarse grid, in which a disc is a few
    points at the most. What reads full scale stays, to be reported as saturated.
    """
    step = max(min(image.shape) // NOISE_SAMPLES, 1)
    coarse = cv2.medianBlur(np.ascontiguousarray(image[::step, ::step]), 5)
    size = (image.shape[1], image.shape[0])
    uneven = np.asarray(cv2.resize(coarse, size, interpolation=cv2.INTER_LINEAR))
    uneven -= coarse.min()
    flat: Image = np.asarray(cv2.subtract(image, uneven, dst=uneven)).view(image.dtype)
    np.copyto(flat, image, where=image >= full_scale)
    return flat


def _thinned(image: Image, stride: int) -> MatLike:
    """Return every `stride`-th pixel of every `stride`-th row; stride 1, 2 or 4."""
    pixels: MatLike
    width = image.shape[1] // stride * stride
    rows = image[::stride, :width]
    if image.strides[1] != image.itemsize or sys.byteorder != "little":
        pixels = np.ascontiguousarray(rows[:, ::stride])
        return pixels
    # The low bytes of `stride` pixels read as one number are the first pixel. Narrowing
    # numbers is three times as fast as gathering pixels.
    pixels = rows.view(f"u{image.itemsize * stride}").astype(image.dtype)
    return pixels


def _find_discs(
    scene: _Survey, budget: Iterator[int], before: Sequence[EdgeStart] = ()
) -> list[Disc]:
    """Return whatever may be an LED, each once."""
    rise = scene.peak - scene.background
    level = scene.background + max(LEVEL_SIGMAS * scene.noise, LEVEL_OF_PEAK * rise)
    height, width = scene.image.shape
    boxes = _regions(scene, PixelBox(0, 0, width, height), level)
    if len(boxes) > MAX_BOXES:
        boxes = sorted(boxes, key=lambda box: box.size, reverse=True)[:MAX_BOXES]

    measured: list[Disc] = []
    unclear: list[tuple[PixelBox, Disc | None]] = []
    for box in boxes:
        if _is_too_large(scene, box):
            unclear.append((box, None))
        else:
            found = list(_measured(scene, box, level, 0.0, budget))
            measured += found
            if not found and scene.hides_light(box, level):
                unclear.append((box, None))
    measured = with_rims(scene.image, measured, before)
    discs = [disc for disc in measured if disc.is_whole]
    unclear += [(disc.box, disc) for disc in measured if not disc.is_whole]
    for box, region in unclear:
        discs += _parted(scene, box, level, region, budget)
    return _unique(discs) if unclear or len(discs) != len(boxes) else discs


def _parted(
    scene: _Survey,
    box: PixelBox,
    level: float,
    disc: Disc | None,
    budget: Iterator[int],
) -> list[Disc]:
    """Return the discs that a region parts into at higher levels, or itself."""
    if disc is not None:
        level = max(level, disc.cut_level)
    parts: list[PixelBox] = []
    for _ in range(MAX_LEVELS_AT_ONCE):
        if next(budget, None) is None:
            break
        level = scene.higher(level)
        parts = _regions(scene, box, level)
        if len(parts) != 1 or not parts[0].is_close_to(box):
            break
    blocks: list[Disc] = []
    for part in parts:
        if _is_too_large(scene, part):
            blocks += _parted(scene, part, level, None, budget)
            continue
        found = list(_measured(scene, part, level, level, budget))
        if not found and scene.hides_light(part, level):
            blocks += _parted(scene, part, level, None, budget)
        for block in with_rims(scene.image, found):
            if block.is_whole:
                blocks.append(block)
            else:
                blocks += _parted(scene, block.box, level, block, budget)
    is_parted = len(blocks) > 1 or any(block.is_whole for block in blocks)
    if disc is None or is_parted or not _resembles_disc(disc):
        return blocks
    return [disc]


def _unique(discs: list[Disc]) -> list[Disc]:
    """Drop duplicates and spots inside a larger disc."""
    kept: list[Disc] = []
    for disc in sorted(discs, key=lambda disc: disc.moments.area, reverse=True):
        if not any(larger.box.holds_center_of(disc.box) for larger in kept):
            kept.append(disc)
    return kept


def _regions(scene: _Survey, box: PixelBox, level: float) -> list[PixelBox]:
    """Return the boxes of regions above a level inside a box."""
    if level >= np.iinfo(scene.image.dtype).max:
        return []
    step = 1 if box.size <= FINE_SIZE else scene.stride
    plane = scene.thinned if step == scene.stride else scene.image
    frame = box.grown(step, scene.image.shape)
    left, top = frame.left // step, frame.top // step
    window = plane[top : -(-frame.bottom // step), left : -(-frame.right // step)]
    bright: MatLike = (window > int(level)).view(np.uint8)
    if step == 1 or cv2.countNonZero(bright) > CROWDED * bright.size:
        # cv2.morphologyEx would shift the regions: it anchors both steps alike.
        bright = cv2.dilate(cv2.erode(bright, SPECK), SPECK, anchor=(0, 0))
        if box.size > FINE_SIZE and _is_textured(bright):
            return [box]
    # Every component, also one in the hole of another, is at the top of this hierarchy.
    contours, hierarchy = cv2.findContours(
        bright, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE, offset=(left, top)
    )
    if not contours:
        return []
    parents = hierarchy[0, :MAX_CONTOURS, 3].tolist()
    found = [
        bounding_box(contour, step)
        for contour, parent in zip(contours, parents, strict=False)
        if parent < 0
    ]
    if frame == box:
        return found
    # What reaches out of the box belongs to a neighbour.
    return [part for part in found if part.overlap(box) == part.area]


def _is_textured(bright: MatLike) -> bool:
    changes = np.count_nonzero(bright[:, 1:] != bright[:, :-1])
    return bool(changes > TEXTURED * bright.size)


def _is_too_large(scene: _Survey, box: PixelBox) -> bool:
    shorter_side: int = min(scene.image.shape)
    return box.size > max(MAX_DIAMETER * shorter_side, FINE_SIZE)


def _measured(
    scene: _Survey, box: PixelBox, level: float, floor: float, budget: Iterator[int]
) -> Iterator[Disc]:
    """Measure the region in a box, and others that coarse sampling took for one."""
    boxes, seen = [box], {box}
    while boxes and next(budget, None) is not None:
        disc = measure_disc(scene.image, boxes.pop(), level, scene.noise, floor)
        if disc is None:
            continue
        # Two regions of which each is another of the other would go round for ever.
        new = [
            each for each in disc.others if each.size < box.size and each not in seen
        ]
        boxes += new
        seen |= {disc.box, *new}
        height = disc.levels.plateau - scene.background
        if disc.levels.contrast > MIN_RELATIVE_CONTRAST * height:
            yield disc


def _resembles_disc(disc: Disc) -> bool:
    """Return whether a region may be a cut or merged LED."""
    major, minor = disc.moments.axes
    return disc.moments.roundness > MIN_ROUNDNESS and major < MAX_AXIS_RATIO * minor


def _as_spots(discs: list[Disc], full_scale: float, noise: float) -> Spots:
    whole = [disc.moments.area for disc in discs if disc.is_whole]
    usual_area = median(whole) if whole else None
    moments = [disc.moments for disc in discs]
    centers = np.array([(m.x, m.y) for m in moments]).reshape(-1, 2)
    regions = [
        center if disc.rim is None else disc.rim.center
        for disc, center in zip(discs, centers, strict=True)
    ]
    return Spots(
        centers,
        np.array([(m.var_x, m.cov_xy, m.cov_xy, m.var_y) for m in moments]).reshape(
            -1, 2, 2
        ),
        np.array([m.area for m in moments]),
        np.array([disc.levels.contrast / full_scale for disc in discs]),
        np.array([m.edge_width for m in moments]),
        np.array(
            [_flaws(disc, usual_area, full_scale, noise) for disc in discs], np.int64
        ),
        np.full(len(discs), EXACT_SIGMA),
        np.array(regions).reshape(-1, 2) - centers,
    )


def _with_small(
    spots: Spots, discs: list[Disc], image: Image, noise: float, full_scale: float
) -> Spots:
    """Return spots with the small ones measured again.

    Blur leaves these without a plateau, or foreign light without a foot.
    """
    raised = np.array([not disc.is_whole or disc.cut_height > RAISED for disc in discs])
    rough_radii = np.sqrt(spots.areas / np.pi)
    fits = rough_radii < LARGEST_RADIUS
    raised &= fits
    # Foreign light at a quarter of the LEDs also affects the others, though less.
    are_lit = raised.sum() > LIT * fits.sum()
    clipped = fits & ((spots.flaws & SpotFlaw.SATURATED) > 0)
    chosen = spots.are_small | raised | clipped
    if chosen.sum() > LIT * fits.sum():
        chosen |= rough_radii < (LARGEST_RADIUS if are_lit else ALIKE_RADIUS)
    small = np.flatnonzero(chosen)
    if not len(small):
        return spots
    found = measure_small(image, spots.centers[small], rough_radii[small], full_scale)
    unwhole = SpotFlaw.CUT | SpotFlaw.MERGED
    kept = spots.flaws[small] & (SpotFlaw.BLURRED | unwhole)
    # What was parted at high levels and is whole in its own window is not cut.
    reach = found.radii[:, None]
    height, width = image.shape
    inside = (found.centers > reach - 0.5) & (found.centers < [width, height] - reach)
    is_whole = inside.all(axis=1) & found.are_whole & ~found.alone
    kept &= ~np.where(is_whole, int(unwhole), 0)
    flaws = kept | np.where(found.are_whole, 0, int(SpotFlaw.MERGED))
    flaws |= np.where(found.saturated, int(SpotFlaw.SATURATED), 0)
    noises = np.minimum(np.maximum(found.noises, MIN_NOISE), noise)
    flaws |= np.where(found.peaks < DIM_SIGMAS * noises, int(SpotFlaw.DIM), 0)

    def replaced(old: NumberArray, new: NumberArray) -> NumberArray:
        values = old.copy()
        values[small] = new
        return values

    return replace(
        spots,
        centers=replaced(spots.centers, found.centers),
        shapes=replaced(spots.shapes, found.shapes),
        areas=replaced(spots.areas, np.pi * found.radii**2),
        contrasts=replaced(spots.contrasts, found.peaks / full_scale),
        flaws=replaced(spots.flaws, np.asarray(flaws, dtype=np.int64)),
        sigmas=replaced(spots.sigmas, np.maximum(found.sigmas, EXACT_SIGMA)),
    )


def _flaws(
    disc: Disc, usual_area: float | None, full_scale: float, noise: float
) -> SpotFlaw:
    flaws = SpotFlaw.NONE
    if disc.cut_height > MERGED_LEVEL:
        flaws |= SpotFlaw.MERGED
    if disc.leaves_image:
        flaws |= SpotFlaw.CUT
    elif not disc.is_whole:
        flaws |= _flaw_of_size(disc.moments.area, usual_area)
    if disc.levels.top >= SATURATED_LEVEL * full_scale:
        flaws |= SpotFlaw.SATURATED
    if disc.moments.edge_width > BLURRED_EDGE:
        flaws |= SpotFlaw.BLURRED
    if disc.levels.contrast < DIM_SIGMAS * noise:
        flaws |= SpotFlaw.DIM
    return flaws


def _flaw_of_size(area: float, usual_area: float | None) -> SpotFlaw:
    """Tell merged from cut by size, if there is a whole disc to compare with."""
    if usual_area is None:
        return SpotFlaw.MERGED | SpotFlaw.CUT
    return SpotFlaw.MERGED if area > usual_area else SpotFlaw.CUT
