"""The draft of a pen: its LEDs as typed, files opened to be edited, corrections."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Self, cast

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import FileError, LightpenError, UsageError
from lightpen.formats.opened_files import PenFile
from lightpen.formats.pen_files import read_unchecked_pen, write_pen
from lightpen.formats.pen_tables import LARGEST_DIAMETER, NORMAL_TOLERANCE
from lightpen.formats.tables import number_flaw
from lightpen.messages import Message, message
from lightpen.model.pen import (
    FRAME_TOLERANCE,
    Pen,
    check_frame,
    check_leds,
    in_pen_frame,
    off_line,
    pen_frame_from_raw,
)
from lightpen.pen_check.match import Finding, MatchFinding


class Rule(StrEnum):
    """Rules of the pen frame."""

    LEDS = "LEDs"  # enough of them, apart, not in a line, in millimetres
    NUMBERS = "numbers"  # LEDs 1 to 4 follow each other, 5 to 7 and 8 to 10 too
    LINE = "line"  # LEDs 1 to 4
    ORIGIN = "origin"  # LED 1 over it
    AXIS = "axis"  # y along LEDs 1 to 4
    PLANE = "plane"  # LEDs 5 to 10 at z = 0
    HANDED = "right-handed"
    NORMALS = "normals"  # towards the viewer


class RuleStatus(StrEnum):
    """Result of checking a rule."""

    MET = "met"
    BROKEN = "broken"
    OPEN = "open"  # cannot be determined, or is not requested


@dataclass(frozen=True)
class RuleCheck:
    """A rule and its result."""

    rule: Rule
    outcome: RuleStatus
    amount: float = float("nan")  # largest deviation, mm; NaN for a rule without one


@dataclass(frozen=True)
class FrameCheck:
    """Result of checking a pen against the pen frame."""

    checks: tuple[RuleCheck, ...]  # in the order of `Rule`
    error: Message | None = None  # why the pen cannot be used, with LED and amount
    remark: Message | None = None  # why it is not of the paper's layout, nor in error
    can_be_moved: bool = False  # whether its coordinates can be put into the pen frame

    @property
    def is_a_pen(self) -> bool:
        """Whether the LEDs could be those of a pen in some frame."""
        return self.checks[0].outcome is RuleStatus.MET


def examine_frame(pen: Pen) -> FrameCheck:
    """Check a pen against every rule of the pen frame.

    A pen of another layout than the paper's passes: its frame is its own.
    """
    try:
        check_leds(pen.leds, pen.diameter)
    except FileError as error:
        return FrameCheck(_all_open(Rule.LEDS), error.message)
    off_layout, off_frame = _layout_error(pen.leds), _frame_error(pen)
    if off_layout and not off_frame:
        return FrameCheck(_all_open(), remark=off_layout)
    if off_layout:
        mirrored = pen.leds * np.array([-1.0, 1.0, 1.0])
        broken = Rule.NUMBERS if _layout_error(mirrored) else Rule.HANDED
        return FrameCheck(_all_open(broken), off_frame)
    can_be_moved = bool(off_frame) and not _frame_error(moved_into_frame(pen))
    return FrameCheck(_measured(pen), off_frame, can_be_moved=can_be_moved)


def moved_into_frame(pen: Pen) -> Pen:
    """Return a pen of raw coordinates in the pen frame.

    Discs that all face +z in raw coordinates were given no normals; they then face the
    viewer.
    """
    moved = in_pen_frame(pen)
    if np.all(pen.normals == [0.0, 0.0, 1.0]):
        moved = replace(moved, normals=pen.normals)
    return moved


def _layout_error(leds: FloatArray) -> Message | None:
    try:
        pen_frame_from_raw(leds)
    except FileError as error:
        return error.message
    return None


def _frame_error(pen: Pen) -> Message | None:
    try:
        check_frame(pen)
    except FileError as error:
        return error.message
    return None


def _all_open(broken: Rule | None = None) -> tuple[RuleCheck, ...]:
    """Return checks with one broken rule; those that depend on it are open."""
    outcomes = dict.fromkeys(Rule, RuleStatus.OPEN)
    if broken is not Rule.LEDS:
        outcomes[Rule.LEDS] = RuleStatus.MET
    if broken is not None:
        outcomes[broken] = RuleStatus.BROKEN
    return tuple(RuleCheck(rule, outcome) for rule, outcome in outcomes.items())


def _measured(pen: Pen) -> tuple[RuleCheck, ...]:
    """Return the checks of LEDs in the paper's layout, in order."""
    leds = pen.leds
    back, front = leds[:4], leds[4:]
    amounts = {
        Rule.LINE: float(off_line(back).max()),
        Rule.ORIGIN: float(np.hypot(*leds[0, :2])),
        Rule.AXIS: float(np.abs(back[:, 0] - back[0, 0]).max()),
        Rule.PLANE: float(np.abs(front[:, 2]).max()),
    }
    checks = []
    for rule in Rule:
        amount = amounts.get(rule, float("nan"))
        broken = amount > FRAME_TOLERANCE
        if rule is Rule.AXIS:
            broken = broken or leds[3, 1] < leds[0, 1]
        elif rule is Rule.NORMALS:
            broken = bool(np.any(pen.normals[:, 2] <= 0))
        checks.append(
            RuleCheck(rule, RuleStatus.BROKEN if broken else RuleStatus.MET, amount)
        )
    return tuple(checks)


