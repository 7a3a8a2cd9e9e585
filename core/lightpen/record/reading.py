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
``journal.jsonl``    what happened, see `lightpen.record.journal`
``swing.lightpen``   opens the swing in the program; holds nothing that is needed
==================== ===================================================================

The images of the touches of a verification are kept in such a record, too; each then
says of which touch it is.

`lightpen.record.writing` puts an image on the disk before its line, and its line
before it acknowledges the image; `lightpen.record.lock` keeps a second program
from writing meanwhile. An image without a line is what a crash leaves: it was not
acknowledged and is passed over. Header, lines and images each have their checksum;
those of header and lines records of format 1 lacked. Everything needed to
calibrate again is in the images and the two files; the centres in the journal spare
reading the images when an interrupted swing goes on.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Self

import numpy as np
from msgspec import Meta, Struct
from msgspec.structs import asdict

from lightpen.arrays import FloatArray, Image, IntArray
from lightpen.cameras.protocol import Stats
from lightpen.errors import FileError
from lightpen.formats.camera_files import CAMERA_FILE, read_camera
from lightpen.formats.decoding import IMAGE_FILE, MAX_FILE_SIZE, decode_image
from lightpen.formats.files import FOLDER, MEGABYTE, printable, read_bytes, unreadable
from lightpen.formats.images import ImageSource
from lightpen.formats.own_json import (
    DamagedError,
    Digest,
    Length,
    Moment,
    Vector,
    has_checksum,
    parse_json,
    require_path,
    require_usual,
)
from lightpen.formats.pen_files import PEN_FILE, read_pen
from lightpen.formats.rig_files import RIG_FILE, read_rig
from lightpen.model.assumptions import USUAL, Assumptions
from lightpen.model.camera import Camera
from lightpen.model.limits import SwingLimits
from lightpen.model.origin import Origin
from lightpen.model.pen import Pen
from lightpen.model.rig import Rig
from lightpen.record.assumed import Plain, recorded_assumptions
from lightpen.record.journal import (
    JOURNAL,
    BackLine,
    ImageLine,
    Line,
    MoreLine,
    OtherImage,
    OutLine,
    TakenOutLine,
    VerdictLine,
    damaged_line,
    length_of,
    parse_lines,
    read_lines,
)
from lightpen.record.names import Names
from lightpen.sentences import Sentence, sentence

HEADER, IMAGES = "header.json", "images"
OPENER = "swing.lightpen"  # by its suffix the system knows the program
FORMAT = 2
RIG_FORMAT = 3  # which earlier versions would take for the first camera alone
FIRST_WITH_CHECKSUMS = 2
HEADER_LIMIT = MEGABYTE
DISCARDED = "discarded"
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
        _limits(self.settings)
        recorded_assumptions(self.settings)


@dataclass(frozen=True, eq=False)
class RecordedImage:
    """An acknowledged image.

    Attributes
    ----------
    time : float
        s, by the clock of the session that took it.
    device_time_ns : int or None
        By the clock of the camera.
    pixels : (L, 2) array
        Ellipse centres of the LEDs, px; NaN where an LED was not seen.
    rotation, translation : (3, 3) and (3,) array
        cam_from_pen, mm.
    stats : Stats
        What became of the camera's images since the swing began.
    others : tuple of OtherImage
        Of the other cameras of a rig at this moment.
    touch : int
        Of a verification that it belongs to, from 1; 0 of a swing.
    """

    number: int
    file: Path
    sha256: str
    time: float
    device_time_ns: int | None
    pixels: FloatArray
    rotation: FloatArray
    translation: FloatArray
    stats: Stats = field(default_factory=Stats)
    others: tuple[OtherImage, ...] = ()
    touch: int = 0

    @property
    def rig_pixels(self) -> FloatArray:
        """Centres by all cameras, (C, L, 2), px; NaN where an LED was not seen."""
        return np.stack([self.pixels, *(_points(each.pixels) for each in self.others)])


