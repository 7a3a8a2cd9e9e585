"""Poses of two tips or two pivots in one file, and which pose belongs to which.

A tip exchanged or a cone moved halfway, or a share of poses that agree with each other
elsewhere, leave one average fit with residuals that look like noise. Two splits are
tried: at the one pose that leaves the least when each side has its own fit, and by
what the poses agree with, wherever they stand. A split counts where the two fits differ
by far more than the residuals that they leave explain, hanging together as they do.
"""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import BoolArray, FloatArray, IntArray
from lightpen.estimation.pivot.pivot import (
    MIN_POSES,
    agreeing_solution,
    contact_matrix,
    in_deviations,
)
from lightpen.model.coverage import EXACT, MIN_SPREAD, chi_quantile, posture_spread

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
    S = _covariance(whitened[:, -1, :, -1], n_free)
    for _ in range(N_ROUNDS):
        W = np.linalg.inv(S)
        H = np.einsum("kilj,kl->ij", by_unknowns[..., :-1], W)
        step = np.linalg.solve(H, np.einsum("kil,kl->i", by_residuals, W))
        to_residuals = np.append(-step, 1.0)
        left = np.einsum("i,kilj,j->kl", to_residuals, whitened, to_residuals)
        S = _covariance(left, n_free)
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


def _covariance(squares: FloatArray, n_free: float) -> FloatArray:
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


LEAST_SHARE = 0.1  # of the poses; fewer are outliers
FIRST_SHARE = 0.4  # that agrees best is of one group, even where both are equal
SECOND_SHARE = 0.6  # of the rest, beside poses that agree with nothing
APART = 4.0  # standard deviations from the first; the second is beyond
WITHIN = 8.0  # standard deviations; poses beyond are of neither group
UNDECIDED = 3.0  # log likelihood ratio: 20 to 1
MAX_UNDECIDED = 0.1  # of the poses; with more the groups are parts of one
SIGNIFICANT = (
    60.0  # chi-square, 6 degrees of freedom: the split was chosen by residuals
)
MAX_ROUNDS = 30
SINGULAR = 1e-12  # of the trace; sides of too similar poses give any finite answer
MAX_LOOKED_AT = 500  # poses examined at first


@dataclass(frozen=True, eq=False)
class PoseGroups:
    """Two groups of poses that do not share tip and pivot."""

    # (N,), 1 for the larger group, or the first of equal ones, 2 for the other, else 0.
    group: IntArray
    # `tips_pen` and `pivots_cam`: (2, 3), of both groups, mm
    tips_pen: FloatArray
    pivots_cam: FloatArray
    has_two_tips: bool  # whether the tips differ more significantly than the pivots

    @property
    def minor_share(self) -> float:
        """Share of the smaller group in both."""
        return float(np.sum(self.group == 2) / np.sum(self.group > 0))

    @property
    def tip_distance(self) -> float:
        """Distance between the tips, mm."""
        return float(np.linalg.norm(self.tips_pen[1] - self.tips_pen[0]))

    @property
    def pivot_distance(self) -> float:
        """Distance between the pivots, mm."""
        return float(np.linalg.norm(self.pivots_cam[1] - self.pivots_cam[0]))


def find_groups(
    rotations: FloatArray, translations: FloatArray, used: BoolArray
) -> PoseGroups | None:
    """Return the two groups that poses fall into, or None if they are one.

    Parameters
    ----------
    rotations, translations : (N, 3, 3) and (N, 3) array
        Poses cam_from_pen in the order of capture, mm.
    used : (N,) array of bool
        Poses that agree with one tip; the others may still make a group.
    """
    equations = _Equations(rotations, contact_matrix(rotations), -translations)
    splits = (
        _split_by_agreement(equations, translations),
        _split_by_time(equations, used),
    )
    found = [
        groups
        for labels in splits
        if labels is not None and (groups := _judged(equations, labels)) is not None
    ]
    return found[0] if found else None


@dataclass(frozen=True, eq=False)
class _Equations:
    """A x = b of each pose, and the rotations in A."""

    rotations: FloatArray
    A: FloatArray
    b: FloatArray

    def solve(self, chosen: BoolArray) -> FloatArray:
        """Return tip and pivot (6,) of the chosen poses."""
        A, b = self.A[chosen].reshape(-1, 6), self.b[chosen].ravel()
        return np.asarray(np.linalg.lstsq(A, b)[0])

    def residuals(self, solution: FloatArray) -> FloatArray:
        """Return the residual of each equation, (N, 3), mm."""
        return self.A @ solution - self.b

    def own_residuals(self, labels: IntArray, solutions: FloatArray) -> FloatArray:
        """Return the residuals of the poses of groups 1 and 2, each by its own."""
        by_first, by_second = (self.residuals(solution) for solution in solutions)
        own: FloatArray = np.where((labels == 1)[:, None], by_first, by_second)
        return own[labels > 0]

    def make_groups(self, labels: IntArray) -> bool:
        """Return whether each group fixes a tip and is more than a few outliers."""
        least = max(MIN_POSES, LEAST_SHARE * len(labels))
        return all(
            np.sum(labels == name) >= least
            and posture_spread(self.rotations[labels == name])[0][0] >= MIN_SPREAD
            for name in (1, 2)
        )


