"""The pose of the pen at each moment by all cameras of a rig that saw it."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.detection.pose import Poses
from lightpen.model.rig import Rig
from lightpen.model.rigid import rotation_from_vector, vector_from_rotation


class RigPoses(NamedTuple):
    """Poses rig_from_pen at N moments; NaN where no camera has one."""

    # `rotations` and `translations`: (N, 3, 3) and (N, 3), mm
    rotations: FloatArray
    translations: FloatArray


def join_poses(
    rig: Rig, n_moments: int, posed: Sequence[IntArray], poses: Sequence[Poses]
) -> RigPoses:
    """Combine the poses by single cameras.

    Each is weighted by its covariance, which is small across the view of its camera and
    large along it.

    Parameters
    ----------
    posed : sequence of (M,) array of int
        Moments at which each camera has a pose.
    poses : sequence of Poses
        cam_from_pen, of each camera.
    """
    rotations = np.full((n_moments, 3, 3), np.nan)
    translations = np.full((n_moments, 3), np.nan)
    information = np.zeros((n_moments, 6, 6))
    for c, (at, each) in enumerate(zip(posed, poses, strict=True)):
        R, t, covariances = poses_in_rig(
            rig, c, each.rotations, each.translations, each.covariances
        )
        new = np.isnan(translations[at, 0])
        rotations[at[new]], translations[at[new]] = R[new], t[new]
        known = np.linalg.inv(covariances)
        turns = vector_from_rotation(R @ np.swapaxes(rotations[at], 1, 2))
        off = np.concatenate([turns, t - translations[at]], axis=1)
        information[at] += known
        step = np.linalg.solve(information[at], known @ off[..., None])[..., 0]
        rotations[at] = rotation_from_vector(step[:, :3]) @ rotations[at]
        translations[at] += step[:, 3:]
    return RigPoses(rotations, translations)


def poses_in_rig(
    rig: Rig,
    c: int,
    rotations: FloatArray,
    translations: FloatArray,
    covariances: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return poses cam_from_pen, mm, of the c-th camera as rig_from_pen.

    ``covariances`` (N, 6, 6) are of (theta, dt), rad and mm.
    """
    back = rig.rotations[c].T
    turned = np.zeros((6, 6))
    turned[:3, :3] = turned[3:, 3:] = back
    return (
        back @ rotations,
        (translations - rig.translations[c]) @ back.T,
        turned @ covariances @ turned.T,
    )
