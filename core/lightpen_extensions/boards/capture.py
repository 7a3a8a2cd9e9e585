"""Automatic capture of views: of a board held still, in a new pose."""

from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from lightpen.arrays import FloatArray
from lightpen_extensions.boards.boards import Board
from lightpen_extensions.boards.views import Views

STILL = 0.0015  # of the image's longer side, between detections, rms
STILL_TIME = 0.4  # s
NEW = 0.05  # of the image's longer side, from each captured view, rms
MAX_VIEWS = 60


class BoardVisibility(StrEnum):
    """Visibility of the board in the newest image."""

    UNSEEN = "unseen"
    MOVING = "moving"
    STILL = "still"
    KEPT = "kept"
    ALIKE = "alike"


@dataclass(frozen=True, eq=False)
class Capture:
    """Captured views, and the last detection of the board."""

    board: Board
    image_size: tuple[int, int]
    kept: tuple[FloatArray, ...] = ()  # each (N, 2), px
    # (N, 2), in the newest image; None where it is not seen.
    points: FloatArray | None = None
    still_since: float = 0.0  # s, on the clock of the images
    sight: BoardVisibility = BoardVisibility.UNSEEN

    def after(self, points: FloatArray | None, time_s: float) -> "Capture":
        """Return the capture after another image, which is added if still and new."""
        if points is None:
            return replace(self, points=None, sight=BoardVisibility.UNSEEN)
        longer = max(self.image_size)
        if self.points is None or _apart(self.points, points) > STILL * longer:
            moved = replace(self, points=points, still_since=time_s)
            return replace(moved, sight=BoardVisibility.MOVING)
        seen = replace(self, points=points)
        if any(_apart(each, points) < NEW * longer for each in self.kept):
            is_last = self.sight is BoardVisibility.KEPT
            return replace(
                seen, sight=BoardVisibility.KEPT if is_last else BoardVisibility.ALIKE
            )
        if time_s - self.still_since < STILL_TIME or len(self.kept) >= MAX_VIEWS:
            return replace(seen, sight=BoardVisibility.STILL)
        return replace(seen, kept=(*self.kept, points), sight=BoardVisibility.KEPT)

    @property
    def views(self) -> Views:
        """The captured views."""
        names = tuple(str(number) for number in range(1, len(self.kept) + 1))
        pixels = np.full((len(self.kept), 1, self.board.n_points, 2), np.nan)
        for v, points in enumerate(self.kept):
            pixels[v, 0] = points
        return Views(self.board, names, pixels, (self.image_size,))


def _apart(one: FloatArray, other: FloatArray) -> float:
    """Return the distance between two detections of a board, px rms."""
    squares = np.square(one - other).sum(axis=-1)
    if not np.isfinite(squares).any():
        return np.inf
    return float(np.sqrt(np.nanmean(squares)))
