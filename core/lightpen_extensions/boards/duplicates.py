"""Detection of repeated board positions, which count once.

What such views share (where the points lie on the pixels, how the board hangs, blur and
shadows) is the same in all of them, so more of them add no information on the camera.
"""

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.messages import Message, message
from lightpen_extensions.boards.views import Views, listed_names

SAME = 0.002  # of the image's longer side: distance of the points, rms
COMMON = 0.8  # of the points of the view that shows fewer


def without_duplicates(views: Views) -> tuple[Views, tuple[str, ...]]:
    """Return the views in which the board is somewhere else, and the others' names."""
    kept: list[int] = []
    scale = SAME * np.array([max(size) for size in views.image_sizes])
    for v in range(views.n_views):
        if not any(_is_same(views.pixels[v], views.pixels[k], scale) for k in kept):
            kept.append(v)
    which = np.zeros(views.n_views, dtype=np.bool_)
    which[kept] = True
    others = tuple(
        name for name, keep in zip(views.names, which, strict=True) if not keep
    )
    return views.chosen(which), others


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
