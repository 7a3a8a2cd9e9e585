"""Prediction of U during a swing, and of the U that more images can reach.

During a swing tip and cone are fitted with the parameters of the files held. U is that
of the whole budget all the same (`budget.contributions_of`), by one step of the bundle
adjustment about the joint fit: its normal equations are kept, and a new image adds its
own. What lens, sag, loose stylus and camera tilt may add is searched for when all
images are linearised again, as it needs the LEDs one by one. Correlated noise is left
to the calibration.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import sqrt
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.adjustment import shrunk_priors
from lightpen.estimation.bundle.bundle import Bundle, jitter_matrices, jitter_of
from lightpen.estimation.bundle.component_search import find_components
from lightpen.estimation.bundle.components import NO_COMPONENTS
from lightpen.estimation.bundle.effect_search import (
    SearchedEffect,
    search_compliance,
    search_effects,
)
from lightpen.estimation.bundle.effects import EffectName
from lightpen.estimation.bundle.linearised import (
    N_CONE,
    BundleState,
    NormalEquations,
    eliminate,
    views_at,
)
from lightpen.estimation.bundle.priors import Priors, priors_of
from lightpen.estimation.bundle.seat_modes import seat_modes_of
from lightpen.estimation.bundle.unknowns import Unknowns
from lightpen.estimation.contact.joint import JointFit
from lightpen.estimation.uncertainty.budget import (
    COVERAGE_FACTOR,
    IMAGES_SHRINK,
    POSTURES,
    ContributionName,
    UncertaintyContribution,
    contributions_of,
)
from lightpen.model.assumptions import Assumptions
from lightpen.model.information import inverse
from lightpen.model.pen import Pen
from lightpen.model.rig import Rig

T = TypeVar("T", bound=np.generic)

SEAT_ROUNDS = 2  # in which the jitter of the seat is found beside other errors
GROWTH = 1.25  # of the number of images, after which all are linearised again
ENDLESS = 100.0  # times the images, more than anyone takes


@dataclass(frozen=True)
class PredictedUncertainty:
    """U of a tip now, and with endless images.

    Attributes
    ----------
    uncertainty : float
        U (k = 2) along the weakest direction, mm; infinite until it is known.
    floor : float
        The same with endless images of this kind, mm: by files, form error, and errors
        of centres that repeat with the posture.
    """

    uncertainty: float = float("inf")
    floor: float = 0.0


UNKNOWN_UNCERTAINTY = PredictedUncertainty()


@dataclass(frozen=True, eq=False)
class UncertaintyPrediction:
    """Normal equations of the images of a swing.

    Attributes
    ----------
    state : BundleState
        About which the equations are, with the rotation of each image.
    equations : NormalEquations
        For a noise of 1 px.
    n_whole : int
        Images that were linearised together.
    effects : tuple of SearchedEffect
        What these images leave open of the effects of a station, but for compliance.
    """

    state: BundleState
    equations: NormalEquations
    n_whole: int
    effects: tuple[SearchedEffect, ...] = ()

    def predicted(
        self, joint: JointFit, sigma: float, assumed: Assumptions
    ) -> PredictedUncertainty:
        """Predict U of the tip by these images.

        Parameters
        ----------
        joint : JointFit
            The fit to them.
        sigma : float
            Noise of one image coordinate, px.
        """
        priors, equations, bundle = self._adjusted(joint, sigma, assumed)
        shrinkage_shift = _shrinkage_shift_of(bundle, priors, equations)
        n_images = int(joint.used.any(axis=1).sum())
        noise = bundle.independent_noise
        jitter = bundle.components.jitter.covariance
        beside = equations if jitter is None else _with_jitter(equations, jitter)
        compliance = search_compliance(bundle, beside, priors.compliance)
        effects = (compliance, *self.effects)
        now = contributions_of(
            bundle, priors, n_images, noise, shrinkage_shift, effects
        )
        endless = _with_endless_images(bundle)
        nothing = np.zeros((6, 6))
        at_last = contributions_of(endless, priors, n_images, nothing, nothing[0])
        stays = [each for each in at_last if each.name not in IMAGES_SHRINK]
        share = min(n_images / POSTURES, 1.0)  # of what no longer averages out then
        stays += [
            replace(each, covariance=share * each.covariance)
            for each in now
            if each.name is ContributionName.CENTERS
        ]
        return PredictedUncertainty(_weakest(now), _weakest(stays))

    def _with_effects(
        self, pixels: FloatArray, joint: JointFit, sigma: float, assumed: Assumptions
    ) -> "UncertaintyPrediction":
        """Search images, pixels (N, C, L, 2), for the effects of a station."""
        priors, _, bundle = self._adjusted(joint, sigma, assumed)
        found = search_effects(
            bundle, pixels, priors.compliance, residuals_at=np.zeros_like(bundle.values)
        )
        effects = tuple(
            replace(each, is_candidate=False)
            for each in found
            if each.effect.name is not EffectName.COMPLIANCE
        )
        return replace(self, effects=effects)

    def _adjusted(
        self, joint: JointFit, sigma: float, assumed: Assumptions
    ) -> tuple[Priors, NormalEquations, Bundle]:
        state = self.state
        priors = priors_of(state.rig, state.pen, assumed)
        unknowns = Unknowns.of(state, priors, seat_modes_of(state.rotations))
        equations = _weighed(self.equations, sigma)
        return priors, equations, _linear_bundle(unknowns, equations, joint, sigma)


def predict_uncertainty(
    rig: Rig,
    pen: Pen,
    pixels: FloatArray,
    joint: JointFit,
    sigma: float,
    assumed: Assumptions,
    before: UncertaintyPrediction | None = None,
) -> UncertaintyPrediction:
    """Add images to a prediction.

    Parameters
    ----------
    pixels : (N, C, L, 2) array
        Of each camera, px; NaN where an LED was not seen.
    joint : JointFit
        The fit to them.
    sigma : float
        Noise of one image coordinate, px.
    before : UncertaintyPrediction or None
        Prediction for the first of these images.
    """
    n_images = len(pixels)
    state = BundleState(rig, pen, joint.tip_pen, joint.cone_cam, joint.rotations)
    if before is None or n_images > GROWTH * before.n_whole:
        whole = UncertaintyPrediction(
            state, _equations_of(state, pixels, joint, 0), n_images
        )
        return whole._with_effects(pixels, joint, sigma, assumed)
    n_before = len(before.state.rotations)
    fresh = _equations_of(state, pixels, joint, n_before)
    return UncertaintyPrediction(
        replace(before.state, rotations=joint.rotations),
        _joined(before.equations, _moved(fresh, state, before.state)),
        before.n_whole,
        before.effects,
    )


def _equations_of(
    state: BundleState, pixels: FloatArray, joint: JointFit, first: int
) -> NormalEquations:
    state = replace(state, rotations=state.rotations[first:])
    n_cameras = state.rig.n_cameras
    views = views_at(state, pixels[first:])
    return eliminate(views, _by_camera(joint.used[first:], n_cameras), 1.0)


def _by_camera(values: npt.NDArray[T], n_cameras: int) -> npt.NDArray[T]:
    """Split values (N, C L, ...) of the LEDs by cameras, (N, C, L, ...)."""
    return values.reshape(len(values), n_cameras, -1, *values.shape[2:])


def _moved(
    each: NormalEquations, now: BundleState, there: BundleState
) -> NormalEquations:
    """Return equations about the tip and the cone of another state."""
    step = np.zeros(len(each.b))
    step[:N_CONE] = now.cone_rig - there.cone_rig
    step[-3 * now.pen.n_leds :] = np.tile(there.tip_pen - now.tip_pen, now.pen.n_leds)
    return replace(
        each,
        b=each.b + each.N @ step,
        cone_right=each.cone_right + each.cone_rows @ step,
    )


def _joined(one: NormalEquations, other: NormalEquations) -> NormalEquations:
    return NormalEquations(
        one.N + other.N,
        one.b + other.b,
        np.concatenate([one.cone_rows, other.cone_rows]),
        np.concatenate([one.cone_right, other.cone_right]),
    )


def _weighed(each: NormalEquations, sigma: float) -> NormalEquations:
    """Return equations of a noise of 1 px for another, px."""
    weight = sigma**-2
    return NormalEquations(
        weight * each.N,
        weight * each.b,
        weight * each.cone_rows,
        weight * each.cone_right,
    )


def _linear_bundle(
    unknowns: Unknowns, equations: NormalEquations, joint: JointFit, sigma: float
) -> Bundle:
    """Return the bundle adjustment after a single step."""
    # LEDs that count by now may not have done so when they were counted.
    seen = np.trace(equations.cone_rows[..., :N_CONE], axis1=1, axis2=2) > 0
    spread = unknowns.sensitivity(equations.cone_rows)
    alone = information, right = unknowns.system(equations)
    components = NO_COMPONENTS
    for _ in range(SEAT_ROUNDS):
        # The jitter first: without it, what other errors there are take it up.
        covariance = inverse(information + unknowns.prior_information(components))
        change = covariance @ right
        jitter = jitter_of(unknowns, equations, spread, seen, change, covariance)
        information, right = (
            alone
            if jitter.covariance is None
            else unknowns.system(_with_jitter(equations, jitter.covariance))
        )
        components = components._replace(jitter=jitter)
        components = find_components(unknowns, information, right, components)
        if jitter.covariance is None:
            break
    prior = unknowns.prior_information(components)
    covariance = inverse(information + prior)
    n_cameras = unknowns.start.rig.n_cameras
    rows = spread
    if jitter.covariance is not None:
        own = equations.cone_rows[..., :N_CONE] + np.linalg.inv(jitter.covariance)
        rows = np.linalg.inv(own) @ spread
    significant, insignificant = jitter_matrices(jitter, rows)
    return Bundle(
        unknowns=unknowns,
        state=unknowns.start,
        values=covariance @ right,
        components=components,
        budget_components=components,
        residuals=_by_camera(joint.residuals, n_cameras),
        used=_by_camera(joint.used, n_cameras),
        sigma=sigma,
        information=information,
        prior_information=prior,
        measured_information=np.zeros_like(information),
        jitter_information=significant,
        insignificant_jitter=insignificant,
        weight_sigma=sigma,
        covariance=covariance,
    )


def _with_jitter(each: NormalEquations, jitter: FloatArray) -> NormalEquations:
    """Return equations with a seat that varies between images.

    Parameters
    ----------
    jitter : (3, 3) array
        Covariance of the seat from image to image, mm^2.
    """
    gain = np.linalg.inv(each.cone_rows[..., :N_CONE] + np.linalg.inv(jitter))
    rows, right = each.cone_rows, each.cone_right
    left = np.eye(N_CONE) - rows[..., :N_CONE] @ gain
    by_seat = gain @ rows
    return NormalEquations(
        each.N - np.tensordot(rows, by_seat, axes=([0, 1], [0, 1])),
        each.b - np.einsum("nik,ni->k", by_seat, right),
        left @ rows,
        np.einsum("nij,nj->ni", left, right),
    )


def _shrinkage_shift_of(
    bundle: Bundle, priors: Priors, equations: NormalEquations
) -> FloatArray:
    """Return the change of (tip, cone) by shrinkage of assumed priors, (6,), mm."""
    held = shrunk_priors(bundle, priors)
    if held is priors:
        return np.zeros(6)
    unknowns = replace(bundle.unknowns, priors=held)
    information, right = unknowns.system(equations)
    prior = unknowns.prior_information(bundle.components)
    return np.asarray((inverse(information + prior) @ right - bundle.values)[:6])


def _with_endless_images(bundle: Bundle) -> Bundle:
    """Return the adjustment with endless images of the same kind."""
    information = ENDLESS * bundle.information
    nothing = np.zeros_like(information)
    prior = bundle.unknowns.prior_information(NO_COMPONENTS)
    return replace(
        bundle,
        components=NO_COMPONENTS,
        budget_components=NO_COMPONENTS,
        information=information,
        prior_information=prior,
        jitter_information=nothing,
        insignificant_jitter=nothing,
        covariance=inverse(information + prior),
    )


def _weakest(shares: Sequence[UncertaintyContribution]) -> float:
    """Return U (k = 2) of the tip along its weakest direction, mm."""
    covariance = sum((share.covariance[:3, :3] for share in shares), np.zeros((3, 3)))
    return COVERAGE_FACTOR * sqrt(float(np.linalg.eigvalsh(covariance)[-1]))
