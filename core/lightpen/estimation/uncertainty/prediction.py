"""Prediction of U during a swing, and of the U that more images can reach.

During a swing tip and cone are fitted with the parameters of the files held. U is that
of the whole budget all the same (`budget.contributions_of`), by one step of the bundle
adjustment about the joint fit. Correlated noise is left to the calibration.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.adjustment import shrunk_priors
from lightpen.estimation.bundle.bundle import Bundle, one_step
from lightpen.estimation.bundle.linearised import BundleState
from lightpen.estimation.bundle.priors import Priors, priors_of
from lightpen.estimation.bundle.unknowns import NO_COMPONENTS, find_components
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

ENDLESS = 100.0  # times the images, more than anyone takes


@dataclass(frozen=True)
class PredictedUncertainty:
    """U of a tip now, and with endless images."""

    # U (k = 2) along the weakest direction, mm; infinite until it is known.
    uncertainty: float = float("inf")
    # The same with endless images of this kind, mm: by files, form error, and errors of
    # centres that repeat with the posture.
    floor: float = 0.0
    n_images: int = 0  # that it is predicted by


UNKNOWN_UNCERTAINTY = PredictedUncertainty()


def predict_uncertainty(
    rig: Rig,
    pen: Pen,
    pixels: FloatArray,
    joint: JointFit,
    sigma: float,
    assumed: Assumptions,
) -> PredictedUncertainty:
    """Predict U of the tip by the images of a swing.

    Parameters
    ----------
    pixels : (N, C, L, 2) array
        Of each camera, px; NaN where an LED was not seen.
    joint : JointFit
        The fit to them.
    sigma : float
        Noise of one image coordinate, px.
    """
    state = BundleState(rig, pen, joint.tip_pen, joint.cone_cam, joint.rotations)
    priors = priors_of(rig, pen, assumed)
    used = joint.used.reshape(pixels.shape[:-1])
    bundle = one_step(pixels, state, priors, used, sigma)
    shrunk = shrunk_priors(bundle, priors)
    if shrunk is not priors:
        bundle = _with_priors(bundle, shrunk)
    n_images = int(used.any(axis=(1, 2)).sum())
    now = contributions_of(bundle, n_images, bundle.independent_noise)
    endless = contributions_of(_with_endless_images(bundle), n_images, np.zeros((6, 6)))
    lasting = [each for each in endless if each.name not in IMAGES_SHRINK]
    share = min(n_images / POSTURES, 1.0)  # of the errors that do not average out
    centers = share * center_errors(bundle, n_images)
    lasting.append(UncertaintyContribution(ContributionName.LENS, centers))
    return PredictedUncertainty(_weakest(now), _weakest(lasting), len(pixels))


def _with_priors(bundle: Bundle, priors: Priors) -> Bundle:
    """Return the adjustment after a single step with other priors."""
    unknowns = replace(bundle.unknowns, priors=priors)
    information, right = bundle.information, bundle.right
    components = find_components(unknowns, information, right, bundle.components)
    prior = unknowns.prior_information(components)
    covariance = inverse(information + prior)
    return replace(
        bundle,
        unknowns=unknowns,
        components=components,
        budget_components=components,
        values=covariance @ (right + unknowns.prior_right()),
        prior_information=prior,
        covariance=covariance,
    )


def _with_endless_images(bundle: Bundle) -> Bundle:
    """Return the adjustment with endless images of the same kind."""
    information = ENDLESS * bundle.information
    nothing = np.zeros_like(information)
    components = NO_COMPONENTS.with_no_fields(bundle.unknowns.fields)
    prior = bundle.unknowns.prior_information(components)
    return replace(
        bundle,
        components=components,
        budget_components=components,
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
