"""Noise that hangs together from image to image.

Errors of a centre that last longer than the time between two images do not average
out as independent ones do. They are taken as a first-order autoregression of each
coordinate of each LED. How likely each coefficient is tells the restricted likelihood
of all images by generalised least squares [1]_, with what is likeliest beside it of the
variance of the noise and of errors of LEDs, seat and drift: noise that lasts looks like
those, and is not to be counted twice. The covariance of what is fitted holds the
products of all pairs of images, weighted by their correlation, on average over the
coefficients.

References
----------
.. [1] D. A. Harville, "Maximum likelihood approaches to variance component estimation
   and to related problems", J. American Statistical Association 72 (1977) 320-338.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.detection.pose import NOISE_FLOOR
from lightpen.estimation.bundle import Z_99, Bundle
from lightpen.estimation.component_search import find_components
from lightpen.estimation.components import Components
from lightpen.estimation.image_rows import Whitened, rows_of, summed_products
from lightpen.estimation.information import inverse
from lightpen.estimation.linearised import eliminate, views_at

TRIED = np.array([0.0, 0.2, 0.4, 0.6, 0.7, 0.8, 0.85, 0.9, 0.94, 0.97, 0.99])
NEGLIGIBLE = 1e-3  # how likely a coefficient is that is left out
FAR = 30.0  # costs beyond the least from which on none is tried farther off
NOISE_PASSES = 2  # in which its variance is found beside the components


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
    components : Components or None
        Of LEDs, seat and drift, beside noise that hangs together so; None where it
        does not.
    excess : (p, p) array or None
        By what the covariance of the values of the fit is larger than as it weighed
        the noise; None likewise.
    """

    coefficient: float
    noise: FloatArray
    factor: float
    components: Components | None
    excess: FloatArray | None


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
        return Correlation(0.0, independent, 1.0, None, None)
    views = views_at(bundle.state, pixels)
    jitter = bundle.components.jitter.covariance
    left = eliminate(views, used, bundle.weight_sigma, jitter).left
    rows = rows_of(bundle.unknowns, views, used, bundle.weight_sigma, left)
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
    noise = of_values[:6, :6]
    as_weighed = bundle.information - bundle.jitter_information
    excess = of_values - bundle.covariance @ as_weighed @ bundle.covariance
    factor = float(np.trace(np.linalg.solve(independent, noise))) / 6
    best = models[int(np.argmin(costs))]
    return Correlation(
        float(likely @ TRIED), noise, max(factor, 1.0), best.components, excess
    )


class _NoiseModel(NamedTuple):
    """What is likely where noise hangs together by one coefficient.

    Attributes
    ----------
    cost : float
        Twice the negative logarithm of the restricted likelihood.
    variance : float
        Of the noise, in units of that by which LEDs were weighed.
    components : Components
        Of the errors beside it.
    """

    cost: float
    variance: float
    components: Components


def _likely_models(
    bundle: Bundle, tried: list[Whitened], variance: float, first: int
) -> dict[int, _NoiseModel]:
    """Return what is likely for each of some coefficients, by their place.

    They are tried outwards from the first, each from what its neighbour gave, as far as
    they are not all but impossible beside the likeliest.
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
    bundle: Bundle, each: Whitened, variance: float, components: Components
) -> _NoiseModel:
    """Find the variance of noise that hangs together so, and the components with it.

    The search for both begins at ``variance`` and ``components``.
    """
    unknowns, at = bundle.unknowns, bundle.columns
    taken_up = bundle.values.copy()
    for kind in (at.tip, at.cone, *at.seat, at.drift):
        taken_up[kind] = 0.0
    right = each.gradient + each.information @ taken_up
    floor = (NOISE_FLOOR / bundle.weight_sigma) ** 2
    measured, measured_right = unknowns.measured(bundle.state, taken_up)
    for _ in range(NOISE_PASSES):
        information = each.information / variance + measured
        both = right / variance + measured_right
        components = find_components(unknowns, information, both, components)
        prior = unknowns.prior_information(components)
        covariance = inverse(information + prior)
        values = covariance @ both
        change = values - taken_up
        left = each.squares - 2 * float(change @ each.gradient)
        left += float(change @ each.information @ change)
        n_free = each.n_free - float(np.sum(covariance * information))
        variance = max(left / max(n_free, 1.0), floor)
    known = np.flatnonzero(np.diag(prior) > 0)
    cost = each.n_free * np.log(variance) + each.log_volume
    cost += np.linalg.slogdet(information + prior)[1]
    cost -= np.linalg.slogdet(prior[np.ix_(known, known)])[1]
    cost += left / variance + float(values @ prior @ values)
    return _NoiseModel(float(cost), variance, components)
