"""The bright regions of an image that may be discs.

Every fourth pixel of every fourth row shows where something is bright; only windows
around that are read in full. A region that is no whole disc is examined again at
higher levels, which parts discs that touch and finds LEDs in front of something bright.
What never becomes a disc is dropped, or kept if it resembles one.
"""

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from math import ceil, sqrt

import cv2
import numpy as np
from cv2.typing import MatLike

from lightpen.arrays import BoolArray, FloatArray, Image
from lightpen.detection.disc_moments import (
    NO_DISCS,
    Discs,
    Starts,
    chosen_rows,
    joined,
    with_rims,
)
from lightpen.detection.disc_stack import measure_discs
from lightpen.detection.pixel_box import PixelBox, bounding_box
from lightpen.model.coverage import normal_quantile

MAX_BOXES = 128  # the smallest of more are clutter
MAX_REGIONS = 1024  # examined in one image
MAX_CONTOURS = 4000
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
MIN_RELATIVE_CONTRAST = 0.15


@dataclass(frozen=True, eq=False)
class Survey:
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


def survey(image: Image, mask: FloatArray | None, stride: int) -> Survey:
    """Return what an image, but for its masked circles, shows at a glance."""
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
    return Survey(image, thinned, stride, background, noise, float(thinned.max()))


def _quantile(values: MatLike, share: float) -> int:
    """Return the quantile of values for a share."""
    rank = int(share * values.size)
    # On bytes this is ten times as fast as what numpy has.
    return int(cv2.sort(values.reshape(1, -1), cv2.SORT_EVERY_ROW)[0, rank])


def flattened(image: Image, full_scale: int) -> Image:
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


def find_discs(
    scene: Survey, budget: Iterator[int], before: Starts | None = None
) -> Discs:
    """Return whatever may be an LED, each once."""
    rise = scene.peak - scene.background
    level = scene.background + max(LEVEL_SIGMAS * scene.noise, LEVEL_OF_PEAK * rise)
    height, width = scene.image.shape
    boxes = _regions(scene, PixelBox(0, 0, width, height), level)
    if len(boxes) > MAX_BOXES:
        boxes = sorted(boxes, key=lambda box: box.size, reverse=True)[:MAX_BOXES]

    measured, hidden = _measured(scene, boxes, level, 0.0, budget)
    measured = with_rims(scene.image, measured, before)
    if len(measured.boxes) == len(boxes) and measured.are_whole.all() and not hidden:
        return measured
    discs = [chosen_rows(measured, measured.are_whole)]
    for box in hidden:
        discs += _parted(scene, box, level, None, budget)
    for region in _each(measured, ~measured.are_whole):
        discs += _parted(scene, _box(region), level, region, budget)
    return _unique(joined(discs))


def _each(discs: Discs, chosen: BoolArray) -> list[Discs]:
    """Return some discs, each by itself."""
    return [chosen_rows(discs, [i]) for i in np.flatnonzero(chosen).tolist()]


def _box(disc: Discs) -> PixelBox:
    """Return the box of one disc."""
    return PixelBox(*disc.boxes[0].tolist())


def _parted(
    scene: Survey,
    box: PixelBox,
    level: float,
    disc: Discs | None,
    budget: Iterator[int],
) -> list[Discs]:
    """Return the discs that a region parts into at higher levels, or itself."""
    if disc is not None:
        level = max(level, float(disc.cut_levels[0]))
    parts: list[PixelBox] = []
    for _ in range(MAX_LEVELS_AT_ONCE):
        if next(budget, None) is None:
            break
        level = scene.higher(level)
        parts = _regions(scene, box, level)
        if len(parts) != 1 or not parts[0].is_close_to(box):
            break
    blocks: list[Discs] = []
    found, hidden = _measured(scene, parts, level, level, budget)
    for part in hidden:
        blocks += _parted(scene, part, level, None, budget)
    found = with_rims(scene.image, found)
    for block in _each(found, np.ones(len(found.boxes), dtype=bool)):
        if block.are_whole[0]:
            blocks.append(block)
        else:
            blocks += _parted(scene, _box(block), level, block, budget)
    is_parted = len(blocks) > 1 or any(block.are_whole[0] for block in blocks)
    if disc is None or is_parted or not _resembles_disc(disc):
        return blocks
    return [disc]


def _unique(discs: Discs) -> Discs:
    """Drop duplicates and spots inside a larger disc."""
    kept: list[int] = []
    boxes = [PixelBox(*box) for box in discs.boxes.tolist()]
    for i in np.argsort(-discs.moments.area, kind="stable").tolist():
        if not any(boxes[larger].holds_center_of(boxes[i]) for larger in kept):
            kept.append(i)
    return chosen_rows(discs, kept)


def _regions(scene: Survey, box: PixelBox, level: float) -> list[PixelBox]:
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


def _measured(
    scene: Survey,
    boxes: list[PixelBox],
    level: float,
    floor: float,
    budget: Iterator[int],
) -> tuple[Discs, list[PixelBox]]:
    """Return the discs in boxes, and the boxes that are too large or hide some.

    Further regions that coarse sampling merged are measured too.
    """
    largest = max(MAX_DIAMETER * min(scene.image.shape), FINE_SIZE)
    hidden = [box for box in boxes if box.size > largest]
    boxes = [box for box in boxes if box.size <= largest]
    found, seen = [NO_DISCS], set(boxes)
    while boxes := [box for box, _ in zip(boxes, budget, strict=False)]:
        discs, at, others = measure_discs(scene.image, boxes, level, scene.noise, floor)
        seen |= {PixelBox(*box) for box in discs.boxes.tolist()}
        # Less contrast is the texture of something bright.
        heights = discs.levels.plateau - scene.background
        are_discs = discs.levels.contrast > MIN_RELATIVE_CONTRAST * heights
        found.append(discs if are_discs.all() else chosen_rows(discs, are_discs))
        clear = set(at[are_discs].tolist())
        hidden += [
            box
            for i, box in enumerate(boxes)
            if i not in clear and scene.hides_light(box, level)
        ]
        # Two regions that each lead to the other would loop for ever.
        more = [other for i, other in others if other.size < boxes[i].size]
        boxes = [box for box in dict.fromkeys(more) if box not in seen]
        seen |= set(boxes)
    return joined(found[1:] or found), hidden


def _resembles_disc(disc: Discs) -> bool:
    """Return whether a region may be a cut or merged LED."""
    major, minor = disc.moments.axes
    is_round = disc.moments.roundness[0] > MIN_ROUNDNESS
    return bool(is_round and major[0] < MAX_AXIS_RATIO * minor[0])
