"""State of a board adjustment, and its fit."""

from dataclasses import dataclass, field
from functools import cache

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.model.camera import Camera
from lightpen_extensions.boards.boards import Board
from lightpen_extensions.boards.start import BoardPoses

N_POSE, N_SHAPE = 6, 5


@dataclass(frozen=True, eq=False)
class BoardState:
    """Parameters of the projected points of the views."""

    cameras: tuple[Camera, ...]  # C of them
    # `rotations` and `translations`: (C, 3, 3) and (C, 3), of cam_from_rig, mm
    rotations: FloatArray
    translations: FloatArray
    poses: BoardPoses  # rig_from_board
    shape: FloatArray  # (5,), stretch, shear, and three bends, mm
    # (3,) or (N, 3), of the points from the shape, mm.
    offsets: FloatArray = field(default_factory=lambda: np.zeros(3))


@dataclass(frozen=True, eq=False)
class BoardFit:
    """A fitted state with its covariance."""

    board: Board
    state: BoardState
    # (V, C, N, 2), observed minus modelled, px; NaN where not seen.
    residuals: FloatArray
    sigma: float  # noise of one coordinate, px
    # `information` and `scores`: (V, p, p) and (V, p), of each view on all but its
    # pose, and its gradient, for points of 1 px noise.
    information: FloatArray
    scores: FloatArray
    prior: FloatArray  # (p, p), information of the priors
    # (p, p), of all but the poses; of `adjust_board` by independent noise alone.
    covariance: FloatArray

    @property
    def board_points(self) -> FloatArray:
        """Points of the board with its estimated shape, (N, 3), mm."""
        return board_points(self.board, self.state.shape) + self.state.offsets

    @property
    def rms(self) -> float:
        """Distance of observed from modelled points, px rms."""
        squares = np.square(self.residuals).sum(axis=-1)
        return float(np.sqrt(np.nanmean(squares)))

    @property
    def view_rms(self) -> FloatArray:
        """The same of each view and camera, (V, C); NaN where nothing was seen."""
        squares = np.square(self.residuals).sum(axis=-1)
        counts = np.isfinite(squares).sum(axis=-1)
        sums = np.nansum(squares, axis=-1)
        return np.asarray(np.sqrt(sums / np.where(counts > 0, counts, np.nan)))

    def of_intrinsics(self, camera: int) -> slice:
        """Return the indices of the intrinsics of a camera."""
        return intrinsics_at(self.state.cameras)[camera]

    def prior_of(self, camera: int) -> FloatArray:
        """Return the prior information of a camera's intrinsics, (4 + n, 4 + n)."""
        at = self.of_intrinsics(camera)
        return self.prior[at, at]

    @property
    def of_places(self) -> slice:
        """Indices of the extrinsics of all cameras but the first."""
        return places_at(self.state.cameras)

    @property
    def of_shape(self) -> slice:
        """Indices of the errors of the board."""
        at = self.of_places
        return slice(at.stop, at.stop + N_SHAPE)


def board_points(board: Board, shape: FloatArray) -> FloatArray:
    """Return the points of the actual board, (N, 3), mm."""
    return np.asarray(board.points + deformations_of(board) @ shape)


@cache
def deformations_of(board: Board) -> FloatArray:
    """Return the derivatives of the board points by its errors, (N, 3, 5)."""
    points = board.points
    x, y = points[:, 0], points[:, 1]
    u, v = x / np.abs(x).max(), y / np.abs(y).max()
    moves = np.zeros((len(points), 3, N_SHAPE))
    moves[:, 0, 0], moves[:, 1, 0] = 0.5 * x, -0.5 * y
    moves[:, 0, 1], moves[:, 1, 1] = 0.5 * y, 0.5 * x
    for k, bend in enumerate((u * u, u * v, v * v), 2):
        moves[:, 2, k] = bend - bend.mean()
    moves.flags.writeable = False
    return moves


def intrinsics_at(cameras: tuple[Camera, ...]) -> list[slice]:
    """Return the indices of the intrinsics of each camera."""
    ends = np.cumsum([len(camera.intrinsics) for camera in cameras]).tolist()
    return [slice(b, e) for b, e in zip([0, *ends[:-1]], ends, strict=True)]


def places_at(cameras: tuple[Camera, ...]) -> slice:
    """Return the indices of the extrinsics of all cameras but the first."""
    begin = sum(len(camera.intrinsics) for camera in cameras)
    return slice(begin, begin + N_POSE * (len(cameras) - 1))
