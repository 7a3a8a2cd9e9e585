"""The bright spots of an image: centres, shapes and flaws."""

from dataclasses import dataclass, replace
from enum import IntFlag
from functools import partial
from typing import Self, TypeVar

import cv2
import numpy as np

from lightpen.arrays import BoolArray, FloatArray, Image, IntArray
from lightpen.detection.disc_moments import (
    FLAT,
    GAUSSIAN_RISE,
    HIGH,
    LOW,
    MIN_SIZE,
    Discs,
    Starts,
    chosen_rows,
    ellipse_misfits,
)
from lightpen.detection.disc_search import (
    LEVEL_OF_PEAK,
    LEVEL_SIGMAS,
    MAX_REGIONS,
    MIN_NOISE,
    Survey,
    find_discs,
    flattened,
    survey,
)
from lightpen.detection.edge_fit import EdgeStarts
from lightpen.detection.pixel_box import PixelBox
from lightpen.detection.pose import MIN_POSE_LEDS
from lightpen.detection.small_spots import LARGEST_RADIUS, measure_small, widths_of_tiny
from lightpen.formats.decoding import full_scale_of

NumberArray = TypeVar("NumberArray", FloatArray, IntArray)

MAX_SPOTS = 64

MOVED = 0.5  # of a spot's size; a hand that holds still trembles by less
CHANGED = 0.1  # of the mean area and contrast of all spots

SMEARED_FRACTIONS = (2e-4, 0.2)  # of the image: more than hot pixels, less than a wall

SMALL_AREA = 100.0  # px^2, usual area of LEDs that are searched in every pixel
HARDLY_AREA = 18.0  # px^2, usual area at which some spots may be too small
FEWEST_TINY = 4
FOUND_TINY = 0.75  # of as many tiny ones, that are found where LEDs are large enough
LEAST_OF_USUAL = 0.3  # of the height of others, above which tiny ones are counted
HEAD = 0.4  # of the height of the brightest

BELL_RADIUS = 6.0  # px; blur leaves less no even inside
ALIKE_RADIUS = 8.0  # px, of a spot that is measured as many others are
CORE = 3.0  # times the height of a halo: the LED in it
MANY_MISFITS = 3.0  # times the usual one, of the outline of an LED that is not whole
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


FLAWS = np.array([*SpotFlaw])


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
    # (N, 2), offset of the centre of the bright region from the disc's, px
    offsets: FloatArray
    # Whether there is light, but no spot: discs moved by many times their size during
    # the exposure leave streaks, a dark image leaves nothing.
    has_smears: bool = False
    # Usual width, px, of spots too small for a centre, if most are; else NaN.
    tiny_width: float = float("nan")

    @classmethod
    def none(cls) -> Self:
        """Return the spots of an image without any."""
        values, places, shapes = np.zeros(0), np.zeros((0, 2)), np.zeros((0, 2, 2))
        flaws = np.zeros(0, dtype=np.int64)
        return cls(places, shapes, values, values, values, flaws, values, places)

    def __len__(self) -> int:
        return len(self.centers)

    def rims(self, corner: FloatArray) -> EdgeStarts:
        """Return the search regions of these spots in the next image.

        Merged spots, and those that the border cuts, are left out. ``corner`` (2,) is
        the pixel of this image where the next one, a part of the sensor, begins, px.
        """
        whole = self.flaws & (SpotFlaw.MERGED | SpotFlaw.CUT) == 0
        starts = EdgeStarts.anew(self.centers[whole] - corner, self.shapes[whole])
        return starts._replace(
            sigmas=self.edge_widths[whole] / GAUSSIAN_RISE, offsets=self.offsets[whole]
        )

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
        Brightest value a pixel can have; if not given, as the levels show, see
        `lightpen.formats.decoding.full_scale_of`.
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
        full_scale = full_scale_of(image)
    stride = 4 if min(image.shape) >= 1024 else 2 if min(image.shape) >= 512 else 1
    corner = np.zeros(2)
    if window is not None:
        corner += (window.left, window.top)
        image = image[window.top : window.bottom, window.left : window.right]
        if mask is not None:
            mask = np.asarray(mask) - np.append(corner, 0)
    starts = None if before is None else partial(before.rims, corner)
    spots = _spots_of(image, mask, stride, full_scale, starts)
    spots.centers[...] += corner
    return spots


