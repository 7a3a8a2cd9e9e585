"""Where images of touches are: folders, patterns and videos, and records of swings."""

from dataclasses import dataclass
from pathlib import Path

from lightpen.arrays import FloatArray
from lightpen.errors import FileError
from lightpen.formats.files import FOLDER, unreadable
from lightpen.formats.images import ImageSource, find_images, natural_order
from lightpen.model.camera import Camera
from lightpen.model.origin import Origin
from lightpen.model.pen import Pen
from lightpen.record.reading import is_record, open_record, recorded_origin, source
from lightpen.record.recordings import is_simulated_recording


@dataclass(frozen=True, eq=False)
class TouchPlace:
    """Images of touches, and the files that they bring if they are a record's.

    Attributes
    ----------
    mask : (M, 3) array or None
        Circles of stray light: centre x, y and radius, px.
    """

    name: str
    images: ImageSource
    origin: Origin | None
    camera: Camera | None = None
    camera_file: Path | None = None
    pen: Pen | None = None
    pen_file: Path | None = None
    mask: FloatArray | None = None


def touch_place(where: tuple[str, ...]) -> TouchPlace:
    """Return a place as `lightpen.formats.images.find_images` takes it, or a record.

    Raises
    ------
    FileError
        There is nothing there, or it cannot be read.
    """
    folder = Path(where[0])
    if len(where) == 1 and is_record(folder):
        record = open_record(folder)
        own = source(record)
        return TouchPlace(
            name=where[0],
            images=own.images,
            origin=recorded_origin(record),
            camera=own.camera,
            camera_file=own.camera_files[0],
            pen=own.pen,
            pen_file=own.pen_file,
            mask=own.masks[0],
        )
    is_simulated = is_simulated_recording(where[0])
    origin = Origin.SIMULATED if is_simulated else Origin.RECORDED
    return TouchPlace(where[0], find_images(*where), origin)


def runs_at(place: str) -> tuple[str, ...]:
    """Return the runs at a place: itself, or the folders in it if they hold the images.

    Raises
    ------
    FileError
        There are no images in any of them.
    """
    folder = Path(place)
    if is_record(folder):
        return (place,)
    try:
        find_images(place)
    except FileError:
        runs = _folders_with_images(folder)
        if not runs:
            raise
        return runs
    return (place,)


def _folders_with_images(folder: Path) -> tuple[str, ...]:
    if not folder.is_dir():
        return ()
    try:
        inner = [path for path in folder.iterdir() if path.is_dir()]
    except OSError as error:
        raise unreadable(folder, FOLDER, error) from error
    inner.sort(key=lambda path: natural_order(path.name))
    return tuple(str(path) for path in inner if _holds_images(path))


def _holds_images(folder: Path) -> bool:
    if is_record(folder):
        return True
    try:
        find_images(str(folder))
    except FileError:
        return False
    return True
