"""The next view of the board: the one that reduces the uncertainty most.

Each of some hundred views that an operator can hold is asked by how much it would
lessen the uncertainty of projections over the whole image, were it added to those that
there are [1]_.

References
----------
.. [1] S. Peng, P. Sturm, "Calibration wizard: a guidance system for camera calibration
   based on modelling geometric and corner uncertainty", ICCV 2019.
"""

from dataclasses import dataclass, replace

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.intrinsics.adjustment import view_information
from lightpen.intrinsics.board_fit import BoardFit
from lightpen.intrinsics.boards import Board
from lightpen.intrinsics.start import USUAL_FOCAL_LENGTH, BoardPoses
from lightpen.intrinsics.uncertainty_map import error_fields
from lightpen.model.camera import Camera
from lightpen.model.rigid import rotation_from_vector

PLACES = (0.25, 0.5, 0.75)  # of width and height
FILLED = (0.45, 0.7)  # of the image's shorter side
TILT = np.radians(32.0)
TURNS = ((0, 0), (TILT, 0), (-TILT, 0), (0, TILT), (0, -TILT), (TILT, TILT))


@dataclass(frozen=True, eq=False)
class SuggestedView:
    """Suggested pose of the board."""

    # (4, 2), of its points in the image, px, from its first corner on.
    outline: FloatArray
    gain: float  # relative reduction of the uncertainty


def choose_next_view(adjustment: BoardFit, board: Board) -> SuggestedView:
    """Return the view that would lessen the uncertainty of one camera most."""
    camera = adjustment.state.cameras[0]
    poses = _candidates(camera, board)
    state = replace(adjustment.state, poses=poses)
    variance = adjustment.sigma**2
    added = view_information(board, state, camera.image_size) / variance
    known = adjustment.information.sum(axis=0) / variance + adjustment.prior
    fields = error_fields(camera).reshape(-1, len(camera.intrinsics))
    weights = np.zeros_like(known)
    at = adjustment.of_intrinsics(0)
    weights[at, at] = fields.T @ fields
    variances = np.einsum("vij,ij->v", np.linalg.inv(known + added), weights)
    before = float(np.sum(np.linalg.inv(known) * weights))
    best = int(np.argmin(variances))
    outline = board.outline @ poses.rotations[best].T + poses.translations[best]
    return SuggestedView(
        camera.project(outline), 1 - float(np.sqrt(variances[best] / before))
    )


def first_views(board: Board, image_size: tuple[int, int]) -> list[FloatArray]:
    """Return outlines to begin with: in the middle, then tilted to each side."""
    width, height = image_size
    focal = USUAL_FOCAL_LENGTH * max(image_size)
    camera = Camera(width, height, focal, focal, 0.5 * (width - 1), 0.5 * (height - 1))
    longer = 2 * float(np.abs(board.points[:, :2]).max())
    depth = focal * longer / (FILLED[-1] * min(image_size))
    outlines = []
    for about_x, about_y in TURNS:
        turn = rotation_from_vector(np.array([about_x, about_y, 0.0]))
        outline = board.outline @ turn.T + np.array([0.0, 0.0, depth])
        outlines.append(camera.project(outline))
    return outlines


def _candidates(camera: Camera, board: Board) -> BoardPoses:
    """Return views that show the whole board."""
    longer = 2 * float(np.abs(board.points[:, :2]).max())
    rotations, translations = [], []
    for filled in FILLED:
        depth = camera.fx * longer / (filled * min(camera.image_size))
        for x in PLACES:
            for y in PLACES:
                pixel = np.array([x * (camera.width - 1), y * (camera.height - 1)])
                direction = np.append(camera.unproject(pixel), 1.0)
                for quarter in (0.0, np.pi / 2):
                    roll = rotation_from_vector(np.array([0.0, 0.0, quarter]))
                    for about_x, about_y in TURNS:
                        turn = rotation_from_vector(np.array([about_x, about_y, 0.0]))
                        rotations.append(turn @ roll)
                        translations.append(depth * direction)
    poses = BoardPoses(np.array(rotations), np.array(translations))
    points = board.outline @ np.swapaxes(poses.rotations, 1, 2)
    pixels = camera.project(points + poses.translations[:, None])
    inside = (pixels >= 0) & (pixels <= np.array(camera.image_size) - 1)
    whole = inside.all(axis=(1, 2))
    return BoardPoses(poses.rotations[whole], poses.translations[whole])
