"""The views of the board that a calibration asks for.

The middle of the image with the board tilted to each side, then its corners, each with
two tilts; in simulation they determine a camera as well as views that are chosen one
after another by the uncertainty that they would leave.
"""

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.model.camera import Camera
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.boards.boards import Board
from lightpen_extensions.boards.start import USUAL_FOCAL_LENGTH

NEAR, FAR = 0.8, 0.6  # of the image's shorter side, filled by the board
TILT = np.radians(32.0)
SHARES = np.linspace(0.5, 0.0, 51)  # of the image, from its middle, the first that fits
# Side of the image along x and y, filled share, tilts about x and y, quarter turns.
VIEWS = (
    (0, 0, NEAR, 0, 0, 0),
    (0, 0, NEAR, 1, 0, 0),
    (0, 0, NEAR, -1, 0, 0),
    (0, 0, NEAR, 0, 1, 0),
    (0, 0, NEAR, 0, -1, 0),
    (-1, -1, FAR, 1, 1, 0),
    (1, 1, FAR, -1, -1, 0),
    (1, -1, FAR, 1, -1, 0),
    (-1, 1, FAR, -1, 1, 0),
    (-1, -1, FAR, -1, -1, 1),
    (1, 1, FAR, 1, 1, 1),
    (1, -1, FAR, -1, 1, 1),
    (-1, 1, FAR, 1, -1, 1),
    (0, 0, NEAR, 1, 0, 1),
    (0, 0, NEAR, -1, 0, 1),
)


def wanted_outline(
    board: Board, image_size: tuple[int, int], n_views: int
) -> FloatArray:
    """Return the outline of the board, (4, 2), px, that is wanted after ``n_views``.

    From its first corner on, within the image.
    """
    width, height = image_size
    along, down, filled, about_x, about_y, quarters = VIEWS[n_views % len(VIEWS)]
    focal = USUAL_FOCAL_LENGTH * max(image_size)
    middle = 0.5 * (np.array(image_size) - 1.0)
    camera = Camera(width, height, focal, focal, *middle.tolist())
    longer = 2 * float(np.abs(board.points[:, :2]).max())
    depth = focal * longer / (filled * min(image_size))
    turn = rotation_from_vector(TILT * np.array([about_x, about_y, 0.0]))
    roll = rotation_from_vector(np.array([0.0, 0.0, quarters * np.pi / 2]))
    turned = board.outline @ (turn @ roll).T
    aside = np.array([along * width, down * height]) / focal
    for share in SHARES:
        outline = camera.project(turned + depth * np.append(share * aside, 1.0))
        if np.all((outline >= 0) & (outline <= 2 * middle)):
            break
    return outline
