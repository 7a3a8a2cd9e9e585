"""A sample rig: cameras in a row, each turned so that it sees the cone."""

from dataclasses import replace

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.model.camera import Camera
from lightpen.model.rig import Rig
from lightpen.model.rigid import rotation_from_vector
from lightpen.simulator.swings import PAPER_CONE, paper_camera

NAMES = ("left", "right", "third", "fourth")
LENS_SPREAD = 0.004  # of the focal length, from one lens of a kind to the next
CENTRE_SPREAD = np.array([7.0, -5.0])  # px
ROTATION_SIGMA = 1e-4  # rad, of a rig that was calibrated with a board
TRANSLATION_SIGMA = 0.1  # mm
BASELINE = 500.0  # mm, of a camera and the one beside it


def row_of_cameras(n_cameras: int, baseline: float, binning: int = 1) -> Rig:
    """Return cameras in a row, given from its middle, where the paper's would stand.

    Parameters
    ----------
    n_cameras : int
        2 to 4.
    baseline : float
        From the first to the last, mm.
    binning : int
        As for `paper_camera`.
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


def beside(camera: Camera, cone_cam: FloatArray) -> Rig:
    """Return the rig of a camera and another to its right, which sees the cone alike.

    Parameters
    ----------
    cone_cam : (3,) array
        Before the camera, mm.
    """
    u, _, w = cone_cam
    turn = np.array([0.0, np.arctan2(u, w) - np.arctan2(u - BASELINE, w), 0.0])
    R = rotation_from_vector(turn)
    return Rig(
        cameras=(camera, replace(camera, fx=camera.fx * (1 + LENS_SPREAD))),
        rotations=np.stack([np.eye(3), R]),
        translations=np.stack([np.zeros(3), -BASELINE * R[:, 0]]),
        covariance=np.diag(np.repeat([ROTATION_SIGMA, TRANSLATION_SIGMA], 3) ** 2),
        names=NAMES[:2],
    )


def _camera(number: int, binning: int) -> Camera:
    """Return the paper's camera with a lens of its own."""
    camera = paper_camera(binning)
    longer = 1 + LENS_SPREAD * number
    cx, cy = np.array([camera.cx, camera.cy]) + CENTRE_SPREAD * number / binning
    return replace(
        camera, fx=longer * camera.fx, fy=longer * camera.fy, cx=float(cx), cy=float(cy)
    )
