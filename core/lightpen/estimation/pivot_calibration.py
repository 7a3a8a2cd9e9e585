"""Pivot calibration from poses of another system, with its warnings.

`lightpen.estimation.pivot.pivot.fit_pivot` trusts the poses. Here they are judged
first: by their convention, and by whether they are of one tip in one place. The
uncertainty accounts for residuals that are correlated from pose to pose.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from lightpen.arrays import BoolArray, FloatArray, IntArray
from lightpen.errors import CalibrationError
from lightpen.estimation.pivot.pivot import (
    MIN_POSES,
    PivotFit,
    agreeing_solution,
    contact_matrix,
    contact_residuals,
    fit_pivot,
    require_poses,
    tip_covariances,
)
from lightpen.messages import Message, message
from lightpen.model.coverage import COVERAGE_FACTOR, EXACT, MIN_SPREAD, posture_spread

# Detection of other conventions of poses: frames, order of numbers, units.
#
# Poses in another convention are valid rotations and translations and may even fit a
# tip badly; only their scatter shows it. So each usual mistake is undone in turn; one
# that brings the poses much closer to a common tip is reported.
#
# Inverted poses are the exception. They fit as well, since ``R tip + t = pivot`` also
# reads ``R^T pivot - R^T t = tip``: tip and pivot change places. Only a tip farther
# from its pen than from the camera gives them away, which may be true: that is
# reported, not refused.


Poses: TypeAlias = tuple[FloatArray, FloatArray]

MUCH_CLOSER = 0.6  # of the scatter as read
ROUNDING = 1e-6  # of the length of the translations: scatter of exact poses
AGREEING = 0.5  # of the poses, at least
FEW = 20  # poses; half of fewer would agree with anything
AGREEING_OF_FEW = 0.9
MAX_LOOKED_AT = 200  # poses examined; all have one convention
SHORT = 10.0  # mm; no tracked pen is that close to its tracker in most poses
LONG = 10_000.0  # mm; no pen is that long
MAX_SCATTER = 20.0  # mm; no tip rests so badly
USUAL_SCATTER = 5.0  # mm; more is no noise if the poses move by little more
MAX_SHARE = 0.4  # of the movement of the poses, that a tip leaves over


@dataclass(frozen=True)
class _PoseMistake:
    """A usual mistake: how it is undone, and its message."""

    undo: Callable[[FloatArray, FloatArray], Poses]
    remark: Callable[[float, float], Message]


def require_usual_reading(rotations: FloatArray, translations: FloatArray) -> None:
    """Raise `CalibrationError` if poses are not cam_from_pen, mm, or have no tip.

    It says what they look like, and what is needed.
    """
    typical = float(np.median(np.linalg.norm(translations, axis=1)))
    if typical < SHORT:
        raise CalibrationError("poses.in-metres", typical=typical)
    chosen = np.unique(
        np.linspace(0, len(rotations) - 1, MAX_LOOKED_AT).round().astype(int)
    )
    R, t = rotations[chosen], translations[chosen]
    as_read = _scatter(R, t)
    undone = [_scatter(*mistake.undo(R, t)) for mistake in _MISTAKES]
    likeliest = int(np.argmin(undone))
    closer = undone[likeliest] < MUCH_CLOSER * as_read
    if closer and as_read > ROUNDING * typical:
        raise CalibrationError(_MISTAKES[likeliest].remark(as_read, undone[likeliest]))
    _require_tip(R, t, as_read)


def is_likely_inverted(tip_pen: FloatArray, pivot_cam: FloatArray) -> bool:
    """Return whether a tip is farther from its pen than from the camera."""
    return bool(np.linalg.norm(tip_pen) > np.linalg.norm(pivot_cam))


def _require_tip(R: FloatArray, t: FloatArray, scatter: float) -> None:
    length = float(np.linalg.norm(_solution(R, t)[:3]))
    if length > LONG:
        raise CalibrationError("poses.in-micrometres", length=length / 1000)
    movement = float(np.median(np.linalg.norm(t - np.median(t, axis=0), axis=1)))
    unexplained = scatter > USUAL_SCATTER and scatter > MAX_SHARE * movement
    if scatter > MAX_SCATTER or unexplained:
        raise CalibrationError("poses.no-tip", scatter=scatter, movement=movement)


def _scatter(rotations: FloatArray, translations: FloatArray) -> float:
    """Return the median distance of the poses' tips from their pivot, mm."""
    solution = _solution(rotations, translations)
    residuals = contact_residuals(rotations, translations, solution[:3], solution[3:])
    return float(np.median(np.linalg.norm(residuals, axis=1)))


