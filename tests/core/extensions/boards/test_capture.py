"""Tests of keeping views of a board that is held before a camera."""

from collections.abc import Callable

import cv2
import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.model.camera import Camera
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.boards.boards import Board, parse_board
from lightpen_extensions.boards.calibration import calibrate_camera
from lightpen_extensions.boards.distortion import map_uncertainty
from lightpen_extensions.boards.observing import (
    STILL_TIME,
    BoardVisibility,
    Capture,
    Views,
)
from lightpen_extensions.boards.wanted_views import VIEWS, wanted_outline

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


@pytest.mark.parametrize("word", ["chessboard:9x6:20", "circles:5x5:20:10"])
def test_views_are_wanted_within_the_image_and_reach_its_corners(word: str) -> None:
    board = parse_board(word)
    wanted = np.stack([wanted_outline(board, SIZE, n) for n in range(len(VIEWS))])

    assert np.all((wanted >= 0) & (wanted <= np.array(SIZE) - 1))
    corners = np.array([[0, 0], [639, 0], [639, 479], [0, 479]])
    apart = np.linalg.norm(wanted[..., None, :] - corners, axis=-1)
    assert np.all(apart.min(axis=(0, 1)) < 0.15 * 639)
    again = wanted_outline(board, SIZE, len(VIEWS))
    np.testing.assert_array_equal(again, wanted[0])


def test_the_wanted_views_determine_a_camera(camera: Camera) -> None:
    board = parse_board("chessboard:9x6:20")
    rng = np.random.default_rng(1)
    poses = [held_as(camera, board, n) for n in range(len(VIEWS))]
    pixels = np.stack([camera.project(board.points @ R.T + t) for R, t in poses])
    pixels = pixels[:, None] + rng.normal(0, 0.05, (len(VIEWS), 1, 54, 2))
    found = calibrate_camera(Views(board, tuple("abcdefghijklmno"), pixels, (SIZE,)))

    assert found.camera.covariance is not None
    assert not found.remarks
    assert map_uncertainty(camera, found.camera.covariance).worst < 0.5


def held_as(camera: Camera, board: Board, n: int) -> tuple[FloatArray, FloatArray]:
    """Return the pose of a board whose outline is where it is wanted."""
    rays = camera.unproject(wanted_outline(board, SIZE, n))[:, None]
    turns, shift = cv2.solvePnP(
        board.outline, rays, np.eye(3), np.zeros(5), flags=cv2.SOLVEPNP_IPPE
    )[1:]
    return rotation_from_vector(np.ravel(turns)), np.ravel(shift).astype(np.float64)
