"""Standard deviations of random effects by restricted maximum likelihood.

Errors of one kind (of the LEDs, of the seat, of a drift) are normal with one standard
deviation, the maximum of the restricted likelihood [1]_, equation (5) of method.md: the
errors themselves and all other unknowns are integrated out.

An effect that is not significant may be there all the same. Its expected variance is
the posterior mean over a prior that is 0 as a rule, else even in the logarithm up to
some 20 um and falling beyond: equation (6).

References
----------
.. [1] D. A. Harville, "Maximum likelihood approaches to variance component estimation
   and to related problems", J. American Statistical Association 72 (1977) 320-338.
"""

from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.model.coverage import chi_square_quantile

# How often chance alone makes so large a gain, at most, of errors that are
CERTAIN = 0.001  # called significant
FITTED = 0.01  # fitted
ALLOWED = 0.1  # allowed to a camera beyond its file
P_NONE = 0.7  # prior probability that there are no errors of a kind
SCALES = np.geomspace(1e-5, 1.0, 200)  # mm, standard deviations tried
SELDOM = 0.02  # mm; few images cannot exclude larger ones, which are the less likely
OBSERVABLE = 1e-9  # of the largest eigenvalue; less is rounding
MAX_PASSES = 12
NO_JITTER = 1e-5  # mm, along an axis; a covariance is to be inverted
LEAST_AXIS = 1e-9  # variance of an axis over the largest
COARSE = 4  # one in so many scales is tried first
SETTLED = 1e-2  # relative, of a standard deviation
LEAST_FREE = 4.0  # degrees of freedom; fewer leave a variance without a mean


class Component(NamedTuple):
    """A variance component: the standard deviation of errors of one kind."""

    sigma: float  # of maximum likelihood, mm
    # Twice the logarithm of the likelihood ratio to no errors, or to the standard
    # deviation that a file states.
    gain: float
    expected_sigma: float = 0.0  # root of the expected variance, equation (6), mm

    def exceeds(self, chance: float) -> bool:
        """Return whether chance alone makes such a gain less often."""
        return self.gain > chi_square_quantile(1, chance)

    @property
    def is_significant(self) -> bool:
        """Whether chance alone makes it less than once in a thousand."""
        return self.exceeds(CERTAIN)


def find_component(S: FloatArray, right: FloatArray, stated: float = 0.0) -> Component:
    """Find the standard deviation of k unknowns of one kind, equation (5).

    Parameters
    ----------
    S : (k, k) array
        Their information, all other unknowns marginalised, 1/mm^2.
    right : (k,) array
        Right side that belongs to it, 1/mm.
    stated : float
        Standard deviation beside which it is judged, mm.
    """
    values, vectors = np.linalg.eigh(S)
    seen = values > OBSERVABLE * max(values[-1], 1e-300)
    values, projected = values[seen], (vectors.T @ right)[seen]
    sigmas = np.concatenate([[stated], SCALES])
    excess = values * sigmas[:, None] ** 2 + 1
    costs = np.log(excess).sum(axis=1) + (1 / excess) @ (projected**2 / values)
    best = int(np.argmin(costs))
    gain = float(costs[0] - costs[best])
    return Component(float(sigmas[best]), gain, _expected_sigma(sigmas, costs))


def find_beside(
    information: FloatArray,
    right: FloatArray,
    moves: FloatArray,
    others: FloatArray,
    stated: float = 0.0,
) -> Component:
    """Find the std. deviation of k of n unknowns that also have other errors.

    Parameters
    ----------
    information : (n, n) array
        Of the unknowns, all others marginalised, 1/mm^2.
    right : (n,) array
        Right side that belongs to it, 1/mm.
    moves : (n, k) array
        Unknowns by each move.
    others : (n, n) array
        Covariance of the unknowns by other errors, mm^2.
    stated : float
        Standard deviation beside which it is judged, mm.
    """
    own = np.column_stack([information @ moves, right])
    left = moves.T @ np.linalg.solve(np.eye(len(others)) + information @ others, own)
    S = left[:, :-1]
    return find_component(0.5 * (S + S.T), left[:, -1], stated)


def _expected_sigma(sigmas: FloatArray, costs: FloatArray) -> float:
    """Return the root of the expected variance, equation (6), mm; the first is 0."""
    weights = np.exp(-0.5 * (costs - costs.min()))
    likely = (1 + (sigmas[1:] / SELDOM) ** 2) ** -2
    weights[1:] *= (1 - P_NONE) / (P_NONE * (len(sigmas) - 1)) * likely
    return float(np.sqrt(weights @ sigmas**2 / weights.sum()))


