"""Noise that is correlated from image to image.

Noise is a first-order autoregression of each coordinate of each LED, equation (12) of
method.md. The restricted likelihood of its coefficient [1]_ is that of generalised
least squares, with the likeliest variance of the noise and components of LEDs, seat and
drift beside it: these look alike, and must not be budgeted twice. The covariance by
noise is equation (13), on average over the coefficients by their likelihood.

References
----------
.. [1] D. A. Harville, "Maximum likelihood approaches to variance component estimation
   and to related problems", J. American Statistical Association 72 (1977) 320-338.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.detection.robust_residuals import NOISE_FLOOR
from lightpen.estimation.bundle.bundle import Bundle
from lightpen.estimation.bundle.component_search import find_components
from lightpen.estimation.bundle.components import Components
from lightpen.estimation.bundle.linearised import eliminate
from lightpen.estimation.bundle.reduced_normal_equations import (
    WhitenedEquations,
    rows_of,
    summed_products,
)
from lightpen.model.information import inverse
from lightpen.model.quantiles import normal_quantile

TRIED = np.array([0.0, 0.2, 0.4, 0.6, 0.7, 0.8, 0.85, 0.9, 0.94, 0.97, 0.99])
BY_CHANCE = 0.01  # probability that independent noise looks correlated
NEGLIGIBLE = 1e-3  # weight of a coefficient that is left out
FAR = 30.0  # cost beyond the least at which the search ends
NOISE_PASSES = 2  # over variance and components


@dataclass(frozen=True, eq=False)
class Correlation:
    """Correlation of the noise, and its effect on the covariance."""

    # F of equation (12): correlation of a coordinate's errors in successive images; 0
    # if it is not significant.
    coefficient: float
    noise: FloatArray  # (6, 6), covariance of (tip, cone) by noise, equation (13), mm^2
    factor: float  # ratio of that to the covariance by independent noise, on average
    # Of LEDs, seat and drift beside correlated noise; None without.
    components: Components | None
    # (p, p), covariance of the fitted values by equation (13), less that of the fit;
    # None without correlation.
    excess: FloatArray | None


def lag1(residuals: FloatArray, used: BoolArray) -> float:
    """Return the lag-1 autocorrelation of residuals (N, ..., 2) over images.

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
    """Estimate the correlation of the noise, and the covariance that it makes.

    ``pixels`` (N, C, L, 2), px, are as fitted, in the order of capture.
    """
    used = bundle.used
    independent = bundle.independent_noise
    seen = lag1(bundle.residuals / bundle.unknowns.noise[..., None], used)
    pairs = 2 * int((used[1:] & used[:-1]).sum())
    if seen <= normal_quantile(BY_CHANCE) / np.sqrt(max(pairs, 1)):
        return Correlation(0.0, independent, 1.0, None, None)
    views = bundle.unknowns.views_at(bundle.state, pixels)
    jitter = bundle.components.jitter.covariance
    eliminated = eliminate(views, used, bundle.weight_sigma, jitter)
    rows = rows_of(
        bundle.unknowns,
        views,
        used,
        bundle.weight_sigma,
        eliminated.nuisance_covariance,
    )
    through = rows.projected @ bundle.covariance
    known = (bundle.sigma / bundle.weight_sigma) ** 2
    shaken = None if jitter is None else jitter / known
    nearest = int(np.argmin(np.abs(TRIED - seen)))
    models = _likely_models(bundle, rows.whitened(TRIED, shaken), known, nearest)
    costs = np.full(len(TRIED), np.inf)
    for i, model in models.items():
        costs[i] = model.cost
    likely = np.exp(-0.5 * (costs - costs.min())) * np.gradient(TRIED)
    likely /= likely.sum()
    of_values = np.zeros_like(bundle.covariance)
    for i in np.flatnonzero(likely > NEGLIGIBLE).tolist():
        products = summed_products(through, TRIED[i])
        of_values += likely[i] * models[i].variance * products
    noise = bundle.effective @ of_values @ bundle.effective.T
    as_weighed = bundle.information - bundle.jitter_information
    excess = of_values - bundle.covariance @ as_weighed @ bundle.covariance
    factor = float(np.trace(np.linalg.solve(independent, noise))) / 6
    best = models[int(np.argmin(costs))]
    return Correlation(
        float(likely @ TRIED), noise, max(factor, 1.0), best.components, excess
    )


class _NoiseModel(NamedTuple):
    """The likeliest model with one coefficient of autoregression."""

    cost: float  # twice the negative logarithm of the restricted likelihood
    variance: float  # noise variance, relative to the LED weights' variance
    components: Components


def _likely_models(
    bundle: Bundle, tried: list[WhitenedEquations], variance: float, first: int
) -> dict[int, _NoiseModel]:
    """Return the model of each coefficient tried, by its index.

    From the first outwards, each started from its neighbour, up to negligible ones.
    """
    models: dict[int, _NoiseModel] = {}
    for way in (range(first, len(tried)), range(first - 1, -1, -1)):
        near = models[first].components if models else bundle.components
        for i in way:
            models[i] = _noise_model(bundle, tried[i], variance, near)
            near = models[i].components
            if models[i].cost > FAR + min(model.cost for model in models.values()):
                break
    return models


def _noise_model(
    bundle: Bundle, each: WhitenedEquations, variance: float, components: Components
) -> _NoiseModel:
    """Find variance and components for one coefficient, starting from the given."""
    unknowns, at = bundle.unknowns, bundle.layout
    current = bundle.values.copy()
    for kind in (at.tip, at.cone, *at.fields, *at.seat, at.drift):
        current[kind] = 0.0
    right = each.gradient + each.information @ current
    floor = (NOISE_FLOOR / bundle.weight_sigma) ** 2
    measured, measured_right = unknowns.measured(bundle.state, current)
    for _ in range(NOISE_PASSES):
        information = each.information / variance + measured
        both = right / variance + measured_right
        components = find_components(unknowns, information, both, components)
        prior = unknowns.prior_information(components)
        covariance = inverse(information + prior)
        by_priors = unknowns.prior_right()
        values = covariance @ (both + by_priors)
        change = values - current
        left = each.squares - 2 * float(change @ each.gradient)
        left += float(change @ each.information @ change)
        n_free = each.n_free - float(np.sum(covariance * information))
        variance = max(left / max(n_free, 1.0), floor)
    known = np.flatnonzero(np.diag(prior) > 0)
    cost = each.n_free * np.log(variance) + each.log_volume
    cost += np.linalg.slogdet(information + prior)[1]
    cost -= np.linalg.slogdet(prior[np.ix_(known, known)])[1]
    cost += left / variance + float(values @ (prior @ values - 2 * by_priors))
    return _NoiseModel(float(cost), variance, components)
