"""The input of a calibration, from a record."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from hashlib import sha256
from pathlib import Path

from lightpen.arrays import FloatArray, Image
from lightpen.cameras.pixel_formats import pixel_format_named
from lightpen.errors import FileError
from lightpen.formats.camera_files import read_camera
from lightpen.formats.decoding import IMAGE_FILE, MAX_FILE_SIZE, decode_image
from lightpen.formats.files import read_bytes
from lightpen.formats.images import ImageSource
from lightpen.formats.pen_files import read_pen
from lightpen.formats.rig_files import read_rig
from lightpen.model.assumptions import USUAL, Assumptions
from lightpen.model.camera import Camera
from lightpen.model.method import Method
from lightpen.model.origin import Origin
from lightpen.model.pen import Pen
from lightpen.model.rig import Rig
from lightpen.record.swings.assumed import recorded_assumptions, recorded_method
from lightpen.record.swings.header import (
    CAMERA_STEM,
    PEN_STEM,
    RIG_STEM,
    camera_stem,
    copy_name,
)
from lightpen.record.swings.reading import Record, image_name, recorded_origin


@dataclass(frozen=True, eq=False)
class RecordSource:
    """Inputs of a calibration."""

    folder: Path
    images: ImageSource  # in the order of capture; loading raises `FileError`
    camera: Camera
    pen: Pen
    masks: tuple[FloatArray, ...]  # (M, 3), stray light: x, y, radius, px
    camera_files: tuple[Path, ...]
    pen_file: Path
    assumptions: Assumptions = USUAL
    method: Method = "joint"
    origin: Origin | None = None
    units: str | None = None  # as of `Header`
    led_diameter: float | None = None  # as in `Header`
    rig: Rig | None = None
    rig_file: Path | None = None
    other_images: tuple[ImageSource, ...] = ()


def source(record: Record) -> RecordSource:
    """Return the input of the calibration of a record."""
    header = record.header
    camera_file = record.folder / copy_name(CAMERA_STEM, header.camera_file)
    pen_file = record.folder / copy_name(PEN_STEM, header.pen_file)

    rig_file, rig = None, None
    camera_files: tuple[Path, ...] = (camera_file,)
    if header.rig is not None:
        rig_file = record.folder / copy_name(RIG_STEM, header.rig.rig_file)
        camera_files += tuple(
            record.folder / copy_name(camera_stem(c), file)
            for c, file in enumerate(header.rig.camera_files, start=1)
        )
        rig = read_rig(rig_file, camera_files).rig
    images = [_images_of(record, c) for c in range(len(camera_files))]
    return RecordSource(
        folder=record.folder,
        images=images[0],
        camera=read_camera(camera_file) if rig is None else rig.cameras[0],
        pen=read_pen(
            pen_file, header.units, header.led_diameter_mm, header.nominal_tip
        ),
        masks=header.masks,
        camera_files=camera_files,
        pen_file=pen_file,
        assumptions=recorded_assumptions(header.settings),
        method=recorded_method(header.settings),
        origin=recorded_origin(record),
        units=header.units,
        led_diameter=header.led_diameter_mm,
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

    names = tuple(file.name for file in files)
    return ImageSource(names, files, loaders, _full_scale(record, c))


def _full_scale(record: Record, c: int) -> int | None:
    """Return the full scale of the c-th camera's pixel format; None: not known."""
    prefix = "" if c == 0 else "second_"
    settings = record.header.settings
    name = str(settings.get(f"{prefix}pixel_format", ""))
    is_container = settings.get(f"{prefix}source") == Origin.RECORDED
    pixel_format = pixel_format_named(name)
    if pixel_format is None or (is_container and pixel_format.bits == 16):
        return None
    return pixel_format.full_scale


def _load(file: Path, digest: str) -> Image:
    data = read_bytes(file, IMAGE_FILE, MAX_FILE_SIZE)
    if sha256(data).hexdigest() != digest:
        raise FileError("record.image-changed", name=file.name)
    return decode_image(data, file.name)
