"""A calibration computed again from its record alone.

The record holds the files of camera and pen, what was assumed where they say nothing,
and the LED centres of each image with the reason why one takes no part. What the images
showed is not judged again.
"""

from base64 import b64decode
from binascii import Error as NoBase64
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from lightpen.detection.observations import Observations, leave_out, observe_centers
from lightpen.errors import UsageError
from lightpen.estimation.calibrate import Calibration, calibrate
from lightpen.estimation.reports.calibration_record import CalibrationRecord
from lightpen.estimation.reports.methods import Method
from lightpen.formats.camera_files import read_camera
from lightpen.formats.files import printable
from lightpen.formats.hashes import InputFile, Inputs
from lightpen.formats.json_records import FileRecord
from lightpen.formats.observation_files import Centers
from lightpen.formats.own_json import DamagedError
from lightpen.formats.pen_files import read_pen
from lightpen.model.camera import Camera
from lightpen.model.limits import SwingLimits
from lightpen.model.pen import Pen
from lightpen.record.calibrations.calibrations import (
    floats,
    read_calibration,
    shown_images,
)


@dataclass(frozen=True, eq=False)
class Recomputed:
    """A calibration computed again.

    Attributes
    ----------
    method : str
        Estimator of the recorded tip.
    """

    calibration: Calibration
    inputs: Inputs
    method: Method
    limits: SwingLimits


def recompute(path: Path) -> Recomputed:
    """Calibrate again from a record as JSON, or from an accepted result.

    Raises
    ------
    UsageError
        It is of several cameras or two cones, or does not hold the files.
    FileError
        It cannot be read, or is not as it was written.
    CalibrationError
        It does not determine the tip.
    """
    record = read_calibration(path).calibration
    if record.rig is not None or record.second_cone is not None:
        raise UsageError("recompute.more-than-one", path=printable(str(path)))
    found, limits = record.inputs, record.verdict.limits
    try:
        files = _kept(found.camera), _kept(found.pen)
    except DamagedError as error:
        raise UsageError("recompute.not-enough", path=printable(str(path))) from error
    nominal = None if record.nominal_tip_mm is None else floats(record.nominal_tip_mm)
    with TemporaryDirectory(prefix="lightpen-record-") as folder:
        camera_file, pen_file = (
            _written(file, Path(folder, name))
            for name, file in zip(("camera", "pen"), files, strict=True)
        )
        camera = read_camera(camera_file)
        pen = read_pen(pen_file, found.units, found.led_diameter_mm, nominal)
    observations = _observations(path, record, camera, pen)
    return Recomputed(
        calibrate(camera, pen, observations, record.assumptions),
        Inputs(
            *files,
            tuple(InputFile(Path(f.file), f.sha256) for f in found.observations),
            nominal_tip=nominal,
            origin=record.origin,
            units=found.units,
            led_diameter=found.led_diameter_mm,
        ),
        record.method,
        SwingLimits(
            max_uncertainty=limits.max_uncertainty_mm,
            min_images=limits.min_images,
            min_per_field=limits.min_per_field,
        ),
    )


def _kept(file: FileRecord) -> InputFile:
    try:
        content = b64decode(file.base64, validate=True)
    except NoBase64 as error:
        raise DamagedError(str(error)) from error
    if sha256(content).hexdigest() != file.sha256:
        raise DamagedError("A file is not the one that is named.")
    return InputFile(Path(Path(file.file).name), file.sha256, content)


def _written(file: InputFile, place: Path) -> Path:
    """Write a file with its own suffix, to be read from a disk as ever."""
    path = place.with_suffix(file.path.suffix)
    path.write_bytes(file.content or b"")
    return path


def _observations(
    path: Path, record: CalibrationRecord, camera: Camera, pen: Pen
) -> Observations:
    """Return the detections, with the same images excluded."""
    shown, frames = shown_images(record), record.frames
    pixels = np.where(shown.fit[..., None], shown.pixels, np.nan)
    numbers = np.arange(1, len(frames) + 1)
    seen = replace(
        observe_centers(Centers(numbers, pixels, path), camera, pen),
        names=tuple(frame.file for frame in frames),
        seen_pixels=shown.pixels,
        areas=shown.areas,
        lamps=shown.lamps,
        edge_widths=shown.edge_widths,
    )
    return leave_out(seen, {i: f.reason for i, f in enumerate(frames) if f.reason})
