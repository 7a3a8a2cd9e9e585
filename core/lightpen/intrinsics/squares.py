"""Extent of a chessboard beyond the corners that were found.

A search finds as many corners as requested, or stops where it loses its way; the
squares beyond tell whether that was the whole board. From the outermost corners on the
next ones are where the rows lead. They are inner corners of the board if the squares
beyond them are black and white in turn, too; where all of those are white, that is the
rim of the board.
"""

from dataclasses import dataclass
from enum import Enum, auto
from itertools import pairwise

import cv2
import numpy as np
import numpy.typing as npt

from lightpen.arrays import FloatArray

SEEN_IN = 0.2  # of a square to each side of its middle
CLEAR = 0.4  # of the half contrast, by which a square is darker or brighter than grey
TELLING = 0.1  # of the most contrast of two squares
NEARLY_ALL = 0.8  # of the squares beside each other
MIN_STEP = 4.0  # px of a square
MOST = 100  # corners along a side
PLACED = 0.3  # of a square to each side, for the gradients of a corner
REFINING = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 30, 0.01)


class _Beyond(Enum):
    """Squares beyond the outermost corners."""

    SQUARES = auto()
    RIM = auto()
    UNKNOWN = auto()  # out of the image, hidden, or dark


@dataclass(frozen=True)
class CornerCount:
    """Number of visible inner corners of a chessboard."""

    # `columns` and `rows`: the larger number first.
    columns: int
    rows: int
    is_whole: bool  # whether the rim is seen all round; else there may be more


def is_chequered(grey: npt.NDArray[np.uint8], grid: FloatArray) -> bool:
    """Return whether the squares between corners are black and white in turn.

    The corners ``grid`` (R, C, 2), px, are candidates. Where light blinds the camera,
    or none falls, squares tell nothing.
    """
    seen = np.stack([_samples(grey, *rows) for rows in pairwise(grid)])
    if not np.isfinite(seen).all():
        return False
    shade, darkest, brightest = (of(seen, axis=1) for of in (np.mean, np.min, np.max))
    turns = np.where(np.indices(shade.shape).sum(axis=0) % 2 == 0, 1.0, -1.0)
    if np.sum(turns * (shade - shade.mean())) < 0:
        turns = -turns
    steps, are_clear = [], []
    for axis in (0, 1):
        size = shade.shape[axis]
        one, other = np.arange(size - 1), np.arange(1, size)
        first, second = (
            [np.take(of, at, axis=axis) for of in (turns, shade, darkest, brightest)]
            for at in (one, other)
        )
        step = first[0] * (first[1] - second[1])
        clear = np.where(first[0] > 0, first[2] > second[3], second[2] > first[3])
        steps.append(np.abs(step).ravel())
        are_clear.append(clear.ravel())
    contrast, clear = np.concatenate(steps), np.concatenate(are_clear)
    telling = contrast > TELLING * contrast.max()
    return bool(clear[telling].mean() >= NEARLY_ALL)


def is_first_dark(grey: npt.NDArray[np.uint8], grid: FloatArray) -> bool:
    """Return whether the square beside the first corner is a dark one.

    The parameters are as of `is_chequered`.
    """
    shade = np.stack([_shades(grey, *rows) for rows in pairwise(grid)])
    turns = np.where(np.indices(shade.shape).sum(axis=0) % 2 == 0, 1.0, -1.0)
    return bool(np.sum(turns * (shade - shade.mean())) < 0)


def goes_on(grey: npt.NDArray[np.uint8], grid: FloatArray) -> bool:
    """Return whether a chessboard extends beyond the corners ``grid`` (R, C, 2), px."""
    return any(_beyond(grey, side) is _Beyond.SQUARES for side in _sides(grid))


