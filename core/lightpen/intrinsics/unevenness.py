"""Points of a board that are off their places, by the residuals of fitted cameras."""

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.intrinsics.adjustment import linearise
from lightpen.intrinsics.board_fit import N_POSE, BoardFit
from lightpen.intrinsics.views import Views

RIDGE, HELD = 1e-8, 1e4  # of the information of a point: of nothing, of what is known


def fit_unevenness(
    groups: tuple[Views, ...], fits: list[BoardFit]
) -> tuple[FloatArray, float]:
    """Return how far points are off an affine board in its plane, (N, 3), mm.

    And the residuals that it leaves, px rms. A step of Gauss and Newton of all unknowns
    together.
    """
    board = groups[0].board
    n_points, n_own = board.n_points, len(fits[0].prior)
    n = 2 * n_points + n_own * len(fits)
    known, right, squares, n_seen = np.zeros((n, n)), np.zeros(n), 0.0, 0
    at = np.arange(n_points)
    for g, (views, fit) in enumerate(zip(groups, fits, strict=True)):
        own = slice(2 * n_points + g * n_own, 2 * n_points + (g + 1) * n_own)
        known[own, own] += fit.sigma**2 * fit.prior
        for sight in linearise(views, fit.state, fit.residuals):
            columns = np.zeros((views.n_views, n_points, 2, n))
            columns[..., own] = sight.shared
            for axis in range(2):
                columns[:, at, :, 2 * at + axis] = np.moveaxis(
                    sight.by_board[..., axis], 1, 0
                )
            by_view = columns.reshape(views.n_views, -1, n)
            own_poses = sight.own.reshape(views.n_views, -1, N_POSE)
            Q = np.linalg.qr(own_poses)[0]
            M = (by_view - Q @ (np.swapaxes(Q, 1, 2) @ by_view)).reshape(-1, n)
            left = sight.residuals.reshape(views.n_views, -1, 1)
            r = (left - Q @ (np.swapaxes(Q, 1, 2) @ left)).ravel()
            known += M.T @ M
            right += M.T @ r
            squares += float(r @ r)
        n_seen += int(views.seen.sum())
    of_points = slice(0, 2 * n_points)
    most = known[of_points, of_points].diagonal().max()
    affine = np.linalg.qr(np.c_[board.points[:, :2], np.ones(n_points)])[0]
    known[of_points, of_points] += HELD * most * np.kron(affine @ affine.T, np.eye(2))
    known[np.arange(n), np.arange(n)] += RIDGE * most
    found = np.linalg.solve(known, right)
    left_over = max(squares - float(right @ found), 0.0) / (2 * n_seen)
    off = found[of_points].reshape(-1, 2)
    return np.c_[off, np.zeros(n_points)], float(np.sqrt(left_over))
