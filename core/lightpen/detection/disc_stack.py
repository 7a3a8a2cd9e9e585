"""Discs measured all at once, as stacks of windows."""

from collections.abc import Iterator, Sequence
from functools import lru_cache

import cv2
import numpy as np
from cv2.typing import MatLike

from lightpen.arrays import FloatArray, Image
from lightpen.detection.disc_moments import (
    BESIDE,
    MIN_SIZE,
    Disc,
    Levels,
    assessed,
    rim_start,
    window_levels,
)
from lightpen.detection.pixel_box import PixelBox, Reals, stacked
from lightpen.detection.region_moments import HIGH, LOW, DiscMoments, moments_by_sums

LOW_SIGMAS = 3.5  # the noise of the background stays below `low`
MAX_LOW = 0.3
MAX_FLOOR = 0.85  # higher, the noise of the plateau makes the outline
MIN_RAMP = 0.2  # least high - low, fraction of the contrast
MIN_SIGMAS = 6.0  # least contrast in terms of the noise
HOLE = 1.05  # times the light of a ring, with its middle filled; noise has less
FULLY = 250  # of 255, the crest of a ring
WIDE_EDGE = 4.5  # px; sharp discs have 2 to 3
MARGIN = 5  # px around a box: the foot of the rim and some background
ALIKE = 2  # times the smallest of a stack, at most, is its largest box


