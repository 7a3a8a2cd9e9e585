"""How well the distance of the cone repeats from swing to swing.

A pen that grew makes all distances come out smaller: ``w / f``, the depth of the cone
over the focal length, tells the growth between two swings at one place. The errors of
the files move all swings alike and cancel. What remains is of each swing: noise, errors
of centres that repeat with the posture, seat and drift. With the unknowns' covariance P
and the derivative c of ``log(w / f)`` it is ``c P I P c^T``, I the information that
these bring, equations (15), (17) and (18) of method.md.
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
