"""Tests of boards and of the words that name them."""

import cv2
import numpy as np
import pytest

from lightpen.errors import UsageError
from lightpen_extensions.boards.boards import BoardKind, marker_dictionary, parse_board

WORDS = (
    "chessboard:11x8:20",
    "charuco:12x9:20:15:DICT_5X5_100",
    "circles:9x7:20:10",
    "asymmetric-circles:4x11:20:10",
)


@pytest.mark.parametrize("word", WORDS)
def test_a_board_is_reported_by_the_word_that_names_it(word: str) -> None:
    assert parse_board(word).name == word


@pytest.mark.parametrize(
    ("word", "n_points"), list(zip(WORDS, (88, 88, 63, 44), strict=True))
)
def test_a_board_has_as_many_points_as_are_found(word: str, n_points: int) -> None:
    board = parse_board(word)

    assert board.points.shape == (n_points, 3)
    np.testing.assert_allclose(board.points.max(axis=0), -board.points.min(axis=0))


def test_points_of_charuco_are_those_of_opencv() -> None:
    charuco = parse_board(WORDS[1])
    theirs = cv2.aruco.CharucoBoard((12, 9), 20, 15, marker_dictionary(charuco))
    corners = np.asarray(theirs.getChessboardCorners())

    np.testing.assert_allclose(
        charuco.points - charuco.points[0], corners - corners[0], atol=1e-4
    )


@pytest.mark.parametrize(
    ("word", "complaint"),
    [
        ("chessboard", "is not a board."),
        ("checkers:9x6:20", "is not a board."),
        ("chessboard:9x6:twenty", "is not a board."),
        ("charuco:9x6:20:15", "is not a board."),
        ("markers:5x7:30:6:DICT_6X6_250", "is not a board."),
        ("chessboard:9x1:20", "9 x 1"),
        ("chessboard:9x6:0", "are not valid"),
        ("charuco:9x6:20:15:DICT_NONE", "unknown dictionary"),
        ("charuco:20x20:20:15:DICT_4X4_50", "needs 200 markers"),
    ],
)
def test_a_board_that_cannot_be_is_refused(word: str, complaint: str) -> None:
    with pytest.raises(UsageError, match=complaint):
        parse_board(word)


def test_a_square_chessboard_looks_the_same_in_four_turns() -> None:
    board = parse_board("chessboard:7x7:20")

    assert len(board.orders) == 4
    for order in board.orders:
        turned = board.points[order, :2]
        steps = np.diff(turned.reshape(7, 7, 2), axis=1)
        np.testing.assert_allclose(steps, np.broadcast_to(steps[0, 0], steps.shape))


def test_a_marked_board_looks_the_same_in_no_other_turn() -> None:
    assert len(parse_board(WORDS[1]).orders) == 1
    assert parse_board(WORDS[1]).kind is BoardKind.CHARUCO
