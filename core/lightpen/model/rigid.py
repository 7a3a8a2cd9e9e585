"""Rotations and rigid motions, vectorised over any number of leading axes."""

import numpy as np

from lightpen.arrays import FloatArray

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
