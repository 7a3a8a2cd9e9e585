"""A swing on disk, image by image, so that a crash loses at most the image in flight.

A record is a folder:

==================== ===================================================================
``header.json``      who, where, with what; written last when the record is made, so
                     that a folder without it is no record
``camera.*``         copy of the camera file, byte by byte
``camera-2.*``       and of those of the other cameras of a rig
``rig.*``            copy of the rig file, where there is one
``pen.*``            copy of the pen file
``images/*.png``     the kept images, lossless, numbered from 1
``images-2/*.png``   those of the same moments by the second camera
``journal.jsonl``    what happened, see `lightpen.record.swings.reading`
``swing.lightpen``   opens the swing in the program; holds nothing that is needed
==================== ===================================================================

Images of the touches of a verification are stored in the same form, each with its
touch and run.

`lightpen.record.swings.writing` puts an image on the disk before its line, and its line
before it acknowledges the image; it keeps a second program
from writing meanwhile. An image without a line is what a crash leaves: it was not
acknowledged and is passed over. Header, lines and images each have their checksum.
Everything needed to calibrate again is in the images and the two files; the centres in
the journal spare reading the images when an interrupted swing continues.
"""

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, TypeAlias

import numpy as np
from msgspec import Meta, Struct, to_builtins

from lightpen.arrays import FloatArray, IntArray
from lightpen.cameras.protocol import Count, Stats
from lightpen.errors import FileError
from lightpen.formats.files import FOLDER, MEGABYTE, read_bytes, unreadable
from lightpen.formats.own_json import (
    DamagedError,
    Digest,
    Length,
    Vector,
    parse_checked,
    with_checksum,
)
from lightpen.messages import message
from lightpen.record.swings.header import HEADER, Header, header_copies, read_header

# The journal of a swing: a line for each thing that happened, appended, never changed.
#
# Each line is a JSON object with its checksum. A crash may leave a part of the last
# line, and a power cut zeros: it was not acknowledged and is ignored. Any other change
# is damage.


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


class RecordedImage(
    Struct, tag_field="kind", tag="image", omit_defaults=True, frozen=True
):
    """An acknowledged image, by its line."""

    number: Number
    sha256: Digest
    time: float  # s, by the clock of the session that took it
    device_time_ns: int | None
    pixels: tuple[tuple[Length, Length] | None, ...]  # ellipse centres of LEDs, px
    rotation: tuple[Row, Row, Row]  # cam_from_pen
    translation: Vector  # cam_from_pen, mm
    camera: Stats | None = None  # since the swing began
    others: tuple[SecondaryImage, ...] = ()  # simultaneous images of a rig
    touch: Count = 0  # number of the touch in a verification, from 1; 0 in a swing
    run: Count = 0  # likewise of its feature or visit
    approach: tuple[Entry, Entry, Entry] | None = None  # way of the tip to the point

    @property
    def rig_pixels(self) -> FloatArray:
        """Centres by all cameras, (C, L, 2), px; NaN where an LED was not seen."""
        views = (self.pixels, *(each.pixels for each in self.others))
        return np.stack([_points(each) for each in views])


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


Line: TypeAlias = RecordedImage | OutLine | ExcludedLine | VerdictLine | MoreLine


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
        if isinstance(last, RecordedImage):
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


IMAGES = "images"
OPENER = "swing.lightpen"  # by its suffix the system knows the program
DISCARDED = "discarded"


