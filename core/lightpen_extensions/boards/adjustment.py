"""Bundle adjustment of a board: cameras, their poses, and the shape of the board.

Point n of the board in view v, seen by camera c, lies at

    X_c = R_c (R_v (x_n + s(x_n)) + t_v) + t_c,

R_c, t_c being the identity for the first camera. The board's own error ``s`` has five
numbers: a stretch along x against y, a shear, and a bend of its corners by three
paraboloids; each has a prior, as have the intrinsics where a file states them. A disc
is seen as its ellipse, the centre of which is not its image. The poses are eliminated
view by view [1]_, and the rest is solved by Levenberg's and Marquardt's method.

References
----------
.. [1] B. Triggs et al., "Bundle adjustment - a modern synthesis", LNCS 1883 (2000)
   298-372, section 6.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.model.camera import Camera
from lightpen.model.ellipse import disc_centroids
from lightpen.model.rigid import rotation_from_vector, skew
from lightpen_extensions.boards.boards import Board
from lightpen_extensions.boards.observing import Views
from lightpen_extensions.boards.start import BoardPoses

N_POSE, N_SHAPE = 6, 5
MAX_STEPS = 100
MAX_DAMPING = 1e12
FIRST_DAMPING = 1e-3
CONVERGED = 1e-6  # of the sum of squares: a thousandth of a standard uncertainty
FINEST = 1e-4  # px; exact points that weigh more drown the priors in rounding
NOISE_ROUNDS = 3
# Standard deviations of a board's shape, which the views tell: relative, and mm.
SQUARENESS, FLATNESS = 0.1, 5.0
_SHARED, _OWN = slice(None, -N_POSE), slice(-N_POSE, None)  # unknowns of a system
VAGUE = 1e-13  # least eigenvalue of an information matrix scaled to ones


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
        return _shaped(self.board, self.state)

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


class _System(NamedTuple):
    """Normal equations for points of 1 px noise, view by view; its pose comes last."""

    residuals: FloatArray
    normal: FloatArray  # (V, p + 6, p + 6)
    right: FloatArray  # (V, p + 6)


class LinearSight(NamedTuple):
    """Points of one camera and their derivatives, 0 where not seen."""

    residuals: FloatArray  # (V, N, 2), px
    # `shared`, `own` and `by_board`: (V, N, 2, p), (V, N, 2, 6) and (V, N, 2, 3),
    # derivatives by all but the poses, by the pose of the view, and by the points on
    # the board.
    shared: FloatArray
    own: FloatArray
    by_board: FloatArray


def adjust_board(
    views: Views,
    start: BoardState,
    stated: tuple[FloatArray | None, ...] = (),
    origin: BoardState | None = None,
) -> BoardFit:
    """Fit everything to the points of all views.

    Raises `CalibrationError` if the points do not settle, or leave the camera open.

    Parameters
    ----------
    start : BoardState
        Start values.
    stated : tuple of (4 + n, 4 + n) array or None
        Information of the intrinsics of each camera beside the views; none where None.
    origin : BoardState
        What they state, and the shape of the board before; by default the start.
    """
    prior = _prior(start, stated)
    state, origin = start, origin or start
    sigma = max(_rms(board_residuals(views, state)), FINEST)
    for _ in range(NOISE_ROUNDS):
        state, system = _settled(views, state, origin, prior, sigma)
        information, scores = _eliminated(system)
        both = information.sum(axis=0) / sigma**2 + prior
        covariance = _inverse(both)
        n_points = int(views.seen.sum())
        n_known = float(np.sum(covariance * prior))
        n_free = 2 * n_points - N_POSE * views.n_views - len(prior) + n_known
        squares = float(np.nansum(np.square(system.residuals)))
        before, sigma = sigma, max(np.sqrt(squares / max(n_free, 1.0)), FINEST)
        if abs(sigma - before) < 1e-3 * sigma:
            break
    covariance = _inverse(information.sum(axis=0) / sigma**2 + prior)
    return BoardFit(
        views.board,
        state,
        system.residuals,
        float(sigma),
        information,
        scores,
        prior,
        covariance,
    )


def fit_board_poses(views: Views, state: BoardState) -> BoardFit:
    """Return the fit of the poses alone; its covariance is as of the held numbers."""
    held = np.diag(np.full(places_at(state.cameras).stop + N_SHAPE, 1e20))
    found, system = _settled(views, state, state, held, 1.0)
    information, scores = _eliminated(system)
    rms = _rms(system.residuals)
    return BoardFit(
        views.board, found, system.residuals, rms, information, scores, held, 0 * held
    )


def _settled(
    views: Views, start: BoardState, origin: BoardState, prior: FloatArray, sigma: float
) -> tuple[BoardState, _System]:
    state, damping = start, FIRST_DAMPING
    residuals = board_residuals(views, state)
    if np.isinf(residuals).any():
        raise CalibrationError("intrinsics.no-start", board=views.board.name)
    system = _system(views, state, residuals)
    away = _away(state, origin)
    cost = _cost_of(residuals, away, prior, sigma)
    for _ in range(MAX_STEPS):
        step, poses_step = _step(system, away, prior, sigma, damping)
        moved = moved_state(state, step, poses_step)
        there = board_residuals(views, moved)
        away_there = _away(moved, origin)
        reached = _cost_of(there, away_there, prior, sigma)
        if not reached <= cost:
            damping *= 10
            if damping > MAX_DAMPING:
                return state, system
            continue
        gained = cost - reached
        state, away, cost = moved, away_there, reached
        damping = max(damping / 10, 1e-12)
        system = _system(views, state, there)
        if gained <= CONVERGED * (cost + 1e-12):
            return state, system
    raise CalibrationError("intrinsics.not-settled", n_steps=MAX_STEPS)


def _step(
    system: _System, away: FloatArray, prior: FloatArray, sigma: float, damping: float
) -> tuple[FloatArray, FloatArray]:
    normal, right_of_each = system.normal / sigma**2, system.right / sigma**2
    own, own_right = normal[:, _OWN, _OWN], right_of_each[:, _OWN]
    # A view without points leaves nothing to divide by.
    own = own + (damping * (own * np.eye(N_POSE)) + 1e-12 * np.eye(N_POSE))
    shared = normal[:, _SHARED, _SHARED].sum(axis=0) + prior
    shared = shared + damping * np.diag(np.diag(shared))
    right = right_of_each[:, _SHARED].sum(axis=0) - prior @ away
    cross = normal[:, _SHARED, _OWN]
    solved = np.linalg.solve(own, np.swapaxes(cross, 1, 2))
    reduced = shared - np.einsum("vpi,viq->pq", cross, solved)
    reduced_right = right - np.einsum("viq,vi->q", solved, own_right)
    scale = 1 / np.sqrt(np.maximum(np.diag(shared), 1e-300))
    step = scale * np.linalg.solve(
        reduced * np.outer(scale, scale) + VAGUE * np.eye(len(scale)),
        scale * reduced_right,
    )
    left = own_right - np.einsum("vpi,p->vi", cross, step)
    return step, np.linalg.solve(own, left[..., None])[..., 0]


def _eliminated(system: _System) -> tuple[FloatArray, FloatArray]:
    """Return information and score of each view about all but its pose."""
    own, cross = (system.normal[:, each, _OWN] for each in (_OWN, _SHARED))
    solved = np.linalg.solve(own + 1e-12 * np.eye(N_POSE), np.swapaxes(cross, 1, 2))
    information = system.normal[:, _SHARED, _SHARED] - cross @ solved
    of_poses = np.einsum("viq,vi->vq", solved, system.right[:, _OWN])
    return information, system.right[:, _SHARED] - of_poses


def _cost_of(
    residuals: FloatArray, away: FloatArray, prior: FloatArray, sigma: float
) -> float:
    return float(np.nansum(np.square(residuals)) / sigma**2 + away @ prior @ away)


def _away(state: BoardState, origin: BoardState) -> FloatArray:
    """Return the deviations of the unknowns from their priors.

    Extrinsics have no prior.
    """
    intrinsics = [
        one.intrinsics - other.intrinsics
        for one, other in zip(state.cameras, origin.cameras, strict=True)
    ]
    places = np.zeros(N_POSE * (len(state.cameras) - 1))
    return np.concatenate([*intrinsics, places, state.shape - origin.shape])


def moved_state(
    state: BoardState, step: FloatArray, poses_step: FloatArray
) -> BoardState:
    """Return a state after a step of all but the poses, and of the poses, (V, 6)."""
    places = places_at(state.cameras)
    cameras = tuple(
        camera.with_intrinsics(camera.intrinsics + step[at])
        for camera, at in zip(state.cameras, intrinsics_at(state.cameras), strict=True)
    )
    extrinsics = np.zeros((len(cameras), N_POSE))
    extrinsics[1:] = step[places].reshape(-1, N_POSE)
    return BoardState(
        cameras,
        rotation_from_vector(extrinsics[:, :3]) @ state.rotations,
        state.translations + extrinsics[:, 3:],
        BoardPoses(
            rotation_from_vector(poses_step[:, :3]) @ state.poses.rotations,
            state.poses.translations + poses_step[:, 3:],
        ),
        state.shape + step[places.stop :],
        state.offsets,
    )


def _points_cam(board: Board, state: BoardState) -> tuple[FloatArray, FloatArray]:
    """Return the points in the rig, less the poses' translations, and in the cameras.

    (V, N, 3) and (V, C, N, 3).
    """
    turned = _shaped(board, state) @ np.swapaxes(state.poses.rotations, 1, 2)
    in_rig = turned + state.poses.translations[:, None]
    in_cameras = np.einsum("cij,vnj->vcni", state.rotations, in_rig)
    return turned, in_cameras + state.translations[None, :, None]


def _shaped(board: Board, state: BoardState) -> FloatArray:
    return board_points(board, state.shape) + state.offsets


def board_residuals(views: Views, state: BoardState) -> FloatArray:
    """Return observed minus modelled points, (V, C, N, 2), px; NaN where not seen."""
    board, (_, points) = views.board, _points_cam(views.board, state)
    normals = state.poses.rotations[..., 2]
    residuals = np.empty_like(views.pixels)
    with np.errstate(all="ignore"):  # a step too far is not taken
        for c, camera in enumerate(state.cameras):
            at = camera.project(points[:, c])
            if board.kind.is_circles:
                faced = (normals @ state.rotations[c].T)[:, None]
                at = disc_centroids(camera, points[:, c], faced, 0.5 * board.detail)
            left = views.pixels[:, c] - at
            is_far = (points[:, c, :, 2:] <= 0) | ~np.isfinite(left)
            residuals[:, c] = np.where(is_far, np.inf, left)
    residuals[~views.seen] = np.nan
    return residuals


def _system(views: Views, state: BoardState, residuals: FloatArray) -> _System:
    n_views = views.n_views
    normal = right = np.zeros(())
    for sight in linearise(views, state, residuals):
        columns = np.concatenate([sight.shared, sight.own], axis=-1)
        columns = columns.reshape(n_views, -1, columns.shape[-1])
        across = np.swapaxes(columns, 1, 2)
        normal = normal + across @ columns
        right = right + (across @ sight.residuals.reshape(n_views, -1, 1))[..., 0]
    return _System(residuals, normal, right)


def linearise(
    views: Views, state: BoardState, residuals: FloatArray
) -> Iterator[LinearSight]:
    """Yield the derivatives of each camera's ``residuals`` (V, C, N, 2), px."""
    turned, points = _points_cam(views.board, state)
    deformations = deformations_of(views.board)
    seen = views.seen
    n_views, _, n_points, _ = views.pixels.shape
    cameras_at, places = intrinsics_at(state.cameras), places_at(state.cameras)
    n_shared = places.stop + N_SHAPE
    for c, camera in enumerate(state.cameras):
        X, R = points[:, c], state.rotations[c]
        by_point = camera.project_with_jacobian(X).jacobian
        shared = np.zeros((n_views, n_points, 2, n_shared))
        shared[..., cameras_at[c]] = camera.intrinsics_jacobian(X[..., :2] / X[..., 2:])
        if c > 0:
            at = places.start + N_POSE * (c - 1)
            arms = X - state.translations[c]
            shared[..., at : at + 3] = -by_point @ skew(arms)
            shared[..., at + 3 : at + 6] = by_point
        by_rig = by_point @ R
        by_board = by_rig @ state.poses.rotations[:, None]
        shared[..., places.stop :] = by_board @ deformations
        own = np.concatenate([-by_rig @ skew(turned), by_rig], axis=-1)
        missing = ~seen[:, c]
        shared[missing], own[missing], by_board[missing] = 0.0, 0.0, 0.0
        left = np.where(missing[..., None], 0.0, residuals[:, c])
        yield LinearSight(left, shared, own, by_board)


def _prior(start: BoardState, stated: tuple[FloatArray | None, ...]) -> FloatArray:
    places = places_at(start.cameras)
    information = np.zeros((places.stop + N_SHAPE,) * 2)
    for at, known in zip(intrinsics_at(start.cameras), stated, strict=False):
        if known is not None:
            information[at, at] = known
    sigmas = np.repeat([SQUARENESS, FLATNESS], [2, 3])
    information[places.stop :, places.stop :] = np.diag(sigmas**-2.0)
    return information


def _inverse(information: FloatArray) -> FloatArray:
    """Return a covariance; raises `CalibrationError` if something is left open."""
    scale = 1 / np.sqrt(np.maximum(np.diag(information), 1e-300))
    values, vectors = np.linalg.eigh(information * np.outer(scale, scale))
    if values[0] < VAGUE:
        raise CalibrationError("intrinsics.open")
    inverse = (vectors / values) @ vectors.T
    return np.asarray(inverse * np.outer(scale, scale))


def _rms(residuals: FloatArray) -> float:
    finite = residuals[np.isfinite(residuals)]
    return float(np.sqrt(np.mean(np.square(finite)))) if len(finite) else 0.0
