"""Prediction of U during a swing, and of the U that more images can reach.

During a swing tip and cone are fitted with the parameters of the files held. U is that
of the whole budget all the same (`budget.contributions_of`), by one step of the bundle
adjustment about the joint fit: its normal equations are kept, and a new image adds its
own. What fields of the images may add is searched for when all images are linearised
again, as it needs the LEDs one by one. Correlated noise is left to the calibration.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import sqrt
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.adjustment import (
    SearchedField,
    search_fields,
    shrunk_priors,
)
from lightpen.estimation.bundle.bundle import Bundle, jitter_matrices, jitter_of
from lightpen.estimation.bundle.component_search import find_components
from lightpen.estimation.bundle.image_fields import seat_modes_of
from lightpen.estimation.bundle.linearised import (
    N_CONE,
    BundleState,
    NormalEquations,
    eliminate,
    views_at,
)
from lightpen.estimation.bundle.priors import Priors, priors_of
from lightpen.estimation.bundle.unknowns import NO_COMPONENTS, Unknowns
from lightpen.estimation.contact.joint import JointFit
from lightpen.estimation.uncertainty.budget import (
    IMAGES_SHRINK,
    POSTURES,
    ContributionName,
    UncertaintyContribution,
    center_errors,
    contributions_of,
)
from lightpen.model.coverage import COVERAGE_FACTOR, inverse
from lightpen.model.limits import Assumptions
from lightpen.model.pen import Pen
from lightpen.model.rigid import Rig

T = TypeVar("T", bound=np.generic)

SEAT_ROUNDS = 2  # in which the jitter of the seat is found beside other errors
GROWTH = 1.1  # of the number of images, after which all are linearised again
ENDLESS = 100.0  # times the images, more than anyone takes


@dataclass(frozen=True)
class PredictedUncertainty:
    """U of a tip now, and with endless images."""

    # U (k = 2) along the weakest direction, mm; infinite until it is known.
    uncertainty: float = float("inf")
    # The same with endless images of this kind, mm: by files, form error, and errors of
    # centres that repeat with the posture.
    floor: float = 0.0


UNKNOWN_UNCERTAINTY = PredictedUncertainty()


@dataclass(frozen=True, eq=False)
class UncertaintyPrediction:
    """Normal equations of the images of a swing."""

    state: BundleState  # about which the equations are, with the rotation of each image
    equations: NormalEquations  # for a noise of 1 px
    n_whole: int  # images that were linearised together
    fields: tuple[SearchedField, ...] = ()  # as far as these images determine them
    # Contributions that remain with endless images of this kind.
    lasting: tuple[UncertaintyContribution, ...] = ()

    @property
    def n_images(self) -> int:
        """Number of images."""
        return len(self.state.rotations)

    def predicted(
        self, joint: JointFit, sigma: float, assumed: Assumptions
    ) -> PredictedUncertainty:
        """Predict U of the tip by the fit to these images, of noise ``sigma``, px."""
        bundle = self._adjusted(joint, sigma, assumed)
        n_images = int(joint.used.any(axis=1).sum())
        now = contributions_of(bundle, n_images, bundle.independent_noise, self.fields)
        share = min(n_images / POSTURES, 1.0)  # of the errors that do not average out
        centers = UncertaintyContribution(
            ContributionName.LENS, share * center_errors(bundle, n_images)
        )
        return PredictedUncertainty(_weakest(now), _weakest([*self.lasting, centers]))

    def _with_fields(
        self, pixels: FloatArray, joint: JointFit, sigma: float, assumed: Assumptions
    ) -> "UncertaintyPrediction":
        """Search images, pixels (N, C, L, 2), for fields and what lasts."""
        bundle = self._adjusted(joint, sigma, assumed)
        there = replace(bundle, values=np.zeros_like(bundle.values))
        fields = search_fields(there, pixels)
        endless = _with_endless_images(bundle)
        at_last = contributions_of(endless, self.n_whole, np.zeros((6, 6)))
        lasting = tuple(each for each in at_last if each.name not in IMAGES_SHRINK)
        return replace(self, fields=fields, lasting=lasting)

    def _adjusted(self, joint: JointFit, sigma: float, assumed: Assumptions) -> Bundle:
        state = self.state
        priors = priors_of(state.rig, state.pen, assumed)
        unknowns = Unknowns.of(state, priors, seat_modes_of(state.rotations))
        equations = _weighed(self.equations, sigma)
        bundle = _linear_bundle(unknowns, equations, joint, sigma)
        shrunk = shrunk_priors(bundle, priors)
        return bundle if shrunk is priors else _with_priors(bundle, shrunk)


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
        equations = _linearised(state, pixels, joint, 0)
        whole = UncertaintyPrediction(state, equations, n_images)
        return whole._with_fields(pixels, joint, sigma, assumed)
    fresh = _linearised(state, pixels, joint, before.n_images)
    return UncertaintyPrediction(
        replace(before.state, rotations=joint.rotations),
        _joined(before.equations, _moved(fresh, state, before.state)),
        *(before.n_whole, before.fields, before.lasting),
    )


def _linearised(
    state: BundleState, pixels: FloatArray, joint: JointFit, first: int
) -> NormalEquations:
    """Return the equations of the images from the first on."""
    state = replace(state, rotations=state.rotations[first:])
    used = _by_camera(joint.used[first:], state.rig.n_cameras)
    return eliminate(views_at(state, pixels[first:]), used, 1.0)


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
    # LEDs may have been accepted since they were linearised.
    seen = np.trace(equations.cone_rows[..., :N_CONE], axis1=1, axis2=2) > 0
    spread = unknowns.sensitivity(equations.cone_rows)
    alone = information, right = unknowns.system(equations)
    components = NO_COMPONENTS
    for _ in range(SEAT_ROUNDS):
        # The jitter first: without it, other errors would absorb it.
        covariance = inverse(information + unknowns.prior_information(components))
        change = covariance @ (right + unknowns.prior_right())
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
        values=covariance @ (right + unknowns.prior_right()),
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
    """Return equations with a seat of covariance (3, 3), mm^2, between images."""
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


def _with_priors(bundle: Bundle, priors: Priors) -> Bundle:
    """Return the adjustment after a single step with other priors."""
    unknowns = replace(bundle.unknowns, priors=priors)
    prior = unknowns.prior_information(bundle.components)
    covariance = inverse(bundle.information + prior)
    return replace(
        bundle,
        unknowns=unknowns,
        values=covariance @ (bundle.right + unknowns.prior_right()),
        prior_information=prior,
        covariance=covariance,
    )


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