@dataclass(frozen=True, eq=False)
class Record:
    """A swing as it is on disk.

    Attributes
    ----------
    images : tuple of RecordedImage
        All that were acknowledged, in the order of capture.
    taken_out : mapping of int to str
        Numbers of images that do not take part, and why.
    verdict : str or None
        The last one; None if the swing was interrupted.
    more : pair of int or None
        Least and greatest number of images that were asked for after a verdict.
    length : int
        Of what was read of the journal, bytes.
    """

    folder: Path
    header: Header
    images: tuple[RecordedImage, ...]
    taken_out: Mapping[int, str]
    verdict: str | None
    more: tuple[int, int] | None
    length: int

    @property
    def used_images(self) -> tuple[RecordedImage, ...]:
        """The images that take part."""
        return tuple(i for i in self.images if i.number not in self.taken_out)

    @property
    def all_numbers(self) -> IntArray:
        """Numbers of all images."""
        return np.array([i.number for i in self.images], dtype=np.int64)

    @property
    def numbers(self) -> IntArray:
        """Numbers of the images that take part, (N,)."""
        return np.array([i.number for i in self.used_images], dtype=np.int64)

    @property
    def stats(self) -> Stats:
        """What became of the camera's images up to the last one that was kept."""
        return self.images[-1].stats if self.images else Stats()

    @property
    def next_number(self) -> int:
        """Number that the next image gets."""
        return self.images[-1].number + 1 if self.images else 1


@dataclass(frozen=True, eq=False)
class RecordSource:
    """What a calibration is computed from.

    Attributes
    ----------
    folder : Path
        Of the record.
    images : ImageSource
        All images, in the order of capture; a damaged one raises `FileError` when
        loaded.
    rig : Rig or None
        Of several cameras.
    other_images : tuple of ImageSource
        Of the other cameras of a rig, of the same moments.
    masks : tuple of (M, 3) array
        Circles of stray light before each camera: centre x, y and radius, px.
    assumptions : Assumptions
        What stands in for what the files do not state.
    origin : Origin or None
        What the images are of; None where the record does not say.
    units, led_diameter
        As of `Header`.
    """

    folder: Path
    images: ImageSource
    camera: Camera
    pen: Pen
    masks: tuple[FloatArray, ...]
    camera_files: tuple[Path, ...]
    pen_file: Path
    assumptions: Assumptions = USUAL
    origin: Origin | None = None
    units: str | None = None
    led_diameter: float | None = None
    rig: Rig | None = None
    rig_file: Path | None = None
    other_images: tuple[ImageSource, ...] = ()


def open_record(folder: Path) -> Record:
    """Open a record, also one whose writer was killed.

    Raises
    ------
    FileError
        The folder is no record, or its files are damaged other than by a crash, or
        written by a later version of the program.
    """
    entries = _read_header(folder)
    header = _header(folder, entries)
    lines = read_lines(folder)
    has_checksums = entries.format >= FIRST_WITH_CHECKSUMS
    parsed = parse_lines(lines, folder, have_checksums=has_checksums)
    last = 0
    for number, line in enumerate(parsed, start=1):
        if isinstance(line, ImageLine):
            others = (len(other.pixels) for other in line.others)
            n_seen = [len(line.pixels), *others]
            is_whole = n_seen == header.n_cameras * [_n_leds(parsed)]
            if line.number <= last or not is_whole:
                raise damaged_line(folder, number)
            last = line.number
    return _record(folder, header, parsed, length_of(lines))


def _n_leds(lines: Sequence[Line]) -> int:
    """Return how many LEDs the first image tells of."""
    return next(len(line.pixels) for line in lines if isinstance(line, ImageLine))


def _record(folder: Path, header: Header, lines: Sequence[Line], length: int) -> Record:
    """Return what a record comes to, line by line."""
    images: list[RecordedImage] = []
    taken_out: dict[int, str] = {}
    verdict, more = None, None
    for line in lines:
        match line:
            case ImageLine():
                images.append(_recorded_image(folder, line))
                verdict = None
            case OutLine():
                taken_out.update(dict.fromkeys(line.numbers, line.reason))
            case BackLine():
                for image in line.numbers:
                    taken_out.pop(image, None)
            case TakenOutLine():
                taken_out = {n: why for why, ns in line.reasons.items() for n in ns}
            case VerdictLine():
                verdict = line.verdict
            case MoreLine():
                more = line.min_images, line.max_images
    return Record(folder, header, tuple(images), taken_out, verdict, more, length)


