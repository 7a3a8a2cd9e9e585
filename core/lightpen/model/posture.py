"""Posture of the pen: tilt, direction and rotation.

The pen leans by a tilt from upright to a direction, and is turned about its own axis:

    R = A(tilt, direction) U Ry(turn)

Upright, U puts the pen's y axis against the v axis of the camera and turns its LEDs to
the camera. A turns y the short way to where the pen leans, which is ``(sin(tilt)
cos(direction), -cos(tilt), sin(tilt) sin(direction))`` in the camera frame.
"""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.model.pen import Pen
from lightpen.model.rigid import rotation_from_vector

UPRIGHT_AXIS = np.array([0.0, 1.0, 0.0])  # of the pen, away from its tip
FACING = np.diag([1.0, -1.0, -1.0])  # cam_from_pen upright, z to the camera
MIN_SIDEWAYS = 0.1  # of the mean normal; LEDs along the axis have no side to face with


@dataclass(frozen=True)
class Posture:
    """One posture of the pen."""

    tilt: float  # angle between the pen's axis and upright, rad
    # Where it leans to, as the camera sees it: 0 to the right, pi/2 away from the
    # camera, rad.
    direction: float
    # About its own axis, seen from above against the clock, from where its LEDs face
    # the camera, rad.
    turn: float


UPRIGHT = Posture(tilt=0.0, direction=0.0, turn=0.0)
FIRST_LEAN = Posture(tilt=0.35, direction=0.0, turn=0.0)  # asked for after upright


def rotations_of(
    pen: Pen, tilts: FloatArray, directions: FloatArray, turns: FloatArray
) -> FloatArray:
    """Return the rotations of cam_from_pen, (N, 3, 3), of N postures, each (N,)."""
    return moved_from(_upright(pen), tilts, directions, turns)


def moved_from(
    upright: FloatArray, tilts: FloatArray, directions: FloatArray, turns: FloatArray
) -> FloatArray:
    """Return rotations cam_from_pen, (N, 3, 3), moved from the upright one, (3, 3)."""
    zero = np.zeros_like(tilts)
    axes = np.stack([-np.sin(directions), zero, np.cos(directions)], axis=-1)
    leant = rotation_from_vector(axes * tilts[:, None])
    turned = rotation_from_vector(np.stack([zero, turns, zero], axis=-1))
    return np.asarray(leant @ upright @ turned)


def posture_of(pen: Pen, rotation: FloatArray) -> Posture:
    """Return the posture of a pen with the rotation (3, 3) of cam_from_pen."""
    one = rotation[None]
    return Posture(
        float(tilts_of(one)[0]),
        float(directions_of(one)[0]),
        float(turns_of(pen, one)[0]),
    )


def tilts_of(rotations: FloatArray) -> FloatArray:
    """Return the tilts (N,) of rotations (N, 3, 3), as `Posture` has them."""
    right, down, away = rotations[:, :, 1].T
    return np.asarray(np.arctan2(np.hypot(right, away), -down))


def directions_of(rotations: FloatArray) -> FloatArray:
    """Return the tilt directions of rotations (N, 3, 3): (N,), 0 to 2 pi, likewise."""
    right, _, away = rotations[:, :, 1].T
    return np.asarray(np.arctan2(away, right) % (2 * np.pi))


def turns_of(pen: Pen, rotations: FloatArray) -> FloatArray:
    """Return the turns (N,) of a pen of rotations (N, 3, 3), likewise."""
    tilts, directions = tilts_of(rotations), directions_of(rotations)
    still = rotations_of(pen, tilts, directions, np.zeros_like(tilts))
    about_y = np.swapaxes(still, 1, 2) @ rotations
    return np.asarray(np.arctan2(about_y[:, 0, 2], about_y[:, 0, 0]))


def angles_between(rotations: FloatArray, others: FloatArray) -> FloatArray:
    """Return the angles, rad, from rotations (N, 3, 3) to others (M, 3, 3), (N, M)."""
    traces = rotations.reshape(-1, 9) @ others.reshape(-1, 9).T
    return np.asarray(np.arccos(np.clip((traces - 1) / 2, -1, 1)))


def _upright(pen: Pen) -> FloatArray:
    """Return cam_from_pen of the pen upright, its LEDs facing the camera."""
    facing = pen.normals.mean(axis=0) * np.array([1.0, 0.0, 1.0])
    length = float(np.linalg.norm(facing))
    z = facing / length if length > MIN_SIDEWAYS else np.array([0.0, 0.0, 1.0])
    y = np.array([0.0, 1.0, 0.0])
    x = np.array([z[2], 0.0, -z[0]])
    return np.asarray(FACING @ np.stack([x, y, z]))
