"""Recorded images: the files beside them, and whether they were simulated."""

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from lightpen.errors import FileError
from lightpen.formats.images import IMAGE_FOLDER
from lightpen.formats.simulated_files import is_simulated
from lightpen.model.origin import Origin
from lightpen.record.swings.header import copy_name
from lightpen.record.swings.reading import is_record, open_record, recorded_origin

CAMERA_FILES = ("camera.yaml", "camera.yml", "camera.json", "camera.xml")
CAMERA_SUFFIXES = tuple(Path(name).suffix for name in CAMERA_FILES)
PEN_FILES = ("leds.csv", "pen.json", "leds.json", "pen.csv")


@dataclass(frozen=True)
class FilesBeside:
    """Files beside recorded images that probably belong to them, if any."""

    camera: Path | None = None
    pen: Path | None = None


def files_beside(place: str) -> FilesBeside:
    """Return the camera and pen file in the folder of recorded images, or of a swing.

    The place is a folder, pattern or video; or a camera file, which is offered itself.
    """
    with suppress(OSError, ValueError, FileError):
        chosen = folder = Path(place)
        if not folder.is_dir():
            folder = folder.parent
        if chosen.suffix.lower() in CAMERA_SUFFIXES and chosen.is_file():
            camera = None if chosen.name in PEN_FILES else chosen
            return FilesBeside(camera, _first(folder, PEN_FILES))
        if folder.name == IMAGE_FOLDER:
            folder = folder.parent
        if is_record(folder):
            header = open_record(folder).header
            return FilesBeside(
                folder / copy_name("camera", header.camera_file),
                folder / copy_name("pen", header.pen_file),
            )
        return FilesBeside(_first(folder, CAMERA_FILES), _first(folder, PEN_FILES))
    return FilesBeside()


def is_simulated_recording(place: str) -> bool:
    """Return whether images, or those of a recorded swing, were simulated."""
    folder = Path(place)
    if is_simulated(folder):
        return True
    with suppress(OSError, ValueError, FileError):
        if folder.name == IMAGE_FOLDER:
            folder = folder.parent
        return is_record(folder) and (
            recorded_origin(open_record(folder)) is Origin.SIMULATED
        )
    return False


def _first(folder: Path, names: tuple[str, ...]) -> Path | None:
    files = (folder / name for name in names)
    return next((file for file in files if file.is_file()), None)