def count_from(grey: npt.NDArray[np.uint8], grid: FloatArray) -> CornerCount:
    """Count the inner corners of a chessboard, from a part on that was found.

    The parameters are as of `goes_on`.
    """
    ends = 0
    while ends < 4 and max(grid.shape[:2]) < MOST:
        beyond = _beyond(grey, grid)
        if beyond is _Beyond.SQUARES:
            grid, ends = np.concatenate([grid, _placed(grey, grid)[None]]), 0
        else:
            grid, ends = np.rot90(grid), ends + 1
    is_whole = all(_beyond(grey, side) is _Beyond.RIM for side in _sides(grid))
    rows, columns = sorted(grid.shape[:2])
    return CornerCount(columns, rows, is_whole)


def _sides(grid: FloatArray) -> list[FloatArray]:
    """Return a grid turned so that each of its sides is the last row once."""
    return [np.rot90(grid, turns) for turns in range(4)]


def _next_row(grid: FloatArray) -> FloatArray:
    """Return the predicted next row, (C, 2)."""
    if len(grid) < 3:
        return np.asarray(2 * grid[-1] - grid[-2])
    return np.asarray(3 * grid[-1] - 3 * grid[-2] + grid[-3])


def _placed(grey: npt.NDArray[np.uint8], grid: FloatArray) -> FloatArray:
    """Return the next row, placed by the gradients round its corners."""
    row = _next_row(grid)
    step = float(np.linalg.norm(row - grid[-1], axis=1).min())
    half = max(round(PLACED * step), 1)
    height, width = grey.shape
    if (row < half + 1).any() or (row > np.array([width, height]) - half - 2).any():
        return row
    start = row.astype(np.float32)[:, None].copy()
    moved = cv2.cornerSubPix(grey, start, (half, half), (-1, -1), REFINING)[:, 0]
    is_near = np.linalg.norm(moved - row, axis=1) < half
    return np.where(is_near[:, None], moved, row)


def _beyond(grey: npt.NDArray[np.uint8], grid: FloatArray) -> _Beyond:
    """Return the squares beyond the last row of a grid."""
    one = _next_row(grid)
    other = _next_row(np.concatenate([grid, one[None]]))
    if np.linalg.norm(one - grid[-1], axis=1).min() < MIN_STEP:
        return _Beyond.UNKNOWN
    before = _shades(grey, grid[-2], grid[-1])
    outermost, after = _shades(grey, grid[-1], one), _shades(grey, one, other)
    # Each square by those beside and before it, as light is uneven.
    middle, half = 0.5 * (before + outermost), 0.5 * np.abs(before - outermost)
    is_dark = outermost > before  # expected of the squares beyond
    if not np.isfinite(after).all() or not np.isfinite(middle).all():
        return _Beyond.UNKNOWN
    level = (after - middle) / np.maximum(half, 1.0)
    if np.all(np.where(is_dark, -level, level) > CLEAR):
        return _Beyond.SQUARES
    return _Beyond.RIM if np.all(level > CLEAR) else _Beyond.UNKNOWN


def _shades(
    grey: npt.NDArray[np.uint8], one: FloatArray, other: FloatArray
) -> FloatArray:
    """Return how bright the squares between two rows are, NaN out of the image."""
    return np.asarray(_samples(grey, one, other).mean(axis=0))


def _samples(
    grey: npt.NDArray[np.uint8], one: FloatArray, other: FloatArray
) -> FloatArray:
    """Return the light in the squares between two rows, (5, C - 1), NaN likewise."""
    corners = np.stack([one[:-1], one[1:], other[1:], other[:-1]])
    middles = corners.mean(axis=0)
    places = np.concatenate([middles[None], middles + SEEN_IN * (corners - middles)])
    height, width = grey.shape
    inside = ((places >= 0) & (places <= np.array([width, height]) - 1)).all(axis=-1)
    x, y = np.moveaxis(places.astype(np.float32), -1, 0)
    light = cv2.remap(grey, x, y, cv2.INTER_LINEAR).astype(np.float64)
    return np.where(inside.all(axis=0), light, np.nan)
