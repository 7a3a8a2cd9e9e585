"""Tests of keeping views of a board that is held before a camera."""

from collections.abc import Callable

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.intrinsics.boards import parse_board
from lightpen.intrinsics.capture import (
    STILL_TIME,
    BoardVisibility,
    Capture,
    wanted_outline,
)
from lightpen.intrinsics.views import Views

MakeViews = Callable[..., Views]
SIZE = (640, 480)


@pytest.fixture
def capture() -> Capture:
    return Capture(parse_board("chessboard:9x6:20"), SIZE)


def held(capture: Capture, points: FloatArray, begin: float = 0.0) -> Capture:
    """Return the capture after the board was held still for long enough."""
    for time_s in begin + STILL_TIME * np.array([0.0, 0.5, 1.1]):
        capture = capture.after(points, float(time_s))
    return capture


def test_a_board_held_still_is_kept_once(
    capture: Capture, make_views: MakeViews
) -> None:
    points = make_views(n_views=1).pixels[0, 0]
    kept = held(capture, points)
    later = held(kept, points, 1.0)

    assert kept.sight is BoardVisibility.KEPT
    assert len(later.kept) == 1


def test_a_moving_board_is_not_kept(capture: Capture, make_views: MakeViews) -> None:
    points = make_views(n_views=1).pixels[0, 0]
    for step in range(20):
        capture = capture.after(points + 3.0 * step, 0.1 * step)

    assert capture.sight is BoardVisibility.MOVING
    assert not capture.kept


def test_a_view_like_one_that_was_kept_is_not_kept(
    capture: Capture, make_views: MakeViews
) -> None:
    first, second = make_views(n_views=2).pixels[:, 0]
    both = held(held(capture, first), second, 1.0)
    for points, begin in ((first, 2.0), (second, 3.0)):
        again = held(both, points + 8.0, begin)

        assert again.sight is BoardVisibility.ALIKE
        assert len(again.kept) == 2


def test_a_board_that_has_just_come_to_rest_is_not_kept_yet(
    capture: Capture, make_views: MakeViews
) -> None:
    first, second = make_views(n_views=2).pixels[:, 0]
    moved = held(capture, first).after(second, 10.0)
    still = moved.after(second, 10.0 + 0.5 * STILL_TIME)

    assert (moved.sight, still.sight) == (BoardVisibility.MOVING, BoardVisibility.STILL)
    assert len(still.kept) == 1


def test_a_board_that_is_not_seen_is_said_to_be_so(capture: Capture) -> None:
    assert capture.after(None, 0.0).sight is BoardVisibility.UNSEEN


def test_points_that_were_not_seen_are_none_of_the_view(
    capture: Capture, make_views: MakeViews
) -> None:
    points = make_views(n_views=1).pixels[0, 0].copy()
    points[:9] = np.nan

    assert held(capture, points).views.seen.sum() == 45


def test_the_board_is_wanted_within_the_image_from_the_first_view_on(
    capture: Capture, make_views: MakeViews
) -> None:
    views = make_views(n_views=7)
    for v in range(8):
        outline = wanted_outline(capture)
        assert np.all((outline >= 0) & (outline < SIZE))
        if v < 7:
            capture = held(capture, views.pixels[v, 0], 10.0 * v)
    assert len(capture.kept) == 7
    assert (capture.cells > 0).any()
