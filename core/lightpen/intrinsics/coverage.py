"""Coverage of the image, distances and tilts by views of a board."""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.intrinsics.start import BoardPoses
from lightpen.intrinsics.views import Views
from lightpen.messages import Message, message

COLUMNS, ROWS = 8, 6  # of cells that the image is divided into
TILTED = np.radians(15.0)
PER_SIDE = 2  # tilted views
NEAR = 1.3  # times the size of the smallest: the distance varies
CORNER_NAMES = (
    message("corner.top-left"),
    message("corner.top-right"),
    message("corner.bottom-left"),
    message("corner.bottom-right"),
)
SIDE_NAMES = (
    message("tilt.right"),
    message("tilt.down"),
    message("tilt.left"),
    message("tilt.up"),
)


@dataclass(frozen=True, eq=False)
class BoardCoverage:
    """Coverage by views of a board."""

    cells: IntArray  # (6, 8), points seen in each part of the image
    sizes: FloatArray  # (V,), side of a square of the board's area in the image, px
    tilts: FloatArray  # (V,), between the board and the image, rad
    # (4,), views in which the board faces to the right, down, to the left and up.
    tilted: IntArray

    @property
    def share(self) -> float:
        """Share of the image in which points were seen."""
        return float(np.mean(self.cells > 0))

    @property
    def missing(self) -> tuple[Message, ...]:
        """Messages on missing coverage."""
        corners = self.cells[[0, 0, -1, -1], [0, -1, 0, -1]]
        empty = tuple(
            name for name, n in zip(CORNER_NAMES, corners, strict=True) if n == 0
        )
        sides = tuple(
            name
            for name, n in zip(SIDE_NAMES, self.tilted, strict=True)
            if n < PER_SIDE
        )
        missing = []
        if empty:
            missing.append(message("coverage.corners", corners=empty))
        if sides:
            missing.append(message("coverage.tilts", least=PER_SIDE, sides=sides))
        if len(self.sizes) and self.sizes.max() < NEAR * self.sizes.min():
            missing.append(message("coverage.sizes"))
        return tuple(missing)


def cover(views: Views, poses: BoardPoses) -> BoardCoverage:
    """Return the coverage by the views of a single camera at poses cam_from_board."""
    normals = poses.rotations[..., 2]
    tilts = np.arccos(np.clip(np.abs(normals[:, 2]), 0, 1))
    # The board's z points away from the camera: it faces against it.
    facing = np.arctan2(-normals[:, 1], -normals[:, 0])
    side = np.round(facing / (np.pi / 2)).astype(np.int64) % 4
    tilted = np.bincount(side[tilts > TILTED], minlength=4)
    return BoardCoverage(cells_of(views), _sizes(views), tilts, tilted)


def cells_of(views: Views) -> IntArray:
    """Return the number of points of one camera in each cell of the image, (6, 8)."""
    places = views.pixels[views.seen] / np.array(views.image_sizes[0])
    at = np.floor(places * np.array([COLUMNS, ROWS])).astype(np.int64)
    at = np.clip(at, 0, [COLUMNS - 1, ROWS - 1])
    cells = np.zeros((ROWS, COLUMNS), dtype=np.int64)
    np.add.at(cells, (at[:, 1], at[:, 0]), 1)
    return cells


def _sizes(views: Views) -> FloatArray:
    """Return the size of the board in each view, px, by the spread of its points."""
    board = views.board.points[:, :2]
    sizes = []
    for pixels, seen in zip(views.pixels[:, 0], views.seen[:, 0], strict=True):
        spread = np.linalg.det(np.cov(pixels[seen].T)) / np.linalg.det(
            np.cov(board[seen].T)
        )
        sizes.append(spread**0.25 * np.sqrt(np.prod(2 * np.abs(board).max(axis=0))))
    return np.array(sizes)