def _solution(rotations: FloatArray, translations: FloatArray) -> FloatArray:
    share = AGREEING_OF_FEW if len(rotations) <= FEW else AGREEING
    return agreeing_solution(rotations, translations, share)


def _transposed(rotations: FloatArray) -> FloatArray:
    return np.swapaxes(rotations, 1, 2)


def _with_scalar_moved(rotations: FloatArray, places: int) -> FloatArray:
    """Return rotations from quaternions with the scalar at the other end."""
    from scipy.spatial.transform import Rotation  # takes 0.2 s

    quaternions = Rotation.from_matrix(rotations).as_quat()
    return np.asarray(Rotation.from_quat(np.roll(quaternions, places, 1)).as_matrix())


def _flipped(axis: int) -> _PoseMistake:
    return _PoseMistake(
        lambda R, t: (R, t * np.where(np.arange(3) == axis, -1.0, 1.0)),
        lambda as_read, undone: message(
            "poses.flipped", axis="xyz"[axis], as_read=as_read, undone=undone
        ),
    )


def _quaternion_message(as_read: float, undone: float) -> Message:
    return message("poses.quaternion-order", as_read=as_read, undone=undone)


_MISTAKES = (
    _PoseMistake(
        lambda R, t: (_transposed(R), t),
        lambda as_read, undone: message(
            "poses.transposed", as_read=as_read, undone=undone
        ),
    ),
    _PoseMistake(lambda R, t: (_with_scalar_moved(R, 1), t), _quaternion_message),
    _PoseMistake(lambda R, t: (_with_scalar_moved(R, -1), t), _quaternion_message),
    *(_flipped(axis) for axis in range(3)),
)


# Covariance of a least-squares fit with residuals correlated from pose to pose.
#
# Plain least squares counts every pose as independent. A tracker's error drifts and
# follows the swing instead, so that hundreds of poses may show no more than a dozen.
# With design A_i (3 x P) and residuals e_i of covariance ``S c(i - j)`` the covariance
# of the least-squares solution is
#
#     (A^T A)^-1 [sum_ij A_i^T S A_j c(i - j)] (A^T A)^-1
#
# The discrete cosine transform takes the sums apart, as it all but diagonalises a
# correlation that falls off with distance: the noise has a spectrum g(k), and poses
# next to each other become frequencies k, independent of each other. The spectra tried
# are those of white noise plus a first-order autoregression, of many shares and
# lengths. Their restricted likelihoods [1]_, which count what the unknowns have
# absorbed, weigh the covariances that follow, so that what the poses cannot show of
# their correlation widens the uncertainty too.
#
# Only those frequencies are examined in which the pen swings. The unknowns feel no
# others, and a model that had to match them also would be swayed by how smoothly a
# tracker filters its poses.
#
# References
# ----------
# .. [1] D. A. Harville, "Maximum likelihood approaches to variance component estimation
#    and to related problems", J. American Statistical Association 72 (1977) 320-338.


SWING_SHARE = 0.99  # of what the design shows; the frequencies beyond are left out
MIN_FREQUENCIES = 30  # fewer do not distinguish white noise from other
SHARES = (0.1, 0.25, 0.5, 0.75, 0.9, 0.97, 0.999)  # of the noise, that is correlated
N_LENGTHS = 10
SHORTEST = 0.7  # poses
LONGEST = 0.25  # of all poses; what is slower looks the same
PRIOR_POSES = 1.0  # that weigh for noise alike in all directions: six poses fix no S
TINY = 1e-24  # mm^2; exact poses have no scatter
N_ROUNDS = 3  # of solution and S; they hardly depend on each other


