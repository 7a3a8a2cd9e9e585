"""Mixed model of board and lens errors with variance components.

The residuals of a fitted board are linear in four kinds of random effects: each point
of the board is off in its plane and out of it, and rows and columns are as a whole;
each lens has a smooth residual field over the image, the same in all views; each view
has a smooth error of its own (blur, shadows, a board that gives way), of second and
third order over the board; the rest is independent noise. Their variances follow from
restricted maximum likelihood [1]_, by the fixed point of [2]_. The cameras are
estimated together with the effects, so what the views cannot separate from an effect is
in their covariance. One set of views hardly determines amplitude and length of the
fields: the estimate is the mean over a grid of both, weighted by the likelihood; the
grid is even in the logarithm of both, the prior of a scale [3]_, and finer about a
length that the likelihood singles out. A large field moves the fit so far that all is
linearised anew there. The section `cameras` of the benchmark states how often 95 %
intervals cover the truth.

References
----------
.. [1] H. D. Patterson, R. Thompson, "Recovery of inter-block information when block
   sizes are unequal", Biometrika 58 (1971) 545-554.
.. [2] D. J. C. MacKay, "Bayesian interpolation", Neural Computation 4 (1992) 415-447,
   equation 27.
.. [3] H. Jeffreys, "Theory of Probability", 3rd ed., Oxford 1961, section 3.1.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.intrinsics.adjustment import board_residuals, moved_state
from lightpen.intrinsics.board_fit import N_POSE, BoardFit
from lightpen.intrinsics.effects import Design, VarianceComponents, design_of
from lightpen.intrinsics.view_scores import ViewScores
from lightpen.intrinsics.views import Views
from lightpen.model.lens_field import LensField

MIDDLE = 0.3  # length, of the image's longer side; half and twice of it are tried, too
FINER = (2**0.5, 2**0.25)  # ratio of further lengths to one that is singled out
SINGLED = 0.9  # of the likelihood, by one length
SPREADS = (0.2, 0.35, 0.6, 1.0, 1.7, 3.0, 5.0, 8.0)  # of the most likely amplitude
LEAST = 1e-3  # of the noise: a component of no effect
LEAST_SPREAD = 0.3  # of the noise: an amplitude that may yet be
MAX_ROUNDS = 20
CONVERGED = 0.1  # of twice the logarithm of the likelihood
FIRST = 0.2  # of the noise: start value of a component
KNOWN = 1e-2  # least number of effects that a variance is estimated from
LOOSENED = 1e-6  # of the assumed information on intrinsics
LARGE = 4.0  # times the noise: a field beside which the fit is far off
SIGNIFICANT = 6.0  # twice the gain of log-likelihood by a field, of two parameters


@dataclass(frozen=True, eq=False)
class MixedFit:
    """A fitted board with its random effects.

    References
    ----------
    .. [1] K.-Y. Liang, S. L. Zeger, "Longitudinal data analysis using generalized
       linear models", Biometrika 73 (1986) 13-22.
    """

    # At the estimate, with the covariance by all effects; residuals without the fields.
    adjustment: BoardFit
    components: VarianceComponents
    # (p, p), share of the covariance by noise and by errors of single views, which
    # another set of views draws again.
    repeatability: FloatArray
    fields: tuple[LensField | None, ...]  # of each camera; None if not supported
    field_gain: float  # twice the gain of log-likelihood by the fields
    # Variance of the views' scores relative to that by the components [1]_; above 1 it
    # multiplies the covariance.
    clustering: float
    scores: ViewScores  # of each view, for tests of groups of views


class _Reduced(NamedTuple):
    """Normal equations without the views' own unknowns, and without priors."""

    normal: FloatArray
    right: FloatArray
    squares: float
    logarithm: float  # of the determinant of what was eliminated
    solved: FloatArray
    inverse_own: FloatArray


class _Solution(NamedTuple):
    """Effects by given components."""

    components: VarianceComponents
    deviance: float
    x: FloatArray
    covariance: FloatArray


_Found = dict[float, list[tuple[Design, _Solution]]]  # by length


