"""The tip of a recorded swing: the one computation for all callers.

The wizard, its review and the command line compute the tip of a record here, always
from the images on the disk, so that they agree to the last digit. Detections do not
depend on which images are used; excluding one solves again without reading images.
"""

import logging
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from hashlib import sha256
from itertools import islice
from pathlib import Path

import numpy as np

from lightpen.arrays import FloatArray, Image, IntArray
from lightpen.cameras.pixel_formats import pixel_format_named
from lightpen.detection.observations import Observations, leave_out
from lightpen.detection.reasons import Reason
from lightpen.detection.rig_observations import observe_rig_images
from lightpen.errors import CalibrationError, FileError
from lightpen.estimation.calibrate import Calibration, calibrate_rig
from lightpen.estimation.contact.joint import ContactModel, reduce
from lightpen.estimation.contact.single_images import steadied
from lightpen.formats.camera_files import read_camera
from lightpen.formats.decoding import IMAGE_FILE, MAX_FILE_SIZE, decode_image
from lightpen.formats.files import is_simulated, read_bytes
from lightpen.formats.images import IMAGE_FOLDER, ImageSource
from lightpen.formats.observation_files import Pairing
from lightpen.formats.opened_files import Inputs, RigInputs, all_hashed, with_content
from lightpen.formats.pen_files import read_pen
from lightpen.formats.rig_files import read_rig
from lightpen.model.camera import Camera
from lightpen.model.limits import USUAL, Assumptions
from lightpen.model.names import Method, Origin
from lightpen.model.pen import Pen
from lightpen.model.rigid import Rig, rig_of, rotation_from_vector
from lightpen.record.swings.header import (
    CAMERA_STEM,
    PEN_STEM,
    RIG_STEM,
    camera_stem,
    copy_name,
)
from lightpen.record.swings.reading import Record, image_name, is_record, open_record


@dataclass(frozen=True, eq=False)
class RecordSource:
    """Inputs of a calibration."""

    folder: Path
    # Of each camera, in the order of capture; loading raises `FileError`.
    images: tuple[ImageSource, ...]
    rig: Rig  # of one camera, too
    pen: Pen
    masks: tuple[FloatArray, ...]  # (M, 3), stray light: x, y, radius, px
    camera_files: tuple[Path, ...]
    pen_file: Path
    assumptions: Assumptions = USUAL
    method: Method = "joint"
    origin: Origin | None = None
    units: str | None = None  # as of `Header`
    led_diameter: float | None = None  # as in `Header`
    rig_file: Path | None = None  # None of one camera

    @property
    def camera(self) -> Camera:
        """The camera, of a rig the first one."""
        return self.rig.cameras[0]


