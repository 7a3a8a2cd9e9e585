"""Views of a board by cameras."""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen_extensions.boards.boards import Board

SHOWN = 6  # names in a message


def listed_names(names: tuple[str, ...]) -> str:
    """Return the first names of views as text."""
    return ", ".join(names[:SHOWN]) + (" ..." if len(names) > SHOWN else "")


@dataclass(frozen=True, eq=False)
class Views:
    """The points of a board in V views of C cameras."""

    board: Board
    names: tuple[str, ...]  # one a view
    pixels: FloatArray  # (V, C, N, 2), px; NaN where a point was not seen
    image_sizes: tuple[tuple[int, int], ...]  # width and height, one a camera, px

    @property
    def n_views(self) -> int:
        """Number of views."""
        return len(self.names)

    @property
    def seen(self) -> BoolArray:
        """Mask of the visible points, (V, C, N)."""
        return np.asarray(np.isfinite(self.pixels).all(axis=-1))

    @property
    def found(self) -> BoolArray:
        """Which views each camera saw the board in, (V, C)."""
        return np.asarray(self.seen.any(axis=-1))

    def chosen(self, which: BoolArray) -> "Views":
        """Return some of the views."""
        names = tuple(
            name for name, keep in zip(self.names, which, strict=True) if keep
        )
        return Views(self.board, names, self.pixels[which], self.image_sizes)

    def of_camera(self, camera: int) -> "Views":
        """Return the views in which one camera saw the board."""
        own = Views(
            self.board,
            self.names,
            self.pixels[:, camera : camera + 1],
            (self.image_sizes[camera],),
        )
        return own.chosen(own.found[:, 0])