def fit_effects(views: Views, fitted: BoardFit) -> MixedFit:
    """Return a fit with random effects of board, lens and views, from one without."""
    longer = max(max(size) for size in views.image_sizes)
    n_cameras = len(fitted.state.cameras)
    noise = max(fitted.sigma, 1e-6)
    mm = _mm_a_px(fitted)
    usual = VarianceComponents(
        noise,
        FIRST * noise * mm,
        FIRST * noise * mm,
        FIRST * noise,
        FIRST * noise,
        (FIRST * noise,) * n_cameras,
        FIRST * noise * mm,
    )
    found: _Found = {}
    lengths = [MIDDLE / 2, MIDDLE, MIDDLE * 2]
    for ratio in (*FINER, None):
        for share in lengths:
            design = design_of(views, fitted, share * longer)
            usual, reduced = _most_likely(design, usual, mm)
            found[share] = []
            for spread in SPREADS:
                amplitudes = tuple(
                    spread * max(each, LEAST_SPREAD * usual.noise)
                    for each in usual.lenses
                )
                solution = _solve(design, reduced, replace(usual, lenses=amplitudes))
                found[share].append((design, solution))
        weights = _weights_of(found)
        likeliest = max(found, key=lambda share: weights[share].sum())
        if ratio is None or weights[likeliest].sum() < SINGLED:
            break
        lengths = [likeliest / ratio, likeliest * ratio]
    design, best = min(found[likeliest], key=lambda each: each[1].deviance)
    if max(best.components.lenses) > LARGE * best.components.noise:
        own = _own(design, _reduced(design, best.components), best)
        fitted = _moved(views, fitted, best.x, own)
        nearest = sorted(found, key=lambda share: abs(np.log(share / likeliest)))[:3]
        found = {share: _relinearised(views, fitted, found[share]) for share in nearest}
        design = found[likeliest][0][0]
    noise = best.components.noise
    nothing = replace(best.components, lenses=(LEAST * noise,) * n_cameras)
    without = _solve(design, _reduced(design, nothing), nothing)
    return _averaged(views, fitted, found, without.deviance)


def _moved(
    views: Views, fitted: BoardFit, step: FloatArray, own: FloatArray
) -> BoardFit:
    """Return the fit after a step of all but the effects, linearised there.

    Its scores are again those that priors balance.
    """
    n = len(fitted.prior)
    state = moved_state(fitted.state, step[:n], own[:, :N_POSE])
    pull = fitted.sigma**2 * fitted.prior @ step[:n]
    return replace(
        fitted,
        state=state,
        residuals=board_residuals(views, state),
        scores=fitted.scores + pull / views.n_views,
    )


def _relinearised(
    views: Views, moved: BoardFit, found: list[tuple[Design, _Solution]]
) -> list[tuple[Design, _Solution]]:
    """Return solutions by the same components, linearised at another fit."""
    length = found[0][0].fields[0].length
    design = design_of(views, moved, length)
    reduced = _reduced(design, found[0][1].components)
    return [(design, _solve(design, reduced, s.components)) for _, s in found]


def _weights_of(found: _Found) -> dict[float, FloatArray]:
    """Return the weight of each solution by its likelihood, for each length.

    Evenly in the logarithm of the length, however many were tried near one.
    """
    lengths = sorted(found)
    widths = np.gradient(np.log(lengths))
    least = min(s.deviance for each in found.values() for _, s in each)
    weights = {
        length: width * np.exp(-0.5 * np.array([s.deviance - least for _, s in each]))
        for length, width in zip(lengths, widths, strict=True)
        for each in [found[length]]
    }
    total = sum(float(each.sum()) for each in weights.values())
    return {length: each / total for length, each in weights.items()}


def _mm_a_px(fitted: BoardFit) -> float:
    """Return the size of a pixel on the board, mm."""
    camera, poses = fitted.state.cameras[0], fitted.state.poses
    return float(np.nanmedian(poses.translations[:, 2])) / camera.fx


def _most_likely(
    design: Design, components: VarianceComponents, mm: float
) -> tuple[VarianceComponents, _Reduced]:
    before = np.inf
    for _ in range(MAX_ROUNDS):
        reduced = _reduced(design, components)
        solution = _solve(design, reduced, components)
        if before - solution.deviance < CONVERGED:
            break
        before = solution.deviance
        following = _following(design, reduced, solution)
        components = _no_less(following, mm, design.n_in_line)
    return solution.components, reduced


def _no_less(
    components: VarianceComponents, mm: float, n_in_line: float
) -> VarianceComponents:
    least = LEAST * components.noise
    in_plane = max(components.in_plane, least * mm)
    return VarianceComponents(
        components.noise,
        in_plane,
        max(components.out_of_plane, least * mm),
        max(components.view, least),
        max(components.between, least),
        tuple(max(each, least) for each in components.lenses),
        max(components.lines, in_plane / n_in_line**0.5),
    )