def source(record: Record) -> RecordSource:
    """Return the input of the calibration of a record."""
    header = record.header
    pen_file = record.folder / copy_name(PEN_STEM, header.pen_file)
    camera_files = tuple(
        record.folder / copy_name(camera_stem(c), each.file)
        for c, each in enumerate(header.cameras)
    )
    rig_file = None
    if header.rig_file is None:
        rig = rig_of(read_camera(camera_files[0]))
    else:
        rig_file = record.folder / copy_name(RIG_STEM, header.rig_file)
        rig = read_rig(rig_file, camera_files).rig
    return RecordSource(
        folder=record.folder,
        images=tuple(_images_of(record, c) for c in range(rig.n_cameras)),
        rig=rig,
        pen=read_pen(
            pen_file, header.units, header.led_diameter_mm, header.nominal_tip
        ),
        masks=tuple(each.mask for each in header.cameras),
        camera_files=camera_files,
        pen_file=pen_file,
        assumptions=header.assumptions,
        method=header.method,
        origin=header.origin,
        units=header.units,
        led_diameter=header.led_diameter_mm,
        rig_file=rig_file,
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
    camera = record.header.cameras[c]
    used = None if camera.in_use is None else camera.in_use.settings.pixel_format
    is_container = camera.source == Origin.RECORDED
    pixel_format = None if used is None else pixel_format_named(used)
    if pixel_format is None or (is_container and pixel_format.bits == 16):
        return None
    return pixel_format.full_scale


def _load(file: Path, digest: str) -> Image:
    data = read_bytes(file, IMAGE_FILE, MAX_FILE_SIZE)
    if sha256(data).hexdigest() != digest:
        raise FileError("record.image-changed", name=file.name)
    return decode_image(data, file.name)


TURNS = 8  # steps by which an image that is left out is turned into the fit

_logger = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class Solution:
    """The tip of a record, with its input."""

    source: RecordSource
    numbers: IntArray  # (N,), of the images, in the record
    observations: Observations  # detections in all N images, accepted or not
    excluded: Mapping[int, str]  # numbers of images that do not take part, and why
    calibration: Calibration
    # (N, C, L, 2), observed less modelled centres with tip in the cone, px; an image
    # that is left out is turned as fits it best; NaN where an LED or pen was not seen
    residuals: FloatArray
    others: tuple[Observations, ...] = ()

    def seen_by(self, camera: int) -> Observations:
        """Return the detections of a camera, from 0."""
        return (self.observations, *self.others)[camera]

    @property
    def misfits(self) -> FloatArray:
        """Root mean square residual of each image, px, (N,); NaN without the pen.

        Of a used image, over its used LEDs; else over all. Of a rig, over the images of
        all cameras.
        """
        calibration = self.calibration
        squares = np.sum(self.residuals**2, axis=3)
        seen = np.isfinite(squares)
        in_fit = np.stack([each.leds_used for each in calibration.cameras], axis=1)
        counted = np.where(calibration.used[:, None, None], in_fit, seen)
        n_leds = counted.sum(axis=(1, 2))
        total = np.sum(squares, axis=(1, 2), where=counted)
        rms = np.sqrt(total / np.maximum(n_leds, 1))
        return np.where(n_leds > 0, rms, np.nan)


def solve_record(
    record: Record, report: Callable[[float], None] = lambda fraction: None
) -> Solution:
    """Solve a record.

    ``report`` is called with the fraction done, 0 to 1; what it raises ends the
    computation. Raises `FileError` if no image, or not the camera or pen file, can be
    read, and `CalibrationError` if the images do not determine the tip.
    """
    if not record.images:
        raise CalibrationError("record.no-images", name=record.folder.name)
    found = source(record)
    _logger.info("solving %d images of %s", len(record.images), record.folder)
    moments = np.arange(len(record.images))[:, None]
    pairing = Pairing(np.repeat(moments, found.rig.n_cameras, axis=1))
    seen = observe_rig_images(
        found.images, pairing, found.rig, found.pen, report, found.masks
    )
    timed = tuple(replace(each, interval_ms=record.interval_ms) for each in seen)
    return _solved(found, record.all_numbers, timed, record.excluded)


def solve_again(solution: Solution, excluded: Mapping[int, str]) -> Solution:
    """Solve with other images excluded, from the same detections.

    ``excluded`` has the numbers of all images to exclude, with the reason. Raises
    `CalibrationError` if the rest does not determine the tip.
    """
    seen = (solution.observations, *solution.others)
    return _solved(solution.source, solution.numbers, seen, excluded)


def report_by(solution: Solution, method: Method) -> Solution:
    """Return a solution whose tip is reported by another method."""
    return replace(
        solution,
        source=replace(solution.source, method=method),
        calibration=replace(solution.calibration, method=method),
    )


def load_image(solution: Solution, number: int, camera: int = 0) -> Image:
    """Read an image of a solved record again, (H, W), by its number and camera."""
    index = int(np.searchsorted(solution.numbers, number))
    source = solution.source
    load = next(islice(source.images[camera].open(), index, None))
    return load()


def record_inputs(source: RecordSource) -> Inputs:
    """Return the files that the tip of a record is computed from, with their hashes.

    Images that are gone took no part and are not among them.
    """
    images = [file for each in source.images for file in each.files]
    rig = None
    if source.rig_file is not None:
        cameras = tuple(map(with_content, source.camera_files))
        rig = RigInputs(with_content(source.rig_file), cameras)
    return Inputs(
        camera=with_content(source.camera_files[0]),
        pen=with_content(source.pen_file),
        observations=all_hashed([file for file in images if file.is_file()]),
        nominal_tip=source.pen.nominal_tip,
        rig=rig,
        origin=source.origin,
        units=source.units,
        led_diameter=source.led_diameter,
    )


def _solved(
    source: RecordSource,
    numbers: IntArray,
    seen: tuple[Observations, ...],
    excluded: Mapping[int, str],
) -> Solution:
    reasons = {
        index: _reason(excluded[number])
        for index, number in enumerate(numbers.tolist())
        if number in excluded
    }
    calibration = calibrate_rig(
        source.rig,
        source.pen,
        [leave_out(each, reasons) for each in seen],
        source.assumptions,
    )
    calibration = replace(calibration, method=source.method)
    return Solution(
        source=source,
        numbers=numbers,
        observations=seen[0],
        excluded=dict(excluded),
        calibration=calibration,
        residuals=_all_residuals(source, seen, calibration),
        others=seen[1:],
    )


def _all_residuals(
    source: RecordSource, seen: tuple[Observations, ...], calibration: Calibration
) -> FloatArray:
    """Return the residuals of all images, (N, C, L, 2), as `Solution` has them."""
    joint, fitted = calibration.joint, calibration.bundle.state
    pixels = np.stack(
        [
            steadied(camera, each, images.path).pixels
            for camera, each, images in zip(
                source.rig.cameras, seen, calibration.cameras, strict=True
            )
        ],
        axis=1,
    )
    residuals = np.full_like(pixels, np.nan)
    in_fit = joint.residuals[joint.used.any(axis=1)]
    residuals[calibration.used] = in_fit.reshape(-1, *pixels.shape[1:])
    rotations = _rough_rotations(fitted.rig, seen)
    shows_pen = np.isfinite(rotations[:, 0, 0])
    others = np.flatnonzero(~calibration.used & shows_pen)
    if len(others):
        model = ContactModel(fitted.rig, fitted.pen, pixels[others])
        turned = _turned_to_fit(model, rotations[others], joint.tip_pen, joint.cone_cam)
        residuals[others] = turned.reshape(-1, *pixels.shape[1:])
    return residuals


def _rough_rotations(rig: Rig, seen: tuple[Observations, ...]) -> FloatArray:
    """Return rig_from_pen by the first camera that shows the pen, (N, 3, 3)."""
    found = seen[0].rotations
    for R, each in zip(rig.rotations[1:], seen[1:], strict=True):
        missing = np.isnan(found[:, 0, 0])[:, None, None]
        found = np.where(missing, R.T @ each.rotations, found)
    return found


def _turned_to_fit(
    model: ContactModel,
    rotations: FloatArray,
    tip_pen: FloatArray,
    cone_cam: FloatArray,
) -> FloatArray:
    """Return the residuals of images turned about the tip until they fit best, px."""
    state = model.at(rotations, tip_pen, cone_cam)
    weights = np.isfinite(state.residuals[..., 0]).astype(float)
    for _ in range(TURNS):
        turns = reduce(state, weights).turn
        rotations = rotation_from_vector(turns) @ rotations
        state = model.at(rotations, tip_pen, cone_cam)
    return state.residuals


def _reason(text: str) -> Reason:
    known = (Reason.SLIPPED, Reason.OUTSIDE)
    return Reason(text) if text in known else Reason.TAKEN_OUT


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
                folder / copy_name(CAMERA_STEM, header.cameras[0].file),
                folder / copy_name(PEN_STEM, header.pen_file),
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
            open_record(folder).header.origin is Origin.SIMULATED
        )
    return False


def _first(folder: Path, names: tuple[str, ...]) -> Path | None:
    files = (folder / name for name in names)
    return next((file for file in files if file.is_file()), None)
