"""A swing on disk, image by image, so that a crash loses at most the image in flight.

A record is a folder:

==================== ===================================================================
``header.json``      who, where, with what; written last when the record is made, so
                     that a folder without it is no record
``camera.*``         copy of the camera file, byte by byte
``pen.*``            copy of the pen file
``images/*.png``     the kept images, lossless, numbered from 1
``journal.jsonl``    one line for each thing that happened, appended and never changed
==================== ===================================================================

`lightpen.record.writing` puts an image on the disk before its line, and its line
before it acknowledges the image; `lightpen.record.lock` keeps a second program
from writing meanwhile. A torn last line, or an image without a line, is what
a crash leaves: it was not acknowledged and is passed over. Everything needed to
calibrate again is in the images and the two files; the centres in the journal spare
reading the images when an interrupted swing goes on.
"""

import json
import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any, Self, TypeAlias

import numpy as np

from lightpen.arrays import FloatArray, Image, IntArray
from lightpen.errors import FileError
from lightpen.formats.camera_files import CAMERA_FILE, read_camera
from lightpen.formats.decoding import IMAGE_FILE, MAX_FILE_SIZE, decode_image
from lightpen.formats.files import FOLDER, MEGABYTE, printable, read_bytes, unreadable
from lightpen.formats.images import ImageSource
from lightpen.formats.pen_files import PEN_FILE, read_pen
from lightpen.model.camera import Camera
from lightpen.model.limits import SwingLimits
from lightpen.model.pen import Pen
from lightpen.record.names import Names
from lightpen.sentences import Sentence, sentence

HEADER, JOURNAL, IMAGES = "header.json", "journal.jsonl", "images"
FORMAT = 1
HEADER_LIMIT = MEGABYTE
JOURNAL_LIMIT = 64 * MEGABYTE
TAIL = 16_384  # bytes of a journal that hold its last few lines
DISCARDED = "discarded"
Plain: TypeAlias = str | int | float | bool | None


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
    """

    number: int
    file: Path
    sha256: str
    time: float
    device_time_ns: int | None
    pixels: FloatArray
    rotation: FloatArray
    translation: FloatArray


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
    mask : (M, 3) array
        Circles of stray light: centre x, y and radius, px.
    """

    folder: Path
    images: ImageSource
    camera: Camera
    pen: Pen
    mask: FloatArray
    camera_file: Path
    pen_file: Path


def open_record(folder: Path) -> Record:
    """Open a record, also one whose writer was killed.

    Raises
    ------
    FileError
        The folder is no record, or its files are damaged other than by a crash, or
        written by a later version of the program.
    """
    header = _read_header(folder)
    images: list[RecordedImage] = []
    taken_out: dict[int, str] = {}
    verdict, more = None, None
    lines = _sound_lines(folder)
    for number, line in enumerate(lines, start=1):
        try:
            entries = json.loads(line)
            match entries["kind"]:
                case "image":
                    images.append(_recorded_image(folder, entries))
                    verdict = None
                case "out":
                    taken_out.update(
                        dict.fromkeys(entries["numbers"], entries["reason"])
                    )
                case "back":
                    for image in entries["numbers"]:
                        taken_out.pop(image, None)
                case "verdict":
                    verdict = str(entries["verdict"])
                case "more":
                    more = int(entries["min_images"]), int(entries["max_images"])
        except (ValueError, KeyError, TypeError) as error:
            raise FileError(
                sentence(
                    "record.damaged-line",
                    "Line {line} of {file} is damaged. Restore the file from a "
                    "copy, or remove the line to go on without that image.",
                    line=number,
                    file=printable(str(folder / JOURNAL)),
                )
            ) from error
    return Record(
        folder, header, tuple(images), taken_out, verdict, more, _length_of(lines)
    )


def record_files(record: Record) -> tuple[Path, ...]:
    """Return all files that a record consists of."""
    header = record.header
    names = (
        *(HEADER, JOURNAL),
        *(copy_name("camera", header.camera), copy_name("pen", header.pen)),
    )
    images = (image.file for image in record.images)
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
    known = {image_name(image.number) for image in record.images}
    found = (f"{IMAGES}/{path.name}" for path in (record.folder / IMAGES).glob("*.png"))
    return tuple(sorted(set(found) - known))


def ends_in_verdict(folder: Path) -> bool:
    """Return whether the end of the journal shows a verdict that no image follows.

    No more is read than its last lines, so that thousands of concluded records cost
    little. That no verdict is seen there does not mean that there is none.

    Raises
    ------
    OSError
        There is no journal, or it cannot be read.
    """
    with (folder / JOURNAL).open("rb") as journal:
        length = journal.seek(0, os.SEEK_END)
        journal.seek(max(0, length - TAIL))
        lines = journal.read().split(b"\n")[:-1]
    for line in reversed(lines):
        try:
            kind = json.loads(line)["kind"]
        except (ValueError, KeyError, TypeError):  # torn, cut by the limit, or damaged
            return False
        if kind in ("image", "verdict"):
            return bool(kind == "verdict")
    return False


def source(record: Record) -> RecordSource:
    """Return what the calibration of a record is computed from, now as ever.

    Raises
    ------
    FileError
        The copy of the camera or pen file cannot be read.
    """
    header = record.header
    camera_file = record.folder / copy_name("camera", header.camera)
    pen_file = record.folder / copy_name("pen", header.pen)

    def loaders() -> Iterator[Callable[[], Image]]:
        for image in record.images:
            yield partial(_load, image)

    files = tuple(image.file for image in record.images)
    return RecordSource(
        folder=record.folder,
        images=ImageSource(tuple(file.name for file in files), files, loaders),
        camera=read_camera(camera_file),
        pen=read_pen(pen_file, header.units, header.led_diameter, header.nominal_tip),
        mask=header.mask,
        camera_file=camera_file,
        pen_file=pen_file,
    )