def _reduced(design: Design, components: VarianceComponents) -> _Reduced:
    weight = components.noise**-2
    own_normal = _own_normal(design, components)
    inverse_own: FloatArray = np.asarray(np.linalg.inv(own_normal), dtype=np.float64)
    cross, own_right = weight * design.cross, weight * design.own_right
    solved = cross @ inverse_own
    normal = weight * design.normal
    normal -= np.tensordot(solved, cross, axes=([0, 2], [0, 2]))
    right = weight * design.right.sum(axis=0)
    right -= np.tensordot(solved, own_right, axes=([0, 2], [0, 1]))
    eliminated = np.einsum("vo,voq,vq->", own_right, inverse_own, own_right)
    logarithm = np.linalg.slogdet(own_normal)[1].sum()
    own_prior = design.own_prior(components)[N_POSE:]
    logarithm -= design.n_views * np.log(own_prior).sum()
    logarithm += design.n * np.log(components.noise**2)
    return _Reduced(
        normal,
        right,
        float(weight * design.squares - eliminated),
        float(logarithm),
        solved,
        inverse_own,
    )


def _solve(
    design: Design, reduced: _Reduced, components: VarianceComponents
) -> _Solution:
    normal = reduced.normal + design.prior(components)
    right = reduced.right - design.prior_pull
    covariance, logarithm = _inverse(0.5 * (normal + normal.T))
    x = covariance @ right
    deviance = (
        reduced.logarithm
        + logarithm
        - design.prior_logarithm(components)
        + reduced.squares
        - right @ x
    )
    return _Solution(components, float(deviance), x, covariance)


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
    diagonal = np.diag(np.diag(inverse))
    logarithm = 2 * float(np.log(np.diag(factor)).sum())
    return np.asarray(inverse + inverse.T - diagonal, dtype=np.float64), logarithm


def _own(design: Design, reduced: _Reduced, solution: _Solution) -> FloatArray:
    """Return pose and smooth error of each view, (V, o)."""
    weight = solution.components.noise**-2
    own = np.einsum("vij,vj->vi", reduced.inverse_own, weight * design.own_right)
    return np.asarray(own - np.einsum("vpo,p->vo", reduced.solved, solution.x))


def _following(
    design: Design, reduced: _Reduced, solution: _Solution
) -> VarianceComponents:
    """Return the next components of the fixed point."""
    x, covariance, components = solution.x, solution.covariance, solution.components
    own = _own(design, reduced, solution)
    spread = np.sum(reduced.solved * (covariance @ reduced.solved), axis=(0, 1))
    spread += np.diagonal(reduced.inverse_own, axis1=1, axis2=2).sum(axis=0)
    of_own = design.n_views - spread * design.own_prior(components)
    own_known = [float(of_own[at].sum()) for at in design.of_errors]
    view, between = (
        float(np.sqrt(np.sum(own[:, at] ** 2) / max(n, KNOWN)))
        for at, n in zip(design.of_errors, own_known, strict=True)
    )
    known, sizes = design.effects(x, covariance, components)
    shared = slice(0, design.n_shared)
    n_known = known.sum() + sum(own_known) + N_POSE * design.n_views
    n_known += design.n_shared - np.sum(
        design.shared_prior * covariance[shared, shared]
    )
    squares = (
        design.squares
        - 2 * (x @ design.right.sum(axis=0) + np.sum(own * design.own_right))
        + x @ design.normal @ x
        + 2 * np.sum(own * np.einsum("vpo,p->vo", design.cross, x))
        + np.einsum("vo,voq,vq->", own, design.own_own, own)
    )
    deviations = np.sqrt(sizes / np.maximum(known, KNOWN))
    return VarianceComponents(
        float(np.sqrt(max(squares, 1e-30) / max(design.n - n_known, 1.0))),
        float(deviations[0]),
        float(deviations[1]),
        view,
        between,
        tuple(map(float, deviations[3:])),
        float(deviations[2]),
    )


