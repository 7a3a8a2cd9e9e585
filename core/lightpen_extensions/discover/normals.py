"""Prior of the disc normal: it faces the camera approximately."""

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.linearised import BundleState
from lightpen.estimation.uncertainty.disc_normals import across_normals

TINY = 1e-12
FACING = 0.3  # rad: standard deviation of the normal about the mean line of sight


def towards_camera(state: BundleState) -> FloatArray:
    """Return the mean direction from the tip to the camera in the pen's frame, (3,).

    A pen is held with its discs to the camera, so their normal is near.
    """
    towards = -np.einsum("nji,j->ni", state.rotations, state.cone_rig).mean(axis=0)
    return np.asarray(towards / np.linalg.norm(towards))


def off_sight(state: BundleState) -> FloatArray:
    """Return the turn of the normal that would bring it to the camera, (2,), rad."""
    normals = state.pen.normals
    axis = np.cross(normals.mean(axis=0), towards_camera(state))
    sine = float(np.linalg.norm(axis))
    cosine = float(normals.mean(axis=0) @ towards_camera(state))
    turn = axis * np.arctan2(sine, cosine) / max(sine, TINY)
    return np.asarray(across_normals(normals) @ turn)
