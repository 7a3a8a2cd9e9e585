"""Tests of printed boards: what is drawn is read back and looked at."""

import re

import cv2
import numpy as np
import pytest

from lightpen.arrays import Image
from lightpen.errors import UsageError
from lightpen.intrinsics.boards import parse_board
from lightpen.intrinsics.page import POINTS_A_MM, board_page
from lightpen.intrinsics.sightings import find_points

SCALE = 3  # px/mm
WORDS = (
    "chessboard:8x5:20",
    "charuco:7x5:20:15:DICT_5X5_100",
    "circles:7x5:20:12",
    "asymmetric-circles:4x9:15:14",
)


def drawn(page: bytes) -> Image:
    """Return what a page shows, drawn from the areas that it fills."""
    text = page.decode("ascii")
    box = re.search(r"/MediaBox \[0 0 ([\d.]+) ([\d.]+)\]", text)
    shift = re.search(r"1 0 0 -1 ([\d.]+) ([\d.]+) cm", text)
    assert box is not None
    assert shift is not None
    width, height = (float(n) / POINTS_A_MM for n in box.groups())
    left, up = map(float, shift.groups())
    image = np.full((round(SCALE * height), round(SCALE * width)), 255, np.uint8)
    for area in re.findall(r"^([-\d. ]+) re f$", text, re.MULTILINE):
        x, y, w, h = map(float, area.split())
        corners = [(left + x, height - up + y), (left + x + w, height - up + y + h)]
        (x1, y1), (x2, y2) = (
            np.round(SCALE * np.array(c)).astype(int) for c in corners
        )
        image[y1:y2, x1:x2] = 0
    for circle in re.findall(r"^([-\d.]+ [-\d.]+) m (.+) f$", text, re.MULTILINE):
        x, y = map(float, circle[0].split())
        curve = np.array(re.findall(r"[-\d.]+", circle[1]), dtype=float).reshape(-1, 6)
        r = 0.5 * (x - curve[:, 4].min())
        center = np.array([left + x - r, height - up + y])
        at = tuple(np.round(SCALE * center * 16).astype(int).tolist())
        cv2.circle(image, at, round(SCALE * r * 16), 0, -1, cv2.LINE_AA, 4)
    return image


@pytest.mark.parametrize("word", WORDS)
def test_a_printed_board_is_found_at_true_scale(word: str) -> None:
    board = parse_board(word)
    points = find_points(drawn(board_page(board)), board)

    assert points is not None
    assert np.isfinite(points).all()
    printed, made = points[[0, -1]] / SCALE, board.points[[0, -1], :2]
    assert np.linalg.norm(np.diff(printed, axis=0)) == pytest.approx(
        np.linalg.norm(np.diff(made, axis=0)), abs=0.1
    )


def test_the_places_of_objects_are_those_of_the_table() -> None:
    page = board_page(parse_board(WORDS[0]))
    begin = int(page.split(b"startxref\n")[1].split(b"\n")[0])
    table = page[begin:].split(b"\n")[3:8]

    assert page[begin:].startswith(b"xref")
    for number, entry in enumerate(table, 1):
        assert page[int(entry[:10]) :].startswith(b"%d 0 obj" % number)


def test_the_smallest_paper_is_taken() -> None:
    assert b"/MediaBox [0 0 595.2756 841.8898]" in board_page(parse_board(WORDS[0]))


def test_a_board_larger_than_the_paper_is_refused() -> None:
    with pytest.raises(UsageError, match="260 x 200 mm"):
        board_page(parse_board("chessboard:12x9:20"), "A4")
