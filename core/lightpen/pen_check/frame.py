"""The frame of a pen, LED files opened to be inspected, and corrections of LEDs."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Self, cast

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import FileError, LightpenError, UsageError
from lightpen.formats.opened_files import PenFile
from lightpen.formats.pen_files import read_unchecked_pen, write_pen
from lightpen.messages import Message
from lightpen.model.pen import (
    Pen,
    check_frame,
    check_leds,
    in_pen_frame,
    pen_frame_from_raw,
)


@dataclass(frozen=True)
class FrameCheck:
    """Result of checking a pen against the pen frame."""

    error: Message | None = None  # why the pen cannot be used, with LED and amount
    remark: Message | None = None  # why it is not of the paper's layout, nor in error
    can_be_moved: bool = False  # whether its coordinates can be put into the pen frame
    is_a_pen: bool = True  # whether the LEDs could be those of a pen in some frame


def examine_frame(pen: Pen) -> FrameCheck:
    """Check a pen against the pen frame.

    A pen of another layout than the paper's passes: its frame is its own.
    """
    try:
        check_leds(pen.leds, pen.diameter)
    except FileError as error:
        return FrameCheck(error.message, is_a_pen=False)
    off_layout, off_frame = _layout_error(pen.leds), _frame_error(pen)
    if off_layout and not off_frame:
        return FrameCheck(remark=off_layout)
    is_movable = bool(off_frame and not off_layout)
    return FrameCheck(
        off_frame, can_be_moved=is_movable and not _frame_error(moved_into_frame(pen))
    )


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


@dataclass(frozen=True, eq=False)
class OpenedPen:
    """Result of opening a pen file."""

    path: Path
    file: PenFile | None = None  # the pen, fit for use
    pen: Pen | None = None  # its LEDs, also of an invalid file
    needs_units: bool = False  # it must be read again with units
    problem: Message | None = None  # why it cannot be used

    @classmethod
    def of(cls, file: PenFile) -> Self:
        """Return a file that is in use."""
        return cls(file.path, file, file.pen)

    @cached_property
    def frame(self) -> FrameCheck:
        """Agreement of the LEDs with the pen frame; they must have been read."""
        assert self.pen is not None
        return examine_frame(self.pen)

    @cached_property
    def sought(self) -> Pen | None:
        """The pen to be found in images, in the pen frame if possible."""
        if self.pen is None or not self.frame.is_a_pen:
            return None
        return moved_into_frame(self.pen) if self.frame.can_be_moved else self.pen


def open_pen(path: Path, units: str | None = None) -> OpenedPen:
    """Open a pen file; errors are in the result."""
    try:
        return OpenedPen.of(PenFile.read(path, units))
    except UsageError as error:
        if units is None:
            return OpenedPen(path, needs_units=True)
        return OpenedPen(path, problem=error.message)
    except FileError as error:
        problem = error.message
    try:
        pen = read_unchecked_pen(path, units)
    except LightpenError:
        return OpenedPen(path, problem=problem)
    return OpenedPen(path, pen=pen, problem=problem)


def save_pen(pen: Pen, path: Path) -> OpenedPen:
    """Write a pen, and return it as read back."""
    write_pen(pen, path)
    return open_pen(path)


def leds_to_exchange(frame: FrameCheck) -> tuple[int, int] | None:
    """Return the numbers of two LEDs that are swapped in the file."""
    error = frame.error
    if error is None or error.code != "pen.leds-exchanged":
        return None
    return cast(int, error.values["first"]), cast(int, error.values["second"])


def exchanged(pen: Pen, leds: Sequence[int]) -> Pen:
    """Return a pen in which two LEDs, by number, swap places."""
    order = np.arange(pen.n_leds)
    one, other = (led - 1 for led in leds)
    order[[one, other]] = other, one
    return replace(pen, leds=pen.leds[order], normals=pen.normals[order])
