"""Errors of board and lens beside the model of a fit, and a robust covariance.

The residuals of a fit are linear in its unknowns, in the places of all points of the
board (as in a calibration that releases the object [1]_), and in a smooth residual
field of the lens over the image. The variances of noise, points and field follow from
restricted maximum likelihood, by the fixed point of [2]_, and so does which of five
lengths the field has; the fit has one if that predicts views better.

What one view has to itself (blur, shadows, a board that gives way) makes its residuals
depend on each other. The covariance therefore takes whole views as independent, and
nothing less: it is cluster-robust [3]_. The same equations predict each view by the
others alone, so its residual there is cross-validated without another fit.

References
----------
.. [1] K. H. Strobl, G. Hirzinger, "More accurate pinhole camera calibration with
   imperfect planar target", ICCV Workshops 2011.
.. [2] D. J. C. MacKay, "Bayesian interpolation", Neural Computation 4 (1992) 415-447,
   equation 27.
.. [3] R. M. Bell, D. F. McCaffrey, "Bias reduction in standard errors for linear
   regression with multi-stage samples", Survey Methodology 28 (2002) 169-181.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.model.fisheye import LensField
from lightpen_extensions.boards.adjustment import (
    FINEST,
    N_POSE,
    N_SHAPE,
    BoardFit,
    board_residuals,
    fit_board_poses,
    linearise,
    moved_state,
)
from lightpen_extensions.boards.observing import Views

LENGTHS = (0.15, 0.21, 0.3, 0.42, 0.6)  # of the field, in the image's longer side
LEAST = 1e-3  # of the noise: a component of no effect
LEAST_FIELD = 0.3  # of the noise: an amplitude that may yet be
FIRST = 0.2  # of the noise: start value of a component
MAX_ROUNDS = 20
CONVERGED = 0.1  # of twice the logarithm of the likelihood
KNOWN = 1e-2  # least number of effects that a variance is estimated from
LARGE = 4.0  # times the noise: a field beside which the fit is far off
SIGNIFICANT = 6.0  # twice the gain of log-likelihood by a field, of two parameters
WORTH = 0.01  # by which a larger model must lessen the held-out error
SIGMAS = 2.0  # of the gain of all views
MUCH = 1.0  # gain of all views together, of the logarithm of their errors


@dataclass(frozen=True)
class VarianceComponents:
    """Standard deviations of noise and effects."""

    noise: float  # of one coordinate, px
    # `in_plane` and `out_of_plane`: of the points of the board, mm
    in_plane: float
    out_of_plane: float
    field: float  # amplitude of the lens field, px


@dataclass(frozen=True, eq=False)
class MixedFit:
    """A fitted board with the effects of board and lens."""

    # At the estimate, with the robust covariance; residuals without the field.
    adjustment: BoardFit
    components: VarianceComponents
    # (p, p), share of the covariance that another set of views draws again.
    repeatability: FloatArray
    field: LensField | None  # None if the views do not support one
    held_out: FloatArray  # (V,), residual of each view by the others, px rms


class _Design(NamedTuple):
    """Linear equations of the residuals, the pose of each view eliminated.

    Their unknowns are n of the fit, 3 N of the points, and the nodes of the field.
    """

    blocks: FloatArray  # (V, 2 N, p)
    left: FloatArray  # (V, 2 N)
    normal: FloatArray
    right: FloatArray
    squares: float
    n: int  # coordinates less poses
    projector: FloatArray  # (V, 2 N, 6), orthonormal; what poses explain
    fit_prior: FloatArray
    pull: FloatArray  # (p,), gradient of the priors at the fit
    n_points: int
    mm: float  # size of a pixel on the board
    field: LensField | None = None  # of amplitude 1
    node_prior: FloatArray = np.zeros((0, 0))

    @property
    def n_fit(self) -> int:
        return len(self.fit_prior)

    @property
    def n_plain(self) -> int:
        return self.n_fit + 3 * self.n_points

    def prior(self, components: VarianceComponents) -> FloatArray:
        """Return the information of all priors, (p, p)."""
        own = np.power([components.in_plane] * 2 + [components.out_of_plane], -2.0)
        n, n_plain = self.n_fit, self.n_plain
        prior = np.zeros_like(self.normal)
        prior[:n, :n] = self.fit_prior
        at = np.arange(n, n_plain)
        prior[at, at] = np.tile(own, self.n_points)
        if self.field is not None:
            prior[n_plain:, n_plain:] = self.node_prior / components.field**2
        return prior


class _Solution(NamedTuple):
    design: _Design
    components: VarianceComponents
    deviance: float  # -2 times the logarithm of the likelihood, but for a constant
    x: FloatArray
    covariance: FloatArray


def fit_effects(views: Views, fitted: BoardFit) -> MixedFit:
    """Return a fit of one camera with effects of board and lens, from one without.

    A large field moves it so far that all is linearised anew there.
    """
    found = _from(views, fitted)
    if found.components.field > LARGE * found.components.noise:
        state = replace(found.adjustment.state, offsets=fitted.state.offsets)
        residuals = board_residuals(views, state)
        found = _from(views, replace(fitted, state=state, residuals=residuals))
    return found


def _from(views: Views, fitted: BoardFit) -> MixedFit:
    plain, longer = _design_of(views, fitted), max(views.image_sizes[0])
    found: list[_Solution] = []
    for share in LENGTHS:
        near = found[-1].components if found else None
        with_field = _with_field(plain, views, fitted, share * longer)
        found.append(_most_likely(with_field, near))
    best = min(found, key=lambda each: each.deviance)
    without = _most_likely(plain, best.components)
    held_out, robust = _robust(best)
    errors = _of_views(views, held_out)
    prior = best.design.prior(best.components)
    total, n = best.covariance @ prior @ best.covariance + robust, plain.n_fit
    held_out, alone = _robust(without)
    errors_alone = _of_views(views, held_out)
    rms, rms_alone = rms_together(errors, views), rms_together(errors_alone, views)
    is_likely = without.deviance - best.deviance > SIGNIFICANT
    if is_likely and rms < (1 - WORTH) * rms_alone:
        field, x = _field(best, total, fitted), best.x[: plain.n_plain]
    else:
        field, x, errors, robust = None, without.x, errors_alone, alone
        total = _without_field(without, best) + alone
    adjustment = _moved(views, fitted, x, best.components.noise, field)
    return MixedFit(
        replace(adjustment, covariance=total[:n, :n]),
        best.components,
        robust[:n, :n],
        field,
        errors,
    )


def _without_field(without: _Solution, best: _Solution) -> FloatArray:
    """Return the covariance that priors leave, and a field that is not fitted."""
    C, n = without.covariance, without.design.n_plain
    pull = without.components.noise**-2 * C @ best.design.normal[:n, n:]
    of_field = np.linalg.solve(best.design.node_prior, pull.T)
    left = C @ without.design.prior(without.components) @ C
    return np.asarray(left + best.components.field**2 * pull @ of_field)


def held_out_errors(views: Views, fitted: BoardFit) -> FloatArray:
    """Return the residual of each view by a fit of the others, (V,), px rms.

    The points of the board are free, as they add the same error to every lens model.
    """
    design = _design_of(views, fitted)
    return _of_views(views, _robust(_most_likely(design))[0])


def rms_together(errors: FloatArray, views: Views) -> float:
    """Return the error of all points, px rms, given the error of each view."""
    counts = views.seen.sum(axis=(1, 2))
    return float(np.sqrt(np.average(errors**2, weights=counts)))


def is_significantly_less(
    rms: float, rms_before: float, errors: FloatArray, errors_before: FloatArray
) -> bool:
    """Return whether a larger model predicts images better than the one before.

    Parameters
    ----------
    rms, rms_before : float
        Cross-validated error of all points, px.
    errors, errors_before : (V,) array
        That of each image, px.
    """
    # By how many times, so that no one image decides alone...
    gains = np.log(np.maximum(errors_before, FINEST) / np.maximum(errors, FINEST))
    chance = float(gains.std(ddof=1)) * len(gains) ** 0.5
    # ... unless it gains much more than others lose: few may reach the rim.
    losses = float(np.sqrt(2 * np.sum(np.minimum(gains, 0.0) ** 2)))
    least = SIGMAS * min(chance, max(losses, MUCH / SIGMAS))
    return bool(rms < (1 - WORTH) * rms_before and gains.sum() > least)


def _of_views(views: Views, residuals: FloatArray) -> FloatArray:
    """Return residuals (V, 2 N) as of each view, (V,), px rms."""
    squares = np.square(residuals).sum(axis=1) / views.seen.sum(axis=(1, 2))
    return np.asarray(np.sqrt(squares))


def _design_of(views: Views, fitted: BoardFit) -> _Design:
    (sight,) = linearise(views, fitted.state, fitted.residuals)
    n_views, n_points, _, n = sight.shared.shape
    blocks = np.zeros((n_views, n_points, 2, n + 3 * n_points))
    blocks[..., :n] = sight.shared
    at = np.arange(n_points)
    for axis in range(3):
        own = np.moveaxis(sight.by_board[..., axis], 1, 0)
        blocks[:, at, :, n + 3 * at + axis] = own
    blocks = blocks.reshape(n_views, 2 * n_points, -1)
    projector = np.linalg.qr(sight.own.reshape(n_views, 2 * n_points, N_POSE))[0]
    blocks = _without_poses(projector, blocks)
    residuals = sight.residuals.reshape(n_views, 2 * n_points, 1)
    left = _without_poses(projector, residuals)[..., 0]
    pull = np.zeros(blocks.shape[-1])
    # Priors are of what is 0 before: the shape, and coefficients of high orders.
    state = fitted.state
    pull[:n] = fitted.prior @ np.r_[state.cameras[0].intrinsics, state.shape]
    camera, depths = fitted.state.cameras[0], fitted.state.poses.translations[:, 2]
    flat = blocks.reshape(-1, blocks.shape[-1])
    return _Design(
        blocks,
        left,
        flat.T @ flat,
        flat.T @ left.ravel(),
        float(np.sum(left**2)),
        2 * int(views.seen.sum()) - N_POSE * n_views,
        projector,
        fitted.prior,
        pull,
        n_points,
        float(np.nanmedian(depths)) / camera.fx,
    )


def _with_field(
    plain: _Design, views: Views, fitted: BoardFit, length: float
) -> _Design:
    """Return the equations with a lens field of a correlation length, px."""
    field = LensField.of(*views.image_sizes[0], 1.0, length)
    # Where points are modelled: noise of the places would be taken for the field's.
    at = np.nan_to_num(views.pixels[:, 0] - fitted.residuals[:, 0])
    weights = np.where(views.seen[:, 0, :, None], field.basis(at), 0.0)
    both = np.zeros((*weights.shape[:2], 2, weights.shape[-1], 2))
    both[..., 0, :, 0] = both[..., 1, :, 1] = weights
    columns = both.reshape(*plain.left.shape, -1)
    columns = _without_poses(plain.projector, columns)
    flat = columns.reshape(-1, columns.shape[-1])
    cross = plain.blocks.reshape(len(flat), -1).T @ flat
    return plain._replace(
        blocks=np.concatenate([plain.blocks, columns], axis=-1),
        normal=np.block([[plain.normal, cross], [cross.T, flat.T @ flat]]),
        right=np.r_[plain.right, flat.T @ plain.left.ravel()],
        pull=np.pad(plain.pull, (0, columns.shape[-1])),
        field=field,
        node_prior=np.asarray(np.kron(field.node_information, np.eye(2)), np.float64),
    )


def _without_poses(projector: FloatArray, columns: FloatArray) -> FloatArray:
    explained = np.swapaxes(projector, 1, 2) @ columns
    return np.asarray(columns - projector @ explained)


def _most_likely(design: _Design, near: VarianceComponents | None = None) -> _Solution:
    """Return the solution by the most likely components."""
    noise = max(np.sqrt(design.squares / max(design.n, 1)), 1e-6)
    mm = FIRST * noise * design.mm
    components = near or VarianceComponents(noise, mm, mm, FIRST * noise)
    before = np.inf
    for _ in range(MAX_ROUNDS):
        solution = _solved(design, components)
        if before - solution.deviance < CONVERGED:
            break
        before = solution.deviance
        components = _following(solution)
    return solution


def _solved(design: _Design, components: VarianceComponents) -> _Solution:
    weight = components.noise**-2
    covariance, logarithm = _inverse(weight * design.normal + design.prior(components))
    right = weight * design.right - design.pull
    x = covariance @ right
    n_nodes = len(design.node_prior)
    logarithm += 2 * n_nodes * np.log(components.field)
    logarithm -= float(np.linalg.slogdet(design.node_prior)[1])
    of_points = 2 * np.log(components.in_plane) + np.log(components.out_of_plane)
    logarithm += 2 * design.n * np.log(components.noise)
    logarithm += 2 * design.n_points * of_points
    deviance = logarithm + weight * design.squares - float(right @ x)
    return _Solution(design, components, float(deviance), x, covariance)


def _following(solution: _Solution) -> VarianceComponents:
    """Return the next components of the fixed point."""
    design, components, x, C = solution[0], solution[1], solution.x, solution.covariance
    n, n_plain, n_points = design.n_fit, design.n_plain, design.n_points
    squares = np.square(x[n:n_plain]).reshape(n_points, 3).sum(axis=0)
    spread = np.diag(C)[n:n_plain].reshape(n_points, 3).sum(axis=0)
    in_plane = 2 * n_points - float(spread[:2].sum()) / components.in_plane**2
    out_of_plane = n_points - float(spread[2]) / components.out_of_plane**2
    nodes, own = x[n_plain:], design.node_prior
    of_field = len(nodes) - float(np.sum(own * C[n_plain:, n_plain:])) / (
        components.field**2
    )
    n_known = n - float(np.sum(design.fit_prior * C[:n, :n]))
    n_known += in_plane + out_of_plane + of_field
    rest = float(design.squares - 2 * x @ design.right + x @ design.normal @ x)
    noise = float(np.sqrt(max(rest, 1e-30) / max(design.n - n_known, 1.0)))
    least = LEAST * noise

    def deviation(squares: float, known: float, least: float) -> float:
        return max(float(np.sqrt(squares / max(known, KNOWN))), least)

    return VarianceComponents(
        noise,
        deviation(squares[:2].sum(), in_plane, least * design.mm),
        deviation(squares[2], out_of_plane, least * design.mm),
        deviation(float(nodes @ own @ nodes), of_field, LEAST_FIELD * noise)
        if len(nodes)
        else components.field,
    )


def _inverse(normal: FloatArray) -> tuple[FloatArray, float]:
    """Return the inverse of normal equations, and the logarithm of the determinant.

    By Cholesky's decomposition, in a third of the time of `numpy.linalg`. Raises
    `CalibrationError` if something is left open.
    """
    from scipy.linalg.lapack import dpotrf, dpotri

    factor, info = dpotrf(normal, lower=1)
    if info != 0:
        raise CalibrationError("intrinsics.open")
    inverse = np.tril(dpotri(factor, lower=1)[0])
    logarithm = 2 * float(np.log(np.diag(factor)).sum())
    return np.asarray(inverse + np.tril(inverse, -1).T, dtype=np.float64), logarithm


def _robust(solution: _Solution) -> tuple[FloatArray, FloatArray]:
    """Return cross-validated residuals (V, 2 N), px, and the robust covariance (p, p).

    By what each view changes, its leverage corrected for. Few views tell the variance
    of many unknowns badly: the covariance by independent noise, scaled alike, counts as
    much as one view for each unknown of the camera.
    """
    design, components, x, C = solution[0], solution[1], solution.x, solution.covariance
    weight = components.noise**-2
    held_out = np.empty_like(design.left)
    changes = np.empty((len(design.left), len(C)))
    for v, (block, left) in enumerate(zip(design.blocks, design.left, strict=True)):
        rest = left - block @ x
        by_block = block @ C
        leverage = weight * by_block @ block.T
        held_out[v] = np.linalg.solve(np.eye(len(rest)) - leverage, rest)
        # The mean of both is the root of the correction, to the second order.
        changes[v] = 0.5 * weight * (rest + held_out[v]) @ by_block
    found = changes.T @ changes
    expected = C - C @ design.prior(components) @ C
    n_views, n = len(changes), design.n_fit - N_SHAPE
    ratio = np.linalg.solve(expected[:n, :n], found[:n, :n])
    scaled = max(float(np.trace(ratio)) / n, 1.0) * expected
    blend = (n_views * found + n * scaled) / (n_views + n)
    return held_out, blend


def _field(best: _Solution, total: FloatArray, fitted: BoardFit) -> LensField:
    """Return the lens field, and the intrinsics' covariance beside it.

    Its covariance refers to the image: an error of the field shifts the intrinsics
    along, and most of it cancels.
    """
    field = best.design.field
    assert field is not None
    nodes = np.arange(best.design.n_plain, len(total))
    own = np.arange(fitted.of_intrinsics(0).stop)
    C = best.covariance
    drawn = np.linalg.solve(C[np.ix_(nodes, nodes)], C[np.ix_(nodes, own)]).T
    both = total[np.ix_(np.r_[own, nodes], np.r_[own, nodes])]
    alone = np.hstack([np.eye(len(own)), -drawn])
    camera = fitted.state.cameras[0]
    seen = camera.sees(field.nodes)
    J = np.zeros((*field.nodes.shape, len(own)))
    J[seen] = camera.intrinsics_jacobian(camera.unproject(field.nodes[seen]))
    by_field = np.eye(len(nodes)) + J.reshape(len(nodes), -1) @ drawn
    known = by_field @ total[np.ix_(nodes, nodes)] @ by_field.T
    return replace(
        field,
        amplitude=best.components.field,
        values=best.x[nodes].reshape(-1, 2),
        covariance=0.5 * (known[0::2, 0::2] + known[1::2, 1::2]),
        intrinsics_covariance=alone @ both @ alone.T,
    )


def _moved(
    views: Views, fitted: BoardFit, x: FloatArray, noise: float, field: LensField | None
) -> BoardFit:
    """Return the fit after a step of all unknowns, its poses fitted there."""
    n = len(fitted.prior)
    poses = np.zeros((views.n_views, N_POSE))
    state = moved_state(fitted.state, x[:n], poses)
    state = replace(state, offsets=fitted.state.offsets + x[n:].reshape(-1, 3))
    return replace(
        fit_board_poses(views_without_field(views, field), state),
        sigma=noise,
        prior=fitted.prior,
    )


def views_without_field(views: Views, field: LensField | None) -> Views:
    """Return the views of one camera with the residual field of its lens removed."""
    if field is None:
        return views
    return replace(views, pixels=views.pixels - field.at(views.pixels))