COLUMNS = ("x", "y", "z", "nx", "ny", "nz")
DECIMALS = 6  # of coordinates in mm, as they are shown
FACING = ("0", "0", "1")


@dataclass(frozen=True)
class CellError:
    """A cell that holds no number."""

    row: int  # from 0
    column: int  # index in `COLUMNS`
    flaw: Message

    @property
    def message(self) -> Message:
        """The message to the user."""
        return message(
            "draft.cell", led=self.row + 1, column=COLUMNS[self.column], flaw=self.flaw
        )


@dataclass(frozen=True)
class PenDraft:
    """The cells of a pen, as text."""

    rows: tuple[tuple[str, ...], ...] = ()  # coordinates, mm, and normal of each LED
    diameter: str = ""  # of the LED discs, mm
    tip: tuple[str, ...] = ("", "", "")  # nominal, mm; all empty if it is not known
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
        """Return the draft with one more LED without coordinates."""
        return replace(self, rows=(*self.rows, ("", "", "", *FACING)))

    def without_led(self, row: int) -> Self:
        """Return the draft without an LED; later ones get lower numbers."""
        return replace(self, rows=(*self.rows[:row], *self.rows[row + 1 :]))

    def flaws(self) -> tuple[CellError, ...]:
        """Return the cells that hold no number."""
        return tuple(
            CellError(row, column, flaw)
            for row, cells in enumerate(self.rows)
            for column, cell in enumerate(cells)
            if number_flaw(_pointed(cell)) and (flaw := number_flaw(cell))
        )

    def pen(self) -> Pen:
        """Return the unchecked pen; raise `FileError` for a cell that cannot be one."""
        for flaw in self.flaws():
            raise FileError(flaw.message)
        cells = np.array([[float(_pointed(c)) for c in row] for row in self.rows])
        cells = cells.reshape(-1, len(COLUMNS))
        normals = _unit_normals(cells[:, 3:])
        return Pen(cells[:, :3], normals, self._diameter(), self._tip(), self.name)

    def _diameter(self) -> float:
        flaw = number_flaw(_pointed(self.diameter))
        if flaw:
            raise FileError("draft.diameter", flaw=flaw)
        diameter = float(_pointed(self.diameter))
        if not 0 < diameter <= LARGEST_DIAMETER:
            raise FileError(
                "draft.disc-diameter", diameter=diameter, most=LARGEST_DIAMETER
            )
        return diameter

    def _tip(self) -> FloatArray | None:
        if not any(self.tip):
            return None
        for axis, cell in zip("xyz", self.tip, strict=True):
            flaw = number_flaw(_pointed(cell))
            if flaw:
                raise FileError("draft.nominal-tip", axis=axis, flaw=flaw)
        return np.array([float(_pointed(cell)) for cell in self.tip])


