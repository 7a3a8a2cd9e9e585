"""The whole adjustment: contradicted priors, correlated noise and shrinkage.

Where a camera file states no uncertainty, the prior assumed in its place must allow for
a bad file. Where the images do not show the file to be off, its values are better than
an estimate from one swing. So the estimate uses the assumed prior shrunk to the
deviation that the images show (empirical Bayes); its uncertainty follows from the
unshrunk prior, and the shift of the estimate by shrinkage is a separate contribution.

Likewise mechanics of usual size have their prior in the uncertainty; the estimate
follows them where chance alone seldom makes them so much likelier than perfect ones.
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.bundle import Bundle, fit_bundle
from lightpen.estimation.bundle.component_search import find_components
from lightpen.estimation.bundle.components import NO_COMPONENTS
from lightpen.estimation.bundle.consistency_findings import (
    ContradictedInputs,
    Contradiction,
    contradictions_of,
    find_contradicted_inputs,
    find_pen_contradictions,
)
from lightpen.estimation.bundle.effect_search import SearchedEffect, search_effects
from lightpen.estimation.bundle.effects import (
    Effect,
    gain_of,
    is_supported,
    mechanics_of,
    prior_of,
)
from lightpen.estimation.bundle.led_noise import find_center_noise, find_led_noise
from lightpen.estimation.bundle.linearised import BundleState, views_at
from lightpen.estimation.bundle.noise_correlation import (
    Correlation,
    measure_correlation,
)
from lightpen.estimation.bundle.priors import Priors
from lightpen.estimation.bundle.seat_modes import axes_of_cone, seat_modes_of
from lightpen.estimation.statistics.variance_components import ALLOWED, find_component
from lightpen.model.information import inverse, symmetric_root

RELATED = 1.1  # times the variance of independent noise; less is not worth a new fit
MAX_RELEASES = 8  # rounds in which contradicted numbers are sought
NOISE_ROUNDS = 3  # in which noisy LEDs lose their weight
NOISE_SETTLED = 0.15  # of a noise; a weight may be off by that
MOST_SHRUNK = 0.01  # of an assumed standard deviation


@dataclass(frozen=True, eq=False)
class Adjustment:
    """An adjustment of tip, cone and all parameters of the files."""

    # Estimate, with assumed camera priors shrunk and without unlikely mechanics.
    bundle: Bundle
    unshrunk: Bundle  # the same with the priors as assumed
    whole: Bundle  # the same with all mechanics; its covariance is the uncertainty
    priors: Priors  # priors of ``unshrunk`` with contradicted numbers released
    contradictions: tuple[Contradiction, ...]
    correlation: Correlation
    # Lens and timing; candidates are unknowns of all three bundles.
    effects: tuple[SearchedEffect, ...]

    def shift_from(self, other: Bundle) -> FloatArray:
        """Return the change of (tip_pen, cone_rig) from another fit, (6,), mm."""
        one, there = self.bundle.state, other.state
        return np.concatenate(
            [one.tip_pen - there.tip_pen, one.cone_rig - there.cone_rig]
        )


@dataclass(frozen=True, eq=False)
class _ConsistentFit:
    """A fit with contradicted parameters released from their priors.

    Of the candidates, unlikely mechanics are held at 0.
    """

    bundle: Bundle
    correlation: Correlation
    priors: Priors
    contradictions: tuple[Contradiction, ...]
    effects: tuple[SearchedEffect, ...]
    candidates: tuple[Effect, ...]


def adjust(
    state: BundleState,
    pixels: FloatArray,
    priors: Priors,
    places: FloatArray | None = None,
    shifts: FloatArray | None = None,
    sigmas: FloatArray | None = None,
) -> Adjustment:
    """Run the adjustment; release priors that the images contradict.

    Raises `CalibrationError` if the iteration does not settle.

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
    bundle = unshrunk = whole = fitted.bundle
    correlation, same = fitted.correlation, bundle.unknowns
    again = partial(fit, inflation=inflation, noise=same.noise)
    if fitted.candidates != same.effects:
        whole = (
            with_effects(bundle, fitted.candidates)
            if correlation.components is None
            else again(fitted.priors, effects=fitted.candidates)
        )
        correlation = measure_correlation(whole, pixels)
    shrunk = shrunk_priors(bundle, fitted.priors)
    if shrunk is not fitted.priors:
        bundle = again(shrunk, effects=same.effects)
    components = correlation.components
    if components is not None:
        bundle = replace(bundle, budget_components=components)
        unshrunk = replace(unshrunk, budget_components=components)
        whole = replace(whole, budget_components=components)
    return Adjustment(
        *(bundle, unshrunk, whole, fitted.priors, fitted.contradictions),
        *(correlation, fitted.effects),
    )


