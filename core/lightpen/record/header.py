"""The header of a record: who, where, with what a swing was captured.

It is written last when a record is made. Beside it stand copies, byte by byte, of the
files it names. Header and copies each have their checksum; those of headers records of
format 1 lacked.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Self

import numpy as np
from msgspec import Meta, Struct

from lightpen.arrays import FloatArray
from lightpen.errors import FileError
from lightpen.formats.camera_files import CAMERA_FILE
from lightpen.formats.files import MEGABYTE, printable, read_bytes
from lightpen.formats.own_json import (
    DamagedError,
    Digest,
    Length,
    Moment,
    Vector,
    has_checksum,
    parse_own_json,
    require_path,
    require_usual,
)
from lightpen.formats.pen_files import PEN_FILE
from lightpen.formats.rig_files import RIG_FILE
from lightpen.model.limits import SwingLimits
from lightpen.record.assumed import Plain, recorded_assumptions
from lightpen.sentences import Sentence, sentence

HEADER = "header.json"
FORMAT = 2
RIG_FORMAT = 3  # which earlier versions would take for the first camera alone
FIRST_WITH_CHECKSUMS = 2
HEADER_LIMIT = MEGABYTE
CAMERA_STEM, PEN_STEM, RIG_STEM = "camera", "pen", "rig"


@dataclass(frozen=True)
class FileCopy:
    """A file's name and its bytes."""

    name: str
    data: bytes

    @classmethod
    def of(cls, path: Path, what: Sentence) -> Self:
        """Read a file; ``what`` it is, for the sentences."""
        return cls(path.name, read_bytes(path, what, 4 * MEGABYTE))


@dataclass(frozen=True, eq=False)
class RigCopies:
    """What a record keeps of a rig besides its first camera.

    Attributes
    ----------
    file : FileCopy
        Of the rig.
    cameras : tuple of FileCopy
        The files of the other cameras.
    masks : tuple of (M, 3) array
        Stray light in the images of each of them, px.
    """

    file: FileCopy
    cameras: tuple[FileCopy, ...]
    masks: tuple[FloatArray, ...]


@dataclass(frozen=True, eq=False)
class Header:
    """What a swing was captured with.

    Attributes
    ----------
    created : datetime
        With its time zone.
    program : str
        Name and version.
    units : str or None
        Of a pen file that does not say.
    led_diameter : float or None
        mm, in place of the pen file's.
    nominal_tip : (3,) array or None
        mm, in place of the pen file's.
    mask : (M, 3) array
        Circles of stray light: centre x, y and radius, px.
    settings : mapping
        What else the program wants to keep: exposure, limits, camera serial.
    rig : RigCopies or None
        Of a swing before several cameras.
    """

    camera: FileCopy
    pen: FileCopy
    created: datetime
    program: str = ""
    station: str = ""
    operator: str = ""
    tip: str = ""
    cone: str = ""
    units: str | None = None
    led_diameter: float | None = None
    nominal_tip: FloatArray | None = None
    mask: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    settings: Mapping[str, Plain] = field(default_factory=dict)
    rig: RigCopies | None = None

    @property
    def n_cameras(self) -> int:
        """Number of cameras."""
        return 1 if self.rig is None else 1 + len(self.rig.cameras)


class FileEntry(Struct):
    """The name of a file and the checksum of its copy, as the header has them."""

    name: str
    sha256: Digest

    def __post_init__(self) -> None:
        require_path(self.name)


class RigEntries(Struct):
    """See `RigCopies`."""

    rig_file: FileEntry
    camera_files: tuple[FileEntry, ...]
    masks_px: tuple[tuple[Vector, ...], ...]

    def __post_init__(self) -> None:
        if not 1 <= len(self.camera_files) == len(self.masks_px):
            raise ValueError("Each of the other cameras has a file and a mask.")


class _Format(Struct):
    format: Annotated[int, Meta(ge=1)]


class HeaderEntries(Struct, omit_defaults=True):
    """The header as it is written; see `Header`."""

    format: int
    created: Moment
    program: str
    station: str
    operator: str
    tip: str
    cone: str
    camera_file: FileEntry
    pen_file: FileEntry
    units: str | None
    led_diameter_mm: Length | None
    nominal_tip_mm: Vector | None
    mask_px: tuple[Vector, ...]
    settings: dict[str, Plain]
    rig: RigEntries | None = None

    def __post_init__(self) -> None:
        require_usual(self.created)
        limits_in(self.settings)
        recorded_assumptions(self.settings)