def correlated_covariance(
    design: FloatArray, residuals: FloatArray, least: float = 0.0
) -> FloatArray:
    """Return the covariance (P, P) of a least-squares solution.

    Parameters
    ----------
    design : (N, 3, P) array
        Of the equations in the order of capture, all of equal weight.
    residuals : (N, 3) array
        Of the solution.
    least : float
        Lower bound of the variance of the residuals in each direction: 1 for equations
        divided by their stated standard deviations.
    """
    from scipy.fft import dct  # takes 0.1 s

    n_poses, _, n_unknowns = design.shape
    inverse = np.linalg.inv(np.einsum("nki,nkj->ij", design, design))
    equations = dct(
        np.concatenate([design, residuals[:, :, None]], axis=2), axis=0, norm="ortho"
    )
    swing = equations[:, :, :-1]
    explained = np.cumsum(np.einsum("nki,ij,nkj->n", swing, inverse, swing))
    n_swing = int(np.searchsorted(explained, SWING_SHARE * n_unknowns)) + 1
    n_kept = min(max(n_swing, MIN_FREQUENCIES), n_poses)
    equations = equations[:n_kept]

    spectra = _spectra(n_kept, n_poses)
    fits = [_fit_spectrum(equations, spectrum, least) for spectrum in spectra]
    likelihoods = np.array([fit.likelihood for fit in fits])
    likelihoods[1:] -= np.log(len(fits) - 1)  # white noise is as likely as all others
    weights = np.exp(likelihoods - likelihoods.max())
    scores = np.average([fit.score for fit in fits], axis=0, weights=weights)
    return np.asarray(inverse @ scores @ inverse)


@dataclass(frozen=True, eq=False)
class _SpectrumFit:
    """Restricted log likelihood of a spectrum, and the covariance of the score."""

    likelihood: float
    score: FloatArray


def _fit_spectrum(
    equations: FloatArray, spectrum: FloatArray, least: float
) -> _SpectrumFit:
    n_kept, _, n_columns = equations.shape
    n_free = n_kept - (n_columns - 1) / 3
    whitened = _products(equations, 1 / spectrum)
    by_unknowns, by_residuals = whitened[:, :-1], whitened[:, :-1, :, -1]
    S = _residual_covariance(whitened[:, -1, :, -1], n_free)
    for _ in range(N_ROUNDS):
        W = np.linalg.inv(S)
        H = np.einsum("kilj,kl->ij", by_unknowns[..., :-1], W)
        step = np.linalg.solve(H, np.einsum("kil,kl->i", by_residuals, W))
        to_residuals = np.append(-step, 1.0)
        left = np.einsum("i,kilj,j->kl", to_residuals, whitened, to_residuals)
        S = _residual_covariance(left, n_free)
    likelihood = -0.5 * (
        3 * np.sum(np.log(spectrum))
        + n_free * np.linalg.slogdet(S)[1]
        + np.trace(np.linalg.solve(S, left))
        + np.linalg.slogdet(H)[1]
    )
    if least > 0:
        values, vectors = np.linalg.eigh(S)
        S = (vectors * np.maximum(values, least)) @ vectors.T
    coloured = _products(equations[..., :-1], spectrum)
    return _SpectrumFit(float(likelihood), np.einsum("kilj,kl->ij", coloured, S))


def _residual_covariance(squares: FloatArray, n_free: float) -> FloatArray:
    """Return the covariance (3, 3) of residuals by the sum of their squares."""
    alike = np.trace(squares) / 3 / n_free * np.eye(3)
    S = (squares + PRIOR_POSES * alike) / (n_free + PRIOR_POSES)
    return np.asarray(S + TINY * np.eye(3))