@dataclass(frozen=True, eq=False)
class DraftCheck:
    """Result of checking a draft."""

    flaw: Message | None = None  # cell and fault, if it is not a valid pen
    pen: Pen | None = None  # the pen as it is typed
    frame: FrameCheck | None = None  # its agreement with the pen frame
    sought: Pen | None = None  # to be found in images; in the pen frame if possible

    @property
    def usable(self) -> Pen | None:
        """The pen, if a swing can be captured with it."""
        return None if self.frame is None or self.frame.error else self.pen


def check_draft(draft: PenDraft, pen: Pen | None = None) -> DraftCheck:
    """Check a draft; an unmodified one shows fewer digits than the original pen."""
    if not draft.rows:
        return DraftCheck()
    try:
        pen = pen or draft.pen()
    except FileError as error:
        return DraftCheck(error.message)
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
            "draft.normal-length",
            led=int(wrong[0]) + 1,
            normal=" ".join(f"{c:g}" for c in normals[wrong[0]]),
        )
    return np.asarray(normals / lengths[:, None])


MEASURED_DECIMALS = 3  # mm; live images do not show an LED's place any finer


def leds_to_exchange(frame: FrameCheck | None) -> tuple[int, int] | None:
    """Return the numbers of two LEDs that are swapped in the file."""
    error = None if frame is None else frame.error
    if error is None or error.code != "pen.leds-exchanged":
        return None
    return cast(int, error.values["first"]), cast(int, error.values["second"])


def exchanged(
    draft: PenDraft, leds: Sequence[int], columns: Sequence[str] = COLUMNS
) -> PenDraft:
    """Return a draft in which two LEDs, by number, swap these columns."""
    one, other = (led - 1 for led in leds)
    result = draft
    for column in map(COLUMNS.index, columns):
        result = result.with_cell(one, column, draft.rows[other][column])
        result = result.with_cell(other, column, draft.rows[one][column])
    return result


def corrected(draft: PenDraft, finding: Finding) -> PenDraft:
    """Return a draft corrected by a finding of live images that `can_be_corrected`.

    Coordinates that are swapped between two LEDs are swapped back, and a displaced LED
    gets its measured position. If either of two coordinates can be swapped, the one is
    chosen that keeps the LEDs in the pen frame.
    """
    if finding.what is not MatchFinding.EXCHANGED:
        return _put_in_place(draft, finding)
    drafts = [
        exchanged(draft, finding.leds, either.split(", "))
        for either in finding.axes.split("/")
    ]
    fit = (each for each in drafts if check_draft(each).usable is not None)
    return next(fit, drafts[0])


def _put_in_place(draft: PenDraft, finding: Finding) -> PenDraft:
    row = finding.leds[0] - 1
    place = draft.pen().leds[row] + finding.by
    for column, value in enumerate(place.tolist()):
        if round(finding.by[column], MEASURED_DECIMALS):
            draft = draft.with_cell(row, column, f"{value:.{MEASURED_DECIMALS}f}")
    return draft


@dataclass(frozen=True, eq=False)
class OpenedPen:
    """Result of opening a pen file."""

    path: Path
    file: PenFile | None = None  # the pen, fit for use
    draft: PenDraft | None = None  # LEDs to be corrected, of an invalid file
    needs_units: bool = False  # it must be read again with units
    problem: Message | None = None  # why it cannot be used


def open_pen(path: Path, units: str | None = None) -> OpenedPen:
    """Open a pen file; errors are in the result."""
    try:
        return OpenedPen(path, PenFile.read(path, units))
    except UsageError as error:
        if units is None:
            return OpenedPen(path, needs_units=True)
        return OpenedPen(path, problem=error.message)
    except FileError as error:
        problem = error.message
    try:
        draft = PenDraft.of(read_unchecked_pen(path, units))
    except LightpenError:
        return OpenedPen(path, problem=problem)
    return OpenedPen(path, draft=draft, problem=problem)


def save_pen(pen: Pen, path: Path) -> PenFile:
    """Write a pen and return it as the file that is now in use."""
    write_pen(pen, path)
    return PenFile.read(path)