def read_entries(folder: Path) -> HeaderEntries:
    """Read the header of a record as it is written.

    Raises
    ------
    FileError
        It is damaged, or of a later version of the program.
    """
    path = folder / HEADER
    data = read_bytes(path, sentence("file.header", "record's header"), HEADER_LIMIT)
    try:
        is_sound = has_checksum(data)
        number = parse_own_json(data, _Format).format
        if number > RIG_FORMAT:
            raise _of_later_version(path, number)
        if number >= FIRST_WITH_CHECKSUMS and not is_sound:
            raise DamagedError("There is no checksum.")
        return parse_own_json(data, HeaderEntries)
    except DamagedError as error:
        raise damaged_file(path) from error


def header_of(folder: Path, entries: HeaderEntries) -> Header:
    """Return the header with the copies of the files that it names.

    Raises
    ------
    FileError
        One of the copies is not as it was recorded.
    """
    tip = entries.nominal_tip_mm
    return Header(
        camera=_read_copy(folder, CAMERA_STEM, CAMERA_FILE, entries.camera_file),
        pen=_read_copy(folder, PEN_STEM, PEN_FILE, entries.pen_file),
        created=entries.created,
        program=entries.program,
        station=entries.station,
        operator=entries.operator,
        tip=entries.tip,
        cone=entries.cone,
        units=entries.units,
        led_diameter=entries.led_diameter_mm,
        nominal_tip=None if tip is None else np.array(tip, dtype=np.float64),
        mask=np.array(entries.mask_px, dtype=np.float64).reshape(-1, 3),
        settings=entries.settings,
        rig=None if entries.rig is None else _rig_copies(folder, entries.rig),
    )


def _rig_copies(folder: Path, entries: RigEntries) -> RigCopies:
    cameras = enumerate(entries.camera_files, start=1)
    return RigCopies(
        file=_read_copy(folder, RIG_STEM, RIG_FILE, entries.rig_file),
        cameras=tuple(
            _read_copy(folder, camera_stem(c), CAMERA_FILE, each) for c, each in cameras
        ),
        masks=tuple(
            np.array(mask, dtype=np.float64).reshape(-1, 3) for mask in entries.masks_px
        ),
    )


def header_copies(header: Header) -> Mapping[str, FileCopy]:
    """Return the copies that a record keeps, by their files from its folder."""
    by_stem = {CAMERA_STEM: header.camera, PEN_STEM: header.pen}
    if header.rig is not None:
        by_stem[RIG_STEM] = header.rig.file
        for c, file in enumerate(header.rig.cameras, start=1):
            by_stem[camera_stem(c)] = file
    return {copy_name(stem, file): file for stem, file in by_stem.items()}


def copy_name(stem: str, file: FileCopy | FileEntry) -> str:
    """Return the file of a copy, from the folder of its record."""
    return stem + Path(file.name).suffix.lower()


def camera_stem(c: int) -> str:
    """Return what the copy of the file of the c-th camera is called."""
    return CAMERA_STEM if c == 0 else f"{CAMERA_STEM}-{c + 1}"


def _read_copy(folder: Path, stem: str, what: Sentence, entry: FileEntry) -> FileCopy:
    path = folder / copy_name(stem, entry)
    data = read_bytes(path, what, 4 * MEGABYTE)
    if sha256(data).hexdigest() != entry.sha256:
        raise FileError(
            sentence(
                "record.file-changed",
                "{path} is not as it was recorded (wrong checksum). Restore it from "
                "a copy.",
                path=printable(str(path)),
            )
        )
    return FileCopy(entry.name, data)


def damaged_file(path: Path) -> FileError:
    """Return the error of a file of a record, other than an image or a copy."""
    return FileError(
        sentence(
            "record.damaged",
            "{path} is damaged. Restore it from a copy.",
            path=printable(str(path)),
        )
    )


def _of_later_version(path: Path, number: int) -> FileError:
    return FileError(
        sentence(
            "record.later-version",
            "{path} was written by a later version of the program (format {number}; "
            "this version reads up to {known}). Open the record with that version.",
            path=printable(str(path)),
            number=number,
            known=RIG_FORMAT,
        )
    )


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
    )


def number_in(settings: Mapping[str, Plain], key: str, usual: float) -> float:
    """Return a number of a record's settings; older programs wrote fewer of them."""
    value = settings.get(key)
    return value if isinstance(value, int | float) else usual
