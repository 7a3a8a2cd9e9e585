"""Where an operator holds a board before a camera."""

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.intrinsics.boards import Board
from lightpen.intrinsics.start import BoardPoses
from lightpen.model.camera import Camera
from lightpen.model.rigid import rotation_from_vector

MAX_TILT = np.radians(35.0)
FILLED = (0.5, 0.8)  # of the image's shorter side, by the longer side of the board
ROLLS = np.radians([-90.0, -15.0, 0.0, 10.0, 90.0])
RIM = 2.0  # squares or distances beyond the points, which stay in the image, too
MAX_TRIES = 100


def simulate_board_poses(
    camera: Camera, board: Board, n_views: int, rng: np.random.Generator
) -> BoardPoses:
    """Return poses in which the whole board is seen, its rim included."""
    size = np.array(camera.image_size)
    longer = 2 * float(np.abs(board.points[:, :2]).max())
    sheet = board.outline + RIM * board.pitch * np.sign(board.outline)
    rotations: list[FloatArray] = []
    translations: list[FloatArray] = []
    for _ in range(MAX_TRIES * n_views):
        if len(rotations) == n_views:
            break
        tilt = np.append(rng.uniform(-MAX_TILT, MAX_TILT, 2), 0.0)
        roll = np.array([0.0, 0.0, rng.choice(ROLLS)])
        R = rotation_from_vector(tilt) @ rotation_from_vector(roll)
        depth = camera.fx * longer / (rng.uniform(*FILLED) * size.min())
        place = camera.unproject(rng.uniform(0.2, 0.8, 2) * size)
        t = depth * np.append(place, 1.0)
        pixels = camera.project(sheet @ R.T + t) / size
        if np.all((pixels > 0) & (pixels < 1)):
            rotations.append(R)
            translations.append(t)
    return BoardPoses(np.array(rotations), np.array(translations))
