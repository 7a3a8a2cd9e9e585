"""Rotations and rigid motions."""

import cv2
import numpy as np

from lightpen.model.rigid import (
    fit_rigid,
    nearest_rotation,
    rotation_from_vector,
    skew,
    vector_from_rotation,
)

RNG = np.random.default_rng(0)
AXES = RNG.standard_normal((200, 3))
AXES /= np.linalg.norm(AXES, axis=1, keepdims=True)


def test_rotation_vectors_agree_with_opencv() -> None:
    vectors = AXES * RNG.uniform(0, 3.1, (200, 1))
    expected = [cv2.Rodrigues(vector)[0] for vector in vectors]

    np.testing.assert_allclose(rotation_from_vector(vectors), expected, atol=1e-12)


def test_vectors_come_back_at_any_angle_up_to_pi() -> None:
    for angle in (0.0, 1e-9, 1e-4, 1.0, 3.0, np.pi - 1e-4, np.pi - 1e-8):
        vectors = angle * AXES
        back = vector_from_rotation(rotation_from_vector(vectors))
        np.testing.assert_allclose(back, vectors, atol=1e-7)


def test_skew_is_the_cross_product() -> None:
    np.testing.assert_allclose(
        skew(AXES[:100]) @ AXES[100:, :, None],
        np.cross(AXES[:100], AXES[100:])[..., None],
        atol=1e-15,
    )


def test_the_nearest_rotation_is_a_rotation_and_leaves_rotations_alone() -> None:
    R = rotation_from_vector(AXES)
    noisy = R + 0.1 * RNG.standard_normal(R.shape)
    nearest = nearest_rotation(noisy)

    np.testing.assert_allclose(nearest_rotation(R), R, atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(nearest), 1.0, atol=1e-12)
    np.testing.assert_allclose(
        nearest @ np.swapaxes(nearest, 1, 2),
        np.tile(np.eye(3), (200, 1, 1)),
        atol=1e-12,
    )


def test_a_rigid_motion_is_found_exactly() -> None:
    points = RNG.standard_normal((5, 8, 3)) * 100
    R, t = rotation_from_vector(AXES[:5]), 300 * AXES[5:10]
    moved = points @ np.swapaxes(R, 1, 2) + t[:, None]

    found_R, found_t = fit_rigid(points, moved)

    np.testing.assert_allclose(found_R, R, atol=1e-12)
    np.testing.assert_allclose(found_t, t, atol=1e-9)


def test_small_angles_come_back_exactly() -> None:
    for angle in (1e-6, 1e-3, 0.019):
        vectors = angle * AXES
        back = vector_from_rotation(rotation_from_vector(vectors))
        np.testing.assert_allclose(back, vectors, atol=1e-14)


def test_no_rotation_is_nearer_than_the_nearest() -> None:
    """Also to a matrix that mirrors, of which the smallest axis is turned over."""
    matrices = RNG.standard_normal((200, 3, 3))
    assert (np.linalg.det(matrices) < 0).any()
    alike = np.einsum("nij,nij->n", nearest_rotation(matrices), matrices)

    sizes = np.linalg.svd(matrices, compute_uv=False)
    sizes[:, 2] *= np.sign(np.linalg.det(matrices))
    np.testing.assert_allclose(alike, sizes.sum(axis=1), atol=1e-12)
    for vector in 0.1 * AXES[:20]:
        other = rotation_from_vector(vector) @ nearest_rotation(matrices)
        assert (np.einsum("nij,nij->n", other, matrices) < alike).all()
