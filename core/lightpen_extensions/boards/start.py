"""Initial values of an adjustment: focal length and poses, from homographies.

A homography ``H = K [r1 r2 t]`` of a plane makes ``h1^T w h2 = 0`` and ``h1^T w h1 =
h2^T w h2`` with ``w = diag(1, 1, f^2) / f^2`` about the middle of the image: linear
equations in ``1 / f^2`` from all views [1]_.

References
----------
.. [1] Z. Zhang, "A flexible new technique for camera calibration", IEEE PAMI 22 (2000)
   1330-1334.
"""

from typing import NamedTuple

import cv2
import numpy as np

from lightpen.arrays import FloatArray
from lightpen.model.camera import Camera, LensModel
from lightpen.model.fisheye import N_COEFFICIENTS
from lightpen_extensions.boards.observing import Views

USUAL_FOCAL_LENGTH = 1.5  # of the longer side of the image, where the views show none
FISHEYE_FOCALS = (0.2, 0.25, 0.3, 0.35, 0.4, 0.5, 0.6, 0.8, 1.0)  # of the longer side
STRAIGHTER = 0.5  # times the bend of rows by a pinhole
STRAIGHT = 0.002  # of the longer side: the bend of rows before a usual lens
FARTHEST = np.tan(np.radians(75.0))  # in the normalised plane, for a first pose
MIN_POINTS = 6
SOME = 8  # views that show a fisheye
SHORTEST, LONGEST = 0.2, 50.0  # of the longer side


class BoardPoses(NamedTuple):
    """Poses of the board in views (rig_from_board)."""

    rotations: FloatArray
    translations: FloatArray


def start_any_camera(views: Views) -> Camera:
    """Return a pinhole camera that the views of one camera are near to, or a fisheye.

    That is taken if rows of points are straighter with it.
    """
    pinhole = start_camera(views, 5)
    bend = _bend(pinhole, views)
    if bend < STRAIGHT * max(views.image_sizes[0]):
        return pinhole
    fisheye = start_camera(views, N_COEFFICIENTS)
    return fisheye if _bend(fisheye, views) < STRAIGHTER * bend else pinhole


def start_camera(views: Views, n_coefficients: int) -> Camera:
    """Return a camera without distortion that the views are near to.

    The equidistant camera in which the board is flattest, if it is to be a fisheye.
    """
    if n_coefficients != N_COEFFICIENTS:
        return _start_pinhole(views, n_coefficients)
    width, height = views.image_sizes[0]
    cameras = [
        Camera(
            *(width, height, focal, focal, 0.5 * (width - 1), 0.5 * (height - 1)),
            distortion=np.zeros(N_COEFFICIENTS),
            lens=LensModel.KANNALA_BRANDT,
        )
        for focal in np.array(FISHEYE_FOCALS) * max(width, height)
    ]
    return min(cameras, key=lambda camera: _bend(camera, views))


def _bend(camera: Camera, views: Views) -> float:
    """Return the rms residual of the points from homographies of the board, px."""
    squares, count = 0.0, 0
    some = slice(None, None, max(views.n_views // SOME, 1))
    for pixels, seen in zip(views.pixels[some, 0], views.seen[some, 0], strict=True):
        normalised = camera.unproject(pixels[seen])
        near = np.linalg.norm(normalised, axis=-1) < FARTHEST
        if near.sum() < MIN_POINTS:
            continue
        flat = views.board.points[seen, :2][near]
        H, _ = cv2.findHomography(flat, normalised[near])
        if H is None:
            continue
        lifted = np.concatenate([flat, np.ones((len(flat), 1))], axis=1) @ H.T
        with np.errstate(all="ignore"):  # a homography of something else
            there = camera.pixels(lifted[:, :2] / lifted[:, 2:])
        squares += float(np.sum(np.square(there - pixels[seen][near])))
        count += 2 * len(flat)
    return float(np.sqrt(squares / count)) if count else np.inf


def _start_pinhole(views: Views, n_coefficients: int) -> Camera:
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
    f, (cx, cy) = focal * longer, middle.tolist()
    return Camera(width, height, f, f, cx, cy, distortion=np.zeros(n_coefficients))


def start_board_poses(camera: Camera, views: Views, which: int = 0) -> BoardPoses:
    """Return the poses of the board before one of the cameras, NaN where unseen.

    Of the two that a far plane may have, each is the one that fits better [1]_.

    References
    ----------
    .. [1] T. Collins, A. Bartoli, "Infinitesimal plane-based pose estimation", IJCV 109
       (2014) 252-286.
    """
    rotations = np.full((views.n_views, 3, 3), np.nan)
    translations = np.full((views.n_views, 3), np.nan)
    points = views.board.points
    directions = camera.unproject(views.pixels[:, which])
    for v, seen in enumerate(views.seen[:, which]):
        if not seen.any():
            continue
        rays = directions[v, seen]
        near = np.linalg.norm(rays, axis=-1) < FARTHEST
        if near.sum() < MIN_POINTS:
            near[:] = True
        found, turns, shifts, _ = cv2.solvePnPGeneric(
            points[seen][near],
            rays[near][:, None],
            np.eye(3),
            np.zeros(5),
            flags=cv2.SOLVEPNP_IPPE,
        )
        if found:
            rotations[v] = cv2.Rodrigues(turns[0])[0]
            translations[v] = np.asarray(shifts[0]).ravel()
    return BoardPoses(rotations, translations)
