"""Noise that hangs together from image to image.

Errors of a centre that last longer than the time between two images do not average
out as independent ones do. They are taken as a first-order autoregression of each
coordinate of each LED. Its coefficient is read from the residuals; what the fit has
taken out of them makes it look smaller than it is, by an amount that simulated
residuals of the same fit tell (indirect inference [1]_). The covariance of what is
fitted then holds the products of all pairs of images, weighted by their correlation.

References
----------
.. [1] C. Gourieroux, A. Monfort, E. Renault, "Indirect inference", J. Applied
   Econometrics 8 (1993) S85-S118.
"""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.estimation.bundle import Z_99, Bundle
from lightpen.estimation.linearised import N_CONE, eliminate, views_at

TRIED = np.array([0.0, 0.2, 0.4, 0.6, 0.7, 0.8, 0.85, 0.9, 0.94, 0.97, 0.99])
N_DRAWS = 8
SEED = 20130604


@dataclass(frozen=True, eq=False)
class Correlation:
    """How the noise hangs together, and what that makes of the covariance.

    Attributes
    ----------
    coefficient : float
        Of the errors of one coordinate from one image to the next; 0 where it is not
        significant.
    noise : (6, 6) array
        Covariance of tip and cone from noise, mm^2.
    factor : float
        What it is larger by than that of independent images, on average.
    """

    coefficient: float
    noise: FloatArray
    factor: float


@dataclass(frozen=True, eq=False)
class _Rows:
    """The linear model of a fit, LED by LED, in units of ``weight_sigma``.

    M is the number of coordinates of an image.

    Attributes
    ----------
    eliminated : (N, M, q) array
        By the unknowns of each image.
    left : (N, q, q) array
        Inverse of their normal matrix.
    projected : (N, M, p) array
        By the common unknowns, less what those of the image take up.
    covariance : (p, p) array
    """

    eliminated: FloatArray
    left: FloatArray
    projected: FloatArray
    covariance: FloatArray

    def residuals_of(self, noise: FloatArray) -> FloatArray:
        """Return what the fit leaves of noise (B, N, M)."""
        taken_up = np.einsum("nmp,bnm->bp", self.projected, noise) @ self.covariance
        through = np.swapaxes(self.eliminated, 1, 2)
        alone = np.einsum("nqm,bnm->bnq", through, noise)
        alone = np.einsum("nmq,nqr,bnr->bnm", self.eliminated, self.left, alone)
        return np.asarray(
            noise - alone - np.einsum("nmp,bp->bnm", self.projected, taken_up)
        )


def _rows_of(bundle: Bundle, pixels: FloatArray) -> _Rows:
    """Return the linear model of a fit to pixels (N, C, L, 2), LED by LED."""
    unknowns, used = bundle.unknowns, bundle.used
    n_images, _, n_leds = used.shape
    mixing = unknowns.mixing
    by_leds = mixing[-3 * n_leds :].reshape(n_leds, 3, -1)
    views = views_at(bundle.state, pixels)
    row, turns, cones, common = N_CONE, [], [], []
    for c, view in enumerate(views):
        k = view.own.shape[-1]
        J = (
            np.einsum("nlik,lkp->nlip", view.led, by_leds, optimize=True)
            + view.cone @ mixing[:N_CONE]
            + view.own @ mixing[row : row + k]
            + view.diameter[..., None] * mixing[-3 * n_leds - 1]
        )
        row += k
        shifted = view.cone[..., None, :] * unknowns.forms[:, None, None, :, None]
        mask = used[:, c, :, None, None]
        forms = shifted.reshape(*shifted.shape[:3], -1)
        common.append(np.where(mask, np.concatenate([J, forms], axis=3), 0.0))
        turns.append(np.where(mask, view.turn, 0.0))
        cones.append(np.where(mask, view.cone, 0.0))

    def flat(parts: list[FloatArray]) -> FloatArray:
        rows = np.stack(parts, axis=1) / bundle.weight_sigma
        return rows.reshape(n_images, -1, rows.shape[-1])

    jitter = bundle.components.jitter.covariance
    T, J = flat(turns), flat(common)
    if jitter is not None:
        T = np.concatenate([T, flat(cones)], axis=2)
    left = eliminate(views, used, bundle.weight_sigma, jitter).left
    return _Rows(
        eliminated=T,
        left=left,
        projected=J - T @ (left @ (np.swapaxes(T, 1, 2) @ J)),
        covariance=bundle.covariance,
    )


