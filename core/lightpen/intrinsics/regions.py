"""Residuals by region of the image: where a model does not fit the lens."""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.intrinsics.board_fit import BoardFit
from lightpen.model.camera import Camera

COLUMNS, ROWS = 4, 3


@dataclass(frozen=True, eq=False)
class Regions:
    """Residuals of one camera in 3 rows and 4 columns.

    Attributes
    ----------
    n_points : (3, 4) array of int
    rms : (3, 4) array
        px; NaN without points.
    means : (3, 4, 2) array
        px; a lens that the model does not fit pulls its regions to some side.
    """

    n_points: IntArray
    rms: FloatArray
    means: FloatArray


def measure_regions(fitted: BoardFit, camera: Camera) -> Regions:
    """Return the residuals of a single camera by region."""
    residuals = fitted.residuals[:, 0]
    seen = np.isfinite(residuals[..., 0])
    poses = fitted.state.poses
    board = fitted.board_points
    points = board @ np.swapaxes(poses.rotations, 1, 2) + poses.translations[:, None]
    at = camera.project(points[seen]) / np.array(camera.image_size)
    at = np.floor(at * np.array([COLUMNS, ROWS])).astype(np.int64)
    column = np.clip(at[:, 0], 0, COLUMNS - 1)
    row = np.clip(at[:, 1], 0, ROWS - 1)
    n_points = np.zeros((ROWS, COLUMNS), dtype=np.int64)
    sums = np.zeros((ROWS, COLUMNS, 2))
    squares = np.zeros((ROWS, COLUMNS))
    np.add.at(n_points, (row, column), 1)
    np.add.at(sums, (row, column), residuals[seen])
    np.add.at(squares, (row, column), np.square(residuals[seen]).sum(axis=-1))
    counts = np.where(n_points > 0, n_points, np.nan)
    return Regions(n_points, np.sqrt(squares / counts), sums / counts[..., None])