class RandomEffect(NamedTuple):
    """Estimate of a random vector, independent from image to image."""

    covariance: FloatArray | None  # (3, 3), mm^2; None where it is not significant
    # Root of the expected variance along each axis, equation (6), mm
    expected_sigma: float


def find_jitter(
    information: FloatArray, right: FloatArray, leverage: FloatArray
) -> RandomEffect:
    """Find the covariance of a random vector, independent from image to image.

    One variance for all axes unless a full covariance is far likelier.

    Parameters
    ----------
    information : (N, 3, 3) array
        Of each image about its own vector, 1/mm^2.
    right : (N, 3) array
        Right side that belongs to it, 1/mm.
    leverage : (N, 3, 3) array
        Covariance that the unknowns common to all images leave in the vector that
        each image alone would give, mm^2.

    Notes
    -----
    The covariance is found by Fisher scoring: with the total covariance V_i of each
    image, the sum of ``V_i^-1 (excess_i - V_i) V_i^-1`` is brought to 0. What would be
    negative is taken as none.

    The estimates are uncertain themselves, in particular with few images. The degrees
    of freedom n of a variance follow from its own variance [1]_; it is multiplied by
    ``n / (n - 2)``, the mean of its distribution, as in JCGM 101, 6.4.9.

    References
    ----------
    .. [1] F. E. Satterthwaite, "An approximate distribution of estimates of variance
       components", Biometrics Bulletin 2 (1946) 110-114.
    """
    noise = np.linalg.inv(information)
    alone = np.einsum("nij,nj->ni", noise, right)
    excess = np.einsum("ni,nj->nij", alone, alone) + leverage

    values, vectors = np.linalg.eigh(noise)
    projected = np.sum(vectors * (excess @ vectors), axis=1)

    def costs_of(sigmas: FloatArray) -> FloatArray:
        totals = values + sigmas[:, None, None] ** 2
        return np.asarray(np.sum(np.log(totals) + projected / totals, axis=(1, 2)))

    sigmas = np.array([0.0, *SCALES[::COARSE]])
    costs = costs_of(sigmas)
    expected = _expected_sigma(sigmas, costs)
    best = int(np.argmin(costs))
    if costs[0] - costs[best] < chi_square_quantile(1, FITTED):
        return RandomEffect(None, expected)
    near = SCALES[max((best - 2) * COARSE, 0) : best * COARSE + 1]
    fine = costs_of(near)
    variance = float(near[int(np.argmin(fine))]) ** 2

    jitter = variance * np.eye(3)
    for _ in range(MAX_PASSES):
        weights = np.linalg.inv(noise + jitter)
        flat = weights.reshape(-1, 9)
        # Of every pair of entries: the sum of products of entries (a, c) and (d, b).
        products = (flat.T @ flat).reshape(3, 3, 3, 3).transpose(0, 3, 1, 2)
        right_side = np.sum(weights @ (excess - noise) @ weights, axis=0)
        before = jitter
        jitter = np.linalg.solve(products.reshape(9, 9), right_side.ravel())
        jitter = _not_negative(jitter.reshape(3, 3))
        change = np.abs(np.diag(jitter) / np.diag(before) - 1)
        if change.max() < SETTLED:
            break
    total = noise + jitter
    misfit = np.einsum("nij,nji->", np.linalg.inv(total), excess)
    cost = float(np.linalg.slogdet(total)[1].sum() + misfit)
    # One variance has one parameter, a covariance six.
    if float(fine.min()) - cost < chi_square_quantile(5, CERTAIN):
        n_free = variance**2 * float(np.sum((values + variance) ** -2))
        n_free = max(n_free, LEAST_FREE)
        return RandomEffect(variance * n_free / (n_free - 2) * np.eye(3), expected)
    # The posterior mean, of an inverse Wishart distribution.
    n_images = len(alone)
    return RandomEffect(jitter * n_images / max(n_images - 4, 1), expected)


def _not_negative(covariance: FloatArray) -> FloatArray:
    """Return a covariance with eigenvalues so large that it can be inverted."""
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    least = max(NO_JITTER**2, LEAST_AXIS * values[-1])
    return np.asarray((vectors * np.maximum(values, least)) @ vectors.T)
