"""The whole adjustment: files that the images deny, noise that lasts, doubt.

Where a camera file states no uncertainty, the assumption must allow for a bad file. A
file that the images do not show to be off at all is then better than what one swing
makes of it: the estimate keeps to it as far as the images have it right (empirical
Bayes). So it is with a seat or a drift that is likely but not certain. The uncertainty
stays that of all that is allowed, and holds what holding back changed.
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle import Bundle, fit_bundle
from lightpen.estimation.contradictions import (
    Contradiction,
    Denied,
    contradictions_of,
    deny,
    find_pen_contradictions,
)
from lightpen.estimation.information import inverse
from lightpen.estimation.linearised import BundleState
from lightpen.estimation.noise_correlation import Correlation, measure_correlation
from lightpen.estimation.priors import Prior, Priors
from lightpen.estimation.seat_forms import forms_of
from lightpen.estimation.variance_components import COUNTED, find_component

RELATED = 1.1  # times the variance of independent noise; less is not worth a new fit
MAX_DENIED = 8  # times that it is looked at anew what is to be let go
HELD = 0.01  # of what is assumed of a camera, where its images show nothing of it


@dataclass(frozen=True, eq=False)
class Adjustment:
    """An adjustment of all that the files may have wrong.

    Attributes
    ----------
    bundle : Bundle
        The estimate.
    allowed : Bundle
        The same with all that is assumed allowed; its covariance counts.
    priors : Priors
        Of ``allowed``, without what the images contradict.
    """

    bundle: Bundle
    allowed: Bundle
    priors: Priors
    contradictions: tuple[Contradiction, ...]
    correlation: Correlation

    @property
    def held_back(self) -> FloatArray:
        """What holding back from what is allowed changed in tip and cone, (6,), mm."""
        one, other = self.bundle.state, self.allowed.state
        return np.concatenate(
            [one.tip_pen - other.tip_pen, one.cone_rig - other.cone_rig]
        )


def adjust(
    state: BundleState,
    pixels: FloatArray,
    priors: Priors,
    places: FloatArray | None = None,
    shifts: FloatArray | None = None,
) -> Adjustment:
    """Adjust all that the files may have wrong; let go what the images contradict.

    Parameters
    ----------
    state : BundleState
        With the files held as they are.
    pixels : (N, C, L, 2) array
        Ellipse centres of the LEDs, px; NaN where an LED was not seen.
    places : (6 (C - 1),) array, optional
        By which the cameras stood off the file of the rig where the state was found,
        in the order of `Rig.covariance`.
    shifts : (N, k) array, optional
        Ways that fixed lamps in view go, px, along which the cone may drift.

    Raises
    ------
    CalibrationError
        The iteration does not settle.
    """
    rig = state.rig
    forms = forms_of(state.rotations, shifts)
    fit = partial(fit_bundle, pixels, state, forms=forms, places=places)

    def measured(priors: Priors, factor: float) -> tuple[Bundle, Correlation]:
        bundle = fit(priors, inflation=factor)
        return bundle, measure_correlation(bundle, pixels)

    def all_allowed(
        factor: float,
    ) -> tuple[Bundle, tuple[Contradiction, ...], Priors, Correlation]:
        bundle, correlation = measured(priors, factor)
        denied = Denied(priors)
        for _ in range(MAX_DENIED):
            now = deny(rig, bundle, priors, correlation.excess, denied)
            if now.numbers == denied.numbers:
                break
            denied = now
            bundle, correlation = measured(denied.priors, factor)
        found = contradictions_of(rig, bundle, priors, correlation.excess, denied)
        freed = denied.priors
        of_pen, freed = find_pen_contradictions(
            state.pen, bundle, freed, correlation.excess
        )
        if of_pen:
            bundle, correlation = measured(freed, factor)
        return bundle, found + of_pen, freed, correlation

    factor = 1.0
    allowed, contradictions, freed, correlation = all_allowed(factor)
    if correlation.factor > RELATED:
        # Noise that lasts contradicts a file by chance more often.
        factor = correlation.factor
        allowed, contradictions, freed, correlation = all_allowed(factor)
    held = held_to_files(allowed, freed)
    bundle = allowed
    if held is not freed:
        bundle = fit(held, inflation=factor)
    if correlation.components is not None:
        bundle = replace(bundle, counted=correlation.components)
        allowed = replace(allowed, counted=correlation.components)
    return Adjustment(bundle, allowed, freed, contradictions, correlation)


def held_to_files(bundle: Bundle, priors: Priors) -> Priors:
    """Return priors that allow an assumed camera no more than its images show."""
    cameras = list(priors.cameras)
    for c, place in enumerate(bundle.columns.cameras):
        if not cameras[c].assumed:
            continue
        known = inverse(bundle.covariance[place, place])
        own = known - bundle.prior_information[place, place]
        right = known @ bundle.values[place]
        values, vectors = np.linalg.eigh(cameras[c].covariance)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        found = find_component(root.T @ own @ root, root.T @ right)
        share = max(found.sigma if found.gain > COUNTED else 0.0, HELD)
        if share < 1:
            cameras[c] = Prior(share**2 * cameras[c].covariance, assumed=True)
    if all(new is old for new, old in zip(cameras, priors.cameras, strict=True)):
        return priors
    return replace(priors, cameras=tuple(cameras))
