"""Rigid transformations, postures, and the cameras of a rig."""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.messages import Message, message
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen

IDENTITY = np.eye(3)
# Of the rotations about x, y and z, row by row.
GENERATORS = np.array(
    [
        [0, 0, 0, 0, 0, -1, 0, 1, 0],
        [0, 0, 1, 0, 0, 0, -1, 0, 0],
        [0, -1, 0, 1, 0, 0, 0, 0, 0],
    ],
    dtype=np.float64,
)
TINY = 1e-200  # rad^2; avoids 0 / 0 and is lost in any other angle


def rotation_from_vector(vectors: FloatArray) -> FloatArray:
    """Return the rotation matrices (..., 3, 3) of rotation vectors (..., 3), rad.

    Rodrigues' formula.
    """
    angle_squared = np.einsum("...i,...i->...", vectors, vectors)
    half = 0.5 * np.sqrt(angle_squared + TINY)
    sinc_half = np.sin(half) / half
    a = sinc_half * np.cos(half)  # sin(angle) / angle
    b = 0.5 * sinc_half**2  # (1 - cos(angle)) / angle^2
    K = skew(vectors)
    rotations: FloatArray = (
        IDENTITY + a[..., None, None] * K + b[..., None, None] * (K @ K)
    )
    return rotations


def with_turns(moves: FloatArray, arms: FloatArray) -> FloatArray:
    """Return derivatives (..., k, 6) by a rotation vector and a move.

    ``moves`` (..., k, 3) are the derivatives of k values by the move of a point alone,
    ``arms`` (..., 3) lead from the centre of rotation to the point.
    """
    J = np.empty((*moves.shape[:-1], 6))
    x, y, z = (arms[..., None, k] for k in range(3))
    J[..., 0] = y * moves[..., 2] - z * moves[..., 1]
    J[..., 1] = z * moves[..., 0] - x * moves[..., 2]
    J[..., 2] = x * moves[..., 1] - y * moves[..., 0]
    J[..., 3:] = moves
    return J


def vector_from_rotation(rotations: FloatArray) -> FloatArray:
    """Return the vectors (..., 3), axis times angle, rad, of rotations (..., 3, 3).

    The angle is 0 to pi; by the unit quaternion [1]_, which stays exact near both.

    References
    ----------
    .. [1] S. W. Shepperd, "Quaternion from rotation matrix", J. Guidance and
       Control 1 (1978) 223-224.
    """
    R = np.asarray(rotations, dtype=np.float64)
    diagonal = np.diagonal(R, axis1=-2, axis2=-1)
    trace = diagonal.sum(axis=-1)
    # Four quaternions, each scaled by a different component; the largest is safe.
    x, y, z = np.moveaxis(diagonal, -1, 0)
    off = R - np.swapaxes(R, -1, -2)
    both = R + np.swapaxes(R, -1, -2)
    w_x, w_y, w_z = off[..., 2, 1], off[..., 0, 2], off[..., 1, 0]
    x_y, x_z, y_z = both[..., 0, 1], both[..., 0, 2], both[..., 1, 2]
    candidates = np.stack(
        [
            np.stack([1 + trace, w_x, w_y, w_z], axis=-1),
            np.stack([w_x, 1 + x - y - z, x_y, x_z], axis=-1),
            np.stack([w_y, x_y, 1 - x + y - z, y_z], axis=-1),
            np.stack([w_z, x_z, y_z, 1 - x - y + z], axis=-1),
        ],
        axis=-2,
    )
    largest = np.argmax(np.stack([trace, x, y, z], axis=-1), axis=-1)
    quaternion = np.take_along_axis(candidates, largest[..., None, None], axis=-2)
    quaternion = quaternion[..., 0, :]
    quaternion = quaternion / np.linalg.norm(quaternion, axis=-1, keepdims=True)
    quaternion = np.where(quaternion[..., :1] < 0, -quaternion, quaternion)
    sine = np.linalg.norm(quaternion[..., 1:], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(sine, quaternion[..., :1])
    scale = np.where(sine > 1e-12, angle / np.maximum(sine, 1e-300), 2.0)
    vectors: FloatArray = scale * quaternion[..., 1:]
    return vectors


def skew(vectors: FloatArray) -> FloatArray:
    """Return the matrices K with ``K @ p = v x p``, shape (..., 3, 3)."""
    return np.asarray((vectors @ GENERATORS).reshape(*vectors.shape, 3))


def reflection(normals: FloatArray) -> FloatArray:
    """Return the reflections (..., 3, 3) in planes with unit normals (..., 3)."""
    return np.asarray(np.eye(3) - 2 * normals[..., :, None] * normals[..., None, :])


def nearest_rotation(matrices: FloatArray) -> FloatArray:
    """Return the rotations nearest to matrices (..., 3, 3) in the Frobenius norm."""
    U, _, Vt = np.linalg.svd(matrices)
    sign = np.linalg.det(U @ Vt)
    U[..., :, 2] *= sign[..., None]
    rotations: FloatArray = U @ Vt
    return rotations


def fit_rigid(source: FloatArray, target: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return R (..., 3, 3), t (..., 3) that fit points to others by least squares [1]_.

    ``target ~ source @ R.T + t``, both (..., N, 3), mm.

    References
    ----------
    .. [1] S. Umeyama, "Least-squares estimation of transformation parameters
       between two point patterns", IEEE PAMI 13 (1991) 376-380.
    """
    source_mean = source.mean(axis=-2)
    target_mean = target.mean(axis=-2)
    scatter = np.einsum(
        "...ni,...nj->...ij",
        target - target_mean[..., None, :],
        source - source_mean[..., None, :],
    )
    R = nearest_rotation(scatter)
    return R, target_mean - np.einsum("...ij,...j->...i", R, source_mean)


# A rig: cameras fixed to each other that see the same pen.
#
# The first camera is the reference: its frame is the frame of the rig. One camera alone
# is a rig of one.


@dataclass(frozen=True, eq=False)
class Rig:
    """Cameras and their poses (cam_from_rig, as in COLMAP [1]_).

    References
    ----------
    .. [1] J. L. Schonberger, J.-M. Frahm, "Structure-from-motion revisited", CVPR 2016.
    """

    cameras: tuple[Camera, ...]  # C of them
    rotations: FloatArray  # (C, 3, 3), of cam_from_rig; the first is the identity
    translations: FloatArray  # (C, 3), of cam_from_rig, mm; the first is zero
    # (6 (C - 1), 6 (C - 1)), of the rotation vectors (left, rad) and translations (mm)
    # of all but the first camera, in this order camera by camera
    covariance: FloatArray | None = None
    names: tuple[str, ...] = ()  # for display; empty for a single camera

    @property
    def n_cameras(self) -> int:
        """Number of cameras."""
        return len(self.cameras)


def rig_of(camera: Camera) -> Rig:
    """Return the rig of one camera alone."""
    return Rig((camera,), np.eye(3)[None], np.zeros((1, 3)))


def of_camera(name: str, fault: Message) -> Message:
    """Return an error of a camera of a rig, with the camera's name."""
    return message("rig.of-camera", camera=name, fault=fault)


# Posture of the pen: tilt, direction and rotation.
#
# The pen leans by a tilt from upright to a direction, and is turned about its own axis:
#
#     R = A(tilt, direction) U Ry(turn)
#
# Upright, U puts the pen's y axis against the v axis of the camera and turns its LEDs
# to the camera. A turns y the short way to where the pen leans, which is ``(sin(tilt)
# cos(direction), -cos(tilt), sin(tilt) sin(direction))`` in the camera frame.


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