def measure_discs(
    image: Image,
    boxes: Sequence[PixelBox],
    level: float,
    noise: float,
    floor: float = 0.0,
) -> list[Disc | None]:
    """Return the discs in boxes; None if nothing there is large and bright enough.

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
    found: list[Disc | None] = [None] * len(boxes)
    for stack in _alike(boxes):
        own = [boxes[i] for i in stack]
        discs = _measured(image, own, 10, level, noise, floor)
        wide = [k for k, disc in enumerate(discs) if disc and disc.leaves_window]
        if wide:
            regions = [disc.box for disc in discs if disc and disc.leaves_window]
            again = _measured(image, regions, 4, level, noise, floor)
            for k, disc in zip(wide, again, strict=True):
                discs[k] = disc
        for i, disc in zip(stack, discs, strict=True):
            found[i] = disc
    return found


def _alike(boxes: Sequence[PixelBox]) -> Iterator[list[int]]:
    """Yield the indices of boxes of like sizes."""
    left = sorted(range(len(boxes)), key=lambda i: boxes[i].size)
    while left:
        largest = ALIKE * boxes[left[0]].size
        n = sum(boxes[i].size <= largest for i in left)
        yield left[:n]
        left = left[n:]


def _measured(
    image: Image,
    boxes: Sequence[PixelBox],
    margin: int,
    level: float,
    noise: float,
    floor: float,
) -> list[Disc | None]:
    """Measure the discs in boxes grown by a share of their size, one over a number."""
    frames = [box.grown(MARGIN + box.size // margin, image.shape) for box in boxes]
    windows = [frame.of(image) for frame in frames]
    light = stacked(windows)
    levels = np.array([window_levels(window, level) for window in windows])
    background, plateau = levels[:, 0], levels[:, 1]
    contrast = np.maximum(plateau - background, 1)
    foot = np.minimum(np.maximum(LOW_SIGMAS * noise / contrast, LOW), MAX_LOW)
    low = np.rint(np.maximum(background + foot * contrast, floor))
    high = np.maximum(background + HIGH * contrast, low + MIN_RAMP * contrast)
    scaled = light - _of_each(low)
    scaled *= _of_each(255 / (high - low))
    np.maximum(scaled, 0, out=scaled)
    flat = cv2.convertScaleAbs(scaled.reshape(-1, light.shape[2]))
    soft = np.asarray(flat, np.uint8).reshape(light.shape)
    regions = _regions(soft, frames, boxes)
    inner = np.asarray(cv2.erode(flat, BESIDE)).reshape(soft.shape) == 255
    are_rings = np.zeros(len(boxes), dtype=bool)
    for k, (region, _, _) in regions.items():
        middle = region.grown(-region.size // 4, image.shape)
        middle = middle.moved(-frames[k].left, -frames[k].top)
        if middle.of(soft[k]).min(initial=255) < FULLY:
            are_rings[k] = _fill(soft[k])
    inner[are_rings] = False  # shows no shading
    layers = np.empty((4, *soft.shape), np.float32)
    layers[0], layers[1] = soft, inner
    np.multiply(light, layers[1], out=layers[2])
    light -= _of_each(background)
    np.minimum(layers[0], 1, out=layers[3])
    layers[3] *= light
    sums, inside, weighted, lit = _sums(layers)
    squares = np.einsum("nyx,nyx->n", layers[0], layers[0])
    ends, ramp = np.array(frames).T, (high - low) / contrast
    moments, are_whole, are_even, are_balanced = assessed(
        moments_by_sums(sums, squares, ends[0], ends[1], ramp),
        *(inside, weighted, lit, PixelBox(*ends), Levels(*levels.T), noise / contrast),
    )
    enough = moments.are_enough & (plateau - background >= MIN_SIGMAS * noise)
    enough &= floor <= background + MAX_FLOOR * contrast
    are_even &= are_whole
    # The outline of a ring that is as bright all round needs no fit of its rim.
    are_clear = (are_even & (moments.edge_width < WIDE_EDGE)) | (
        are_rings & are_whole & are_balanced
    )
    found: list[Disc | None] = [None] * len(boxes)
    columns = (np.stack(moments, axis=1), levels, low, are_whole, are_even, are_clear)
    of_each = zip(*(column.tolist() for column in columns), strict=True)
    for k, (row, of_window, cut, is_whole, is_even, is_clear) in enumerate(of_each):
        if not enough[k]:
            continue
        region, contour, others = regions[k]
        sides = zip(region, frames[k], (0, 0, *image.shape[::-1]), strict=True)
        reached = [there == end for here, there, end in sides if here == there]
        needs_rim = not is_clear and not reached
        corner = frames[k].left, frames[k].top - k * light.shape[1]
        found[k] = Disc(
            *(DiscMoments(*row), Levels(*of_window), cut, region),
            is_whole=is_whole and not reached,
            is_even=is_even and not reached,
            leaves_image=any(reached),
            leaves_window=not all(reached),
            others=others,
            rim=rim_start(contour, corner) if needs_rim else None,
        )
    return found


def _regions(
    soft: Image, frames: Sequence[PixelBox], boxes: Sequence[PixelBox]
) -> dict[int, tuple[PixelBox, MatLike, tuple[PixelBox, ...]]]:
    """Return the regions that boxes were drawn around, with contours in the stack.

    Others vanish from ``soft``, and are the third if they are in the box.
    """
    height, width = soft.shape[1:]
    found: dict[int, list[tuple[PixelBox, MatLike]]] = {}
    contours, _ = cv2.findContours(
        soft.reshape(-1, width), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE
    )
    for contour in contours:
        x, y, right, down = cv2.boundingRect(contour)
        k, y = divmod(y, height)
        x, y = x + frames[k].left, y + frames[k].top
        region = PixelBox(x, y, x + right, y + down)
        found.setdefault(k, []).append((region, contour))
    regions = {}
    for k, here in found.items():
        if len(here) > 1:
            here.sort(key=lambda region: -region[0].overlap(boxes[k]))
            alone: Image = np.zeros_like(soft[k])
            at = (0, -k * height)
            cv2.drawContours(alone, [here[0][1]], 0, 255, cv2.FILLED, offset=at)
            soft[k] &= alone
        boxed = (other for other, _ in here[1:] if boxes[k].holds_center_of(other))
        others = tuple(other for other in boxed if other.size >= MIN_SIZE)
        regions[k] = (*here[0], others)
    return regions


def _fill(soft: Image) -> bool:
    """Fill the dark middle of a ring in a window; return whether there was one."""
    _, crest = cv2.threshold(soft, FULLY, 255, cv2.THRESH_BINARY)
    contours, _ = cv2.findContours(crest, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    cv2.drawContours(crest, contours, -1, 255, cv2.FILLED)
    filled = cv2.max(soft, crest)
    if filled.sum() < HOLE * soft.sum():
        return False
    soft[:] = filled
    return True


def _of_each(values: FloatArray) -> Reals:
    return values.astype(np.float32)[:, None, None]


def _sums(layers: Reals) -> list[dict[str, FloatArray]]:
    """Return the sums over windows (4, N, H, W), (N,); of the first central moments."""
    height, width = layers.shape[2:]
    middle = width // 2  # from where powers stay small
    rows = (layers.reshape(-1, width) @ _powers(width, middle)).reshape(-1, height, 4)
    m = (_powers(height, middle).T @ rows).astype(np.float64)
    # Places are the power of y, and of x.
    m = m.reshape(*layers.shape[:2], 4, 4).transpose(2, 3, 0, 1)
    m00 = np.maximum(m[0, 0], 1.0)
    m10, m01 = m[0, 1] + middle * m00, m[1, 0] + middle * m00
    sums = [
        {"m00": area, "m10": along_x, "m01": along_y}
        for area, along_x, along_y in zip(m00, m10, m01, strict=True)
    ]
    m, area = m[:, :, 0], m00[0]
    u, v = m[0, 1] / area, m[1, 0] / area
    m20, m11, m02 = m[0, 2], m[1, 1], m[2, 0]
    sums[0] |= {
        "mu20": m20 - u * u * area,
        "mu11": m11 - u * v * area,
        "mu02": m02 - v * v * area,
        "mu30": m[0, 3] - 3 * u * m20 + 2 * u * u * u * area,
        "mu21": m[1, 2] - 2 * u * m11 - v * m20 + 2 * u * u * v * area,
        "mu12": m[2, 1] - 2 * v * m11 - u * m02 + 2 * v * v * u * area,
        "mu03": m[3, 0] - 3 * v * m02 + 2 * v * v * v * area,
    }
    return sums


@lru_cache(maxsize=64)
def _powers(n: int, middle: int) -> Reals:
    """Return the powers of n places from the middle, (n, 4)."""
    places = (np.arange(n)[:, None] - middle) ** np.arange(4)
    return places.astype(np.float32)
