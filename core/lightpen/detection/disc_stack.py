"""Discs that stand alone, measured all at once as one stack of windows."""

from collections.abc import Sequence

import cv2
import numpy as np
import numpy.typing as npt

from lightpen.arrays import BoolArray, FloatArray, Image, IntArray
from lightpen.detection.disc_moments import (
    BESIDE,
    LOW_SIGMAS,
    MARGIN,
    MAX_LOW,
    MIN_RAMP,
    MIN_SIGMAS,
    Disc,
    Levels,
    assessed,
    window_levels,
    with_start,
)
from lightpen.detection.pixel_box import PixelBox
from lightpen.detection.region_moments import HIGH, LOW, DiscMoments, moments_by_sums

LARGEST = 128  # px, of a region; larger ones are few
LARGER = 2.0  # times the usual size: others would make all windows large
NAMES = ["m00", "m10", "m01", "mu20", "mu11", "mu02", "mu30", "mu21", "mu12", "mu03"]


def measure_alone(
    image: Image, boxes: Sequence[PixelBox], level: float, noise: float
) -> list[Disc | None]:
    """Return the discs in boxes that hold one each, as `measure_disc` measures them.

    None where something else is near, or nothing is found.
    """
    found: list[Disc | None] = [None] * len(boxes)
    sizes = np.array([box.size for box in boxes])
    usual = float(np.median(sizes)) if len(boxes) else 0.0
    chosen = np.flatnonzero(sizes <= min(LARGEST, LARGER * usual))
    if len(chosen) < 2:
        return found
    side = int(sizes[chosen].max())
    side += 2 * (MARGIN + side // 10)
    ends = np.array([boxes[i] for i in chosen.tolist()])
    corners = (ends[:, :2] + ends[:, 2:] - side) // 2
    inside = (corners >= 0) & (corners + side <= image.shape[::-1])
    chosen, corners = chosen[inside.all(axis=1)], corners[inside.all(axis=1)]
    if len(chosen) < 2:
        return found
    # A dark row below each window separates it from the next.
    windows = np.zeros((len(chosen), side + 1, side), image.dtype)
    for window, (x, y) in zip(windows, corners.tolist(), strict=True):
        window[:-1] = image[y : y + side, x : x + side]
    levels = np.array([_own_levels(image, boxes[i], level) for i in chosen.tolist()])
    background, plateau = levels[:, 0], levels[:, 1]
    contrast = np.maximum(plateau - background, 1)
    foot = np.clip(LOW_SIGMAS * noise / contrast, LOW, MAX_LOW)
    low = np.rint(background + foot * contrast)
    high = np.maximum(background + HIGH * contrast, low + MIN_RAMP * contrast)
    light = windows.astype(np.float32)
    scaled = light - _of_each(low)
    scaled *= _of_each(255 / (high - low))
    soft = np.rint(np.clip(scaled, 0, 255, out=scaled), out=scaled).astype(np.uint8)
    regions, are_alone = _regions(soft)
    inner = cv2.erode(soft.reshape(-1, side), BESIDE).reshape(soft.shape) == 255
    layers = np.empty((4, *soft.shape), np.float32)
    layers[0], layers[1] = soft, inner
    np.multiply(light, inner, out=layers[2])
    light -= _of_each(background)
    np.multiply(light, soft > 0, out=layers[3])
    sums, inside, weighted, lit = _sums(layers)
    squares = np.einsum("nyx,nyx->n", layers[0], layers[0])
    sums["m00"] = np.maximum(sums["m00"], 1.0)
    left, top, ramp = corners[:, 0], corners[:, 1], (high - low) / contrast
    moments = moments_by_sums(sums, squares, left, top, ramp)
    frames = PixelBox(left, top, left + side, top + side)
    moments, are_whole, are_even, are_balanced = assessed(
        *(moments, inside, weighted, lit, frames, Levels(*levels.T), noise / contrast)
    )
    fit = are_alone & moments.are_enough & (contrast >= MIN_SIGMAS * noise)
    rows = np.stack(moments, axis=1).tolist()
    for k in np.flatnonzero(fit).tolist():
        x, y = corners[k].tolist()
        disc = Disc(
            DiscMoments(*rows[k]),
            Levels(*levels[k].tolist()),
            float(low[k]),
            PixelBox(*regions[k].tolist()).moved(x, y),
            is_whole=bool(are_whole[k]),
            is_even=bool(are_whole[k] & are_even[k]),
            is_balanced=bool(are_balanced[k]),
        )
        frame = PixelBox(x, y, x + side, y + side)
        disc = with_start(disc, soft[k], frame, float(ramp[k]), noise)
        if disc.is_whole or disc.rim is not None:
            found[chosen[k]] = disc
    return found


def _own_levels(image: Image, box: PixelBox, level: float) -> Levels:
    frame = box.grown(MARGIN + box.size // 10, image.shape)
    return window_levels(
        image[frame.top : frame.bottom, frame.left : frame.right], level
    )


def _of_each(values: FloatArray) -> npt.NDArray[np.float32]:
    return values.astype(np.float32)[:, None, None]


def _regions(soft: Image) -> tuple[IntArray, BoolArray]:
    """Return the boxes (N, 4) of light in windows, and whether each holds one region.

    Others show as gaps between columns or rows, or as light at the border.
    """
    ends, alone = [], np.ones(len(soft), dtype=bool)
    for axis in (1, 2):
        lit = soft.max(axis=axis) > 0
        first, beyond = lit.argmax(axis=1), lit.shape[1] - lit[:, ::-1].argmax(axis=1)
        alone &= (beyond - first == lit.sum(axis=1)) & (first > 0)
        alone &= beyond < soft.shape[2]
        ends.append((first, beyond))
    return np.stack([*ends[0], *ends[1]], axis=1)[:, [0, 2, 1, 3]], alone


def _sums(layers: npt.NDArray[np.float32]) -> list[dict[str, FloatArray]]:
    """Return the sums of windows (K, N, H, W), (N,), by layer."""
    height, side = layers.shape[2:]
    middle = side // 2  # from where powers stay small
    powers = np.arange(4)
    x = (np.arange(side)[:, None] - middle) ** powers
    y = (np.arange(height)[:, None] - middle) ** powers
    by_rows = layers @ x.astype(np.float32)
    m = (y.T.astype(np.float32) @ by_rows).astype(np.float64)  # [..., power of y, of x]
    m00 = m[..., 0, 0]
    amount = np.maximum(m00, 1e-9)
    u, v = m[..., 0, 1] / amount, m[..., 1, 0] / amount
    m20, m11, m02 = m[..., 0, 2], m[..., 1, 1], m[..., 2, 0]
    values = [
        m00,
        m[..., 0, 1] + middle * m00,
        m[..., 1, 0] + middle * m00,
        m20 - u * u * m00,
        m11 - u * v * m00,
        m02 - v * v * m00,
        m[..., 0, 3] - 3 * u * m20 + 2 * u**3 * m00,
        m[..., 1, 2] - 2 * u * m11 - v * m20 + 2 * u * u * v * m00,
        m[..., 2, 1] - 2 * v * m11 - u * m02 + 2 * v * v * u * m00,
        m[..., 3, 0] - 3 * v * m02 + 2 * v**3 * m00,
    ]
    return [
        {name: value[k] for name, value in zip(NAMES, values, strict=True)}
        for k in range(len(layers))
    ]
