"""The journal of a swing: a line for each thing that happened, appended, never changed.

Each line is a JSON object with its checksum. A crash may leave a part of the last line,
and a power cut zeros: it was not acknowledged and is ignored. Any other change is
damage.
"""

import json
import os
from pathlib import Path
from typing import Annotated, TypeAlias

from msgspec import Meta, Struct, to_builtins

from lightpen.cameras.protocol import Count, Stats
from lightpen.errors import FileError
from lightpen.formats.files import MEGABYTE, read_bytes
from lightpen.formats.own_json import (
    DamagedError,
    Digest,
    Length,
    Vector,
    parse_checked,
    with_checksum,
)
from lightpen.messages import message

JOURNAL = "journal.jsonl"
LIMIT = 64 * MEGABYTE
TAIL = 16_384  # bytes of a journal that hold its last few lines
ZEROS = b"\0\0"  # of one zero a flipped bit may be the cause

Entry: TypeAlias = Annotated[float, Meta(ge=-1.001, le=1.001)]  # of a rotation
Number: TypeAlias = Annotated[int, Meta(ge=1, le=10**9)]
Row: TypeAlias = tuple[Entry, Entry, Entry]


class SecondaryImage(Struct):
    """The image of another camera of a rig at that moment."""

    sha256: Digest
    device_time_ns: int | None
    pixels: tuple[tuple[Length, Length] | None, ...]


class ImageLine(Struct, tag_field="kind", tag="image", omit_defaults=True):
    """An image was acknowledged; see `lightpen.record.swings.reading.RecordedImage`."""

    number: Number
    sha256: Digest
    time: float
    device_time_ns: int | None
    pixels: tuple[tuple[Length, Length] | None, ...]
    rotation: tuple[Row, Row, Row]
    translation: Vector
    camera: Stats | None = None  # since the swing began
    others: tuple[SecondaryImage, ...] = ()
    touch: Count = 0  # of a verification, from 1
    run: Count = 0  # likewise: of a feature or visit, from 1
    approach: tuple[Entry, Entry, Entry] | None = None


class OutLine(Struct, tag_field="kind", tag="out"):
    """Further images that are excluded."""

    numbers: tuple[int, ...]
    reason: str


class ExcludedLine(Struct, tag_field="kind", tag="taken out"):
    """Excluded images by reason; all others are included."""

    reasons: dict[str, tuple[int, ...]]


class VerdictLine(Struct, tag_field="kind", tag="verdict"):
    """The swing is concluded."""

    verdict: str


class MoreLine(Struct, tag_field="kind", tag="more"):
    """More images after a verdict, up to a number."""

    min_images: Count
    max_images: Number


Line: TypeAlias = ImageLine | OutLine | ExcludedLine | VerdictLine | MoreLine


def line_bytes(line: Line) -> bytes:
    """Return the bytes of a line, with its end."""
    text = json.dumps(to_builtins(line), allow_nan=False)
    return with_checksum(text.encode()) + b"\n"


def journal_bytes(folder: Path) -> bytes:
    """Return the journal of a record."""
    return read_bytes(folder / JOURNAL, message("file.journal"), LIMIT)


def read_lines(folder: Path) -> list[bytes]:
    """Return the lines of the journal in a folder, without their ends.

    What a crash or a power cut left of the last one is not among them.
    """
    path = folder / JOURNAL
    if path.is_file() and path.stat().st_size == 0:
        return []
    data = journal_bytes(folder)
    *lines, rest = data.split(b"\n")
    if lines and (ZEROS in lines[-1] or lines[-1].startswith(b"\0")):
        lines.pop()
    elif _is_whole(rest[:-1]):  # its last byte was the line end
        lines.append(rest)
    return lines


def parse_lines(lines: list[bytes], folder: Path) -> list[Line]:
    """Parse the lines of a journal."""
    parsed: list[Line] = []
    for number, line in enumerate(lines, start=1):
        try:
            parsed.append(_parse_line(line))
        except DamagedError as error:
            raise damaged_line(folder, number) from error
    return parsed


def damaged_line(folder: Path, number: int) -> FileError:
    """Return the error of a line of the journal in a folder."""
    return FileError("record.damaged-line", line=number, file=folder / JOURNAL)


def length_of(lines: list[bytes]) -> int:
    """Return the length of lines in the journal, bytes."""
    return sum(len(line) + 1 for line in lines)


def sound_length(folder: Path) -> int:
    """Return the length of the complete lines of a journal, bytes."""
    length = length_of(read_lines(folder))
    return min(length, (folder / JOURNAL).stat().st_size)


def last_verdict(folder: Path) -> str | None:
    """Return the verdict at the end of the journal that no image follows.

    No more is read than its last lines, so that thousands of concluded records cost
    little. None does not prove that there is no verdict. Raises `OSError` without a
    journal.
    """
    path = folder / JOURNAL
    if path.exists() and not path.is_file():  # a pipe would never be read to its end
        return None
    with path.open("rb") as journal:
        length = journal.seek(0, os.SEEK_END)
        journal.seek(max(0, length - TAIL))
        lines = journal.read().split(b"\n")[:-1]
    for line in reversed(lines):
        try:
            last = _parse_line(line)
        except DamagedError:  # torn, or cut by the limit
            return None
        if isinstance(last, VerdictLine):
            return last.verdict
        if isinstance(last, ImageLine):
            return None
    return None


def _parse_line(line: bytes) -> Line:
    # A union of classes is a type, but no class.
    parsed: Line = parse_checked(line, Line)  # type: ignore[arg-type]
    return parsed


def _is_whole(line: bytes) -> bool:
    try:
        _parse_line(line)
    except DamagedError:
        return False
    return True
