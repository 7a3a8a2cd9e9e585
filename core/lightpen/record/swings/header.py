"""The header of a record: station, operator, item and setup of a swing.

It is written last when a record is made. Beside it stand copies, byte by byte, of the
files it names. Header and copies each have their checksum.
"""

import json
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from datetime import datetime
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Self

import numpy as np
from msgspec import Meta, Struct, to_builtins

from lightpen.arrays import FloatArray
from lightpen.cameras.protocol import CameraInUse
from lightpen.errors import FileError
from lightpen.formats.camera_files import CAMERA_FILE
from lightpen.formats.files import MEGABYTE, is_reserved, read_bytes
from lightpen.formats.own_json import (
    FORMAT,
    DamagedError,
    Digest,
    LaterFormatError,
    Length,
    Plain,
    Vector,
    ZonedTime,
    parse_stored,
    require_path,
    require_usual,
    with_checksum,
)
from lightpen.formats.pen_files import PEN_FILE
from lightpen.formats.rig_files import RIG_FILE
from lightpen.messages import Message, message
from lightpen.model.limits import LIMITS, USUAL, Assumptions, StationLimits, SwingLimits
from lightpen.model.names import Method, Origin

HEADER = "header.json"
HEADER_LIMIT = MEGABYTE
COPY_LIMIT = 4 * MEGABYTE
CAMERA_STEM, PEN_STEM, RIG_STEM = "camera", "pen", "rig"
COPIES = {CAMERA_STEM: CAMERA_FILE, PEN_STEM: PEN_FILE, RIG_STEM: RIG_FILE}


class FileCopy(Struct, frozen=True, omit_defaults=True):
    """A file that a record has a copy of, with the content only for a new record."""

    name: str
    sha256: Digest
    data: bytes = b""

    def __post_init__(self) -> None:
        require_path(self.name)

    @classmethod
    def of(cls, path: Path, what: Message) -> Self:
        """Read a file; ``what`` it is, for the messages."""
        data = read_bytes(path, what, COPY_LIMIT)
        return cls(path.name, sha256(data).hexdigest(), data)


@dataclass(frozen=True)
class Names:
    """Station, operator, serial number of the pen, tip, cone and ball diameter, mm."""

    station: str = ""
    operator: str = ""
    pen: str = ""
    tip: str = ""
    cone: str = ""
    ball_diameter: float | None = None


class RecordedCamera(Struct, frozen=True, omit_defaults=True):
    """A camera of a swing."""

    file: FileCopy  # its intrinsics
    mask_px: tuple[Vector, ...] = ()  # circles of stray light: centre x, y and radius
    source: str = ""  # key of the source of its images
    place: str = ""  # as `SourceChoice.place`
    in_use: CameraInUse | None = None  # None of images from files

    @property
    def mask(self) -> FloatArray:
        """Circles of stray light, (M, 3), px."""
        return np.array(self.mask_px, dtype=float).reshape(-1, 3)


class Header(Struct, frozen=True, kw_only=True):
    """Conditions of the capture of a swing."""

    format: int = FORMAT
    created: ZonedTime
    program: str = ""
    names: Names = Names()
    cameras: Annotated[tuple[RecordedCamera, ...], Meta(min_length=1)]
    rig_file: FileCopy | None = None  # of several cameras
    pen_file: FileCopy
    units: str | None = None  # units given for a pen file without units
    led_diameter_mm: Length | None = None  # replaces the pen file's
    nominal_tip_mm: Vector | None = None  # replaces the pen file's
    origin: Origin | None = None  # of the images; None if not stated
    limits: SwingLimits = SwingLimits()
    assumptions: Assumptions = USUAL
    method: Method = "joint"  # of the reported tip
    is_press_test: bool = False  # made to be compared with another swing alone

    def __post_init__(self) -> None:
        require_usual(self.created)
        if (len(self.cameras) > 1) is (self.rig_file is None):
            raise ValueError("Several cameras have a rig file, and one has none.")

    @property
    def nominal_tip(self) -> FloatArray | None:
        """Tip by design in place of the pen file's, pen frame, (3,), mm."""
        tip = self.nominal_tip_mm
        return None if tip is None else np.array(tip, dtype=np.float64)

    @property
    def is_of_recording(self) -> bool:
        """Whether the images were recorded before the swing."""
        return self.cameras[0].source == Origin.RECORDED

    @property
    def settings(self) -> dict[str, Plain]:
        """Limits and assumptions, as an entry of the archive has them."""
        limits = StationLimits(swing=self.limits)
        found = {e.key: limits.value(e) for e in LIMITS if e.part == "swing"}
        return {**found, **asdict(self.assumptions), "method": self.method}


