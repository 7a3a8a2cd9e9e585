"""Discs measured all at once, as stacks of windows."""

from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import NamedTuple

import cv2
import numpy as np
from cv2.typing import MatLike

from lightpen.arrays import BoolArray, FloatArray, Image, IntArray
from lightpen.detection.disc_moments import (
    HIGH,
    LOW,
    MIN_SIZE,
    Discs,
    Levels,
    assessed,
    chosen_rows,
    joined,
    moments_by_sums,
    rim_start,
)
from lightpen.detection.edge_fit import EdgeStarts
from lightpen.detection.pixel_box import PixelBox, Reals, stacked

LOW_SIGMAS = 3.5  # the noise of the background stays below `low`
MAX_LOW = 0.3
MAX_FLOOR = 0.85  # higher, the noise of the plateau makes the outline
MIN_RAMP = 0.2  # least high - low, fraction of the contrast
MIN_SIGMAS = 6.0  # least contrast in terms of the noise
HOLE = 1.05  # times the light of a ring, with its middle filled; noise has less
FULL = 254.5  # of 255, the plateau
FULLY = 250  # of 255, the crest of a ring
HOLLOW = 128  # of 255, the middle of a ring that is too uneven to be filled
WIDE_EDGE = 4.5  # px; sharp discs have 2 to 3
MARGIN = 5  # px around a box: the foot of the rim and some background
ALIKE = 2  # times the smallest of a stack, at most, is its largest box
GROWTH = np.array([-1, -1, 1, 1])  # of left, top, right and bottom
NOTHING = np.zeros((0, 1, 2), np.int32)  # contour of no region
SHARES = np.arange(8) / 8  # of a side: a hole of a ring is wider
SAMPLES = 16  # per side of a window, to find background and plateau


class DiscsOfBoxes(NamedTuple):
    """Discs in boxes."""

    discs: Discs
    box: IntArray  # (N,), which box each disc is in
    others: list[tuple[int, PixelBox]]  # further regions in boxes, after the box


def measure_discs(
    image: Image,
    boxes: Sequence[PixelBox],
    level: float,
    noise: float,
    floor: float = 0.0,
) -> DiscsOfBoxes:
    """Return the discs in boxes where something is large and bright enough.

    Parameters
    ----------
    image : (H, W) array
        The whole image.
    boxes : sequence of PixelBox
        Bounding boxes of the regions; they may be a few pixels too small.
    level : float
        An intensity that the regions exceed and their background does not, digital
        numbers.
    noise : float
        Standard deviation of the background, digital numbers.
    floor : float
        The intensity above which the regions are apart from their neighbours, digital
        numbers; zero for regions that stand alone.
    """
    every = np.array(boxes)
    parts = []
    for stack in _alike(every):
        found = _measured(image, every[stack], 10, level, noise, floor)
        wide = found.discs.leave_window
        if wide.any():
            whole, left = found.box[~wide], found.box[wide]
            regions = found.discs.boxes[wide]
            again = _measured(image, regions, 4, level, noise, floor)
            others = [other for other in found.others if other[0] in whole]
            kept = DiscsOfBoxes(chosen_rows(found.discs, ~wide), whole, others)
            found = _joined([kept, _of_boxes(again, left)])
        parts.append(_of_boxes(found, stack))
    return _joined(parts)


def _of_boxes(found: DiscsOfBoxes, boxes: IntArray) -> DiscsOfBoxes:
    """Return discs in some of more boxes."""
    others = [(int(boxes[i]), other) for i, other in found.others]
    return DiscsOfBoxes(found.discs, boxes[found.box], others)


def _joined(parts: Sequence[DiscsOfBoxes]) -> DiscsOfBoxes:
    if len(parts) == 1:
        return parts[0]
    others = [other for part in parts for other in part.others]
    discs, box = (
        joined([part.discs for part in parts]),
        np.concatenate([part.box for part in parts]),
    )
    return DiscsOfBoxes(discs, box, others)


def _alike(boxes: IntArray) -> Iterator[IntArray]:
    """Yield the indices of boxes (N, 4) of like sizes."""
    sizes = np.maximum(*_sides(boxes))
    order = np.argsort(sizes, kind="stable")
    while len(order):
        n = int((sizes[order] <= ALIKE * sizes[order[0]]).sum())
        yield order[:n]
        order = order[n:]


