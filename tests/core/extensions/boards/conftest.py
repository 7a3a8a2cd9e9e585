"""Boards before a camera, without rendering them."""

from collections.abc import Callable

import numpy as np
import pytest
from tests.simulated_boards import simulate_board_poses

from lightpen.arrays import FloatArray
from lightpen.model.camera import Camera
from lightpen.model.ellipse import disc_centroids
from lightpen_extensions.boards.adjustment import board_points
from lightpen_extensions.boards.boards import Board, parse_board
from lightpen_extensions.boards.observing import Views

NOISE = 0.03  # px

MakeViews = Callable[..., Views]


@pytest.fixture(scope="session")
def camera() -> Camera:
    return Camera(
        *(640, 480, 900.0, 899.4, 322.3, 238.1),
        distortion=np.array([-0.1, 0.05, 3e-4, -2e-4, 0.0]),
    )


@pytest.fixture(scope="session")
def make_views(camera: Camera) -> MakeViews:
    """Return views of a board that may be another than it is said to be."""

    def make(
        word: str = "chessboard:9x6:20",
        n_views: int = 16,
        noise: float = NOISE,
        seed: int = 1,
        shape: FloatArray | None = None,
        of: Camera = camera,
        uneven: float = 0.0,
    ) -> Views:
        board = parse_board(word)
        rng = np.random.default_rng(seed)
        poses = simulate_board_poses(of, board, n_views, rng)
        true = board_points(board, np.zeros(5) if shape is None else shape)
        off = np.random.default_rng(27).normal(0, uneven, (board.n_points, 2))
        true = true + np.pad(off, ((0, 0), (0, 1)))
        points = true @ np.swapaxes(poses.rotations, 1, 2)
        points += poses.translations[:, None]
        pixels = seen_points(of, board, points, poses.rotations)
        pixels = pixels + rng.normal(0, noise, pixels.shape)
        names = tuple(f"view_{v + 1:02}.png" for v in range(n_views))
        return Views(board, names, pixels[:, None], (of.image_size,))

    return make


def seen_points(
    camera: Camera, board: Board, points: FloatArray, rotations: FloatArray
) -> FloatArray:
    """Return where the points are seen, the circles as ellipses."""
    if not board.kind.is_circles:
        return camera.project(points)
    normals = np.broadcast_to(rotations[:, None, :, 2], points.shape)
    return disc_centroids(camera, points, normals, 0.5 * board.detail)