def _spots_of(
    image: Image,
    mask: FloatArray | None,
    stride: int,
    full_scale: int,
    before: Starts | None,
) -> Spots:
    budget = iter(range(MAX_REGIONS))
    scene = survey(image, mask, stride)
    discs = find_discs(scene, budget, before)
    # Too few for a pose are worth a closer look, and so small that light joins them.
    is_few = len(discs.boxes) < MIN_POSE_LEDS
    usual_area = 0.0 if is_few else np.median(discs.moments.area)
    if stride > 1 and (is_few or HARDLY_AREA < usual_area < SMALL_AREA):
        budget = iter(range(MAX_REGIONS))
        finer = survey(image, mask, stride // 2 if is_few else 1)
        found = find_discs(finer, budget)
        if is_few or len(found.boxes) > len(discs.boxes):
            scene, discs = finer, found
    has_smears = False
    if len(discs.boxes) < MIN_POSE_LEDS or next(budget, None) is None:
        flat = survey(flattened(image, full_scale), mask, stride)
        flat_discs = find_discs(flat, iter(range(MAX_REGIONS)))
        if len(flat_discs.boxes) > len(discs.boxes):
            scene, discs = flat, flat_discs
        has_smears = not len(discs.boxes) and _has_smears(flat)
    order = np.argsort(-discs.levels.contrast, kind="stable")
    discs = chosen_rows(discs, order[:MAX_SPOTS])
    spots = _as_spots(discs, full_scale, scene.noise, has_smears)
    usual_area = np.median(spots.areas) if len(spots) else 0.0
    if len(spots) < MIN_POSE_LEDS or usual_area < HARDLY_AREA:
        spots = replace(spots, tiny_width=_tiny_width(scene, spots, full_scale))
    if len(spots) and usual_area < np.pi * LARGEST_RADIUS**2:
        spots = _with_small(spots, discs, image, scene.noise, full_scale)
    return spots


def _tiny_width(scene: Survey, spots: Spots, full_scale: int) -> float:
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


def _has_smears(scene: Survey) -> bool:
    """Return whether an image without spots or background gradient shows light."""
    level = scene.background + LEVEL_SIGMAS * scene.noise
    lit = cv2.countNonZero(cv2.threshold(scene.thinned, level, 1, cv2.THRESH_BINARY)[1])
    low, high = SMEARED_FRACTIONS
    return low < lit / scene.thinned.size < high


def _as_spots(discs: Discs, full_scale: float, noise: float, has_smears: bool) -> Spots:
    moments, are_whole, leave = discs.moments, discs.are_whole, discs.leave_image
    contrasts = discs.levels.contrast
    # Merged is told from cut by size, if there is a whole disc to compare with.
    usual = np.median(moments.area[are_whole]) if are_whole.any() else np.nan
    unwhole = ~are_whole & ~leave
    have_flaws = (  # in the order of `SpotFlaw`
        (discs.cut_heights > MERGED_LEVEL) | (unwhole & ~(moments.area <= usual)),
        leave | (unwhole & ~(moments.area > usual)),
        discs.levels.top >= SATURATED_LEVEL * full_scale,
        moments.edge_width > BLURRED_EDGE,
        contrasts < DIM_SIGMAS * noise,
    )
    centers = np.stack([moments.x, moments.y], axis=1)
    rims = discs.rims.centers
    shapes = (moments.var_x, moments.cov_xy, moments.cov_xy, moments.var_y)
    return Spots(
        centers=centers,
        shapes=np.stack(shapes, axis=1).reshape(-1, 2, 2),
        areas=moments.area,
        contrasts=contrasts / full_scale,
        edge_widths=moments.edge_width,
        flaws=FLAWS @ np.stack(have_flaws),
        sigmas=np.full(len(centers), EXACT_SIGMA),
        offsets=np.where(np.isnan(rims), 0.0, rims - centers),
        has_smears=has_smears,
    )


def _with_small(
    spots: Spots, discs: Discs, image: Image, noise: float, full_scale: float
) -> Spots:
    """Return spots with the small ones measured again.

    Blur leaves these without a plateau, or foreign light without a foot.
    """
    raised = ~discs.are_whole | (discs.cut_heights > RAISED)
    rough_radii = np.sqrt(spots.areas / np.pi)
    fits = rough_radii < LARGEST_RADIUS
    raised &= fits
    # Foreign light at a quarter of the LEDs also affects the others, though less.
    are_lit = raised.sum() > LIT * fits.sum()
    clipped = fits & ((spots.flaws & SpotFlaw.SATURATED) > 0)
    # A halo may be taken for the disc, wide and dim, of the LED in its middle.
    x, y = np.rint(spots.centers).astype(np.int64).T
    tops = (image[y, x] - discs.levels.background) / full_scale
    is_halo = tops > CORE * spots.contrasts
    chosen = spots.are_small | raised | clipped | is_halo
    if chosen.sum() > LIT * fits.sum():
        chosen |= rough_radii < (LARGEST_RADIUS if are_lit else ALIKE_RADIUS)
    small = np.flatnonzero(chosen)
    if not len(small):
        return spots
    found = measure_small(image, spots.centers[small], rough_radii[small], full_scale)
    unwhole = SpotFlaw.CUT | SpotFlaw.MERGED
    kept = spots.flaws[small] & (SpotFlaw.BLURRED | unwhole)
    kept &= ~np.where(is_halo[small], int(SpotFlaw.BLURRED), 0)
    # What was parted at high levels and is whole in its own window is not cut.
    reach = found.radii[:, None]
    height, width = image.shape
    inside = (found.centers > reach - 0.5) & (found.centers < [width, height] - reach)
    misfits = ellipse_misfits(discs.moments, noise / discs.levels.contrast)
    # LEDs that are no even discs all miss the ellipse; hidden ones miss it by more.
    usual = np.median(misfits[fits]) if fits.sum() >= MIN_POSE_LEDS else 0.0
    is_usual = misfits[small] < max(MANY_MISFITS * usual, 1.0)
    is_whole = inside.all(axis=1) & found.are_whole & (is_usual | ~found.alone)
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
