"""Convergence of a tip with the number of images, from single-image poses.

Each image i says ``R_i tip_pen + t_i = cone_cam`` with the covariance of its pose. The
normal equations of weighted least squares add up over images, so that the tip by the
first n of them, for every n, costs one pass.
"""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.model.rigid import skew


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
