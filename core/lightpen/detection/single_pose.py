"""The pose of the pen in a single image, as `lightpen.detection.pose` fits many.

OpenCV's refinement fits projected centres, so the offset of the ellipses' centres is
taken off first; one weighted step on the full model follows.
"""

import cv2
import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.detection.pose import MIN_POSE_LEDS, Poses, fit_poses, poses_at
from lightpen.detection.robust_residuals import (
    cauchy_weights,
    disc_residuals,
    robust_sigma,
)
from lightpen.model.camera import Camera, LensModel
from lightpen.model.ellipse import ellipse_centers
from lightpen.model.pen import Pen
from lightpen.model.rigid import rotation_from_vector

LEAST_WEIGHT = 0.6  # of an LED: residuals up to three standard deviations
WEIGHTINGS = 4  # of LEDs by residuals; each leaves some sixteenth
SMALL = 1e-3  # of an angle in rad and of a translation over its length


def fit_pose(
    camera: Camera,
    pen: Pen,
    pixels: FloatArray,
    rotation: FloatArray,
    translation: FloatArray,
    sigmas: FloatArray,
) -> Poses:
    """Fit the pose of one image; see `lightpen.detection.pose.fit_poses`.

    Parameters
    ----------
    pixels : (L, 2) array
        Ellipse centres of the LEDs, px; NaN where an LED was not seen.
    rotation, translation : (3, 3) and (3,) array
        Start near the pose, cam_from_pen, mm.
    sigmas : (L,) array
        How exact the centres are compared with each other, px.
    """
    seen = np.isfinite(pixels[:, 0])
    are_alike = np.nanmax(sigmas) == np.nanmin(sigmas)
    if camera.lens is LensModel.BROWN and are_alike and seen.sum() >= MIN_POSE_LEDS:
        poses = _refined(camera, pen, pixels, rotation, translation, seen)
        if poses is not None:
            return poses
    start = rotation[None], translation[None]
    return fit_poses(
        camera, pen, pixels[None], *start, sigmas=sigmas[None], is_near=True
    )


def _refined(
    camera: Camera,
    pen: Pen,
    pixels: FloatArray,
    rotation: FloatArray,
    translation: FloatArray,
    seen: BoolArray,
) -> Poses | None:
    """Return the pose, None where an LED or the start is far off."""
    radius = pen.diameter / 2
    leds, normals = pen.leds[seen], pen.normals[seen] @ rotation.T
    centers = leds @ rotation.T + translation
    offsets = ellipse_centers(camera, centers, normals, radius)
    offsets -= camera.project(centers)
    vector, t = cv2.solvePnPRefineLM(
        *(leds, pixels[seen] - offsets, camera.matrix, camera.distortion),
        *(cv2.Rodrigues(rotation)[0], translation.copy()),
    )
    R, t = np.asarray(cv2.Rodrigues(vector)[0]), np.asarray(t).ravel()
    lever = (pen.leds @ R.T)[None]
    normals = (pen.normals @ R.T)[None]
    residuals, J = disc_residuals(
        camera, lever, lever + t, normals, radius, pixels[None]
    )
    rows = J[0, seen].reshape(-1, 6)
    errors = residuals[0, seen].ravel()
    step = np.zeros(6)
    for _ in range(WEIGHTINGS):
        left = residuals - J @ step
        weights = cauchy_weights(left, robust_sigma(left, 6))
        weighted = (J * weights[..., None, None])[0, seen].reshape(-1, 6).T
        step = np.linalg.solve(weighted @ rows, weighted @ errors)
    turn, move = step[:3], step[3:]
    is_small = max(np.abs(turn).max(), np.abs(move).max() / abs(t[2])) < SMALL
    if weights[0, seen].min() < LEAST_WEIGHT or not is_small:
        return None
    R, t = rotation_from_vector(turn) @ R, t + move
    left = np.asarray(residuals - J @ step)
    return poses_at(R[None], t[None], left, J, robust=True)
