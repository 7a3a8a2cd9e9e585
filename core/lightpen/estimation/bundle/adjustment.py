"""The whole adjustment: contradicted priors, correlated noise and shrinkage.

Where a camera file states no uncertainty, the prior assumed in its place must allow for
a bad file. Where the images do not show the file to be off, its values are better than
an estimate from one swing. So the estimate is taken with the assumed prior shrunk to
the deviation that the images show (empirical Bayes); its uncertainty is that of the
unshrunk prior, and the shift of the estimate by shrinkage is a separate contribution.
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.bundle import Bundle, fit_bundle
from lightpen.estimation.bundle.consistency_findings import (
    ContradictedInputs,
    Contradiction,
    contradictions_of,
    find_contradicted_inputs,
    find_pen_contradictions,
)
from lightpen.estimation.bundle.effect_search import SearchedEffect, search_effects
from lightpen.estimation.bundle.led_noise import find_center_noise, find_led_noise
from lightpen.estimation.bundle.linearised import BundleState
from lightpen.estimation.bundle.noise_correlation import (
    Correlation,
    measure_correlation,
)
from lightpen.estimation.bundle.priors import Prior, Priors
from lightpen.estimation.bundle.seat_modes import seat_modes_of
from lightpen.estimation.statistics.variance_components import ALLOWED, find_component
from lightpen.model.information import inverse

RELATED = 1.1  # times the variance of independent noise; less is not worth a new fit
MAX_RELEASES = 8  # rounds in which contradicted numbers are sought
NOISE_ROUNDS = 3  # in which noisy LEDs lose their weight
NOISE_SETTLED = 0.15  # of a noise; a weight may be off by that
MOST_SHRUNK = 0.01  # of an assumed standard deviation


@dataclass(frozen=True, eq=False)
class Adjustment:
    """An adjustment of tip, cone and all parameters of the files.

    Attributes
    ----------
    bundle : Bundle
        The estimate, with assumed camera priors shrunk.
    unshrunk : Bundle
        The fit with these priors as assumed; its covariance is the uncertainty.
    priors : Priors
        Priors of ``unshrunk`` with contradicted numbers released.
    effects : tuple of SearchedEffect
        Beside a fit without them; candidates are unknowns of ``bundle``.
    """

    bundle: Bundle
    unshrunk: Bundle
    priors: Priors
    contradictions: tuple[Contradiction, ...]
    correlation: Correlation
    effects: tuple[SearchedEffect, ...]

    @property
    def shrinkage_shift(self) -> FloatArray:
        """Change of (tip_pen, cone_rig) by shrinkage, (6,), mm."""
        one, other = self.bundle.state, self.unshrunk.state
        return np.concatenate(
            [one.tip_pen - other.tip_pen, one.cone_rig - other.cone_rig]
        )


@dataclass(frozen=True, eq=False)
class _ConsistentFit:
    """A fit with contradicted numbers released from their priors."""

    bundle: Bundle
    correlation: Correlation
    priors: Priors
    contradictions: tuple[Contradiction, ...]
    effects: tuple[SearchedEffect, ...]


def adjust(
    state: BundleState,
    pixels: FloatArray,
    priors: Priors,
    places: FloatArray | None = None,
    shifts: FloatArray | None = None,
    sigmas: FloatArray | None = None,
) -> Adjustment:
    """Run the adjustment; release priors that the images contradict.

    Parameters
    ----------
    state : BundleState
        Start, with the parameters of the files.
    pixels : (N, C, L, 2) array
        Ellipse centres of the LEDs, px; NaN where an LED was not seen.
    places : (6 (C - 1),) array, optional
        Extrinsics at the start less those of the rig file, in the order of
        `Rig.covariance`, rad and mm.
    shifts : (N, k) array, optional
        Shifts of fixed lamps in view, px, along which the cone may drift.
    sigmas : (N, C, L) array, optional
        Standard deviation of each centre by its detector, px.

    Raises
    ------
    CalibrationError
        The iteration does not settle.
    """
    modes = seat_modes_of(state.rotations, shifts)
    fit = partial(fit_bundle, pixels, state, modes=modes, places=places)

    def consistent_fit(inflation: float) -> _ConsistentFit:
        return _fit_consistent(
            partial(fit, inflation=inflation), pixels, state, priors, sigmas
        )

    inflation = 1.0
    fitted = consistent_fit(inflation)
    if fitted.correlation.factor > RELATED:
        # Correlated noise contradicts a file by chance more often.
        inflation = fitted.correlation.factor
        fitted = consistent_fit(inflation)
    shrunk = shrunk_priors(fitted.bundle, fitted.priors)
    bundle = unshrunk = fitted.bundle
    if shrunk is not fitted.priors:
        same = bundle.unknowns
        bundle = fit(
            shrunk, inflation=inflation, effects=same.effects, noise=same.noise
        )
    components = fitted.correlation.components
    if components is not None:
        bundle = replace(bundle, budget_components=components)
        unshrunk = replace(unshrunk, budget_components=components)
    return Adjustment(
        *(bundle, unshrunk, fitted.priors, fitted.contradictions),
        *(fitted.correlation, fitted.effects),
    )


def _fit_consistent(
    fit: "partial[Bundle]",
    pixels: FloatArray,
    state: BundleState,
    priors: Priors,
    sigmas: FloatArray | None,
) -> _ConsistentFit:
    """Fit again and again, with contradicted numbers released, until none is left."""
    rig, bundle = state.rig, fit(priors)
    of_centers = None
    if sigmas is not None:
        of_centers = find_center_noise(bundle.residuals, bundle.used, sigmas)
    if of_centers is not None:
        fit = partial(fit, noise=of_centers)
        bundle = fit(priors)
    effects = search_effects(bundle, pixels, priors.compliance)
    candidates = tuple(each.effect for each in effects if each.is_candidate)
    if candidates:
        fit = partial(fit, effects=candidates)
        bundle = fit(priors)
    fit, bundle = _with_led_noise(fit, bundle, priors, of_centers)
    correlation = measure_correlation(bundle, pixels)
    inputs = ContradictedInputs(priors)
    for _ in range(MAX_RELEASES):
        now = find_contradicted_inputs(rig, bundle, priors, correlation.excess, inputs)
        if now.numbers == inputs.numbers:
            break
        inputs, bundle = now, fit(now.priors)
        correlation = measure_correlation(bundle, pixels)
    found = contradictions_of(rig, bundle, priors, correlation.excess, inputs)
    of_pen, released = find_pen_contradictions(
        state.pen, bundle, inputs.priors, correlation.excess
    )
    if of_pen:
        bundle = fit(released)
        correlation = measure_correlation(bundle, pixels)
    return _ConsistentFit(bundle, correlation, released, found + of_pen, effects)


def _with_led_noise(
    fit: "partial[Bundle]",
    bundle: Bundle,
    priors: Priors,
    of_centers: FloatArray | None,
) -> tuple["partial[Bundle]", Bundle]:
    """Weigh each LED by its noise, where these differ, until it settles.

    ``of_centers`` (N, C, L) is that of single centres, if these differ.
    """
    known = np.ones_like(bundle.unknowns.noise) if of_centers is None else of_centers
    weights = np.ones(known.shape[1:])
    for _ in range(NOISE_ROUNDS):
        left = bundle.residuals / known[..., None]
        noise = find_led_noise(left, bundle.used, bundle.sigma, weights)
        if noise is None or np.abs(noise / weights - 1).max() < NOISE_SETTLED:
            break
        weights, fit = noise, partial(fit, noise=known * noise)
        bundle = fit(priors)
    return fit, bundle


def shrunk_priors(bundle: Bundle, priors: Priors) -> Priors:
    """Return priors with assumed intrinsics shrunk to the observed deviations.

    The standard deviation of the intrinsics in units of the assumed one is found by
    restricted maximum likelihood, equation (5) of method.md.
    """
    cameras = list(priors.cameras)
    for c, place in enumerate(bundle.layout.cameras):
        if not cameras[c].assumed:
            continue
        known = inverse(bundle.covariance[place, place])
        own = known - bundle.prior_information[place, place]
        right = known @ bundle.values[place]
        values, vectors = np.linalg.eigh(cameras[c].covariance)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        found = find_component(root.T @ own @ root, root.T @ right)
        ratio = max(found.sigma if found.exceeds(ALLOWED) else 0.0, MOST_SHRUNK)
        if ratio < 1:
            cameras[c] = Prior(ratio**2 * cameras[c].covariance, assumed=True)
    if all(new is old for new, old in zip(cameras, priors.cameras, strict=True)):
        return priors
    return replace(priors, cameras=tuple(cameras))
