"""Normal equations of a fitted board and its random effects, view by view.

The unknowns are those of the board adjustment but the poses, then the points of the
board (x y z each, mm), then the nodes of each lens' residual field (u v each, px). Each
view has its pose and the coefficients of a smooth error of its own.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.intrinsics.adjustment import linearise
from lightpen.intrinsics.board_fit import N_POSE, BoardFit
from lightpen.intrinsics.boards import Board
from lightpen.intrinsics.views import Views
from lightpen.model.lens_field import LensField


@dataclass(frozen=True)
class VarianceComponents:
    """Standard deviations of the random effects.

    Attributes
    ----------
    noise : float
        Of one coordinate, px.
    in_plane, out_of_plane : float
        Of the points of the board, mm.
    view : float
        Of the smooth error of a view, px.
    lenses : tuple of float
        Amplitude of the residual field of each camera, px.
    """

    noise: float
    in_plane: float
    out_of_plane: float
    view: float
    lenses: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Design:
    """Normal equations for points of 1 px noise.

    Attributes
    ----------
    normal : (p, p) array
    right : (V, p) array
    columns : (V, p, s) array
        Of the normal equations of each view, by the first s unknowns.
    cross : (V, p, o) array
    own_own, own_right : (V, o, o) and (V, o) array
        Of the pose and the smooth error of each view.
    squares : float
        Of the residuals, px^2.
    n : int
        Number of coordinates.
    shared_prior, prior_pull : (s, s) and (p,) array
        Information of the priors of the board adjustment, and their gradient.
    fields : tuple of LensField
        Of amplitude 1, one a camera.
    """

    normal: FloatArray
    right: FloatArray
    columns: FloatArray
    cross: FloatArray
    own_own: FloatArray
    own_right: FloatArray
    squares: float
    n: int
    shared_prior: FloatArray
    prior_pull: FloatArray
    fields: tuple[LensField, ...]
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
        for c, amplitude in enumerate(components.lenses):
            own = self.of_field(c)
            prior[own, own] = self._node_information(c) / amplitude**2
        return prior

    def prior_logarithm(self, components: VarianceComponents) -> float:
        """Return the logarithm of the priors' determinant, but for a constant."""
        logarithm = -2 * self.n_points * np.log(components.in_plane**2)
        logarithm -= self.n_points * np.log(components.out_of_plane**2)
        for field, amplitude in zip(self.fields, components.lenses, strict=True):
            known = np.linalg.slogdet(field.node_information)[1]
            logarithm += 2 * (known - len(field.nodes) * np.log(amplitude**2))
        return float(logarithm)

    def effects(
        self, x: FloatArray, covariance: FloatArray, components: VarianceComponents
    ) -> tuple[FloatArray, FloatArray]:
        """Return how many effects are known, and their sum of squares.

        Both of the points in their plane, out of it, and of each lens.
        """
        points = x[self.of_points].reshape(-1, 3)
        spread = np.diag(covariance)[self.of_points].reshape(-1, 3)
        known: list[float] = [
            2 * self.n_points - spread[:, :2].sum() / components.in_plane**2,
            self.n_points - spread[:, 2].sum() / components.out_of_plane**2,
        ]
        squares = [float(np.sum(points[:, :2] ** 2)), float(np.sum(points[:, 2] ** 2))]
        for c, amplitude in enumerate(components.lenses):
            own = self.of_field(c)
            information = self._node_information(c)
            unknown = np.sum(information * covariance[own, own]) / amplitude**2
            known.append(float(own.stop - own.start - unknown))
            squares.append(float(x[own] @ information @ x[own]))
        return np.array(known), np.array(squares)

    def _node_information(self, camera: int) -> FloatArray:
        return np.asarray(
            np.kron(self.fields[camera].node_information, np.eye(2)), dtype=np.float64
        )


def design_of(views: Views, fitted: BoardFit, length: float) -> Design:
    """Return the normal equations at a fit, with lens fields of a correlation length.

    Parameters
    ----------
    length : float
        px.
    """
    state, n_views = fitted.state, views.n_views
    n_shared, n_points = len(fitted.prior), views.board.n_points
    fields = tuple(LensField.of(*size, 1.0, length) for size in views.image_sizes)
    n_nodes = [2 * len(each.nodes) for each in fields]
    points_at = n_shared + np.arange(3 * n_points)
    n = n_shared + 3 * n_points + sum(n_nodes)
    smooth = smooth_functions(views.board)
    n_smooth = 2 * smooth.shape[1]
    n_own = N_POSE + n_smooth * len(state.cameras)
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
        few = np.concatenate([sight.shared, by_field], axis=-1)
        few_at = np.r_[0:n_shared, begin : begin + n_nodes[c]]
        begin += n_nodes[c]
        own = np.zeros((n_views, n_points, 2, n_own))
        own[..., :N_POSE] = sight.own
        mine = slice(N_POSE + n_smooth * c, N_POSE + n_smooth * (c + 1))
        own[..., mine] = by_smooth
        few, own = (each.reshape(n_views, 2 * n_points, -1) for each in (few, own))
        left = sight.residuals.reshape(n_views, -1, 1)
        across, B = np.swapaxes(few, 1, 2), sight.by_board
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
        right[:, points_at] += np.einsum("vnik,vni->vnk", B, sight.residuals).reshape(
            n_views, -1
        )
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
        float(np.nansum(np.square(fitted.residuals))),
        2 * int(views.seen.sum()),
        fitted.prior,
        pull,
        fields,
        n_points,
    )


@cache
def smooth_functions(board: Board) -> FloatArray:
    """Return functions of second and third order over the board, (N, 7).

    Orthogonal to each other and to those of lower order, of mean square 1.
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
