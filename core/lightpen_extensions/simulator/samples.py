"""Sample pens of several layouts, and sample rigs that observe the cone."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen.model.rig import Rig
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.simulator.swings import (
    PAPER_CONE,
    flat_pen,
    paper_camera,
    paper_pen,
)

FAN_ANGLE = np.radians(20)  # of a fanned column's discs from +z
NEARLY = 2.0  # mm by which the near-symmetric pen misses its mirror image
NAMES = ("left", "right", "third", "fourth")
LENS_SPREAD = 0.004  # of the focal length, from one lens of a kind to the next
CENTRE_SPREAD = np.array([7.0, -5.0])  # px
ROTATION_SIGMA = 1e-4  # rad, of a rig that was calibrated with a board
TRANSLATION_SIGMA = 0.1  # mm
BASELINE = 500.0  # mm, of a camera and the one beside it


def six_led_pen() -> Pen:
    """Return a pen with four LEDs in front of two."""
    front = [(-25, 20, 0), (25, 45, 0), (-25, 115, 0), (25, 160, 0)]
    back = [(0, 75, -30), (0, 180, -30)]
    return flat_pen("six", front + back)


def eight_led_pen() -> Pen:
    """Return a pen with LEDs at three depths."""
    front = [(-28, 10, 0), (24, 40, 0), (-22, 95, 0), (30, 130, 0), (-26, 175, 0)]
    middle = [(3, 70, -15), (0, 150, -18)]
    back = [(0, 0, -35)]
    return flat_pen("eight", front + middle + back)


def near_symmetric_pen() -> Pen:
    """Return a ten-LED pen that its mirror image fits to `NEARLY`."""
    back = [(0.0, y, -30.0) for y in (0.0, 60.0, 120.0, 180.0)]
    left = [(-25.0, y, 0.0) for y in (25.0, 90.0, 155.0)]
    right = [(25.0, y + NEARLY, 0.0) for _, y, _ in left]
    return flat_pen("near-symmetric", back + left + right)


def fanned_pen() -> Pen:
    """Return the paper's pen with the discs of its two columns turned outwards."""
    pen = paper_pen()
    turns = FAN_ANGLE * np.sign(pen.leds[:, 0])
    zero = np.zeros_like(turns)
    rotations = rotation_from_vector(np.stack([zero, turns, zero], axis=-1))
    return replace(pen, normals=rotations[:, :, 2], name="fanned")


SAMPLE_PENS: dict[str, Callable[[], Pen]] = {
    "paper": paper_pen,
    "six": six_led_pen,
    "eight": eight_led_pen,
    "near-symmetric": near_symmetric_pen,
    "fanned": fanned_pen,
}


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


def beside(camera: Camera, cone_cam: FloatArray) -> Rig:
    """Return the rig of a camera and one to its right that sees the cone alike."""
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
    """Return the paper's camera with another lens."""
    camera = paper_camera(binning)
    longer = 1 + LENS_SPREAD * number
    cx, cy = np.array([camera.cx, camera.cy]) + CENTRE_SPREAD * number / binning
    return replace(
        camera, fx=longer * camera.fx, fy=longer * camera.fy, cx=float(cx), cy=float(cy)
    )