def record_files(record: Record) -> tuple[Path, ...]:
    """Return all files that a record of a swing consists of."""
    header = record.header
    names = (HEADER, JOURNAL, OPENER, *header_copies(header))
    images = (
        record.folder / image_name(image.number, c)
        for image in record.images
        for c in range(header.n_cameras)
    )
    return (*(record.folder / name for name in names), *images)


def is_record(folder: Path) -> bool:
    """Return whether a folder is a record.

    Raises
    ------
    FileError
        The folder may not be looked into.
    """
    try:
        return (folder / HEADER).is_file() and (folder / JOURNAL).is_file()
    except OSError as error:
        raise unreadable(folder, FOLDER, error) from error


def missing_parts(folder: Path) -> tuple[str, ...]:
    """Return what a folder lacks that looks like a record; nothing of any other."""
    parts = (HEADER, JOURNAL, IMAGES)
    missing = tuple(name for name in parts if not (folder / name).exists())
    return missing if len(missing) < len(parts) else ()


def unacknowledged_images(record: Record) -> tuple[str, ...]:
    """Return the images in the folder of a record that its journal does not name.

    A crash, or a journal that was cut, leaves them; they take no part.

    Returns
    -------
    tuple of str
        Files, from the folder of the record, in their order.
    """
    cameras = range(record.header.n_cameras)
    known = {image_name(image.number, c) for image in record.images for c in cameras}
    found = (
        f"{images_folder(c)}/{path.name}"
        for c in cameras
        for path in (record.folder / images_folder(c)).glob("*.png")
    )
    return tuple(sorted(set(found) - known))


def source(record: Record) -> RecordSource:
    """Return what the calibration of a record is computed from, now as ever.

    Raises
    ------
    FileError
        The copy of the camera or pen file cannot be read.
    """
    header = record.header
    camera_file = record.folder / copy_name(CAMERA_STEM, header.camera)
    pen_file = record.folder / copy_name(PEN_STEM, header.pen)

    rig_file, rig = None, None
    masks: tuple[FloatArray, ...] = (header.mask,)
    camera_files: tuple[Path, ...] = (camera_file,)
    if header.rig is not None:
        rig_file = record.folder / copy_name(RIG_STEM, header.rig.file)
        camera_files += tuple(
            record.folder / copy_name(camera_stem(c), file)
            for c, file in enumerate(header.rig.cameras, start=1)
        )
        rig = read_rig(rig_file, camera_files).rig
        masks += header.rig.masks
    images = [_images_of(record, c) for c in range(len(camera_files))]
    return RecordSource(
        folder=record.folder,
        images=images[0],
        camera=read_camera(camera_file) if rig is None else rig.cameras[0],
        pen=read_pen(pen_file, header.units, header.led_diameter, header.nominal_tip),
        masks=masks,
        camera_files=camera_files,
        pen_file=pen_file,
        assumptions=recorded_assumptions(header.settings),
        origin=recorded_origin(record),
        units=header.units,
        led_diameter=header.led_diameter,
        rig=rig,
        rig_file=rig_file,
        other_images=tuple(images[1:]),
    )


def _images_of(record: Record, c: int) -> ImageSource:
    """Return the images of the c-th camera."""
    files = tuple(record.folder / image_name(i.number, c) for i in record.images)
    hashes = [
        image.sha256 if c == 0 else image.others[c - 1].sha256
        for image in record.images
    ]

    def loaders() -> Iterator[Callable[[], Image]]:
        for file, digest in zip(files, hashes, strict=True):
            yield partial(_load, file, digest)

    return ImageSource(tuple(file.name for file in files), files, loaders)


def _load(file: Path, digest: str) -> Image:
    data = read_bytes(file, IMAGE_FILE, MAX_FILE_SIZE)
    if sha256(data).hexdigest() != digest:
        raise FileError(
            sentence(
                "record.image-changed",
                "{name} is not as it was recorded (wrong checksum). Restore it from "
                "a copy.",
                name=file.name,
            )
        )
    return decode_image(data, file.name)


