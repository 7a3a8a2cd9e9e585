"""Tip and cone by a few poses, and distances of poses from them.

The equations are those of `estimation.pivot.pivot`, R_i tip_pen + t_i = cone_cam,
weighed by the covariances of the poses. Prior knowledge of the tip is added, so that a
second of hardly moving poses already gives the cone point.
"""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.pivot.pivot import (
    contact_matrix,
    contact_residuals,
    in_deviations,
    tip_covariances,
)
from lightpen.model.pen import Pen

NOMINAL_SIGMA = 3.0  # mm, of a tip about its design
UNKNOWN_SIGMA = 200.0  # mm, of a tip about the LEDs
CONE_SIGMA = 1e4  # mm, of the cone before anything is seen
SEATING = 0.01  # mm, by which the tip may move in a good cone


@dataclass(frozen=True, eq=False)
class Seat:
    """Tip and cone with their covariance."""

    tip_pen: FloatArray  # (3,), mm
    cone_cam: FloatArray  # (3,), mm
    covariance: FloatArray  # (6, 6), of (tip_pen, cone_cam), mm^2


def tip_prior(pen: Pen) -> tuple[FloatArray, float]:
    """Return the prior of the tip, (3,), mm, and its standard deviation."""
    if pen.nominal_tip is None:
        return pen.leds.mean(axis=0), UNKNOWN_SIGMA
    return pen.nominal_tip, NOMINAL_SIGMA


def fit_seat(
    pen: Pen, rotations: FloatArray, translations: FloatArray, covariances: FloatArray
) -> Seat:
    """Fit tip and cone to poses and to a prior of the tip; see `tip_distances`."""
    expected, sigma = tip_prior(pen)
    spread = tip_covariances(rotations, covariances, expected) + SEATING**2 * np.eye(3)
    A = contact_matrix(rotations)
    AtW = np.swapaxes(A, 1, 2) @ np.linalg.inv(spread)
    center = (rotations @ expected + translations).mean(axis=0)
    missing = center - (rotations @ expected + translations)
    prior = np.diag([sigma**-2] * 3 + [CONE_SIGMA**-2] * 3)
    H = (AtW @ A).sum(axis=0) + prior
    step = np.linalg.solve(H, (AtW @ missing[..., None]).sum(axis=0)[:, 0])
    return Seat(expected + step[:3], center + step[3:], np.linalg.inv(H))


def tip_offsets(
    seat: Seat, rotations: FloatArray, translations: FloatArray
) -> FloatArray:
    """Return the tip by each pose minus the cone, camera frame, (N, 3), mm."""
    return contact_residuals(rotations, translations, seat.tip_pen, seat.cone_cam)


def tip_distances(
    seat: Seat, rotations: FloatArray, translations: FloatArray, covariances: FloatArray
) -> FloatArray:
    """Return the distances (N,) of the tip from the cone, in standard deviations.

    They are 1.73 on average where the tip rests in the cone. The poses cam_from_pen are
    rotations (N, 3, 3) and translations (N, 3), mm; their covariances (N, 6, 6) are of
    (theta, dt), rad and mm.
    """
    offsets = tip_offsets(seat, rotations, translations)
    A = contact_matrix(rotations)
    spread = tip_covariances(rotations, covariances, seat.tip_pen)
    spread = spread + A @ seat.covariance @ np.swapaxes(A, 1, 2)
    return in_deviations(offsets, spread + SEATING**2 * np.eye(3))