def _measured(
    image: Image, boxes: IntArray, margin: int, level: float, noise: float, floor: float
) -> DiscsOfBoxes:
    """Measure the discs in boxes grown by a share of their size, one over a number."""
    sizes = np.maximum(*_sides(boxes))
    height, width = image.shape
    frames = boxes + (MARGIN + sizes // margin)[:, None] * GROWTH
    frames = np.minimum(np.maximum(frames, 0), [width, height, width, height])
    light = stacked(image, frames)
    levels = _levels(light, frames, level)
    low, high = _ramp(levels, noise, floor)
    layers = np.empty((4, *light.shape), np.float32)
    soft, inner, weighted, lit = layers
    _soften(light, low, high, soft)
    regions, contours, others = _regions(soft, frames, boxes)
    inner[...] = _inside(soft > FULL)
    rings, are_hollow = _filled(soft, regions - frames[:, [0, 1, 0, 1]])
    if rings:  # with half of their light on their flanks
        levels.plateau[rings] = levels.top[rings]
        low, high = _ramp(levels, noise, floor)
        crests = np.empty((len(rings), *light.shape[1:]), np.float32)
        _soften(light[rings], low[rings], high[rings], crests)
        crests *= soft[rings] > 0
        for k, crest in zip(rings, crests, strict=True):
            soft[k] = crest
            _is_filled(soft[k])
    background, contrast = levels.background, levels.contrast
    inner[rings] = 0  # a ring shows no shading
    np.multiply(light, inner, out=weighted)
    light -= _of_each(background)
    np.minimum(soft, 1, out=lit)
    lit *= light
    rows = soft.reshape(len(boxes), 1, -1)
    squares = (rows @ rows.transpose(0, 2, 1)).ravel()
    sums, ramps = _sums(layers), (high - low) / contrast
    x, y = frames[:, 0] + light.shape[2] // 2, frames[:, 1] + light.shape[1] // 2
    moments, are_whole, are_even, are_balanced = assessed(
        moments_by_sums(sums[:, :, 0], squares, x, y, ramps),
        *(sums[:, :, 1:], x, y, levels, noise / contrast),
    )
    are_enough = moments.are_enough & (contrast >= MIN_SIGMAS * noise)
    are_enough &= floor <= background + MAX_FLOOR * contrast
    are_even &= are_whole
    # The outline of a ring that is as bright all round needs no fit of its rim.
    are_clear = are_even & (moments.edge_width < WIDE_EDGE)
    are_clear[rings] |= are_whole[rings] & are_balanced[rings]
    reached, ends = regions == frames, frames == [0, 0, width, height]
    leave = reached.any(axis=1)
    rims = np.full((len(boxes), 5), np.nan)
    for k in np.flatnonzero(are_enough & ~are_clear & ~leave).tolist():
        rims[k] = rim_start(contours[k])
    rims[:, 1] -= np.arange(len(boxes)) * light.shape[1]
    starts = EdgeStarts.anew(
        rims[:, :2] + frames[:, :2], rims[:, [2, 3, 3, 4]].reshape(-1, 2, 2)
    )
    are_hollow[rings] = True
    discs = Discs(
        *(moments, levels, low, regions),
        *(are_whole & ~leave, are_even & ~leave),
        leave_image=(reached & ends).any(axis=1),
        leave_window=(reached & ~ends).any(axis=1),
        rims=starts._replace(are_rings=are_hollow),
    )
    box = np.flatnonzero(are_enough)
    if len(box) < len(boxes):
        discs = chosen_rows(discs, box)
        others = [other for other in others if are_enough[other[0]]]
    return DiscsOfBoxes(discs, box, others)


def _ramp(levels: Levels, noise: float, floor: float) -> tuple[FloatArray, FloatArray]:
    """Return the intensities between which light counts in part."""
    background, contrast = levels.background, levels.contrast
    foot = np.minimum(np.maximum(LOW_SIGMAS * noise / contrast, LOW), MAX_LOW)
    low = np.rint(np.maximum(background + foot * contrast, floor))
    high = np.maximum(background + HIGH * contrast, low + MIN_RAMP * contrast)
    return low, high


def _soften(light: Reals, low: FloatArray, high: FloatArray, soft: Reals) -> None:
    """Write light between two intensities, of 255, to an array."""
    np.subtract(light, _of_each(low), out=soft)
    soft *= _of_each(255 / (high - low))
    np.maximum(soft, 0, out=soft)
    np.minimum(soft, 255, out=soft)


def _levels(light: Reals, frames: IntArray, level: float) -> Levels:
    """Return the medians of two classes of pixels of each window."""
    sizes = frames[:, 3:1:-1] - frames[:, 1::-1]
    step = max(1, int(sizes.min()) // SAMPLES)
    samples = light[:, ::step, ::step].copy()
    down, right = (step * np.arange(n) for n in samples.shape[1:])
    beyond = (down >= sizes[:, :1])[:, :, None] | (right >= sizes[:, 1:])[:, None]
    samples[beyond] = np.inf
    samples = np.sort(samples.reshape(len(frames), -1)).astype(np.float64)
    n, each = (sizes // -step).prod(axis=1), np.arange(len(frames))
    split: IntArray | FloatArray = np.full(len(frames), int(level))
    for _ in range(2):
        n_dark = (samples <= split[:, None]).sum(axis=1)
        background = samples[each, n_dark // 2]
        plateau = samples[each, np.minimum((n_dark + n) // 2, n - 1)]
        split = (background + plateau) // 2
    top = samples[each, np.minimum((n_dark + 9 * n) // 10, n - 1)]
    return Levels(background, np.maximum(plateau, background + 1), top)


def _inside(bright: BoolArray) -> BoolArray:
    """Return the pixels of windows (N, H, W) without those beside others."""
    width = bright.shape[2]
    flat, inside = bright.ravel(), np.zeros(bright.size, dtype=bool)
    along = flat[:-2] & flat[1:-1] & flat[2:]
    inside[width + 1 : -width - 1] = (
        along[: -2 * width] & along[width:-width] & along[2 * width :]
    )
    return inside.reshape(bright.shape)


def _regions(
    soft: Reals, frames: IntArray, boxes: IntArray
) -> tuple[IntArray, list[MatLike], list[tuple[int, PixelBox]]]:
    """Return the regions that boxes were drawn around, with contours in the stack.

    Others vanish from ``soft``; the third are those in a box, after its index.
    """
    height, width = soft.shape[1:]
    bright = (soft > 0).view(np.uint8).reshape(-1, width)
    contours, _ = cv2.findContours(bright, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    regions, others = frames.copy(), []
    outlines: list[MatLike] = [NOTHING] * len(boxes)
    found: dict[int, list[tuple[PixelBox, MatLike]]] = {}
    corners = frames.tolist()
    for contour in contours:
        x, y, right, down = cv2.boundingRect(contour)
        k, y = divmod(y, height)
        x, y = x + corners[k][0], y + corners[k][1]
        region = PixelBox(x, y, x + right, y + down)
        found.setdefault(k, []).append((region, contour))
    for k, here in found.items():
        if len(here) > 1:
            box = PixelBox(*boxes[k].tolist())
            here.sort(key=lambda region: -region[0].overlap(box))
            alone = np.zeros(soft[k].shape, np.uint8)
            at = (0, -k * height)
            cv2.drawContours(alone, [here[0][1]], 0, 1, cv2.FILLED, offset=at)
            soft[k] *= alone
            others += [
                (k, other)
                for other, _ in here[1:]
                if box.holds_center_of(other) and other.size >= MIN_SIZE
            ]
        regions[k], outlines[k] = here[0]
    return regions, outlines, others


def _filled(soft: Reals, regions: IntArray) -> tuple[list[int], BoolArray]:
    """Fill the dark middles of rings; return windows with one, and all hollow ones."""
    # Half of a region's box, at places that a dark middle is not between.
    sides = np.stack(_sides(regions), axis=1)
    insets = sides.max(axis=1, keepdims=True) // 4
    spans = sides - 2 * insets
    first = np.minimum(regions[:, :2] + insets, regions[:, 2:] - 1)[..., None]
    there = first + (np.maximum(spans, 0)[..., None] * SHARES).astype(np.intp)
    columns, rows = there[:, 0], there[:, 1]
    each = np.arange(len(soft))[:, None, None]
    middles = soft[each, rows[:, :, None], columns[:, None]].min(axis=(1, 2))
    middles[spans.min(axis=1) <= 0] = FULL
    dark = np.flatnonzero(middles < FULLY).tolist()
    return [k for k in dark if _is_filled(soft[k])], middles < HOLLOW


def _is_filled(soft: Reals) -> bool:
    """Fill the dark middle of a ring in a window; return whether there was one."""
    crest = (soft > FULLY).view(np.uint8)
    contours, _ = cv2.findContours(crest, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    cv2.drawContours(crest, contours, -1, 255, cv2.FILLED)
    filled = np.maximum(soft, crest)
    if filled.sum() < HOLE * soft.sum():
        return False
    soft[...] = filled
    return True


def _sides(boxes: IntArray) -> tuple[IntArray, IntArray]:
    """Return widths and heights of boxes (N, 4)."""
    return boxes[:, 2] - boxes[:, 0], boxes[:, 3] - boxes[:, 1]


def _of_each(values: FloatArray) -> Reals:
    return values.astype(np.float32)[:, None, None]


def _sums(layers: Reals) -> FloatArray:
    """Return sums over layers (K, N, H, W) by powers of y and x, (4, 4, K, N)."""
    height, width = layers.shape[2:]
    rows = layers.reshape(-1, width) @ _powers(width)
    sums = _powers(height).T @ rows.reshape(-1, height, 4)
    return sums.transpose(1, 2, 0).reshape(4, 4, *layers.shape[:2]).astype(np.float64)


@lru_cache(maxsize=64)
def _powers(n: int) -> Reals:
    """Return the powers of n places from the middle, (n, 4)."""
    places = (np.arange(n)[:, None] - n // 2) ** np.arange(4)
    return places.astype(np.float32)
