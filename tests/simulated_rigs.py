"""Several cameras in a row."""

from dataclasses import replace

import numpy as np

from lightpen.model.camera import Camera
from lightpen.model.rigid import Rig, rotation_from_vector
from lightpen_extensions.simulator.scenes import (
    LENS_SPREAD,
    ROTATION_SIGMA,
    TRANSLATION_SIGMA,
)
from lightpen_extensions.simulator.swings import PAPER_CONE, paper_camera

NAMES = ("left", "right", "third", "fourth")
CENTRE_SPREAD = np.array([7.0, -5.0])  # px


def row_of_cameras(n_cameras: int, baseline: float, binning: int = 1) -> Rig:
    """Return 2 to 4 cameras in a row about the paper's camera position.

    The baseline is from the first to the last, mm.
    """
    u, _, w = PAPER_CONE
    places = np.linspace(-baseline / 2, baseline / 2, n_cameras)
    turns = np.zeros((n_cameras, 3))
    turns[:, 1] = np.arctan2(u, w) - np.arctan2(u - places, w)
    rotations = rotation_from_vector(turns)
    sigmas = np.tile(np.repeat([ROTATION_SIGMA, TRANSLATION_SIGMA], 3), n_cameras - 1)
    return Rig(
        cameras=tuple(_camera(number, binning) for number in range(n_cameras)),
        rotations=rotations,
        translations=-rotations[:, :, 0] * places[:, None],
        covariance=np.diag(sigmas**2),
        names=NAMES[:n_cameras],
    )


def _camera(number: int, binning: int) -> Camera:
    """Return the paper's camera with another lens."""
    camera = paper_camera(binning)
    longer = 1 + LENS_SPREAD * number
    cx, cy = np.array([camera.cx, camera.cy]) + CENTRE_SPREAD * number / binning
    return replace(
        camera, fx=longer * camera.fx, fy=longer * camera.fy, cx=float(cx), cy=float(cy)
    )


def from_first(rig: Rig) -> Rig:
    """Return a rig without covariance, expressed in the frame of its first camera."""
    rotations = rig.rotations @ rig.rotations[0].T
    translations = rig.translations - rotations @ rig.translations[0]
    rotations[0], translations[0] = np.eye(3), 0.0  # exactly, whatever was rounded
    return replace(rig, rotations=rotations, translations=translations)