def images_folder(c: int) -> str:
    """Return the folder of the images of the c-th camera, from that of its record."""
    return IMAGES if c == 0 else f"{IMAGES}-{c + 1}"


def image_name(number: int, c: int = 0) -> str:
    """Return the file of an image of the c-th camera, from the folder of its record."""
    return f"{images_folder(c)}/{number:06d}.png"


def camera_stem(c: int) -> str:
    """Return what the copy of the file of the c-th camera is called."""
    return CAMERA_STEM if c == 0 else f"{CAMERA_STEM}-{c + 1}"


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


def _recorded_image(folder: Path, line: ImageLine) -> RecordedImage:
    return RecordedImage(
        number=line.number,
        file=folder / image_name(line.number),
        sha256=line.sha256,
        time=line.time,
        device_time_ns=line.device_time_ns,
        pixels=_points(line.pixels),
        rotation=np.array(line.rotation, dtype=np.float64),
        translation=np.array(line.translation, dtype=np.float64),
        stats=Stats() if line.camera is None else Stats(**asdict(line.camera)),
        others=line.others,
        touch=line.touch,
    )


def _points(pixels: Sequence[tuple[float, float] | None]) -> FloatArray:
    """Return LED centres (L, 2), px; NaN where an LED was not seen."""
    points = [(np.nan, np.nan) if p is None else p for p in pixels]
    return np.array(points, dtype=np.float64).reshape(-1, 2)


def _read_header(folder: Path) -> HeaderEntries:
    path = folder / HEADER
    data = read_bytes(path, sentence("file.header", "record's header"), HEADER_LIMIT)
    try:
        is_sound = has_checksum(data)
        number = parse_json(data, _Format).format
        if number > RIG_FORMAT:
            raise _of_later_version(path, number)
        if number >= FIRST_WITH_CHECKSUMS and not is_sound:
            raise DamagedError("There is no checksum.")
        return parse_json(data, HeaderEntries)
    except DamagedError as error:
        raise damaged_file(path) from error


def _header(folder: Path, entries: HeaderEntries) -> Header:
    """Return the header with the copies of the files that it names."""
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


def recorded_names(record: Record) -> Names:
    """Return who calibrated what in a record."""
    header = record.header
    return Names(
        station=header.station,
        operator=header.operator,
        pen=str(header.settings.get("pen", "")),
        tip=header.tip,
        cone=header.cone,
        ball_diameter=_number(header.settings, "ball_diameter_mm", 0.0) or None,
    )


def recorded_origin(record: Record) -> Origin | None:
    """Return what the images of a record are of; None if it does not say.

    Records of earlier versions name the kind of the source alone.
    """
    settings = record.header.settings
    said = settings.get("origin", settings.get("source"))
    return Origin(said) if said in set(Origin) else None


def is_of_recording(record: Record) -> bool:
    """Return whether the images of a record were recorded before its swing."""
    return record.header.settings.get("source") == Origin.RECORDED


def recorded_limits(record: Record) -> SwingLimits:
    """Return what a record's swing needed, and when it was to end."""
    return _limits(record.header.settings)


def _limits(settings: Mapping[str, Plain]) -> SwingLimits:
    """Return the limits in the settings of a header; `ValueError` if there are none."""
    usual = SwingLimits()
    return SwingLimits(
        max_uncertainty=_number(settings, "max_uncertainty_mm", usual.max_uncertainty),
        min_images=int(_number(settings, "min_images", usual.min_images)),
        max_images=int(_number(settings, "max_images", usual.max_images)),
        min_per_field=int(_number(settings, "min_per_field", usual.min_per_field)),
        spacing=_number(settings, "spacing_rad", usual.spacing),
    )


def _number(settings: Mapping[str, Plain], key: str, usual: float) -> float:
    """Return a number of a record's settings; older programs wrote fewer of them."""
    value = settings.get(key)
    return value if isinstance(value, int | float) else usual
