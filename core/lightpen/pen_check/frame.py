"""Check of a pen against the definition of the pen frame, rule by rule."""

from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import FileError
from lightpen.messages import Message
from lightpen.model.pen import (
    FRAME_TOLERANCE,
    Pen,
    check_frame,
    check_leds,
    in_pen_frame,
    off_line,
    pen_frame_from_raw,
)


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
