"""Scale of a board, by a caliper on its print."""

from dataclasses import dataclass, replace

import numpy as np

from lightpen.errors import UsageError
from lightpen.intrinsics.boards import Board
from lightpen.messages import printable
from lightpen.model.expanded_uncertainty import COVERAGE_FACTOR

LARGEST_U = 0.05  # of the length
FARTHEST = 0.1  # of the stated length: more is another unit or a slip, no printer


@dataclass(frozen=True)
class ScaleCheck:
    """A length that was measured.

    Raises `UsageError` if the lengths are not above 0, U is more than a twentieth of
    the length, or a print is far from what was stated.
    """

    stated: float  # as the description of the board has it, mm
    measured: float  # mm
    expanded_uncertainty: float  # U (k = 2), mm

    def __post_init__(self) -> None:
        values = (self.stated, self.measured, self.expanded_uncertainty)
        is_plain = bool(np.isfinite(values).all()) and min(values) > 0
        if not is_plain or self.expanded_uncertainty > LARGEST_U * self.measured:
            raise UsageError(
                "board.scale-check",
                stated=self.stated,
                measured=self.measured,
                u=self.expanded_uncertainty,
            )
        off = abs(self.measured - self.stated)
        if off > FARTHEST * self.stated:
            raise UsageError(
                "board.scale-check-far", stated=self.stated, measured=self.measured
            )

    @property
    def sigma(self) -> float:
        """Relative standard uncertainty of all lengths of the board."""
        return self.expanded_uncertainty / COVERAGE_FACTOR / self.measured

    @classmethod
    def parse(cls, text: str) -> "ScaleCheck":
        """Return the check of a text: stated, measured, U, mm.

        Raises `UsageError` if it is none.
        """
        try:
            stated, measured, u = map(float, text.replace(";", " ").split())
        except ValueError as error:
            raise UsageError("board.scale-check-form", text=printable(text)) from error
        return cls(stated, measured, u)

    def scaled(self, board: Board) -> Board:
        """Return the board with its lengths as they were measured, mm."""
        factor = self.measured / self.stated
        return replace(board, pitch=factor * board.pitch, detail=factor * board.detail)
