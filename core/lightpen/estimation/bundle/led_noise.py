"""Noise of each centre by its detector, and of each LED as a variance component.

The standard deviations that the detector states are taken relative to their median, to
the power of maximum likelihood of the residuals: 0 where these do not follow them.

The logarithms of the LEDs' variances are normal about a common mean. Their spread is
that beyond what as few residuals scatter by, and each is shrunk to the mean by what is
known of it. LEDs that are alike are not distinguished.
"""

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.estimation.statistics.variance_components import CERTAIN
from lightpen.model.quantiles import chi_square_quantile

WORTH_IT = 1.25  # times the noise of another LED; less is not worth a new fit
MIN_FREE = 10.0  # degrees of freedom of an LED that is distinguished
LEAST = 1e-12  # px^2
POWERS = np.array([0.0, 0.25, 0.5, 0.75, 1.0])


def find_center_noise(
    residuals: FloatArray, used: BoolArray, sigmas: FloatArray
) -> FloatArray | None:
    """Return the noise of centres, 1 for a usual one, (N, C, L); None if equal.

    ``sigmas`` (N, C, L) are standard deviations by the detector, px; NaN where not
    seen. The residuals (N, C, L, 2) are in px.
    """
    known = used & np.isfinite(sigmas)
    if not known.any() or sigmas[known].min() == sigmas[known].max():
        return None
    ratios = np.where(np.isfinite(sigmas), sigmas / np.median(sigmas[known]), 1.0)
    squares, logs = np.sum(residuals[known] ** 2, axis=-1), np.log(ratios[known])
    # Minus twice the logarithm of the likelihood, with the likeliest common factor.
    means = [np.mean(squares * np.exp(-2 * power * logs)) for power in POWERS]
    costs = 2 * len(logs) * np.log(np.maximum(means, LEAST)) + 4 * POWERS * logs.sum()
    best = int(np.argmin(costs))
    if costs[0] - costs[best] < chi_square_quantile(1, CERTAIN):
        return None
    return np.asarray(ratios ** POWERS[best])


def find_led_noise(
    residuals: FloatArray, used: BoolArray, sigma: float, weights: FloatArray
) -> FloatArray | None:
    """Return the noise of each LED, 1 for a usual one, (C, L); None if equal.

    Parameters
    ----------
    residuals : (N, C, L, 2) array
        px.
    used : (N, C, L) array of bool
    sigma : float
        Noise of the fit for a weight of 1, px, degrees of freedom counted.
    weights : (C, L) array
        Noise of each LED by which the fit weighed it.
    """
    squares = np.sum(np.where(used[..., None], residuals, 0.0) ** 2, axis=(0, 3))
    counts = 2.0 * used.sum(axis=0)
    weighed = float(np.sum(squares / weights**2))
    freedom = min(weighed / (sigma**2 * counts.sum()), 1.0)
    free = counts * freedom
    known = free >= MIN_FREE
    if known.sum() < 2:
        return None
    logs = np.log(np.maximum(squares[known] / free[known], LEAST))
    by_chance = 2 / free[known]
    mean = np.sum(logs / by_chance) / np.sum(1 / by_chance)
    misfit = float(np.sum((logs - mean) ** 2 / by_chance))
    if misfit < chi_square_quantile(len(logs) - 1, CERTAIN):
        return None
    middle = float(np.median(logs))  # a few noisy LEDs are the usual case
    spread = max(float(np.mean((logs - middle) ** 2 - by_chance)), 0.0)
    noise = np.ones(counts.shape)
    noise[known] = np.exp(0.5 * (logs - middle) * spread / (spread + by_chance))
    return noise if noise.max() > WORTH_IT * noise.min() else None
