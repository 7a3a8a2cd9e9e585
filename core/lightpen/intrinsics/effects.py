"""Normal equations of a fitted board and its random effects, view by view.

The unknowns are those of the board adjustment without the poses, then the points of the
board (x y z each, mm), then the nodes of each lens' residual field (u v each, px). Each
view has its pose, the coefficients of a smooth error of its own, and for each further
camera a rigid motion of the board between the exposures, which also absorbs other
pose-like errors (blur, shadows). The points of each camera are weighted by its noise.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.intrinsics.adjustment import FINEST, linearise
from lightpen.intrinsics.board_fit import N_POSE, BoardFit
from lightpen.intrinsics.boards import Board
from lightpen.intrinsics.views import Views
from lightpen.model.lens_field import LensField


@dataclass(frozen=True)
class VarianceComponents:
    """Standard deviations of the random effects."""

    noise: float  # of one coordinate, px; of several cameras the geometric mean
    # `in_plane` and `out_of_plane`: of the points of the board, mm
    in_plane: float
    out_of_plane: float
    view: float  # of the smooth error of a view, px
    # Of the turns, and of the shifts, of the board in a view of a further camera, px
    # rms; alike in all directions.
    between: float
    lenses: tuple[float, ...]  # amplitude of the residual field of each camera, px
    # Of the mean offset of a column of points along the rows, or of a row along the
    # columns, mm; for independent points, that of one point over the root of their
    # number.
    lines: float


@dataclass(frozen=True, eq=False)
class Design:
    """Normal equations for points of 1 px noise."""

    normal: FloatArray  # (p, p)
    right: FloatArray  # (V, p)
    # (V, p, s), of the normal equations of each view, by the first s unknowns.
    columns: FloatArray
    cross: FloatArray  # (V, p, o)
    # `own_own`, `own_right`: (V, o, o), (V, o), of pose and smooth errors of each view.
    own_own: FloatArray
    own_right: FloatArray
    n_between: int  # number of these that cameras differ by; they are the last
    squares: float  # of the residuals, px^2
    n: int  # number of coordinates
    # `shared_prior` and `prior_pull`: (s, s) and (p,), information of the priors of the
    # board adjustment, and their gradient.
    shared_prior: FloatArray
    prior_pull: FloatArray
    fields: tuple[LensField, ...]  # of amplitude 1, one a camera
    # (3 N, g), orthonormal offsets of whole rows and columns of the board.
    lines: FloatArray
    n_points: int

    @property
    def n_shared(self) -> int:
        """Number of unknowns of the board adjustment but the poses."""
        return len(self.shared_prior)

    @property
    def n_views(self) -> int:
        """Number of views."""
        return len(self.right)

    @property
    def of_errors(self) -> tuple[slice, slice]:
        """Indices of the smooth errors of a view, and of those between cameras."""
        n_own = self.own_right.shape[-1]
        n_smooth = n_own - self.n_between
        return slice(N_POSE, n_smooth), slice(n_smooth, n_own)

    def own_prior(self, components: VarianceComponents) -> FloatArray:
        """Return the information of pose and smooth errors of a view, (o,)."""
        prior = np.zeros(self.own_right.shape[-1])
        smooth, between = self.of_errors
        prior[smooth], prior[between] = components.view**-2, components.between**-2
        return prior

    @property
    def of_points(self) -> slice:
        """Indices of the points of the board, x y z each."""
        return slice(self.n_shared, self.n_shared + 3 * self.n_points)

    def of_field(self, camera: int) -> slice:
        """Return the indices of the nodes of a lens, u v each."""
        sizes = [2 * len(each.nodes) for each in self.fields]
        begin = self.of_points.stop + sum(sizes[:camera])
        return slice(begin, begin + sizes[camera])

    def prior(self, components: VarianceComponents) -> FloatArray:
        """Return the information of all priors, (p, p)."""
        prior = np.zeros_like(self.normal)
        prior[: self.n_shared, : self.n_shared] = self.shared_prior
        at = np.arange(self.of_points.start, self.of_points.stop)
        deviations = [components.in_plane, components.in_plane, components.out_of_plane]
        prior[at, at] = np.tile(np.power(deviations, -2.0), self.n_points)
        further = self._line_variance(components) ** -1 - components.in_plane**-2
        prior[self.of_points, self.of_points] += further * self.lines @ self.lines.T
        for c, amplitude in enumerate(components.lenses):
            own = self.of_field(c)
            prior[own, own] = self._node_information(c) / amplitude**2
        return prior

    def prior_logarithm(self, components: VarianceComponents) -> float:
        """Return the logarithm of the priors' determinant, but for a constant."""
        n_lines = self.lines.shape[1]
        logarithm = -(2 * self.n_points - n_lines) * np.log(components.in_plane**2)
        logarithm -= n_lines * np.log(self._line_variance(components))
        logarithm -= self.n_points * np.log(components.out_of_plane**2)
        for field, amplitude in zip(self.fields, components.lenses, strict=True):
            known = np.linalg.slogdet(field.node_information)[1]
            logarithm += 2 * (known - len(field.nodes) * np.log(amplitude**2))
        return float(logarithm)

    def effects(
        self, x: FloatArray, covariance: FloatArray, components: VarianceComponents
    ) -> tuple[FloatArray, FloatArray]:
        """Return the number of known effects, and their sum of squares.

        Both of the points in their plane, out of it, of lines of them, and of each
        lens. Squares of lines are those of means.
        """
        at, L = self.of_points, self.lines
        points = x[at].reshape(-1, 3)
        spread = np.diag(covariance)[at].reshape(-1, 3)
        of_lines = float(np.sum((L.T @ x[at]) ** 2))
        spread_of_lines = float(np.sum(L * (covariance[at, at] @ L)))
        n_lines = L.shape[1]
        in_plane = spread[:, :2].sum() - spread_of_lines
        known: list[float] = [
            2 * self.n_points - n_lines - in_plane / components.in_plane**2,
            self.n_points - spread[:, 2].sum() / components.out_of_plane**2,
            n_lines - spread_of_lines / self._line_variance(components),
        ]
        squares = [
            float(np.sum(points[:, :2] ** 2)) - of_lines,
            float(np.sum(points[:, 2] ** 2)),
            of_lines / self.n_in_line,
        ]
        for c, amplitude in enumerate(components.lenses):
            own = self.of_field(c)
            information = self._node_information(c)
            unknown = np.sum(information * covariance[own, own]) / amplitude**2
            known.append(float(own.stop - own.start - unknown))
            squares.append(float(x[own] @ information @ x[own]))
        return np.array(known), np.array(squares)

    @property
    def n_in_line(self) -> float:
        """Mean number of points of a row or column."""
        return 2 * self.n_points / int(self.lines.shape[1])

    def _line_variance(self, components: VarianceComponents) -> float:
        return float(self.n_in_line * components.lines**2)

    def _node_information(self, camera: int) -> FloatArray:
        return np.asarray(
            np.kron(self.fields[camera].node_information, np.eye(2)), dtype=np.float64
        )


