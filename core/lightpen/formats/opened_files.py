"""The files opened at a station: their paths and contents."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Self, TypeVar

from lightpen.errors import LightpenError
from lightpen.formats.camera_files import read_camera
from lightpen.formats.files import sha256
from lightpen.formats.pen_files import read_pen
from lightpen.formats.rig_files import RigFile, read_rig
from lightpen.formats.simulated_files import is_simulated
from lightpen.messages import Message
from lightpen.model.camera import Camera
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
