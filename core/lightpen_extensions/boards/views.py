"""Views of a board by cameras."""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.messages import Message, message
from lightpen_extensions.boards.boards import Board

SAME = 0.002  # of the image's longer side: distance of the points, rms
COMMON = 0.8  # of the points of the view that shows fewer
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
        names = np.array(self.names)[which].tolist()
        return Views(self.board, tuple(names), self.pixels[which], self.image_sizes)

    def of_camera(self, camera: int) -> "Views":
        """Return the views in which one camera saw the board."""
        own = Views(
            self.board,
            self.names,
            self.pixels[:, camera : camera + 1],
            (self.image_sizes[camera],),
        )
        return own.chosen(own.found[:, 0])


def without_duplicates(views: Views) -> tuple[Views, tuple[str, ...]]:
    """Return the views in which the board is somewhere else, and the others' names.

    What views of one place share (pixels, hang of the board, blur, shadows) is the same
    in all of them: more of them add no information on the camera.
    """
    kept: list[int] = []
    scale = SAME * np.array([max(size) for size in views.image_sizes])
    for v in range(views.n_views):
        if not any(_is_same(views.pixels[v], views.pixels[k], scale) for k in kept):
            kept.append(v)
    which = np.zeros(views.n_views, dtype=np.bool_)
    which[kept] = True
    return views.chosen(which), tuple(np.array(views.names)[~which].tolist())


def message_on_duplicates(n_views: int, names: tuple[str, ...]) -> Message:
    """Return the message on the named views that do not count; ``n_views`` do."""
    return message(
        "intrinsics.duplicates",
        n_duplicates=len(names),
        n_views=n_views,
        names=listed_names(names),
    )


def _is_same(one: FloatArray, other: FloatArray, scale: FloatArray) -> bool:
    """Return whether all cameras see the points (C, N, 2) at the same places."""
    squares = np.square(one - other).sum(axis=-1)
    common = np.isfinite(squares)
    n_seen = np.isfinite(one[..., 0]).sum(axis=-1)
    n_other = np.isfinite(other[..., 0]).sum(axis=-1)
    if np.any((n_seen > 0) != (n_other > 0)):
        return False
    n_common = common.sum(axis=-1)
    if np.any(n_common < COMMON * np.minimum(n_seen, n_other)):
        return False
    sums = np.where(common, squares, 0.0).sum(axis=-1)
    return bool(np.all(sums <= scale**2 * n_common))