def design_of(views: Views, fitted: BoardFit, length: float) -> Design:
    """Return the normal equations at a fit; lens fields correlate over a length, px."""
    state, n_views = fitted.state, views.n_views
    n_shared, n_points = len(fitted.prior), views.board.n_points
    fields = tuple(LensField.of(*size, 1.0, length) for size in views.image_sizes)
    n_nodes = [2 * len(each.nodes) for each in fields]
    points_at = n_shared + np.arange(3 * n_points)
    n = n_shared + 3 * n_points + sum(n_nodes)
    smooth = smooth_functions(views.board)
    n_cameras, n_smooth = len(state.cameras), 2 * smooth.shape[1]
    n_between = N_POSE * (n_cameras - 1)
    n_own = N_POSE + n_smooth * n_cameras + n_between
    weights = _weights(views, fitted.residuals)
    squares = 0.0
    normal = np.zeros((n, n))
    right = np.zeros((n_views, n))
    columns = np.zeros((n_views, n, n_shared))
    cross = np.zeros((n_views, n, n_own))
    own_own = np.zeros((n_views, n_own, n_own))
    own_right = np.zeros((n_views, n_own))
    begin = n_shared + 3 * n_points
    for c, sight in enumerate(linearise(views, state, fitted.residuals)):
        seen = views.seen[:, c, :, None]
        # Where points are modelled: noise of the places would be taken for the field's.
        at = np.nan_to_num(views.pixels[:, c] - fitted.residuals[:, c])
        by_field = _both(np.where(seen, fields[c].basis(at), 0.0))
        by_smooth = _both(np.where(seen, smooth, 0.0))
        few = weights[c] * np.concatenate([sight.shared, by_field], axis=-1)
        few_at = np.r_[0:n_shared, begin : begin + n_nodes[c]]
        begin += n_nodes[c]
        own = np.zeros((n_views, n_points, 2, n_own))
        own[..., :N_POSE] = sight.own
        mine = slice(N_POSE + n_smooth * c, N_POSE + n_smooth * (c + 1))
        own[..., mine] = by_smooth
        if c > 0:
            sizes = np.square(sight.own).sum(axis=(0, 1, 2)) / max(2 * seen.sum(), 1)
            sizes = np.repeat(np.sqrt(sizes.reshape(2, 3).mean(axis=1)), 3)
            end = n_own - N_POSE * (n_cameras - 1 - c)
            moved = sight.own / np.where(sizes > 0, sizes, 1.0)
            own[..., end - N_POSE : end] = moved
        own *= weights[c]
        few, own = (each.reshape(n_views, 2 * n_points, -1) for each in (few, own))
        left = weights[c] * sight.residuals.reshape(n_views, -1, 1)
        squares += float(np.sum(left * left))
        across, B = np.swapaxes(few, 1, 2), weights[c] * sight.by_board
        normal[np.ix_(few_at, few_at)] += np.tensordot(few, few, axes=([0, 1], [0, 1]))
        mixed = np.swapaxes(B, 2, 3) @ few.reshape(n_views, n_points, 2, -1)
        columns[:, few_at] += across @ few[..., :n_shared]
        columns[:, points_at] += mixed[..., :n_shared].reshape(n_views, -1, n_shared)
        mixed = mixed.sum(axis=0).reshape(3 * n_points, -1)
        normal[np.ix_(points_at, few_at)] += mixed
        normal[np.ix_(few_at, points_at)] += mixed.T
        blocks = np.einsum("vnik,vnil->nkl", B, B)
        for i, j in np.ndindex(3, 3):
            normal[points_at[i::3], points_at[j::3]] += blocks[:, i, j]
        right[:, few_at] += (across @ left)[..., 0]
        right[:, points_at] += np.einsum(
            "vnik,vni->vnk", B, left.reshape(sight.residuals.shape)
        ).reshape(n_views, -1)
        cross[:, few_at] += across @ own
        by_own = np.swapaxes(B, 2, 3) @ own.reshape(n_views, n_points, 2, -1)
        cross[:, points_at] += by_own.reshape(n_views, 3 * n_points, n_own)
        turned = np.swapaxes(own, 1, 2)
        own_own += turned @ own
        own_right += (turned @ left)[..., 0]
    pull = np.zeros(n)
    pull[:n_shared] = fitted.scores.sum(axis=0) / fitted.sigma**2
    return Design(
        normal,
        right,
        columns,
        cross,
        own_own,
        own_right,
        n_between,
        squares,
        2 * int(views.seen.sum()),
        fitted.prior,
        pull,
        fields,
        _lines(views.board),
        n_points,
    )