def _load(image: RecordedImage) -> Image:
    data = read_bytes(image.file, IMAGE_FILE, MAX_FILE_SIZE)
    if sha256(data).hexdigest() != image.sha256:
        raise FileError(
            sentence(
                "record.image-changed",
                "{name} is not as it was recorded (wrong checksum). Restore it from "
                "a copy.",
                name=image.file.name,
            )
        )
    return decode_image(data, image.file.name)


def image_name(number: int) -> str:
    """Return the file of an image, from the folder of its record."""
    return f"{IMAGES}/{number:06d}.png"


def copy_name(stem: str, file: FileCopy) -> str:
    """Return the file of a copy, from the folder of its record."""
    return stem + Path(file.name).suffix.lower()


def _recorded_image(folder: Path, entries: Mapping[str, Any]) -> RecordedImage:
    points = [[np.nan, np.nan] if p is None else p for p in entries["pixels"]]
    number = int(entries["number"])
    return RecordedImage(
        number=number,
        file=folder / image_name(number),
        sha256=str(entries["sha256"]),
        time=float(entries["time"]),
        device_time_ns=entries["device_time_ns"],
        pixels=np.array(points, dtype=np.float64).reshape(-1, 2),
        rotation=np.array(entries["rotation"], dtype=np.float64).reshape(3, 3),
        translation=np.array(entries["translation"], dtype=np.float64).reshape(3),
    )


def _sound_lines(folder: Path) -> list[bytes]:
    """Return the lines of the journal but a torn last one."""
    path = folder / JOURNAL
    if path.is_file() and path.stat().st_size == 0:
        return []
    lines = read_bytes(path, sentence("file.journal", "journal"), JOURNAL_LIMIT).split(
        b"\n"
    )[:-1]
    if lines and not _is_whole(lines[-1]):  # blocks of zeros, after a power cut
        lines.pop()
    return lines


def sound_length(folder: Path) -> int:
    """Return how many bytes of the journal in a folder are whole lines."""
    return _length_of(_sound_lines(folder))


def _length_of(lines: list[bytes]) -> int:
    return sum(len(line) + 1 for line in lines)


def _is_whole(line: bytes) -> bool:
    try:
        json.loads(line)
    except ValueError:
        return False
    return True


def _read_header(folder: Path) -> Header:
    path = folder / HEADER
    header = sentence("file.header", "record's header")
    data = read_bytes(path, header, HEADER_LIMIT)
    try:
        entries = json.loads(data)
        if entries["format"] > FORMAT:
            raise _of_later_version(path, entries["format"])
        if entries["format"] != FORMAT:
            raise ValueError(entries["format"])
        tip = entries["nominal_tip_mm"]
        return Header(
            camera=_read_copy(folder, "camera", CAMERA_FILE, entries["camera_file"]),
            pen=_read_copy(folder, "pen", PEN_FILE, entries["pen_file"]),
            created=datetime.fromisoformat(entries["created"]),
            program=entries["program"],
            station=entries["station"],
            operator=entries["operator"],
            tip=entries["tip"],
            cone=entries["cone"],
            units=entries["units"],
            led_diameter=entries["led_diameter_mm"],
            nominal_tip=None if tip is None else np.array(tip, dtype=np.float64),
            mask=np.array(entries["mask_px"], dtype=np.float64).reshape(-1, 3),
            settings=entries["settings"],
        )
    except (ValueError, KeyError, TypeError) as error:
        raise FileError(
            sentence(
                "record.damaged",
                "{path} is damaged. Restore it from a copy.",
                path=printable(str(path)),
            )
        ) from error


def _of_later_version(path: Path, number: Any) -> FileError:
    return FileError(
        sentence(
            "record.later-version",
            "{path} was written by a later version of the program (format {number}; "
            "this version reads {known}). Open the record with that version.",
            path=printable(str(path)),
            number=number,
            known=FORMAT,
        )
    )


def _read_copy(
    folder: Path, stem: str, what: Sentence, entries: Mapping[str, str]
) -> FileCopy:
    name = entries["name"]
    path = folder / (stem + Path(name).suffix.lower())
    data = read_bytes(path, what, 4 * MEGABYTE)
    if sha256(data).hexdigest() != entries["sha256"]:
        raise FileError(
            sentence(
                "record.file-changed",
                "{path} is not as it was recorded (wrong checksum). Restore it from "
                "a copy.",
                path=printable(str(path)),
            )
        )
    return FileCopy(name, data)


def recorded_names(record: Record) -> Names:
    """Return who calibrated what in a record."""
    header = record.header
    return Names(
        station=header.station,
        operator=header.operator,
        pen=str(header.settings.get("pen", "")),
        tip=header.tip,
        cone=header.cone,
        ball_diameter=_number(record, "ball_diameter_mm", 0.0) or None,
    )


def recorded_limits(record: Record) -> SwingLimits:
    """Return what a record's swing needed, and when it was to end."""
    usual = SwingLimits()
    return SwingLimits(
        max_uncertainty=_number(record, "max_uncertainty_mm", usual.max_uncertainty),
        min_images=int(_number(record, "min_images", usual.min_images)),
        max_images=int(_number(record, "max_images", usual.max_images)),
        min_per_field=int(_number(record, "min_per_field", usual.min_per_field)),
        spacing=_number(record, "spacing_rad", usual.spacing),
    )


def _number(record: Record, key: str, usual: float) -> float:
    """Return a number of a record's settings; older programs wrote fewer of them."""
    value = record.header.settings.get(key)
    return value if isinstance(value, int | float) else usual
