"""A calibration computed again from its record, and its poses estimated again."""

from base64 import b64decode
from binascii import Error as NoBase64
from collections.abc import Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.detection.observations import Observations, leave_out, observe_centers
from lightpen.detection.pose import MIN_POSE_LEDS, fit_poses, start_poses
from lightpen.detection.rig_observations import at_moments
from lightpen.errors import UsageError
from lightpen.estimation.calibrate import Calibration, calibrate_rig
from lightpen.estimation.contact.single_images import MIN_IMAGES
from lightpen.estimation.reports.calibration_record import (
    CalibrationRecord,
    FrameRecord,
    InstrumentRecord,
)
from lightpen.estimation.uncertainty.budget import ContributionName
from lightpen.formats.camera_files import read_camera
from lightpen.formats.observation_files import NONE, Centers, Pairing
from lightpen.formats.opened_files import InputFile, Inputs, RigInputs
from lightpen.formats.own_json import DamagedError, FileRecord
from lightpen.formats.pen_files import read_pen
from lightpen.formats.rig_files import read_rig
from lightpen.model.camera import Camera, lens_model_of
from lightpen.model.coverage import COVERAGE_FACTOR, MIN_SPREAD, posture_spread
from lightpen.model.limits import SwingLimits
from lightpen.model.pen import Pen
from lightpen.model.rigid import Rig, directions_of, rig_of, skew, tilts_of
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


# Poses of a calibration's images estimated again, from its file alone.
#
# Camera and pen are as adjusted by the calibration, so that poses and residuals are
# those of its fit without the constraint of the tip to the cone. The normals of the
# LEDs are the pen's z axis: a file does not store them.


# Convergence of a tip with the number of images, from single-image poses.
#
# Each image i says ``R_i tip_pen + t_i = cone_cam`` with the covariance of its pose.
# The normal equations of weighted least squares add up over images, so that the tip by
# the first n of them, for every n, costs one pass.


@dataclass(frozen=True, eq=False)
class RunningTip:
    """The tip by the first n images, for n = `first`, `first` + 1 ..."""

    first: int
    tips: FloatArray  # (M, 3), pen frame, mm
    # (M, 3, 3), by noise that is independent from image to image, mm^2.
    covariances: FloatArray


def fit_running_tip(
    rotations: FloatArray,
    translations: FloatArray,
    covariances: FloatArray,
    tip_pen: FloatArray,
    first: int,
) -> RunningTip:
    """Fit the tip to the first poses, to one more, and so on to all.

    Parameters
    ----------
    rotations, translations : (N, 3, 3) and (N, 3) array
        Poses cam_from_pen in the order of capture, mm.
    covariances : (N, 6, 6) array
        Of each pose's (theta, dt) in rad and mm, see `lightpen.detection.pose`.
    tip_pen : (3,) array
        About where the tip is, to weight the poses by, mm.
    first : int
        Poses to begin with; they must fix the tip.
    """
    levers = skew(rotations @ tip_pen)
    by_pose = np.concatenate([-levers, np.broadcast_to(np.eye(3), levers.shape)], -1)
    spread = by_pose @ covariances @ np.swapaxes(by_pose, 1, 2)
    by_points = np.concatenate(
        [rotations, np.broadcast_to(-np.eye(3), rotations.shape)], axis=-1
    )
    weighted = np.swapaxes(by_points, 1, 2) @ np.linalg.inv(spread)
    normal = np.cumsum(weighted @ by_points, axis=0)[first - 1 :]
    right = np.cumsum(-weighted @ translations[..., None], axis=0)[first - 1 :]
    inverse = np.linalg.inv(normal)
    return RunningTip(first, (inverse @ right)[:, :3, 0], inverse[:, :3, :3])


N_COEFFICIENTS = (4, 5, 8)  # of distortion that a camera may have; 4 a fisheye


