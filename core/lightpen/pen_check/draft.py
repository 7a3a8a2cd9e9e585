"""The LEDs of a pen as they are typed, before they are a pen."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import FileError
from lightpen.formats.pen_files import LARGEST_DIAMETER, NORMAL_TOLERANCE
from lightpen.formats.tables import number_flaw
from lightpen.model.pen import Pen
from lightpen.pen_check.frame import FrameCheck, examine_frame, moved_into_frame

COLUMNS = ("x", "y", "z", "nx", "ny", "nz")
DECIMALS = 6  # of coordinates in mm, as they are shown
FACING = ("0", "0", "1")


@dataclass(frozen=True)
class CellFlaw:
    """A cell that holds no number.

    Attributes
    ----------
    row, column : int
        From 0; the columns are those of `COLUMNS`.
    text : str
        What is wrong with it, after LED and column.
    """

    row: int
    column: int
    text: str

    @property
    def sentence(self) -> str:
        """What is wrong, and where."""
        return f"LED {self.row + 1}, {COLUMNS[self.column]}: {self.text}"


@dataclass(frozen=True)
class PenDraft:
    """The cells of a pen, as text.

    Attributes
    ----------
    rows : tuple of tuple of six str
        Coordinates, mm, and normal of each LED.
    diameter : str
        Of the LED discs, mm.
    tip : tuple of three str
        Nominal tip, pen frame, mm; all empty if it is not known.
    name : str
    """

    rows: tuple[tuple[str, ...], ...] = ()
    diameter: str = ""
    tip: tuple[str, ...] = ("", "", "")
    name: str = ""

    @classmethod
    def of(cls, pen: Pen) -> Self:
        """Return the draft that shows a pen."""
        numbers = np.column_stack([pen.leds, pen.normals])
        tip = pen.nominal_tip
        return cls(
            rows=tuple(tuple(map(_text, row)) for row in numbers.tolist()),
            diameter=_text(pen.diameter),
            tip=("", "", "") if tip is None else tuple(map(_text, tip.tolist())),
            name=pen.name,
        )

    @property
    def n_leds(self) -> int:
        """Number of LEDs."""
        return len(self.rows)

    @property
    def has_normals(self) -> bool:
        """Whether any disc faces otherwise than +z."""
        return any(row[3:] != FACING for row in self.rows)

    def with_cell(self, row: int, column: int, text: str) -> Self:
        """Return the draft with another text in a cell."""
        cells = list(self.rows[row])
        cells[column] = text.strip()
        return replace(
            self, rows=(*self.rows[:row], tuple(cells), *self.rows[row + 1 :])
        )

    def with_led(self) -> Self:
        """Return the draft with one more LED, whose coordinates are to be typed."""
        return replace(self, rows=(*self.rows, ("", "", "", *FACING)))

    def without_led(self, row: int) -> Self:
        """Return the draft without an LED; later ones get lower numbers."""
        return replace(self, rows=(*self.rows[:row], *self.rows[row + 1 :]))

    def flaws(self) -> tuple[CellFlaw, ...]:
        """Return the cells that hold no number."""
        return tuple(
            CellFlaw(row, column, flaw)
            for row, cells in enumerate(self.rows)
            for column, cell in enumerate(cells)
            if (flaw := number_flaw(_pointed(cell)) and number_flaw(cell))
        )

    def pen(self) -> Pen:
        """Return the pen, whose LEDs are still to be checked.

        Raises
        ------
        FileError
            A cell holds no number, or a normal or the diameter cannot be one.
        """
        for flaw in self.flaws():
            raise FileError(flaw.sentence)
        cells = np.array([[float(_pointed(c)) for c in row] for row in self.rows])
        cells = cells.reshape(-1, len(COLUMNS))
        normals = _unit_normals(cells[:, 3:])
        return Pen(cells[:, :3], normals, self._diameter(), self._tip(), self.name)

    def _diameter(self) -> float:
        flaw = number_flaw(_pointed(self.diameter))
        if flaw:
            raise FileError(f"Diameter of the discs: {flaw}")
        diameter = float(_pointed(self.diameter))
        if not 0 < diameter <= LARGEST_DIAMETER:
            raise FileError(
                f"The LED discs cannot be {diameter:g} mm wide. Give a diameter of up "
                f"to {LARGEST_DIAMETER:g} mm."
            )
        return diameter

    def _tip(self) -> FloatArray | None:
        if not any(self.tip):
            return None
        for axis, cell in zip("xyz", self.tip, strict=True):
            flaw = number_flaw(_pointed(cell))
            if flaw:
                raise FileError(f"Nominal tip, {axis}: {flaw}")
        return np.array([float(_pointed(cell)) for cell in self.tip])


@dataclass(frozen=True, eq=False)
class DraftCheck:
    """What a draft is worth.

    Attributes
    ----------
    flaw : str
        Why it is no pen: the cell and what is wrong with it; empty if it is one.
    pen : Pen or None
        The pen as it is typed.
    frame : FrameCheck or None
        How that fares with the pen frame.
    sought : Pen or None
        The pen to look for in images: in the pen frame if it can be put there.
    """

    flaw: str = ""
    pen: Pen | None = None
    frame: FrameCheck | None = None
    sought: Pen | None = None

    @property
    def usable(self) -> Pen | None:
        """The pen, if a swing can be captured with it."""
        return None if self.frame is None or self.frame.error else self.pen


def check_draft(draft: PenDraft, pen: Pen | None = None) -> DraftCheck:
    """Check a draft.

    Parameters
    ----------
    draft : PenDraft
    pen : Pen, optional
        Of which it is the draft, unchanged; a draft shows fewer digits.
    """
    if not draft.rows:
        return DraftCheck()
    try:
        pen = pen or draft.pen()
    except FileError as error:
        return DraftCheck(str(error))
    frame = examine_frame(pen)
    sought = pen if frame.is_a_pen else None
    if frame.can_be_moved:
        sought = moved_into_frame(pen)
    return DraftCheck(pen=pen, frame=frame, sought=sought)


def _pointed(cell: str) -> str:
    return cell.replace(",", ".")


def _text(value: float) -> str:
    text = f"{value:.{DECIMALS}f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def _unit_normals(normals: FloatArray) -> FloatArray:
    lengths = np.linalg.norm(normals, axis=1)
    wrong = np.flatnonzero(np.abs(lengths - 1) > NORMAL_TOLERANCE)
    if len(wrong):
        raise FileError(
            f"LED {wrong[0] + 1}: the normal "
            f"{' '.join(f'{c:g}' for c in normals[wrong[0]])} does not have the length "
            "1. Correct it; a disc that faces +z has the normal 0 0 1."
        )
    return np.asarray(normals / lengths[:, None])
