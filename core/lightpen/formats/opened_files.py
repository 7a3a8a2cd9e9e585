"""The files opened at a station: their paths and contents."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from hashlib import sha256 as sha256_of
from itertools import chain
from pathlib import Path
from typing import Self, TypeVar

from lightpen.arrays import FloatArray
from lightpen.errors import LightpenError
from lightpen.formats.camera_files import read_camera
from lightpen.formats.files import A_FILE, MEGABYTE, is_simulated, read_bytes, sha256
from lightpen.formats.pen_files import read_pen
from lightpen.formats.rig_files import RigFile, read_rig
from lightpen.messages import Message
from lightpen.model.camera import Camera
from lightpen.model.names import Origin
from lightpen.model.pen import Pen

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class CameraFile:
    """An intrinsics file that was read, with the hash of its content."""

    path: Path
    camera: Camera
    is_simulated: bool = False
    sha256: str = ""

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read it."""
        return cls(path, read_camera(path), is_simulated(path), sha256(path))


@dataclass(frozen=True, eq=False)
class PenFile:
    """An LED geometry file that was read."""

    path: Path
    pen: Pen
    units: str | None = None  # given for a file that states none
    is_simulated: bool = False
    sha256: str = ""  # of the content read; empty for a pen in no file yet

    @classmethod
    def read(cls, path: Path, units: str | None = None) -> Self:
        """Read it; raise `UsageError` unless the units are in the file or given."""
        pen = read_pen(path, units)
        return cls(path, pen, units, is_simulated(path), sha256(path))


@dataclass(frozen=True, eq=False)
class OpenedFiles:
    """The readable files of a station, and why others must be chosen again."""

    camera_file: CameraFile | None = None
    pen_file: PenFile | None = None
    rig_file: RigFile | None = None
    faults: tuple[Message, ...] = ()


def open_files(
    camera_path: Path | None,
    pen_path: Path | None,
    units: str | None = None,
    rig_path: Path | None = None,
) -> OpenedFiles:
    """Read the files last in use, each independently of the others; None if not in use.

    ``units`` apply to a pen file that states none.
    """
    faults: list[Message] = []

    def opened(read: Callable[[Path], T], path: Path | None) -> T | None:
        try:
            return None if path is None else read(path)
        except LightpenError as error:
            faults.append(error.message)
            return None

    camera_file = opened(CameraFile.read, camera_path)
    pen_file = opened(partial(PenFile.read, units=units), pen_path)
    return OpenedFiles(camera_file, pen_file, opened(read_rig, rig_path), tuple(faults))


LIMIT = 16 * MEGABYTE  # of a file that is kept in the record


@dataclass(frozen=True)
class InputFile:
    """An input file of a calibration."""

    path: Path
    sha256: str
    content: bytes | None = None  # in the record, to recompute from that alone


@dataclass(frozen=True)
class RigInputs:
    """The rig file and the camera files of several cameras."""

    rig: InputFile
    cameras: tuple[InputFile, ...]


@dataclass(frozen=True, eq=False)
class Inputs:
    """The inputs of a calibration."""

    camera: InputFile
    pen: InputFile
    observations: tuple[InputFile, ...]  # images, video, or file of LED centres
    nominal_tip: FloatArray | None
    rig: RigInputs | None = None
    origin: Origin | None = None
    units: str | None = None  # units of a pen file that states none
    led_diameter: float | None = None  # of the discs, mm, if the pen file has none


def hashed(path: Path) -> InputFile:
    """Return a file with its hash."""
    return InputFile(path, sha256(path))


def with_content(path: Path) -> InputFile:
    """Return a file with its hash and its content."""
    content = read_bytes(path, A_FILE, LIMIT)
    return InputFile(path, sha256_of(content).hexdigest(), content)


def all_hashed(paths: Sequence[Path]) -> tuple[InputFile, ...]:
    """Return files with their hashes, computed in parallel."""
    n_threads = os.cpu_count() or 1
    n_each = -(-len(paths) // n_threads) or 1  # taking one by one, threads wait in turn
    shares = [paths[i : i + n_each] for i in range(0, len(paths), n_each)]
    with ThreadPoolExecutor(n_threads) as executor:
        found = executor.map(lambda some: list(map(hashed, some)), shares)
        return tuple(chain.from_iterable(found))
