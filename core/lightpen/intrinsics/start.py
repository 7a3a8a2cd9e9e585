"""Start of an adjustment: focal length and poses, from homographies.

A homography ``H = K [r1 r2 t]`` of a plane makes ``h1^T w h2 = 0`` and ``h1^T w h1 =
h2^T w h2`` with ``w = diag(1, 1, f^2) / f^2`` about the middle of the image, which all
views together tell linearly in ``1 / f^2`` [1]_.

References
----------
.. [1] Z. Zhang, "A flexible new technique for camera calibration", IEEE PAMI 22 (2000)
   1330-1334.
"""

from typing import NamedTuple

import cv2
import numpy as np

from lightpen.arrays import FloatArray
from lightpen.intrinsics.views import Views
from lightpen.model.camera import Camera

USUAL_FOCAL_LENGTH = 1.5  # of the longer side of the image, where the views tell none
SHORTEST, LONGEST = 0.2, 50.0  # of the longer side


class BoardPoses(NamedTuple):
    """Poses of the board in views (rig_from_board)."""

    rotations: FloatArray
    translations: FloatArray


def start_camera(views: Views, n_coefficients: int) -> Camera:
    """Return a camera without distortion that the views of one camera are near to."""
    width, height = views.image_sizes[0]
    middle = 0.5 * np.array([width - 1, height - 1])
    longer = max(width, height)
    rows, right = [], []
    for pixels, seen in zip(views.pixels[:, 0], views.seen[:, 0], strict=True):
        flat = views.board.points[seen, :2]
        H, _ = cv2.findHomography(flat, (pixels[seen] - middle) / longer)
        if H is None:
            continue
        (a, d), (b, e), (c, g) = (H / np.linalg.norm(H[:, :2]))[:, :2]
        rows += [a * d + b * e, a * a + b * b - d * d - e * e]
        right += [-c * g, g * g - c * c]
    by, of = np.array(rows), np.array(right)
    inverse_square = float(by @ of / (by @ by)) if rows else 0.0
    focal = USUAL_FOCAL_LENGTH
    if LONGEST**-2 < inverse_square < SHORTEST**-2:
        focal = inverse_square**-0.5
    return Camera(
        width,
        height,
        focal * longer,
        focal * longer,
        float(middle[0]),
        float(middle[1]),
        distortion=np.zeros(n_coefficients),
    )


def start_board_poses(camera: Camera, views: Views, which: int = 0) -> BoardPoses:
    """Return the poses of the board before one of the cameras.

    Of the two that a far plane may have, each is the one that fits better [1]_.

    Returns
    -------
    BoardPoses
        NaN where the camera did not see the board.

    References
    ----------
    .. [1] T. Collins, A. Bartoli, "Infinitesimal plane-based pose estimation", IJCV 109
       (2014) 252-286.
    """
    rotations = np.full((views.n_views, 3, 3), np.nan)
    translations = np.full((views.n_views, 3), np.nan)
    points = views.board.points
    for v, (pixels, seen) in enumerate(
        zip(views.pixels[:, which], views.seen[:, which], strict=True)
    ):
        if not seen.any():
            continue
        found, turns, shifts, _ = cv2.solvePnPGeneric(
            points[seen],
            camera.unproject(pixels[seen])[:, None],
            np.eye(3),
            np.zeros(5),
            flags=cv2.SOLVEPNP_IPPE,
        )
        if found:
            rotations[v] = cv2.Rodrigues(turns[0])[0]
            translations[v] = np.asarray(shifts[0]).ravel()
    return BoardPoses(rotations, translations)
