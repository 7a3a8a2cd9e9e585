"""How large the errors of one kind are, as the images themselves tell.

Errors of one kind (of the LEDs, of the seat, of a drift) are taken as normal with one
standard deviation, found by restricted maximum likelihood (empirical Bayes [1]_): the
errors themselves, and all that the images leave open beside them, are integrated out.

What chance makes often is not taken for an error; yet it may be one. Its variance is
expected to be the mean over all that it may be, weighed by how likely the images have
it: none as a rule, else anything, evenly in the logarithm.

References
----------
.. [1] D. A. Harville, "Maximum likelihood approaches to variance component estimation
   and to related problems", J. American Statistical Association 72 (1977) 320-338.
"""

from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray

SIGNIFICANT = 10.83  # chi-square, 1 degree of freedom, at 0.001
COUNTED = 2.71  # the same at 0.1: enough to be counted in the uncertainty
FITTED = 6.63  # the same at 0.01: enough to be fitted
NONE_SHARE = 0.7  # of swings in which errors of a kind are as good as none
SCALES = np.geomspace(1e-5, 1.0, 200)  # mm, standard deviations tried
SEEN = 1e-9  # of the largest eigenvalue; what is less is not seen at all
MAX_PASSES = 12
NO_JITTER = 1e-5  # mm, along an axis; a covariance is to be inverted
COARSE = 4  # one in so many scales, where all images are asked for each
SETTLED = 1e-2  # relative, of a standard deviation
DIRECTED = 20.52  # chi-square, 5 degrees of freedom, at 0.001
LEAST_FREE = 4.0  # degrees of freedom; fewer leave a variance without a mean


class Component(NamedTuple):
    """The likeliest standard deviation of some errors.

    Attributes
    ----------
    sigma : float
        mm.
    gain : float
        Twice the logarithm of how much likelier it is than none, or than what a file
        states.
    expected : float
        Root of the mean variance over all that it may be, mm.
    """

    sigma: float
    gain: float
    expected: float = 0.0

    @property
    def is_significant(self) -> bool:
        """Whether chance alone hardly makes it."""
        return self.gain > SIGNIFICANT


def find_component(S: FloatArray, right: FloatArray, stated: float = 0.0) -> Component:
    """Find the likeliest standard deviation of k unknowns.

    In the eigenvectors of S the right sides are independent and normal, with variance
    ``value^2 sigma^2 + value``.

    Parameters
    ----------
    S : (k, k) array
        Their information, all other unknowns eliminated, 1/mm^2.
    right : (k,) array
        Right side that belongs to it, 1/mm.
    stated : float
        Standard deviation beside which it is judged, mm.
    """
    values, vectors = np.linalg.eigh(S)
    seen = values > SEEN * max(values[-1], 1e-300)
    values, projected = values[seen], (vectors.T @ right)[seen]
    sigmas = np.concatenate([[stated], SCALES])
    excess = values * sigmas[:, None] ** 2 + 1
    costs = np.log(excess).sum(axis=1) + (1 / excess) @ (projected**2 / values)
    best = int(np.argmin(costs))
    gain = float(costs[0] - costs[best])
    return Component(float(sigmas[best]), gain, _expected(sigmas, costs))


def find_beside(
    information: FloatArray,
    right: FloatArray,
    moves: FloatArray,
    others: FloatArray,
    stated: float = 0.0,
) -> Component:
    """Find the likeliest standard deviation of k moves of n unknowns.

    Parameters
    ----------
    information : (n, n) array
        Of the unknowns, all others eliminated, 1/mm^2.
    right : (n,) array
        Right side that belongs to it, 1/mm.
    moves : (n, k) array
        What each move makes of the unknowns.
    others : (n, n) array
        Covariance of what else moves them, mm^2.
    stated : float
        Standard deviation beside which it is judged, mm.
    """
    own = np.column_stack([information @ moves, right])
    left = moves.T @ np.linalg.solve(np.eye(len(others)) + information @ others, own)
    S = left[:, :-1]
    return find_component(0.5 * (S + S.T), left[:, -1], stated)


def _expected(sigmas: FloatArray, costs: FloatArray) -> float:
    """Return the root mean square of standard deviations, the first being none, mm."""
    weights = np.exp(-0.5 * (costs - costs.min()))
    weights[1:] *= (1 - NONE_SHARE) / (NONE_SHARE * (len(sigmas) - 1))
    return float(np.sqrt(weights @ sigmas**2 / weights.sum()))


class Jitter(NamedTuple):
    """What is likely of a vector that is another in each image.

    Attributes
    ----------
    covariance : (3, 3) array or None
        mm^2; None where it is not significant.
    expected : float
        Standard deviation along each axis that is expected all the same, mm.
    """

    covariance: FloatArray | None
    expected: float


def find_jitter(
    information: FloatArray, right: FloatArray, leverage: FloatArray
) -> Jitter:
    """Find the covariance of a vector that is another in each image.

    One standard deviation along all axes unless a covariance is far likelier.

    Parameters
    ----------
    information : (N, 3, 3) array
        What each image says of its own vector, 1/mm^2.
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

    What is found is itself uncertain, the more the fewer images there are. One variance
    counts as of as many degrees of freedom n as its own variance tells [1]_, and is
    raised by ``n / (n - 2)`` to the mean of what it may be, as JCGM 101, 6.4.9 has it.

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
    expected = _expected(sigmas, costs)
    best = int(np.argmin(costs))
    if costs[0] - costs[best] < FITTED:
        return Jitter(None, expected)
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
    if float(fine.min()) - cost < DIRECTED:
        n_free = variance**2 * float(np.sum((values + variance) ** -2))
        n_free = max(n_free, LEAST_FREE)
        return Jitter(variance * n_free / (n_free - 2) * np.eye(3), expected)
    # The mean of what it may be, an inverse Wishart distribution.
    n_images = len(alone)
    return Jitter(jitter * n_images / max(n_images - 4, 1), expected)


def _not_negative(covariance: FloatArray) -> FloatArray:
    """Return a covariance without what is negative in it."""
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    return np.asarray((vectors * np.maximum(values, NO_JITTER**2)) @ vectors.T)
