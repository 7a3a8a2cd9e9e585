"""Locations of images of touches: folders, patterns, videos and records of swings.

Those of a rig are in a folder for each camera, named as the rig file names it, in the
folder of a run; or in a record.
"""

from dataclasses import dataclass, replace
from pathlib import Path

from lightpen.arrays import FloatArray
from lightpen.errors import FileError
from lightpen.formats.camera_files import read_camera
from lightpen.formats.hashes import InputFile, all_hashed
from lightpen.formats.images import ImageSource, find_images
from lightpen.formats.rig_files import RigFile, read_rig
from lightpen.messages import printable
from lightpen.model.assumptions import Assumptions
from lightpen.model.camera import Camera
from lightpen.model.origin import Origin
from lightpen.model.pen import Pen
from lightpen.model.rig import Rig, rig_of
from lightpen.record.swings.assumed import recorded_assumptions
from lightpen.record.swings.reading import (
    Record,
    is_record,
    open_record,
    recorded_origin,
)
from lightpen.record.swings.recorded_source import RecordSource, source
from lightpen.record.swings.recordings import is_simulated_recording


@dataclass(frozen=True, eq=False)
class PenCameras:
    """The cameras that observe the pen, one or a rig."""

    rig: Rig
    files: tuple[InputFile, ...]  # of the camera; or of the rig and all its cameras

    @property
    def hashes(self) -> tuple[str, ...]:
        """SHA-256 of their files, which identify them."""
        return tuple(file.sha256 for file in self.files)


@dataclass(frozen=True, eq=False)
class RecordedTouch:
    """The touch of an image, from 1, or 0 for none; and the approach to it, (3,)."""

    number: int
    approach_cam: FloatArray | None
    run: int = 1


@dataclass(frozen=True)
class RecordedConditions:
    """Who took images of a record, and in what environment."""

    operator: str
    conditions: Assumptions


@dataclass(frozen=True, eq=False)
class ImageLocation:
    """Images of touches, and the files that they bring if they are a record's."""

    name: str
    images: tuple[ImageSource, ...]
    origin: Origin | None
    viewers: PenCameras | None = None
    pen: Pen | None = None
    pen_file: Path | None = None
    masks: tuple[FloatArray | None, ...] = (None,)  # (M, 3), stray light, px
    touches: tuple[RecordedTouch, ...] | None = None
    recorded: RecordedConditions | None = None

    def of_bits(self, bits: int | None) -> "ImageLocation":
        """Return the place with images of so many bits; see `ImageSource.of_bits`."""
        return replace(self, images=tuple(each.of_bits(bits) for each in self.images))

    @property
    def files(self) -> tuple[Path, ...]:
        """Files of all images."""
        return tuple(file for each in self.images for file in each.files)


def viewers_of_camera(camera: Camera, file: Path) -> PenCameras:
    """Return a single camera that was read from a file."""
    return PenCameras(rig_of(camera), all_hashed([file]))


def viewers_of_rig(file: RigFile) -> PenCameras:
    """Return the cameras of a rig file."""
    return PenCameras(file.rig, all_hashed([file.path, *file.camera_files]))


def read_viewers(camera_file: Path | None, rig_file: Path | None) -> PenCameras | None:
    """Read a camera file or a rig file; None for any other file."""
    if rig_file is not None:
        return viewers_of_rig(read_rig(rig_file))
    if camera_file is not None:
        return viewers_of_camera(read_camera(camera_file), camera_file)
    return None


def touch_place(where: tuple[str, ...], rig: Rig | None = None) -> ImageLocation:
    """Return a place as `lightpen.formats.images.find_images` takes it, or a record.

    With a rig, it lists one place per camera, or is a folder with one sub-folder each.
    """
    folder = Path(where[0])
    if len(where) == 1 and is_record(folder):
        record = open_record(folder)
        own = source(record)
        return ImageLocation(
            name=where[0],
            images=(own.images, *own.other_images),
            origin=recorded_origin(record),
            viewers=_recorded_viewers(own),
            pen=own.pen,
            pen_file=own.pen_file,
            masks=own.masks,
            touches=_recorded_touches(record),
            recorded=RecordedConditions(
                record.header.operator, recorded_assumptions(record.header.settings)
            ),
        )
    is_simulated = is_simulated_recording(where[0])
    origin = Origin.SIMULATED if is_simulated else Origin.RECORDED
    if rig is None or rig.n_cameras == 1:
        return ImageLocation(where[0], (find_images(*where),), origin)
    images = tuple(map(find_images, _of_each_camera(where, rig)))
    return ImageLocation(where[0], images, origin, masks=(None,) * rig.n_cameras)


def _recorded_touches(record: Record) -> tuple[RecordedTouch, ...] | None:
    """Return the touch of each image of a verification; None for a swing."""
    if not any(image.touch for image in record.images):
        return None
    out = record.excluded
    return tuple(
        RecordedTouch(0 if i.number in out else i.touch, i.approach_cam, i.run)
        for i in record.images
    )


def _recorded_viewers(own: RecordSource) -> PenCameras:
    if own.rig is None or own.rig_file is None:
        return viewers_of_camera(own.camera, own.camera_files[0])
    return PenCameras(own.rig, all_hashed([own.rig_file, *own.camera_files]))


def _of_each_camera(where: tuple[str, ...], rig: Rig) -> tuple[str, ...]:
    """Return the places of the images of each camera."""
    if len(where) == rig.n_cameras:
        return where
    folders = [Path(where[0]) / name for name in rig.names]
    if len(where) > 1 or not all(map(Path.is_dir, folders)):
        raise FileError(
            "verification.no-rig-folders",
            place=printable(where[0]),
            names=", ".join(rig.names),
        )
    return tuple(map(str, folders))