def _weights(views: Views, residuals: FloatArray) -> FloatArray:
    """Return the weight of each camera's coordinates, (C,), their product 1.

    By the scatter of the points about a smooth error of each view.
    """
    if residuals.shape[1] == 1:
        return np.ones(1)
    x, y = views.board.points[:, 0], views.board.points[:, 1]
    functions = np.c_[np.ones(len(x)), x / x.std(), y / y.std()]
    functions = np.concatenate([functions, smooth_functions(views.board)], axis=1)
    left = np.nan_to_num(residuals)
    seen = views.seen.astype(np.float64)
    known = np.einsum("ni,vcn,nj->vcij", functions, seen, functions, optimize=True)
    known += 1e-9 * len(functions) * np.eye(functions.shape[1])
    fitted = np.linalg.solve(known, functions.T @ left)
    left = np.where(views.seen[..., None], left - functions @ fitted, 0.0)
    n_free = np.maximum(views.seen.sum(axis=2) - functions.shape[1], 0).sum(axis=0)
    noise = np.sqrt(np.square(left).sum(axis=(0, 2, 3)) / np.maximum(2 * n_free, 1))
    noise = np.maximum(noise, FINEST)
    return np.asarray(np.exp(np.mean(np.log(noise))) / noise)


@cache
def _lines(board: Board) -> FloatArray:
    """Return the offsets of whole columns along x, and of rows along y, (3 N, g)."""
    offsets = []
    for axis in range(2):
        places = np.round(board.points[:, axis] / board.pitch, 3)
        for place in np.unique(places):
            offset = np.zeros((len(places), 3))
            offset[places == place, axis] = 1.0
            offsets.append(offset.ravel() / np.linalg.norm(offset))
    lines = np.stack(offsets, axis=1)
    lines.flags.writeable = False
    return lines


@cache
def smooth_functions(board: Board) -> FloatArray:
    """Return functions of second and third order over the board, (N, 7).

    Orthogonal to each other and to functions of lower order, of mean square 1.
    """
    x, y = board.points[:, 0], board.points[:, 1]
    u, v = x / np.abs(x).max(), y / np.abs(y).max()
    powers = [(i - j, j) for i in range(4) for j in range(i + 1)]
    columns = np.stack([u**i * v**j for i, j in powers], axis=-1)
    orthogonal, triangle = np.linalg.qr(columns)
    independent = np.abs(np.diag(triangle)) > 1e-9 * np.sqrt(len(x))
    independent[:3] = False  # a place and a tilt are the pose's
    functions = orthogonal[:, independent] * np.sqrt(len(x))
    functions.flags.writeable = False
    return np.asarray(functions)


def _both(weights: FloatArray) -> FloatArray:
    """Return weights (..., m) of u and of v alike, (..., 2, 2 m)."""
    both = np.zeros((*weights.shape[:-1], 2, weights.shape[-1], 2))
    both[..., 0, :, 0] = both[..., 1, :, 1] = weights
    return both.reshape(*weights.shape[:-1], 2, -1)