def _split_by_agreement(
    equations: _Equations, translations: FloatArray
) -> IntArray | None:
    """Return the group of each pose by which of two solutions it agrees with."""
    n_poses = len(translations)
    some = np.unique(np.linspace(0, n_poses - 1, MAX_LOOKED_AT).round().astype(int))
    R, t = equations.rotations[some], translations[some]
    first = agreeing_solution(R, t, FIRST_SHARE)
    distances = np.linalg.norm(equations.residuals(first)[some], axis=1)
    unit = max(
        float(np.quantile(distances, FIRST_SHARE)) / chi_quantile(3, 1 - FIRST_SHARE),
        EXACT,
    )
    rest = distances > APART * unit
    if rest.sum() < max(MIN_POSES, LEAST_SHARE * len(some)):
        return None
    second = agreeing_solution(R[rest], t[rest], SECOND_SHARE)
    labels = np.zeros(n_poses, dtype=np.int64)
    S = np.diag(np.full(3, unit**2))
    for _ in range(MAX_ROUNDS):
        misses = np.array([equations.residuals(x) for x in (first, second)])
        apart = np.array([in_deviations(each, S) for each in misses])
        nearest = np.argmin(apart, axis=0)
        changed = np.where(apart.min(axis=0) < WITHIN, nearest + 1, 0)
        if not equations.make_groups(changed):
            return None
        if np.array_equal(changed, labels):
            break
        labels = changed
        first, second = (equations.solve(labels == name) for name in (1, 2))
        own = equations.own_residuals(labels, np.array([first, second]))
        S = np.asarray(own.T @ own / len(own) + EXACT**2 * np.eye(3))
    undecided = np.abs(apart[0] ** 2 - apart[1] ** 2) / 2 < UNDECIDED
    if np.mean(undecided[labels > 0]) > MAX_UNDECIDED:
        return None
    return labels


def _split_by_time(equations: _Equations, used: BoolArray) -> IntArray | None:
    """Return the group of each used pose, split where residuals are least."""
    order = np.flatnonzero(used)
    least = int(np.ceil(max(MIN_POSES, LEAST_SHARE * len(order))))
    if len(order) < 2 * least:
        return None
    A = equations.A[order]
    b = equations.b[order] - equations.b[order].mean(axis=0)
    H = np.cumsum(np.einsum("nki,nkj->nij", A, A), axis=0)
    g = np.cumsum(np.einsum("nki,nk->ni", A, b), axis=0)
    ends = np.arange(least - 1, len(order) - least)
    ridge = SINGULAR * np.trace(H[-1]) * np.eye(6)
    explained = np.zeros(len(ends))
    for sums, moments in ((H[ends], g[ends]), (H[-1] - H[ends], g[-1] - g[ends])):
        solutions = np.linalg.solve(sums + ridge, moments[..., None])[..., 0]
        explained += np.einsum("ni,ni->n", solutions, moments)
    first = order[ends[np.argmax(explained)]]
    labels = np.where(used, np.where(np.arange(len(used)) <= first, 1, 2), 0)
    return labels if equations.make_groups(labels) else None


def _judged(equations: _Equations, labels: IntArray) -> PoseGroups | None:
    """Return the groups, the larger one first, if their solutions differ."""
    sizes = [int(np.sum(labels == name)) for name in (1, 2)]
    begins = [int(np.argmax(labels == name)) for name in (1, 2)]
    if (-sizes[1], begins[1]) < (-sizes[0], begins[0]):
        labels = np.array([0, 2, 1])[labels]
    members = labels > 0
    of_group = np.array([labels == name for name in (1, 2)])
    solutions = np.array([equations.solve(each) for each in of_group])
    design = np.concatenate(
        [
            np.where(each[members, None, None], equations.A[members], 0.0)
            for each in of_group
        ],
        axis=2,
    )
    covariance = correlated_covariance(
        design, equations.own_residuals(labels, solutions)
    )
    between = np.hstack([-np.eye(6), np.eye(6)])
    difference = solutions[1] - solutions[0]
    uncertainty = between @ covariance @ between.T
    alike = np.abs(difference).max() < EXACT
    if alike or _chi_square(difference, uncertainty) < SIGNIFICANT:
        return None
    return PoseGroups(
        group=labels,
        tips_pen=solutions[:, :3],
        pivots_cam=solutions[:, 3:],
        has_two_tips=_chi_square(difference[:3], uncertainty[:3, :3])
        > _chi_square(difference[3:], uncertainty[3:, 3:]),
    )


def _chi_square(difference: FloatArray, covariance: FloatArray) -> float:
    return float(difference @ np.linalg.solve(covariance, difference))