def lag1(residuals: FloatArray, used: BoolArray) -> float:
    """Return the correlation of residuals (N, ..., 2) with those of the image before.

    ``used`` is (N, ...).
    """
    clean = np.where(used[..., None], residuals, 0.0)
    both = used[1:] & used[:-1]
    if not both.any():
        return 0.0
    total = float(np.sum(clean**2)) / max(2 * int(used.sum()), 1)
    pairs = float(np.sum(clean[1:] * clean[:-1])) / (2 * int(both.sum()))
    return pairs / total if total > 0 else 0.0


def measure_correlation(bundle: Bundle, pixels: FloatArray) -> Correlation:
    """Measure how the noise hangs together, and carry it to tip and cone.

    Parameters
    ----------
    pixels : (N, C, L, 2) array
        As fitted, in the order of capture, px.
    """
    used = bundle.used
    independent = bundle.independent_noise
    seen = lag1(bundle.residuals, used)
    pairs = 2 * int((used[1:] & used[:-1]).sum())
    if seen <= Z_99 / np.sqrt(max(pairs, 1)):
        return Correlation(0.0, independent, 1.0)
    rows = _rows_of(bundle, pixels)
    coefficient, share = _corrected(seen, rows, used)
    variance = float(np.sum(np.where(used[..., None], bundle.residuals, 0.0) ** 2))
    variance /= 2 * int(used.sum()) * share * bundle.weight_sigma**2
    noise = variance * bundle.carried(_summed(rows.projected, coefficient))
    factor = float(np.trace(np.linalg.solve(independent, noise))) / 6
    return Correlation(coefficient, noise, max(factor, 1.0))


def _corrected(seen: float, rows: _Rows, used: BoolArray) -> tuple[float, float]:
    """Return the coefficient whose residuals look like those seen.

    And what the fit leaves of the variance of such noise.
    """
    rng = np.random.default_rng(SEED)
    n_images = len(used)
    draws = rng.standard_normal((N_DRAWS, n_images, *used.shape[1:], 2))
    looks, shares = np.empty(len(TRIED)), np.empty(len(TRIED))
    for k, coefficient in enumerate(TRIED):
        noise = np.where(used[..., None], _autoregressive(draws, coefficient), 0.0)
        left = rows.residuals_of(noise.reshape(N_DRAWS, n_images, -1))
        left = left.reshape(noise.shape)
        looks[k] = np.mean([lag1(one, used) for one in left])
        shares[k] = float(np.mean(left**2)) / float(np.mean(used))
    looks = np.maximum.accumulate(looks)
    coefficient = float(np.interp(seen, looks, TRIED))
    return coefficient, float(np.interp(coefficient, TRIED, shares))


def _autoregressive(draws: FloatArray, coefficient: float) -> FloatArray:
    """Return noise of variance 1 from independent draws (B, N, ...)."""
    noise = draws.copy()
    fresh = np.sqrt(1 - coefficient**2)
    for i in range(1, draws.shape[1]):
        noise[:, i] = coefficient * noise[:, i - 1] + fresh * draws[:, i]
    return noise


def _summed(projected: FloatArray, coefficient: float) -> FloatArray:
    """Return the products of all pairs of images (N, m, p), weighted, (p, p)."""
    past = np.empty_like(projected)
    carried = np.zeros_like(projected[0])
    for i, rows in enumerate(projected):
        past[i] = carried
        carried = coefficient * (carried + rows)
    p = projected.shape[-1]
    flat, before = projected.reshape(-1, p), past.reshape(-1, p)
    cross = flat.T @ before
    return np.asarray(flat.T @ flat + cross + cross.T)
