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
from typing import Self

import numpy as np
from msgspec import Struct, to_builtins
from msgspec.structs import replace

from lightpen.arrays import FloatArray
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
from lightpen.model.limits import USUAL, Assumptions, SwingLimits
from lightpen.model.names import Method

PREFIX = "assumed_"


def assumption_entries(assumptions: Assumptions) -> dict[str, Plain]:
    """Return assumptions as settings of a record."""
    return {PREFIX + name: value for name, value in asdict(assumptions).items()}


def recorded_assumptions(settings: Mapping[str, Plain]) -> Assumptions:
    """Return the assumptions among settings; defaults for missing ones.

    Raises `ValueError` if one makes no sense.
    """
    values = asdict(USUAL)
    for name in values:
        value = settings.get(PREFIX + name)
        if isinstance(value, int | float):
            values[name] = float(value)
    return Assumptions(**values)


def recorded_method(settings: Mapping[str, Plain]) -> Method:
    """Return the method of the reported tip among settings."""
    return "two-stage" if settings.get("method") == "two-stage" else "joint"


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


class RigCopies(Struct, frozen=True):
    """Copies of the files of rig and other cameras."""

    rig_file: FileCopy
    camera_files: tuple[FileCopy, ...]
    masks_px: tuple[tuple[Vector, ...], ...]  # as `Header.mask_px`

    def __post_init__(self) -> None:
        if not 1 <= len(self.camera_files) == len(self.masks_px):
            raise ValueError("Each of the other cameras has a file and a mask.")


class Header(Struct, frozen=True, kw_only=True):
    """Conditions of the capture of a swing."""

    format: int = FORMAT
    created: ZonedTime
    program: str = ""
    station: str = ""
    operator: str = ""
    tip: str = ""
    cone: str = ""
    camera_file: FileCopy
    pen_file: FileCopy
    units: str | None = None  # units given for a pen file without units
    led_diameter_mm: Length | None = None  # replaces the pen file's
    nominal_tip_mm: Vector | None = None  # replaces the pen file's
    mask_px: tuple[Vector, ...] = ()  # circles of stray light: centre x, y and radius
    settings: Mapping[str, Plain] = {}  # further: exposure, limits, camera
    rig: RigCopies | None = None

    def __post_init__(self) -> None:
        require_usual(self.created)
        limits_in(self.settings)
        recorded_assumptions(self.settings)

    @property
    def n_cameras(self) -> int:
        """Number of cameras."""
        return 1 if self.rig is None else 1 + len(self.rig.camera_files)

    @property
    def nominal_tip(self) -> FloatArray | None:
        """Tip by design in place of the pen file's, pen frame, (3,), mm."""
        tip = self.nominal_tip_mm
        return None if tip is None else np.array(tip, dtype=np.float64)

    @property
    def masks(self) -> tuple[FloatArray, ...]:
        """Circles of stray light before each camera, (M, 3), px."""
        all_masks = self.mask_px, *(() if self.rig is None else self.rig.masks_px)
        return tuple(np.array(mask, dtype=float).reshape(-1, 3) for mask in all_masks)


def header_bytes(header: Header) -> bytes:
    """Return the bytes of a header, without the content of the files."""
    rig = header.rig
    if rig is not None:
        rig = replace(
            rig,
            rig_file=replace(rig.rig_file, data=b""),
            camera_files=tuple(replace(file, data=b"") for file in rig.camera_files),
        )
    entries = replace(
        header,
        camera_file=replace(header.camera_file, data=b""),
        pen_file=replace(header.pen_file, data=b""),
        rig=rig,
    )
    text = json.dumps(to_builtins(entries), indent=1, ensure_ascii=False)
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
    by_stem = {CAMERA_STEM: header.camera_file, PEN_STEM: header.pen_file}
    if header.rig is not None:
        by_stem[RIG_STEM] = header.rig.rig_file
        for c, file in enumerate(header.rig.camera_files, start=1):
            by_stem[camera_stem(c)] = file
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


def limits_in(settings: Mapping[str, Plain]) -> SwingLimits:
    """Return the limits in the settings of a header; `ValueError` if there are none."""
    usual = SwingLimits()
    return SwingLimits(
        max_uncertainty=number_in(
            settings, "max_uncertainty_mm", usual.max_uncertainty
        ),
        min_images=int(number_in(settings, "min_images", usual.min_images)),
        max_images=int(number_in(settings, "max_images", usual.max_images)),
        min_per_field=int(number_in(settings, "min_per_field", usual.min_per_field)),
        spacing=number_in(settings, "spacing_rad", usual.spacing),
        requires_temperature=bool(settings.get("requires_temperature", False)),
    )


def number_in(settings: Mapping[str, Plain], key: str, usual: float) -> float:
    """Return a number of a record's settings, or its default."""
    value = settings.get(key)
    return value if isinstance(value, int | float) else usual


UNFIT = re.compile(r"[^\w.-]+")  # for the name of a folder
LONGEST_WORD = 24  # characters; of up to 4 bytes, of the 255 that a name may have


@dataclass(frozen=True)
class Names:
    """Station, operator, serial number of the pen, tip, cone and ball diameter, mm."""

    station: str = ""
    operator: str = ""
    pen: str = ""
    tip: str = ""
    cone: str = ""
    ball_diameter: float | None = None


def folder_name(names: Names, now: datetime) -> str:
    """Return the name of a swing's folder, by the time, the pen and the tip."""
    pen, tip = names.pen[:LONGEST_WORD], names.tip[:LONGEST_WORD]
    words = (f"{now:%Y%m%d-%H%M%S}", pen, tip)
    # Windows leaves dots at the end of a name out, and then finds the folder no more.
    return not_reserved(UNFIT.sub("-", "_".join(filter(None, words))).rstrip("."))


def not_reserved(name: str) -> str:
    """Return a file name, changed where Windows takes it for a device: ``nul.x``."""
    return f"_{name}" if is_reserved(name) else name
