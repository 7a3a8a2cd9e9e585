"""A pen file opened to be used, or else to be mended."""

from dataclasses import dataclass
from pathlib import Path

from lightpen.errors import FileError, LightpenError, UsageError
from lightpen.formats.opened_files import PenFile
from lightpen.formats.pen_files import read_unchecked_pen, write_pen
from lightpen.model.pen import Pen
from lightpen.pen_check.draft import PenDraft
from lightpen.sentences import Sentence


@dataclass(frozen=True, eq=False)
class OpenedPen:
    """What came of opening a pen file.

    Attributes
    ----------
    file : PenFile or None
        The pen, fit for use.
    draft : PenDraft or None
        Else its LEDs to be mended, if they can be shown.
    needs_units : bool
        Whether the file has to be read again with the units that it does not say.
    problem : Sentence or None
        Why it cannot be used.
    """

    path: Path
    file: PenFile | None = None
    draft: PenDraft | None = None
    needs_units: bool = False
    problem: Sentence | None = None


def open_pen(path: Path, units: str | None = None) -> OpenedPen:
    """Open a pen file; whatever is wrong with it is in what is returned."""
    try:
        return OpenedPen(path, PenFile.read(path, units))
    except UsageError as error:
        if units is None:
            return OpenedPen(path, needs_units=True)
        return OpenedPen(path, problem=error.sentence)
    except FileError as error:
        problem = error.sentence
    try:
        draft = PenDraft.of(read_unchecked_pen(path, units))
    except LightpenError:
        return OpenedPen(path, problem=problem)
    return OpenedPen(path, draft=draft, problem=problem)


def save_pen(pen: Pen, path: Path) -> PenFile:
    """Write a pen and return it as the file that is now in use.

    Raises
    ------
    FileError
        It cannot be written; what was there before is unchanged.
    """
    write_pen(pen, path)
    return PenFile.read(path)