def header_bytes(header: Header) -> bytes:
    """Return the bytes of a header, without the content of the files."""
    entries = to_builtins(header)
    copies = [entries["pen_file"], *(each["file"] for each in entries["cameras"])]
    for copy in (*copies, entries["rig_file"] or {}):
        copy.pop("data", None)
    text = json.dumps(entries, indent=1, ensure_ascii=False)
    # The bytes of a file name that is no text become JSON escapes.
    return with_checksum(text.encode("utf-8", "backslashreplace"))


def read_header(folder: Path) -> Header:
    """Read the header of a record and check its copies.

    Raises `FileError` if it is damaged, of a later version of the program, or a copy
    was changed.
    """
    path = folder / HEADER
    data = read_bytes(path, message("file.header"), HEADER_LIMIT)
    try:
        header = parse_stored(data, Header)
    except LaterFormatError as error:
        raise FileError(
            "record.later-version", path=path, number=error.number, known=FORMAT
        ) from error
    except DamagedError as error:
        raise damaged_file(path) from error
    for name, copy in header_copies(header).items():
        stem = name.partition(".")[0].partition("-")[0]
        data = read_bytes(folder / name, COPIES[stem], COPY_LIMIT)
        if sha256(data).hexdigest() != copy.sha256:
            raise FileError("record.file-changed", path=folder / name)
    return header


def header_copies(header: Header) -> Mapping[str, FileCopy]:
    """Return the copies in a record by their relative path."""
    by_stem = {camera_stem(c): each.file for c, each in enumerate(header.cameras)}
    by_stem[PEN_STEM] = header.pen_file
    if header.rig_file is not None:
        by_stem[RIG_STEM] = header.rig_file
    return {copy_name(stem, file): file for stem, file in by_stem.items()}


def copy_name(stem: str, file: FileCopy) -> str:
    """Return the file of a copy, relative to its record."""
    return stem + Path(file.name).suffix.lower()


def camera_stem(c: int) -> str:
    """Return the stem of the copy of the c-th camera file."""
    return CAMERA_STEM if c == 0 else f"{CAMERA_STEM}-{c + 1}"


def damaged_file(path: Path) -> FileError:
    """Return the error of a file of a record, other than an image or a copy."""
    return FileError("record.damaged", path=path)


UNFIT = re.compile(r"[^\w.-]+")  # for the name of a folder
LONGEST_WORD = 24  # characters; of up to 4 bytes, of the 255 that a name may have


def folder_name(names: Names, now: datetime) -> str:
    """Return the name of a swing's folder, by the time, the pen and the tip."""
    pen, tip = names.pen[:LONGEST_WORD], names.tip[:LONGEST_WORD]
    words = (f"{now:%Y%m%d-%H%M%S}", pen, tip)
    # Windows leaves dots at the end of a name out, and then finds the folder no more.
    return not_reserved(UNFIT.sub("-", "_".join(filter(None, words))).rstrip("."))


def not_reserved(name: str) -> str:
    """Return a file name, changed where Windows takes it for a device: ``nul.x``."""
    return f"_{name}" if is_reserved(name) else name
