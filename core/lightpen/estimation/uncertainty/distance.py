"""Repeatability of the distance of the cone from swing to swing.

If the pen has expanded, all distances appear smaller: ``w / f``, the depth of the cone
over the focal length, shows the expansion between two swings at one place. Errors of
the files are common to all swings and cancel. What remains varies from swing to swing:
noise, errors of centres that repeat with the posture, seat and drift. Its variance is
``c P I P c^T``, with the covariance P of the unknowns, the derivative c of
``log(w / f)`` and the information I of these errors, equations (15), (17) and (18) of
method.md.
"""

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.bundle import Bundle
from lightpen.estimation.bundle.priors import Priors
from lightpen.estimation.uncertainty.budget import (
    POSTURES,
    Budget,
    drift_variance,
    seat_covariance,
)


def distance_repeatability(bundle: Bundle, budget: Budget, priors: Priors) -> float:
    """Return the relative standard deviation of ``w / f`` from swing to swing.

    Of the first camera.
    """
    at, state = bundle.layout, bundle.state
    row = np.zeros(len(bundle.covariance))
    row[at.cone.stop - 1] = 1 / state.cone_rig[2]
    row[at.cameras[0].start] = -1 / state.rig.cameras[0].fx
    gain = row @ bundle.covariance
    n_images = int(bundle.used.any(axis=(1, 2)).sum())
    independent = (bundle.sigma / bundle.weight_sigma) ** 2 * (
        bundle.information - bundle.jitter_information
    )
    biased = max(n_images / POSTURES, 1.0) * (priors.center_bias / bundle.sigma) ** 2
    shaken = bundle.jitter_information + bundle.insignificant_jitter
    information = (budget.correlation_factor + biased) * independent + shaken
    n_drift = at.drift.stop - at.drift.start
    return float(
        np.sqrt(
            gain @ information @ gain
            + _of_moves(bundle, gain, at.whole_seat, seat_covariance(bundle))
            + _of_moves(
                bundle, gain, at.drift, drift_variance(bundle) * np.eye(n_drift)
            )
        )
    )


def _of_moves(
    bundle: Bundle, gain: FloatArray, at: slice, covariance: FloatArray
) -> float:
    """Return the variance by moves of the seat with a covariance, mm^2."""
    follows = gain[at] @ bundle.prior_information[at, at]
    return float(follows @ covariance @ follows)
