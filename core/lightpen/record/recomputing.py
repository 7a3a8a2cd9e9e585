"""A calibration computed again from its record."""

from base64 import b64decode
from binascii import Error as NoBase64
from collections.abc import Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from lightpen.detection.observations import Observations, leave_out, observe_centers
from lightpen.detection.rig_observations import at_moments
from lightpen.errors import UsageError
from lightpen.estimation.calibrate import Calibration, calibrate_rig
from lightpen.estimation.reports.calibration_record import (
    CalibrationRecord,
    FrameRecord,
)
from lightpen.formats.camera_files import read_camera
from lightpen.formats.observation_files import NONE, Centers, Pairing
from lightpen.formats.opened_files import InputFile, Inputs, RigInputs
from lightpen.formats.own_json import DamagedError, FileRecord
from lightpen.formats.pen_files import read_pen
from lightpen.formats.rig_files import read_rig
from lightpen.model.camera import Camera
from lightpen.model.limits import SwingLimits
from lightpen.model.pen import Pen
from lightpen.model.rigid import Rig, rig_of
from lightpen.record.calibrations import (
    CalibrationFile,
    floats,
    read_calibration,
    shown_images,
)

# A calibration computed again from its record alone.
#
# The record holds the files of cameras and pen, what was assumed where they say
# nothing, and the LED centres of each image with the reason why one takes no part. What
# the images showed is not judged again.


@dataclass(frozen=True, eq=False)
class Recomputed:
    """A calibration computed again; it reports by the method of the recorded tip."""

    calibration: Calibration
    inputs: Inputs
    limits: SwingLimits


def recompute(path: Path) -> Recomputed:
    """Calibrate again from a record as JSON, or from an accepted result.

    Raises `UsageError` if it does not hold the files.
    """
    record = read_calibration(path).calibration
    found, limits = record.inputs, record.verdict.limits
    try:
        kept_pen = _kept(found.pen)
        kept_rig = None if found.rig is None else _kept(found.rig)
        kept_cameras = tuple(map(_kept, found.cameras or (found.camera,)))
    except DamagedError as error:
        raise UsageError("recompute.not-enough", path=path) from error
    nominal = None if record.nominal_tip_mm is None else floats(record.nominal_tip_mm)
    with TemporaryDirectory(prefix="lightpen-record-") as folder:
        cameras = [
            _written(file, Path(folder, f"camera-{i}"))
            for i, file in enumerate(kept_cameras)
        ]
        pen_file = _written(kept_pen, Path(folder, "pen"))
        if kept_rig is None:
            rig = rig_of(read_camera(cameras[0]))
        else:
            rig = read_rig(_written(kept_rig, Path(folder, "rig")), cameras).rig
        pen = read_pen(pen_file, found.units, found.led_diameter_mm, nominal)
    seen = [_of_camera(path, record, c, rig, pen) for c in range(rig.n_cameras)]
    return Recomputed(
        replace(
            calibrate_rig(rig, pen, seen, record.assumptions), method=record.method
        ),
        Inputs(
            kept_cameras[0],
            kept_pen,
            tuple(InputFile(Path(f.file), f.sha256) for f in found.observations),
            nominal_tip=nominal,
            rig=None if kept_rig is None else RigInputs(kept_rig, kept_cameras),
            origin=record.origin,
            units=found.units,
            led_diameter=found.led_diameter_mm,
        ),
        SwingLimits(
            max_uncertainty=limits.max_uncertainty_mm,
            min_images=limits.min_images,
            min_per_field=limits.min_per_field,
            requires_temperature=limits.requires_temperature,
        ),
    )


def recorded_camera_and_pen(calibration: CalibrationFile) -> tuple[Camera, Pen]:
    """Return camera and pen of the files that a result contains.

    Raises `UsageError` if it contains no files.
    """
    found = calibration.calibration.inputs
    try:
        camera, pen = _kept(found.camera), _kept(found.pen)
    except DamagedError as error:
        raise UsageError("recompute.not-enough", path=calibration.path) from error
    with TemporaryDirectory(prefix="lightpen-record-") as folder:
        camera_file = _written(camera, Path(folder, "camera"))
        pen_file = _written(pen, Path(folder, "pen"))
        stated = found.units, found.led_diameter_mm
        return read_camera(camera_file), read_pen(pen_file, *stated)


def _kept(file: FileRecord) -> InputFile:
    try:
        content = b64decode(file.base64, validate=True)
    except NoBase64 as error:
        raise DamagedError(str(error)) from error
    if sha256(content).hexdigest() != file.sha256:
        raise DamagedError("A file is not the one that is named.")
    return InputFile(Path(Path(file.file).name), file.sha256, content)


def _written(file: InputFile, place: Path) -> Path:
    """Write a file with its own suffix, to be read with the usual functions."""
    path = place.with_suffix(file.path.suffix)
    path.write_bytes(file.content or b"")
    return path


def _of_camera(
    path: Path, record: CalibrationRecord, c: int, rig: Rig, pen: Pen
) -> Observations:
    """Return the detections of a camera at the moments of its rig."""
    name = rig.names[c] if rig.names else ""
    frames = tuple(each for each in record.frames if each.camera == name)
    seen = _observations(path, record, frames, rig.cameras[c], pen)
    if not rig.names:
        return seen
    n_moments = max(each.moment for each in record.frames)
    images = np.full((n_moments, 1), NONE)
    for i, frame in enumerate(frames):
        images[frame.moment - 1] = i
    (placed,) = at_moments([seen], Pairing(images))
    return placed


def _observations(
    path: Path,
    record: CalibrationRecord,
    frames: Sequence[FrameRecord],
    camera: Camera,
    pen: Pen,
) -> Observations:
    """Return the detections in images, with the same ones excluded."""
    shown = shown_images(record, frames)
    pixels = np.where(shown.fit[..., None], shown.pixels, np.nan)
    numbers = np.arange(1, len(frames) + 1)
    seen = replace(
        observe_centers(Centers(numbers, pixels, path), camera, pen),
        names=tuple(frame.file for frame in frames),
        seen_pixels=shown.pixels,
        areas=shown.areas,
        sigmas=shown.sigmas,
        lamps=shown.lamps,
        edge_widths=shown.edge_widths,
        interval_ms=record.inputs.image_interval_ms,
    )
    return leave_out(seen, {i: f.reason for i, f in enumerate(frames) if f.reason})
