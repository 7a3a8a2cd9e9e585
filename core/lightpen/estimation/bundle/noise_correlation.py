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
from lightpen.estimation.bundle.linearised import N_CONE, N_TURN, CameraView, eliminate
from lightpen.estimation.bundle.unknowns import Components, Unknowns, find_components
from lightpen.model.coverage import inverse, normal_quantile


class WhitenedEquations(NamedTuple):
    """Normal equations of all images by generalised least squares.

    The unknowns of each image are eliminated.
    """

    information: FloatArray  # (p, p)
    gradient: FloatArray  # (p,)
    # Sum of the squared residuals after the unknowns of single images were eliminated.
    squares: float
    log_volume: float  # log determinants of the noise and of the eliminated unknowns
    n_free: int  # observations less eliminated unknowns


RIDGE = 1e-12  # of the mean of a diagonal, where an image shows nothing


@dataclass(frozen=True, eq=False)
class ImageRows:
    """The linear model of a fit, in units of the standard deviation that weighs it.

    M is the number of coordinates of an image.
    """

    eliminated: FloatArray  # (N, M, q), derivatives by the unknowns of each image
    nuisance_covariance: FloatArray  # (N, q, q), inverse of their normal matrix
    # (N, M, p), J of equation (13): ``common`` with those of each image eliminated.
    projected: FloatArray
    common: FloatArray  # (N, M, p), derivatives by the common unknowns
    residuals: FloatArray  # (N, M)
    used: BoolArray  # (N, M)

    def whitened(
        self, coefficients: FloatArray, jitter: FloatArray | None
    ) -> list["WhitenedEquations"]:
        """Return the equations by generalised least squares for B coefficients.

        Parameters
        ----------
        coefficients : (B,) array
            f of equation (12), for noise of variance 1. Where the image before does not
            show a coordinate, it starts again.
        jitter : (3, 3) array or None
            Covariance of the jitter of the seat, mm^2 for that noise.
        """
        T = self.eliminated
        J = np.concatenate([self.common, self.residuals[..., None]], axis=2)
        follows = np.zeros(self.used.shape)
        follows[1:] = self.used[1:] & self.used[:-1]
        known = np.zeros((T.shape[2], T.shape[2]))
        if jitter is not None:
            known[N_TURN:, N_TURN:] = np.linalg.inv(jitter)
        sums, logs, inner, beside, right = [], [], [], [], []
        for coefficient in coefficients:
            carried = coefficient * follows
            weight = self.used / np.sqrt(1 - carried**2)
            logs.append(-2 * float(np.log(weight[self.used]).sum()))
            own, past = weight[..., None] * T, np.zeros_like(T)
            past[1:] = -(weight * carried)[1:, :, None] * T[:-1]
            rows = weight[..., None] * J
            rows[1:] -= (weight * carried)[1:, :, None] * J[:-1]
            flat = rows.reshape(-1, rows.shape[-1])
            sums.append(flat.T @ flat)
            from_own, from_past = np.swapaxes(own, 1, 2), np.swapaxes(past, 1, 2)
            D, C = from_own @ own + known, from_own @ rows
            D[:-1] += from_past[1:] @ past[1:]
            C[:-1] += from_past[1:] @ rows[1:]
            D += RIDGE * np.trace(D.sum(axis=0)) / len(D) * np.eye(D.shape[1])
            inner.append(D)
            beside.append(from_past @ own)
            right.append(C)
        left, volumes = _eliminate(*map(np.array, (inner, beside, right)))
        normal = np.array(sums) - left
        n_free = int(self.used.sum()) - N_TURN * len(T)
        return [
            WhitenedEquations(
                N[:-1, :-1], N[:-1, -1], float(N[-1, -1]), log + volume, n_free
            )
            for N, log, volume in zip(normal, logs, volumes, strict=True)
        ]