@dataclass(frozen=True, eq=False)
class Record:
    """A swing on disk."""

    folder: Path
    header: Header
    images: tuple[RecordedImage, ...]  # acknowledged ones, in order of capture
    excluded: Mapping[int, str]  # numbers of images that do not take part, and why
    verdict: str | None  # the last one; None if the swing was interrupted
    more: tuple[int, int] | None  # number of images requested after a verdict
    length: int  # length of the journal that was read, bytes

    @property
    def used_images(self) -> tuple[RecordedImage, ...]:
        """The images that take part."""
        return tuple(i for i in self.images if i.number not in self.excluded)

    @property
    def all_numbers(self) -> IntArray:
        """Numbers of all images."""
        return np.array([i.number for i in self.images], dtype=np.int64)

    @property
    def numbers(self) -> IntArray:
        """Numbers of the images that take part, (N,)."""
        return np.array([i.number for i in self.used_images], dtype=np.int64)

    @property
    def interval_ms(self) -> float | None:
        """Time from one image to the next, as a rule; None if not known."""
        steps = np.diff([image.time for image in self.images])
        usual = float(np.median(steps)) if len(steps) else 0.0
        return 1000 * usual if usual > 0 else None

    @property
    def stats(self) -> Stats:
        """Return the camera counters up to the last accepted image."""
        return (self.images[-1].camera if self.images else None) or Stats()

    @property
    def next_number(self) -> int:
        """Number that the next image gets."""
        return self.images[-1].number + 1 if self.images else 1


def open_record(folder: Path) -> Record:
    """Open a record, also after a crash of its writer.

    Raises `FileError` if the folder is no record, or its files are damaged other than
    by a crash, or written by a later version of the program.
    """
    header = read_header(folder)
    lines = read_lines(folder)
    parsed = parse_lines(lines, folder)
    n_leds = next((len(x.pixels) for x in parsed if isinstance(x, RecordedImage)), 0)
    last = 0
    for number, line in enumerate(parsed, start=1):
        if isinstance(line, RecordedImage):
            others = (len(other.pixels) for other in line.others)
            n_seen = [len(line.pixels), *others]
            is_whole = n_seen == len(header.cameras) * [n_leds]
            if line.number <= last or not is_whole:
                raise damaged_line(folder, number)
            last = line.number
    return _record(folder, header, parsed, length_of(lines))


def _record(folder: Path, header: Header, lines: Sequence[Line], length: int) -> Record:
    """Return the record of the journal's lines."""
    images: list[RecordedImage] = []
    excluded: dict[int, str] = {}
    verdict, more = None, None
    for line in lines:
        match line:
            case RecordedImage():
                images.append(line)
                verdict = None
            case OutLine():
                excluded.update(dict.fromkeys(line.numbers, line.reason))
            case ExcludedLine():
                excluded = {n: why for why, ns in line.reasons.items() for n in ns}
            case VerdictLine():
                verdict = line.verdict
            case MoreLine():
                more = line.min_images, line.max_images
    return Record(folder, header, tuple(images), excluded, verdict, more, length)


def record_files(record: Record) -> tuple[Path, ...]:
    """Return all files that a record of a swing consists of."""
    header = record.header
    names = (HEADER, JOURNAL, OPENER, *header_copies(header))
    images = (
        record.folder / image_name(image.number, c)
        for image in record.images
        for c in range(len(header.cameras))
    )
    return (*(record.folder / name for name in names), *images)


def is_record(folder: Path) -> bool:
    """Return whether a folder is a record."""
    try:
        return (folder / HEADER).is_file() and (folder / JOURNAL).is_file()
    except OSError as error:
        raise unreadable(folder, FOLDER, error) from error


def unacknowledged_images(record: Record) -> tuple[str, ...]:
    """Return the image files, in order, that the journal of a record does not name.

    A crash, or a journal that was cut, leaves them; they take no part.
    """
    cameras = range(len(record.header.cameras))
    known = {image_name(image.number, c) for image in record.images for c in cameras}
    found = (
        f"{images_folder(c)}/{path.name}"
        for c in cameras
        for path in (record.folder / images_folder(c)).glob("*.png")
    )
    return tuple(sorted(set(found) - known))


def images_folder(c: int) -> str:
    """Return the image folder of the c-th camera, relative to the record."""
    return IMAGES if c == 0 else f"{IMAGES}-{c + 1}"


def image_name(number: int, c: int = 0) -> str:
    """Return the image file of the c-th camera, relative to the record."""
    return f"{images_folder(c)}/{number:06d}.png"


def _points(pixels: Sequence[tuple[float, float] | None]) -> FloatArray:
    """Return LED centres (L, 2), px; NaN where an LED was not seen."""
    points = [(np.nan, np.nan) if p is None else p for p in pixels]
    return np.array(points, dtype=np.float64).reshape(-1, 2)
