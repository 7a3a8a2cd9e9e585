"""Brightness of the squares of a chessboard between its corners."""

import cv2
import numpy as np
import numpy.typing as npt

from lightpen.arrays import FloatArray

SEEN_IN = 0.2  # of a square to each side of its middle
TELLING = 0.1  # of the most contrast of two squares
NEARLY_ALL = 0.8  # of the squares beside each other


def is_chequered(grey: npt.NDArray[np.uint8], grid: FloatArray) -> bool:
    """Return whether the squares between corners are black and white in turn.

    The corners ``grid`` (R, C, 2), px, are candidates. Where light blinds the camera,
    or none falls, squares tell nothing.
    """
    seen = _samples(grey, grid)
    if not np.isfinite(seen).all():
        return False
    shade, darkest, brightest = seen.mean(axis=0), seen.min(axis=0), seen.max(axis=0)
    turns = _turns(shade)
    if np.sum(turns * (shade - shade.mean())) < 0:
        turns = -turns
    steps, are_clear = [], []
    for axis in (0, 1):
        sign, light, low, high = (
            np.moveaxis(each, axis, 0) for each in (turns, shade, darkest, brightest)
        )
        is_bright = sign[:-1] > 0
        clear = np.where(is_bright, low[:-1] > high[1:], low[1:] > high[:-1])
        steps.append(np.abs(light[:-1] - light[1:]).ravel())
        are_clear.append(clear.ravel())
    contrast, clear = np.concatenate(steps), np.concatenate(are_clear)
    telling = contrast > TELLING * contrast.max()
    return bool(clear[telling].mean() >= NEARLY_ALL)


def is_first_dark(grey: npt.NDArray[np.uint8], grid: FloatArray) -> bool:
    """Return whether the square beside the first corner is a dark one.

    The parameters are as of `is_chequered`.
    """
    shade = _samples(grey, grid).mean(axis=0)
    return bool(np.sum(_turns(shade) * (shade - shade.mean())) < 0)


def _turns(shade: FloatArray) -> FloatArray:
    """Return 1 and -1 in turn, 1 at the first square."""
    return np.where(np.indices(shade.shape).sum(axis=0) % 2 == 0, 1.0, -1.0)


def _samples(grey: npt.NDArray[np.uint8], grid: FloatArray) -> FloatArray:
    """Return the light at 5 places of each square, NaN out of the image."""
    corners = np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]])
    middles = corners.mean(axis=0)
    places = np.concatenate([middles[None], middles + SEEN_IN * (corners - middles)])
    height, width = grey.shape
    inside = ((places >= 0) & (places <= np.array([width, height]) - 1)).all(axis=-1)
    x, y = np.moveaxis(places.reshape(-1, 1, 2).astype(np.float32), -1, 0)
    light = cv2.remap(grey, x, y, cv2.INTER_LINEAR).astype(np.float64)
    light = light.reshape(places.shape[:-1])
    return np.where(inside.all(axis=0), light, np.nan)
