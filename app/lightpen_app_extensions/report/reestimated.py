"""Poses of a calibration's images estimated again, from its file alone.

Camera and pen are as adjusted by the calibration, so that poses and residuals are
those of its fit without the constraint of the tip to the cone. The normals of the
LEDs are the pen's z axis: a file does not store them.
"""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.detection.pose import MIN_POSE_LEDS, fit_poses, start_poses
from lightpen.estimation.contact.single_images import MIN_IMAGES
from lightpen.estimation.reports.calibration_record import (
    CalibrationRecord,
    InstrumentRecord,
)
from lightpen.model.camera import Camera, lens_model_of
from lightpen.model.pen import Pen
from lightpen.model.rigid import directions_of, tilts_of

N_COEFFICIENTS = (4, 5, 8)  # of distortion that a camera may have; 4 a fisheye


@dataclass(frozen=True, eq=False)
class ReestimatedPoses:
    """Postures and residuals of the images in use."""

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
    pixels = pixels[enough]
    if len(pixels) < MIN_IMAGES:
        return None
    camera, pen = _camera(fitted, pixels), _pen(fitted)
    rotations, translations = start_poses(camera, pen, pixels)
    if not np.isfinite(translations).all():
        return None
    poses = fit_poses(camera, pen, pixels, rotations, translations)
    seen = np.isfinite(pixels[..., 0])
    return ReestimatedPoses(
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
