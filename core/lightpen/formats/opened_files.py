"""The files that a user opened: where each is, and what it holds."""

from dataclasses import dataclass
from pathlib import Path
from typing import Self

from lightpen.errors import LightpenError
from lightpen.formats.camera_files import read_camera
from lightpen.formats.pen_files import read_pen
from lightpen.formats.rig_files import RigFile, read_rig
from lightpen.formats.simulated_files import is_simulated
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen.sentences import Sentence


@dataclass(frozen=True, eq=False)
class CameraFile:
    """An intrinsics file that was read.

    Attributes
    ----------
    is_simulated : bool
        Whether it is of a simulated camera.
    """

    path: Path
    camera: Camera
    is_simulated: bool = False

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read it.

        Raises
        ------
        FileError
            It cannot be read.
        """
        return cls(path, read_camera(path), is_simulated(path))


@dataclass(frozen=True, eq=False)
class PenFile:
    """An LED geometry file that was read.

    Attributes
    ----------
    units : str or None
        That were given for a file that does not say.
    is_simulated : bool
        Whether it is of a simulated pen.
    """

    path: Path
    pen: Pen
    units: str | None = None
    is_simulated: bool = False

    @classmethod
    def read(cls, path: Path, units: str | None = None) -> Self:
        """Read it.

        Raises
        ------
        UsageError
            The file does not say its units, and none are given.
        FileError
            It cannot be read.
        """
        return cls(path, read_pen(path, units), units, is_simulated(path))


@dataclass(frozen=True, eq=False)
class OpenedFiles:
    """The files of a station, as far as they can be read.

    Attributes
    ----------
    troubles : tuple of Sentence
        Why a file must be chosen again.
    """

    camera_file: CameraFile | None = None
    pen_file: PenFile | None = None
    rig_file: RigFile | None = None
    troubles: tuple[Sentence, ...] = ()


def open_files(
    camera_path: Path | None,
    pen_path: Path | None,
    units: str | None = None,
    rig_path: Path | None = None,
) -> OpenedFiles:
    """Read the files that were in use before, each whether or not the others can be.

    Parameters
    ----------
    camera_path, pen_path, rig_path : Path or None
        None where there was no such file.
    units : str, optional
        Of a pen file that does not say.
    """
    camera_file, pen_file, rig_file, troubles = None, None, None, []
    try:
        camera_file = None if camera_path is None else CameraFile.read(camera_path)
    except LightpenError as error:
        troubles.append(error.sentence)
    try:
        pen_file = None if pen_path is None else PenFile.read(pen_path, units)
    except LightpenError as error:
        troubles.append(error.sentence)
    try:
        rig_file = None if rig_path is None else read_rig(rig_path)
    except LightpenError as error:
        troubles.append(error.sentence)
    return OpenedFiles(camera_file, pen_file, rig_file, tuple(troubles))
