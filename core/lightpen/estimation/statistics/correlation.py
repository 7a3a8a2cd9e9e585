"""Covariance of a least-squares fit with residuals correlated from pose to pose.

Plain least squares counts every pose as independent. A tracker's error drifts and
follows the swing instead, so that hundreds of poses may show no more than a dozen. With
design A_i (3 x P) and residuals e_i of covariance ``S c(i - j)`` the covariance of the
least-squares solution is

    (A^T A)^-1 [sum_ij A_i^T S A_j c(i - j)] (A^T A)^-1

The discrete cosine transform takes the sums apart, as it all but diagonalises a
correlation that falls off with distance: the noise has a spectrum g(k), and poses next
to each other become frequencies k, independent of each other. The spectra tried are
those of white noise plus a first-order autoregression, of many shares and lengths.
Their restricted likelihoods [1]_, which count what the unknowns have absorbed, weigh
the covariances that follow, so that what the poses cannot show of their correlation
widens the uncertainty too.

Only those frequencies are examined in which the pen swings. The unknowns feel no
others, and a model that had to match them also would be swayed by how smoothly a
tracker filters its poses.

References
----------
.. [1] D. A. Harville, "Maximum likelihood approaches to variance component estimation
   and to related problems", J. American Statistical Association 72 (1977) 320-338.
"""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray

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
