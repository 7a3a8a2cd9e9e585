"""Views vary enough: over the image, in size and in skew."""

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.intrinsics.boards import parse_board
from lightpen.intrinsics.view_progress import ViewProgress, view_progress
from lightpen.intrinsics.views import Views

BOARD = parse_board("chessboard:7x5:20")
SIZE = (1000, 800)


def seen(x: float, y: float, scale: float = 1.0, shear: float = 0.0) -> FloatArray:
    """The board about a place in the image, px."""
    points = BOARD.points[:, :2] * scale
    points = points + np.outer(points[:, 1], [shear, 0.0])
    return np.asarray(points + np.array([x, y]))


def is_enough(found: ViewProgress) -> bool:
    return min(found.x, found.y, found.size, found.skew) >= 1.0


def progress(*pixels: FloatArray) -> ViewProgress:
    names = tuple(str(v) for v in range(len(pixels)))
    return view_progress(Views(BOARD, names, np.stack(pixels)[:, None], (SIZE,)))


def test_one_view_shows_no_range_of_places() -> None:
    found = progress(seen(500, 400, 2.0))

    assert (found.x, found.y, found.skew) == pytest.approx((0, 0, 0), abs=1e-6)
    # 240 x 160 of 1000 x 800 px
    assert found.size == pytest.approx(np.sqrt(240 * 160 / 8e5) / 0.4)


def test_views_at_two_edges_complete_one_axis_only() -> None:
    found = progress(seen(120, 400), seen(880, 400))

    assert found.x == 1.0
    assert found.y == pytest.approx(0.0, abs=1e-9)
    assert not is_enough(found)


def test_views_at_all_edges_near_and_tilted_are_enough() -> None:
    near = seen(500, 400, 4.0)
    edges = [seen(120, 90), seen(880, 90), seen(120, 710), seen(880, 710)]

    assert not is_enough(progress(near, *edges))
    assert is_enough(progress(near, *edges, seen(500, 400, shear=0.5)))


def test_points_that_are_not_seen_do_not_count() -> None:
    part = seen(500, 400, 2.0)
    part[5:9] = np.nan

    assert progress(part).size == pytest.approx(progress(seen(500, 400, 2.0)).size)