def _products(equations: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the weighted products (3, C, 3, C) of the columns (K, 3, C), summed."""
    shape = equations.shape[1:]
    flat = equations.reshape(len(equations), -1)
    return np.asarray((flat.T @ (weights[:, None] * flat)).reshape(*shape, *shape))


def _spectra(n_kept: int, n_poses: int) -> FloatArray:
    """Return the spectra to try, (M, K), each 1 on average, the white one first."""
    # At zero the spectrum averages all lengths up to the whole swing.
    angles = np.pi / n_poses * np.maximum(np.arange(n_kept), 0.5)
    shortest = max(SHORTEST, n_poses / n_kept / np.pi)
    spectra = [np.ones(n_kept)]
    for length in np.geomspace(shortest, max(LONGEST * n_poses, shortest), N_LENGTHS):
        decay = np.exp(-1 / length)
        shape = 1 / (1 - 2 * decay * np.cos(angles) + decay**2)
        shape /= shape.mean()
        spectra += [1 - share + share * shape for share in SHARES]
    return np.array(spectra)


LEAST_PART = 0.1  # of the poses, before a step and after it
SINGULAR = 1e-12  # of the trace; parts of too similar poses give any finite answer
STEP = 60.0  # chi-square, 6 degrees of freedom: its place was chosen by residuals
MANY_LEFT_OUT = 0.1  # of the poses
STRETCH = 5  # neighbouring poses, which noise alone does not leave out
MOST_LEFT_OUT = 0.4  # of the poses; with more the tip is ambiguous
MAX_RUNS = 10  # of neighbouring poses, that a warning names; the record has all

COVERED = message("pivot.covered")
NOT_COVERED = message("pivot.not-covered")


@dataclass(frozen=True, eq=False)
class PivotCalibration:
    """Tip and pivot of poses, with covariance and warnings."""

    fit: PivotFit  # its covariance assumes independent noise
    # (6, 6), of (tip_pen, pivot_cam) by correlated residuals, mm^2.
    covariance: FloatArray
    warnings: tuple[Message, ...]

    @property
    def expanded_uncertainty(self) -> FloatArray:
        """U (k = 2) of tip_pen and pivot_cam, (6,), mm."""
        return COVERAGE_FACTOR * np.sqrt(np.diag(self.covariance))

    @property
    def correlation_factor(self) -> float:
        """Variance inflation of tip and pivot by correlated residuals, on average."""
        independent = np.linalg.inv(self.fit.covariance)
        return float(np.trace(independent @ self.covariance)) / 6


def calibrate_pivot(
    rotations: FloatArray,
    translations: FloatArray,
    covariances: FloatArray | None = None,
    *,
    robust: bool = True,
    places: IntArray | None = None,
) -> PivotCalibration:
    """Find the tip from poses in the order of capture.

    ``places`` (N,) are their numbers for messages; parameters else as of
    `lightpen.estimation.pivot.pivot.fit_pivot`. Raises
    `CalibrationError` if the poses do not fix a tip, are in another convention or unit,
    have no tip in common, or too few of them have.
    """
    require_poses(rotations)
    require_usual_reading(rotations, translations)
    if places is None:
        places = np.arange(len(rotations)) + 1
    fit = fit_pivot(rotations, translations, covariances, robust=robust)
    if np.mean(~fit.used) > MOST_LEFT_OUT:
        raise CalibrationError(
            "pivot.no-majority",
            n_used=int(fit.used.sum()),
            n_poses=len(fit.used),
            others=_names(~fit.used, len(fit.used), places),
        )
    if robust:
        _require_no_step(rotations[fit.used], translations[fit.used], places[fit.used])
    return PivotCalibration(
        fit=fit,
        covariance=_covariance(rotations, covariances, fit),
        warnings=tuple(_warnings(fit, places)),
    )


def _require_no_step(
    rotations: FloatArray, translations: FloatArray, places: IntArray
) -> None:
    """Refuse poses whose tip or pivot is elsewhere from one of them on.

    One fit to all leaves residuals that look like noise. They are parted where each
    part by itself leaves the least, and the parts compared by what they then leave.
    """
    A, n_poses = contact_matrix(rotations), len(rotations)
    b = translations.mean(axis=0) - translations
    least = int(np.ceil(max(MIN_POSES, LEAST_PART * n_poses)))
    if n_poses < 2 * least:
        return
    H = np.cumsum(np.einsum("nki,nkj->nij", A, A), axis=0)
    g = np.cumsum(np.einsum("nki,nk->ni", A, b), axis=0)
    ends = np.arange(least - 1, n_poses - least)
    ridge = SINGULAR * np.trace(H[-1]) * np.eye(6)
    explained = np.zeros(len(ends))
    for sums, moments in ((H[ends], g[ends]), (H[-1] - H[ends], g[-1] - g[ends])):
        solutions = np.linalg.solve(sums + ridge, moments[..., None])[..., 0]
        explained += np.einsum("ni,ni->n", solutions, moments)
    first = int(ends[np.argmax(explained)]) + 1
    parts = rotations[:first], rotations[first:]
    if min(posture_spread(each)[0][0] for each in parts) < MIN_SPREAD:
        return
    is_before = (np.arange(n_poses) < first)[:, None, None]
    parted = np.where(is_before, A, 0.0), np.where(is_before, 0.0, A)
    design = np.concatenate(parted, axis=2)
    both = np.asarray(np.linalg.lstsq(design.reshape(-1, 12), b.ravel())[0])
    between = np.hstack([-np.eye(6), np.eye(6)])
    change = between @ both
    covariance = correlated_covariance(design, design @ both - b)
    likely = change @ np.linalg.solve(between @ covariance @ between.T, change)
    if np.abs(change).max() > EXACT and likely > STEP:
        raise CalibrationError(
            "pivot.step",
            pose=int(places[first]),
            tip=float(np.linalg.norm(change[:3])),
            pivot=float(np.linalg.norm(change[3:])),
        )


def _names(chosen: BoolArray, max_runs: int, places: IntArray) -> str:
    """Return the chosen poses (N,) as text, by their place in the file from 1."""
    runs = [places[run] for run in _runs(chosen)]
    named = [
        f"{run[0]}" if len(run) == 1 else f"{run[0]}-{run[-1]}"
        for run in runs[:max_runs]
    ]
    return ", ".join(named) + (", ..." if len(runs) > max_runs else "")


def _runs(chosen: BoolArray) -> list[IntArray]:
    """Return the indices of the chosen poses (N,), neighbours together."""
    indices = np.flatnonzero(chosen)
    return np.split(indices, np.flatnonzero(np.diff(indices) > 1) + 1)


def _covariance(
    rotations: FloatArray, covariances: FloatArray | None, fit: PivotFit
) -> FloatArray:
    """Return the covariance of tip and pivot by the residuals of the used poses."""
    design = contact_matrix(rotations[fit.used])
    residuals = fit.residuals[fit.used]
    if covariances is None:
        return correlated_covariance(design, residuals)
    of_tips = tip_covariances(rotations[fit.used], covariances[fit.used], fit.tip_pen)
    roots = np.linalg.cholesky(of_tips)
    return correlated_covariance(
        np.linalg.solve(roots, design),
        np.linalg.solve(roots, residuals[..., None])[..., 0],
        least=1.0,
    )


def _warnings(fit: PivotFit, places: IntArray) -> list[Message]:
    warnings, scattered = [], ~fit.used
    longest = max(map(len, _runs(scattered)))
    if scattered.mean() > MANY_LEFT_OUT or longest >= STRETCH:
        warnings.append(
            message(
                "pivot.many-left-out",
                n_left_out=int(scattered.sum()),
                n_poses=len(scattered),
                poses=_names(scattered, MAX_RUNS, places),
            )
        )
    if is_likely_inverted(fit.tip_pen, fit.pivot_cam):
        warnings.append(
            message(
                "poses.likely-inverted",
                tip=float(np.linalg.norm(fit.tip_pen)),
                pivot=float(np.linalg.norm(fit.pivot_cam)),
            )
        )
    return warnings