@dataclass(frozen=True, eq=False)
class ReestimatedPoses:
    """Tips and residuals of the images in use."""

    numbers: IntArray  # (M,), images up to which a tip is known, from 1
    tips: FloatArray  # (M, 3), tip by the images up to each of these, mm
    uncertainties: FloatArray  # (M, 3), U (k = 2) by the noise of these images, mm
    tilts: FloatArray  # (N,), as in `lightpen.model.rigid.Posture`, rad
    directions: FloatArray  # (N,), the same, rad
    points: FloatArray  # (K, 2), LED centres, px
    residuals: FloatArray  # (K, 2), observed minus modelled, px


def reestimate_poses(calibration: CalibrationRecord) -> ReestimatedPoses | None:
    """Estimate the poses of a calibration's images again.

    None of several cameras, and where the file does not keep enough.
    """
    fitted = calibration.instrument
    if fitted is None or calibration.rig is not None:
        return None
    if len(fitted.intrinsics) - 4 not in N_COEFFICIENTS:
        return None
    used = [i for i, image in enumerate(calibration.frames) if image.used]
    pixels = np.full((len(used), len(fitted.leds_mm), 2), np.nan)
    for row, i in enumerate(used):
        for spot in calibration.frames[i].leds:
            if spot.used:
                pixels[row, spot.led - 1] = spot.x_px, spot.y_px
    enough = np.isfinite(pixels[..., 0]).sum(axis=1) >= MIN_POSE_LEDS
    numbers, pixels = np.array(used, dtype=np.int64)[enough] + 1, pixels[enough]
    if len(numbers) < MIN_IMAGES:
        return None
    camera, pen = _camera(fitted, pixels), _pen(fitted)
    rotations, translations = start_poses(camera, pen, pixels)
    if not np.isfinite(translations).all():
        return None
    poses = fit_poses(camera, pen, pixels, rotations, translations)
    first = _first(poses.rotations)
    if first is None:
        return None
    running = fit_running_tip(
        poses.rotations,
        poses.translations,
        poses.covariances,
        np.array(calibration.tip_pen_mm),
        first,
    )
    seen = np.isfinite(pixels[..., 0])
    return ReestimatedPoses(
        numbers=numbers[first - 1 :],
        tips=running.tips,
        uncertainties=_uncertainties(calibration, running),
        tilts=tilts_of(poses.rotations),
        directions=directions_of(poses.rotations),
        points=pixels[seen],
        residuals=poses.residuals[seen],
    )


def _camera(fitted: InstrumentRecord, pixels: FloatArray) -> Camera:
    """Return the camera; its image size is the extent of the LED centres."""
    fx, fy, cx, cy, *distortion = fitted.intrinsics
    width, height = np.ceil(np.nanmax(pixels, axis=(0, 1))).astype(int).tolist()
    return Camera(
        width + 1,
        height + 1,
        fx,
        fy,
        cx,
        cy,
        distortion=np.array(distortion),
        lens=lens_model_of(len(distortion)),
    )


def _pen(fitted: InstrumentRecord) -> Pen:
    leds = np.array(fitted.leds_mm)
    normals = np.tile([0.0, 0.0, 1.0], (len(leds), 1))
    return Pen(leds, normals, fitted.disc_diameter_mm)


def _first(rotations: FloatArray) -> int | None:
    """Return the number of poses (N, 3, 3) from which the tip is determined."""
    for n_images in range(MIN_IMAGES, len(rotations) + 1):
        spread, _ = posture_spread(rotations[:n_images])
        if spread[0] >= MIN_SPREAD:
            return n_images
    return None


def _uncertainties(calibration: CalibrationRecord, running: RunningTip) -> FloatArray:
    """Return U (k = 2) of a running tip, (M, 3), mm, ending at the recorded U."""
    alone = np.sqrt(np.diagonal(running.covariances, axis1=1, axis2=2))
    variances = {
        share.name: np.square(share.standard_uncertainty_mm)
        for share in calibration.uncertainty.shares
    }
    noise = variances.pop(ContributionName.NOISE, np.zeros(3))
    others = sum(variances.values(), np.zeros(3))
    grown = noise * np.square(alone / alone[-1])
    return np.asarray(COVERAGE_FACTOR * np.sqrt(grown + others))
