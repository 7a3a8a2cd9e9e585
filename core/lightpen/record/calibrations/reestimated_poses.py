"""Poses of a calibration's images estimated again, from its file alone.

Camera and pen are as adjusted by the calibration, so that poses and residuals are those
of its fit without the constraint of the tip to the cone. The normals of the LEDs are
the pen's z axis: a file does not store them.
"""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.detection.pose import MIN_POSE_LEDS, fit_poses, start_poses
from lightpen.estimation.contact.single_images import MIN_IMAGES
from lightpen.estimation.reports.calibration_record import (
    CalibrationRecord,
    InstrumentRecord,
)
from lightpen.estimation.uncertainty.budget import ContributionName
from lightpen.model.camera import Camera, lens_model_of
from lightpen.model.coverage import MIN_SPREAD, posture_spread
from lightpen.model.expanded_uncertainty import COVERAGE_FACTOR
from lightpen.model.pen import Pen
from lightpen.model.posture import directions_of, tilts_of
from lightpen.model.rigid import skew

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
    tilts: FloatArray  # (N,), as in `lightpen.model.posture.Posture`, rad
    directions: FloatArray  # (N,), the same, rad
    points: FloatArray  # (K, 2), LED centres, px
    residuals: FloatArray  # (K, 2), observed minus modelled, px


def reestimate_poses(calibration: CalibrationRecord) -> ReestimatedPoses | None:
    """Estimate the poses of a calibration's images again.

    None of several cameras or two cones, and where the file does not keep enough.
    """
    fitted = calibration.instrument
    if fitted is None or calibration.rig is not None or calibration.second_cone:
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