def _averaged(
    views: Views, fitted: BoardFit, by_length: _Found, without: float
) -> MixedFit:
    """Return the mean of solutions, weighed by their likelihood."""
    found = [each for length in by_length for each in by_length[length]]
    by_likelihood = _weights_of(by_length)
    weights = np.concatenate([by_likelihood[length] for length in by_length])
    n = len(fitted.prior)
    n_kept = n + 3 * views.board.n_points
    deviances = np.array([each.deviance for _, each in found])
    x = np.sum([w * s.x[:n_kept] for w, (_, s) in zip(weights, found, strict=True)], 0)
    covariance, repeated = np.zeros((n, n)), np.zeros((n, n))
    for w, (design, each) in zip(weights, found, strict=True):
        off = each.x[:n] - x[:n]
        C = each.covariance[:n]
        covariance += w * (C[:, :n] + np.outer(off, off))
        repeated += w * (C[:, :n] - C @ design.prior(each.components) @ C.T)
    design, likeliest = found[int(np.argmin(deviances))]
    gain = without - float(deviances.min())
    reduced = _reduced(design, likeliest.components)
    scores = _scores(design, reduced, likeliest, fitted)
    clustering = scores.clustering
    factor = max(clustering, 1.0)
    poses = _own(design, reduced, likeliest)[:, :N_POSE]
    off = x[:n_kept] - likeliest.x[:n_kept]
    C = likeliest.covariance
    moved = C[:, :n] @ np.linalg.solve(C[:n, :n], off[:n])  # with them the fields
    moved[:n_kept] = off
    poses = poses - np.einsum("vpo,p->vo", reduced.solved[..., :N_POSE], moved)
    state = moved_state(fitted.state, x[:n], poses)
    state = replace(state, offsets=fitted.state.offsets + x[n:].reshape(-1, 3))
    fields = tuple(
        _field(design, reduced, likeliest, fitted, c, factor, moved)
        if gain > SIGNIFICANT
        else None
        for c in range(len(state.cameras))
    )
    adjustment = replace(
        fitted,
        state=state,
        residuals=board_residuals(without_fields(views, fields), state),
        sigma=likeliest.components.noise,
        covariance=factor * covariance,
    )
    return MixedFit(
        adjustment,
        likeliest.components,
        factor * repeated,
        fields,
        gain,
        clustering,
        scores,
    )


def without_fields(views: Views, fields: tuple[LensField | None, ...]) -> Views:
    """Return the views with the residual fields of the lenses removed."""
    pixels = views.pixels.copy()
    for c, field in enumerate(fields):
        if field is not None:
            pixels[:, c] -= field.at(pixels[:, c])
    return replace(views, pixels=pixels)


def _scores(
    design: Design, reduced: _Reduced, solution: _Solution, fitted: BoardFit
) -> ViewScores:
    """Return the scores of the views about all unknowns but the poses.

    At the intrinsics that the views show by themselves: a prior draws all views alike.
    """
    n, n_places = len(fitted.prior), fitted.of_places.start
    loosened = design.shared_prior.copy()
    loosened[:n_places, :n_places] *= LOOSENED
    pull = design.prior_pull.copy()
    pull[:n_places] *= LOOSENED
    loose = replace(design, shared_prior=loosened, prior_pull=pull)
    solution = _solve(loose, reduced, solution.components)
    weight = solution.components.noise**-2
    information = weight * design.columns
    information -= reduced.solved @ np.swapaxes(weight * design.cross[:, :n], 1, 2)
    scores = weight * design.right[:, :n]
    scores -= np.einsum("vpo,vo->vp", reduced.solved[:, :n], weight * design.own_right)
    scores -= np.einsum("vqp,q->vp", information, solution.x)
    return ViewScores(scores, information, solution.covariance)


def _own_normal(design: Design, components: VarianceComponents) -> FloatArray:
    """Return the normal equations of pose and smooth error of each view."""
    prior = np.diag(design.own_prior(components) + 1e-12)
    return np.asarray(components.noise**-2 * design.own_own + prior)


def _field(
    design: Design,
    reduced: _Reduced,
    solution: _Solution,
    fitted: BoardFit,
    c: int,
    factor: float,
    moved: FloatArray,
) -> LensField:
    """Return the residual field of a lens, and the intrinsics' covariance beside it.

    Its values are moved from the solution.

    Its covariance refers to the image: an error of the field shifts the intrinsics
    along, and most of it cancels.
    """
    at, own, field = design.of_field(c), fitted.of_intrinsics(c), design.fields[c]
    C, values = solution.covariance, solution.x[at] + moved[at]
    normal = reduced.normal + design.prior(solution.components)
    others = np.delete(np.arange(len(normal)), at)
    among = normal[np.ix_(others, others)]
    # The intrinsics have their indices before those of all fields.
    beside: FloatArray = np.asarray(
        np.linalg.inv(0.5 * (among + among.T))[own], dtype=np.float64
    )
    drawn = -beside @ normal[others, at]
    camera = fitted.state.cameras[c]
    J = camera.intrinsics_jacobian(camera.unproject(field.nodes))
    by_field = np.eye(len(drawn.T)) + J.reshape(len(drawn.T), -1) @ drawn
    known = factor * by_field @ C[at, at] @ by_field.T
    return replace(
        field,
        amplitude=solution.components.lenses[c],
        values=values.reshape(-1, 2),
        covariance=0.5 * (known[0::2, 0::2] + known[1::2, 1::2]),
        intrinsics_covariance=factor * beside[:, own],
    )
