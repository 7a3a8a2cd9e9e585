"""The LEDs of a pen as they are typed, before they are a pen."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import FileError
from lightpen.formats.pen_content import LARGEST_DIAMETER, NORMAL_TOLERANCE
from lightpen.formats.tables import number_flaw
from lightpen.model.pen import Pen
from lightpen.pen_check.frame import FrameCheck, examine_frame, moved_into_frame
from lightpen.sentences import Sentence, sentence

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
    flaw : Sentence
        What is wrong with it.
    """

    row: int
    column: int
    flaw: Sentence

    @property
    def sentence(self) -> Sentence:
        """What is wrong, and where."""
        return sentence(
            "draft.cell",
            "LED {led}, {column}: {flaw}",
            led=self.row + 1,
            column=COLUMNS[self.column],
            flaw=self.flaw,
        )


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
            if number_flaw(_pointed(cell)) and (flaw := number_flaw(cell))
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
            raise FileError(
                sentence(
                    "draft.diameter",
                    "Diameter of the discs: {flaw}",
                    flaw=flaw,
                )
            )
        diameter = float(_pointed(self.diameter))
        if not 0 < diameter <= LARGEST_DIAMETER:
            raise FileError(
                sentence(
                    "draft.disc-diameter",
                    "The LED discs cannot be {diameter:g} mm wide. Give a diameter "
                    "of up to {most:g} mm.",
                    diameter=diameter,
                    most=LARGEST_DIAMETER,
                )
            )
        return diameter

    def _tip(self) -> FloatArray | None:
        if not any(self.tip):
            return None
        for axis, cell in zip("xyz", self.tip, strict=True):
            flaw = number_flaw(_pointed(cell))
            if flaw:
                raise FileError(
                    sentence(
                        "draft.nominal-tip",
                        "Nominal tip, {axis}: {flaw}",
                        axis=axis,
                        flaw=flaw,
                    )
                )
        return np.array([float(_pointed(cell)) for cell in self.tip])


@dataclass(frozen=True, eq=False)
class DraftCheck:
    """What a draft is worth.

    Attributes
    ----------
    flaw : Sentence or None
        Why it is no pen: the cell and what is wrong with it.
    pen : Pen or None
        The pen as it is typed.
    frame : FrameCheck or None
        How that fares with the pen frame.
    sought : Pen or None
        The pen to look for in images: in the pen frame if it can be put there.
    """

    flaw: Sentence | None = None
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
    pen : Pen, optional
        Of which it is the draft, unchanged; a draft shows fewer digits.
    """
    if not draft.rows:
        return DraftCheck()
    try:
        pen = pen or draft.pen()
    except FileError as error:
        return DraftCheck(error.sentence)
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
            sentence(
                "draft.normal-length",
                "LED {led}: the normal {normal} does not have the length 1. Correct "
                "it; a disc that faces +z has the normal 0 0 1.",
                led=int(wrong[0]) + 1,
                normal=" ".join(f"{c:g}" for c in normals[wrong[0]]),
            )
        )
    return np.asarray(normals / lengths[:, None])