def _fit_consistent(
    fit: "partial[Bundle]",
    pixels: FloatArray,
    state: BundleState,
    priors: Priors,
    sigmas: FloatArray | None,
) -> _ConsistentFit:
    """Fit again and again, with contradicted numbers released, until none is left."""
    rig, rotations = state.rig, state.rotations
    candidates = mechanics_of(
        views_at(state, pixels),
        rotations,
        axes_of_cone(rotations),
        state.pen.leds,
        priors.compliance,
    )
    held = tuple(each.at_zero for each in candidates)
    bundle = fit(priors, effects=held)
    of_centers = None
    if sigmas is not None:
        of_centers = find_center_noise(bundle.residuals, bundle.used, sigmas)
    if of_centers is not None:
        fit = partial(fit, noise=of_centers)
        bundle = fit(priors, effects=held)
    whole = with_effects(bundle, candidates)
    effects = search_effects(whole, pixels, bundle.values)
    found = tuple(each.effect for each in effects if each.is_candidate)
    if found:
        candidates += found
        bundle = fit(priors, effects=held + found)
        whole = with_effects(bundle, candidates)
    likely = likely_effects(whole)
    fit = partial(fit, effects=likely)
    if likely != bundle.unknowns.effects:
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
    of_files = contradictions_of(rig, bundle, priors, correlation.excess, inputs)
    of_pen, released = find_pen_contradictions(
        state.pen, bundle, inputs.priors, correlation.excess
    )
    if of_pen:
        bundle = fit(released)
        correlation = measure_correlation(bundle, pixels)
    return _ConsistentFit(
        *(bundle, correlation, released, of_files + of_pen, effects, candidates)
    )


def _with_led_noise(
    fit: "partial[Bundle]",
    bundle: Bundle,
    priors: Priors,
    of_centers: FloatArray | None,
) -> tuple["partial[Bundle]", Bundle]:
    """Weigh each LED by its noise, where these differ, until it settles.

    ``of_centers`` (N, C, L) is the noise of single centres, if these differ.
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


def with_effects(bundle: Bundle, effects: tuple[Effect, ...]) -> Bundle:
    """Return a fit with other priors of its effects, by one linear step.

    The residuals of the fit are kept.
    """
    unknowns = replace(bundle.unknowns, effects=effects)
    information, right = bundle.information + bundle.measured_information, bundle.right
    # Again, as other components may have absorbed the effects.
    components = NO_COMPONENTS._replace(jitter=bundle.components.jitter)
    components = components.with_no_effects(effects)
    components = find_components(unknowns, information, right, components)
    prior = unknowns.prior_information(components)
    covariance = inverse(information + prior)
    values = covariance @ (right + unknowns.prior_right(components))
    return replace(
        bundle,
        unknowns=unknowns,
        state=unknowns.moved(bundle.state, values, np.zeros(3)),
        values=values,
        components=components,
        budget_components=components,
        prior_information=prior,
        covariance=covariance,
    )


def likely_effects(bundle: Bundle) -> tuple[Effect, ...]:
    """Return the effects of a fit, mechanics held at 0 if the images deny them.

    An effect that they support on its own stays.
    """
    effects, places = bundle.unknowns.effects, bundle.layout.effects
    of_mechanics = [
        (effect, place)
        for effect, place, found in zip(
            effects, places, bundle.components.effects, strict=True
        )
        if effect.is_mechanical and not (effect.is_exact or found.is_supported)
    ]
    if not of_mechanics:
        return effects
    chosen, slices = zip(*of_mechanics, strict=True)
    at = np.concatenate([np.arange(place.start, place.stop) for place in slices])
    known = inverse(bundle.covariance[np.ix_(at, at)])
    S = known - bundle.prior_information[np.ix_(at, at)]
    right = known @ bundle.values[at]
    right -= bundle.unknowns.prior_right(bundle.components)[at]
    means = np.concatenate([effect.mean for effect in chosen])
    if is_supported(gain_of(S, right, prior_of(chosen), means)):
        return effects
    return tuple(effect.at_zero if effect in chosen else effect for effect in effects)


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
        root = symmetric_root(cameras[c].covariance)
        found = find_component(root @ own @ root, root @ right)
        ratio = max(found.sigma if found.exceeds(ALLOWED) else 0.0, MOST_SHRUNK)
        if ratio < 1:
            shrunk = ratio**2 * cameras[c].covariance
            cameras[c] = replace(cameras[c], covariance=shrunk)
    if all(new is old for new, old in zip(cameras, priors.cameras, strict=True)):
        return priors
    return replace(priors, cameras=tuple(cameras))
