"""The pose of the pen at each moment by all cameras of a rig that saw it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from lightpen.arrays import BoolArray, FloatArray, IntArray
from lightpen.detection.pose import Poses
from lightpen.estimation.contact.single_images import PosedImages
from lightpen.estimation.rigs.synchrony import (
    PenRotations,
    TimeLag,
    measure_lag,
    require_same_moments,
)
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


# Extrinsics of a rig by the images alone, to start the fit from.
#
# At a moment that two cameras see, the two poses of the pen give their relative pose.
# The fit of a rig starts from there, as a wrong rig file or focal length would mislead
# it.


@dataclass(frozen=True, eq=False)
class InitialExtrinsics:
    """The extrinsics of a rig by the images."""

    rig: Rig  # with the file's cameras, without a covariance
    # Of each camera but the first; None: not determined.
    lags: tuple[TimeLag | None, ...]
    apart: BoolArray  # (N, C), images not simultaneous with those of earlier cameras

    def deviations(self, file: Rig) -> FloatArray:
        """Return the deviations from a file's extrinsics, as in `Rig.covariance`."""
        turns = self.rig.rotations[1:] @ np.swapaxes(file.rotations[1:], 1, 2)
        shifts = self.rig.translations[1:] - file.translations[1:]
        return np.concatenate([vector_from_rotation(turns), shifts], axis=1).ravel()


def find_initial_extrinsics(
    rig: Rig, parts: Sequence[PosedImages]
) -> InitialExtrinsics:
    """Find the extrinsics by the images of each camera at the same N instants.

    Raises `CalibrationError` if too few moments are seen by two cameras, or the images
    are not of the same moments.
    """
    turns = [PenRotations.of(part) for part in parts]
    seen, cone = turns[0], parts[0].pivot.pivot_cam
    rotations, translations = rig.rotations.copy(), rig.translations.copy()
    lags: list[TimeLag | None] = [None] * rig.n_cameras
    apart = np.zeros((len(seen.known), rig.n_cameras), dtype=bool)
    left = list(range(1, rig.n_cameras))
    while left:
        c = max(left, key=lambda each: np.sum(seen.known & turns[each].known))
        left.remove(c)
        found = require_same_moments(seen, turns[c], rig.names[c])
        lags[c] = measure_lag(seen, found)
        apart[found.apart, c] = True
        rotations[c] = found.rotation
        # From the cone, as all images of a camera determine it, not from single poses.
        translations[c] = parts[c].pivot.pivot_cam - found.rotation @ cone
        seen = seen.completed(turns[c], found.rotation)
    placed = replace(
        rig, rotations=rotations, translations=translations, covariance=None
    )
    return InitialExtrinsics(placed, tuple(lags[1:]), apart)
