"""Calibration boards and their description in one word.

A board is described as ``KIND:COLUMNSxROWS:...`` with lengths in mm:

================================================ =====================================
``chessboard:11x8:20``                           inner corners, side of a square
``charuco:12x9:20:15:DICT_5X5_100``              squares, their side, side of a marker,
                                                 dictionary of the markers
``circles:9x7:20:10``                            circles, their distance, diameter
``asymmetric-circles:4x11:20:10``                circles; each second row is set off by
                                                 the distance, and twice that apart
================================================ =====================================

The frame of a board has x along its rows, y down its columns and z away from whoever
looks at it; its origin is the middle of its points.
"""

import re
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property

import cv2
import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.errors import UsageError

MIN_SIDE, MAX_SIDE = 2, 100  # points or squares along a side
MAX_LENGTH = 10_000.0  # mm
FORMS = (
    "chessboard:11x8:20, charuco:12x9:20:15:DICT_5X5_100, circles:9x7:20:10, "
    "asymmetric-circles:4x11:20:10"
)
_LENGTH = r"(\d+(?:\.\d*)?|\.\d+)"
_FORM = (
    r"(?ai)(chessboard|charuco|circles|asymmetric-circles):(\d{1,3})x(\d{1,3})"
    rf":{_LENGTH}(?::{_LENGTH})?(?::(\w+))?"
)


class BoardKind(StrEnum):
    """Kinds of boards."""

    CHESSBOARD = "chessboard"
    CHARUCO = "charuco"
    CIRCLES = "circles"
    ASYMMETRIC_CIRCLES = "asymmetric-circles"

    @property
    def is_circles(self) -> bool:
        """Whether its points are the centres of discs."""
        return self in (BoardKind.CIRCLES, BoardKind.ASYMMETRIC_CIRCLES)

    @property
    def has_markers(self) -> bool:
        """Whether its points are numbered."""
        return self is BoardKind.CHARUCO


@dataclass(frozen=True)
class Board:
    """A flat board with known points."""

    kind: BoardKind
    # `columns`, `rows`: inner corners of a chessboard, else squares, circles.
    columns: int
    rows: int
    # Side of a square, or distance of the circles (half of that within a row, if they
    # are asymmetric), mm
    pitch: float
    # Side of a marker, or diameter of the circles, mm; 0 of a chessboard.
    detail: float = 0.0
    dictionary: str = ""  # marker dictionary, by its OpenCV name; empty without markers

    @property
    def name(self) -> str:
        """The description of the board."""
        parts = [self.kind.value, f"{self.columns}x{self.rows}", f"{self.pitch:g}"]
        if self.kind is not BoardKind.CHESSBOARD:
            parts.append(f"{self.detail:g}")
        return ":".join([*parts, self.dictionary] if self.dictionary else parts)

    @cached_property
    def points(self) -> FloatArray:
        """Points in the frame of the board, (N, 3), mm; only to be read."""
        grid = self._grid
        points = np.zeros((len(grid), 3))
        points[:, :2] = grid - 0.5 * (grid.min(axis=0) + grid.max(axis=0))
        points.flags.writeable = False
        return points

    @property
    def n_points(self) -> int:
        """Number of points."""
        return len(self.points)

    @property
    def outline(self) -> FloatArray:
        """Corners of the rectangle round its points, (4, 3), mm, one after another."""
        x, y = np.abs(self.points[:, :2]).max(axis=0)
        return np.array([[-x, -y, 0.0], [x, -y, 0.0], [x, y, 0.0], [-x, y, 0.0]])

    @property
    def orders(self) -> tuple[IntArray, ...]:
        """Numbers of the points for each turn that looks the same, itself first."""
        numbers = np.arange(self.n_points)
        if self.kind not in (BoardKind.CHESSBOARD, BoardKind.CIRCLES):
            return (numbers,)
        turned = [numbers, numbers[::-1]]
        if self.columns == self.rows:
            quarter = np.rot90(numbers.reshape(self.rows, self.columns)).ravel()
            turned += [quarter, quarter[::-1]]
        return tuple(turned)

    @property
    def _grid(self) -> FloatArray:
        """Points from the first one on, (N, 2), mm, in the order they are found in."""
        if self.kind is BoardKind.ASYMMETRIC_CIRCLES:
            lattice = _lattice(self.columns, self.rows)
            lattice[:, 0] = 2 * lattice[:, 0] + lattice[:, 1] % 2
            return np.asarray(self.pitch * lattice)
        fewer = 1 if self.kind.has_markers else 0
        return np.asarray(
            self.pitch * _lattice(self.columns - fewer, self.rows - fewer)
        )


def marker_dictionary(board: Board) -> cv2.aruco.Dictionary:
    """Return the markers of a board that has some."""
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))


def parse_board(text: str) -> Board:
    """Parse a board, see the module for the forms; `UsageError` if it is invalid."""
    parts = re.fullmatch(_FORM, text.strip())
    kind = BoardKind(parts[1].casefold()) if parts else None
    n_details = {BoardKind.CHESSBOARD: 0, BoardKind.CHARUCO: 2}
    details = [part for part in parts.groups()[4:] if part] if parts else []
    if parts is None or kind is None or len(details) != n_details.get(kind, 1):
        raise UsageError("board.form", text=text, forms=FORMS)
    columns, rows, pitch, detail = int(parts[2]), int(parts[3]), parts[4], parts[5]
    dictionary = (parts[6] or "").upper()
    board = Board(kind, columns, rows, float(pitch), float(detail or 0), dictionary)
    _check(board, text)
    return board


def _check(board: Board, text: str) -> None:
    """Refuse impossible numbers."""
    if not all(MIN_SIDE <= n <= MAX_SIDE for n in (board.columns, board.rows)):
        raise UsageError(
            "board.size",
            text=text,
            columns=board.columns,
            rows=board.rows,
            least=MIN_SIDE,
            most=MAX_SIDE,
        )
    nearest = 2**0.5 if board.kind is BoardKind.ASYMMETRIC_CIRCLES else 1.0
    is_smaller = board.detail < nearest * board.pitch
    has_detail = board.detail > 0 or board.kind is BoardKind.CHESSBOARD
    if not (0 < board.pitch <= MAX_LENGTH and has_detail and is_smaller):
        raise UsageError("board.lengths", text=text)
    if not board.kind.has_markers:
        return
    if not board.dictionary.startswith("DICT_") or not hasattr(
        cv2.aruco, board.dictionary
    ):
        raise UsageError("board.dictionary", text=text)
    known = len(marker_dictionary(board).bytesList)
    needed = board.columns * board.rows // 2
    if needed > known:
        raise UsageError(
            "board.markers",
            text=text,
            needed=needed,
            dictionary=board.dictionary,
            known=known,
        )


def _lattice(columns: int, rows: int) -> FloatArray:
    """Return the points of a lattice row by row, (columns rows, 2)."""
    x, y = np.meshgrid(np.arange(columns), np.arange(rows))
    return np.stack([x.ravel(), y.ravel()], axis=-1).astype(np.float64)