def _eliminate(
    inner: FloatArray, beside: FloatArray, right: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Eliminate the unknowns of images by block-tridiagonal elimination.

    Their normal matrices (B, N, q, q) are ``inner``, and ``beside`` of an image
    (columns) with the one before (rows); ``right`` (B, N, q, k) is with the common
    unknowns. Return what is taken off the normal matrix of these, (B, k, k), and the
    logarithm of the determinants of what was eliminated, (B,).
    """
    left = np.zeros((len(inner), right.shape[-1], right.shape[-1]))
    volumes = np.zeros(len(inner))
    by_next: FloatArray = np.zeros_like(inner[:, 0])
    gain: FloatArray = np.zeros_like(right[:, 0])
    for i in range(inner.shape[1]):
        through = np.swapaxes(beside[:, i], 1, 2)
        D, C = inner[:, i] - through @ by_next, right[:, i] - through @ gain
        both = C if i + 1 == inner.shape[1] else np.dstack([C, beside[:, i + 1]])
        solved: FloatArray = np.asarray(np.linalg.solve(D, both), dtype=np.float64)
        gain, by_next = solved[..., : C.shape[-1]], solved[..., C.shape[-1] :]
        left += np.swapaxes(C, 1, 2) @ gain
        volumes += np.linalg.slogdet(D)[1]
    return left, volumes


def summed_products(rows: FloatArray, coefficient: float) -> FloatArray:
    """Return the sum over pairs of images in (13), (p, p), for rows (N, M, p)."""
    past = np.empty_like(rows)
    carried = np.zeros_like(rows[0])
    for i, row in enumerate(rows):
        past[i] = carried
        carried = coefficient * (carried + row)
    p = rows.shape[-1]
    flat, before = rows.reshape(-1, p), past.reshape(-1, p)
    cross = flat.T @ before
    return np.asarray(flat.T @ flat + cross + cross.T)


def rows_of(
    unknowns: Unknowns,
    views: tuple[CameraView, ...],
    used: BoolArray,
    sigma: float,
    nuisance_covariance: FloatArray,
) -> ImageRows:
    """Return the linear model around a state, LED by LED.

    Parameters
    ----------
    used : (N, C, L) array of bool
    sigma : float
        By which LEDs are weighed, px.
    nuisance_covariance : (N, q, q) array
        As `lightpen.estimation.bundle.linearised.Eliminated` has it.
    """
    n_images, _, n_leds = used.shape
    mixing = unknowns.mixing
    by_leds = mixing[-3 * n_leds :].reshape(n_leds, 3, -1)
    n_fields = views[0].fields.shape[-1]
    at_fields = slice(-3 * n_leds - 1 - n_fields, -3 * n_leds - 1)
    row, turns, cones, common = N_CONE, [], [], []
    for c, view in enumerate(views):
        k = view.own.shape[-1]
        J = (
            np.einsum("nlik,lkp->nlip", view.led, by_leds, optimize=True)
            + view.cone @ mixing[:N_CONE]
            + view.own @ mixing[row : row + k]
            + view.fields @ mixing[at_fields]
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
        rows = np.stack(parts, axis=1) / sigma
        return rows.reshape(n_images, -1, rows.shape[-1])

    T, J = flat(turns), flat(common)
    seen = np.repeat(used.reshape(n_images, -1), 2, axis=1)
    observed = np.stack([view.residuals for view in views], axis=1)
    observed = observed.reshape(n_images, -1)
    if nuisance_covariance.shape[-1] > N_TURN:
        T = np.concatenate([T, flat(cones)], axis=2)
    return ImageRows(
        eliminated=T,
        nuisance_covariance=nuisance_covariance,
        projected=J - T @ (nuisance_covariance @ (np.swapaxes(T, 1, 2) @ J)),
        common=J,
        residuals=np.where(seen, observed, 0.0) / sigma,
        used=seen,
    )


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
    measured, measured_right = unknowns.measured()
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
