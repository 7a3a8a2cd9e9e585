"""Whether the camera moved during a session: a witness touched before and after.

The witness is a cone that stands still, touched at the start, at the end and as often
in between as one likes. What tip, LEDs and camera have wrong moves all visits alike
where the pen is held alike, so that it hardly counts in a difference. What the witness
moved by is counted into points that were measured in between as a rectangular
distribution of that half-width [1]_.

References
----------
.. [1] JCGM 100:2008, "Guide to the expression of uncertainty in measurement", 4.3.7.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.instrument import Instrument
from lightpen.estimation.uncertainty import COVERAGE_FACTOR
from lightpen.model.limits import VerificationLimits
from lightpen.sentences import sentence
from lightpen.verification.assessment import (
    VERIFY_AGAIN,
    Conformity,
    accepted,
    check,
    refused,
)
from lightpen.verification.touch import Touch, mean_point

MIN_VISITS = 2
ALONG = 3.0  # times the limit, that U may be along the view, as of a fixed point
TOUCH_LONGER = sentence(
    "drift.touch-longer",
    "Next: hold the pen alike at each visit, take more images of a touch, or bring the "
    "camera nearer.",
)
USE_TOUCHES = sentence(
    "drift.use-touches", "Next: use what was touched between the visits."
)


@dataclass(frozen=True, eq=False)
class Drift:
    """A witness visited several times.

    Attributes
    ----------
    names : tuple of str
        Of the visits.
    moves : (N, 3) array
        Of the witness since the first visit, camera frame, mm.
    uncertainties : (N, 3) array
        U (k = 2) of each, mm.
    """

    names: tuple[str, ...]
    moves: FloatArray
    uncertainties: FloatArray
    assessment: Conformity

    @property
    def share(self) -> FloatArray:
        """Standard uncertainty by it of a point measured meanwhile, (3,), mm."""
        return np.asarray(np.abs(self.moves).max(axis=0) / np.sqrt(3))


def measure_drift(
    visits: Sequence[tuple[str, Sequence[Touch]]],
    instrument: Instrument,
    limits: VerificationLimits,
) -> Drift:
    """Measure how a witness moves from visit to visit.

    Parameters
    ----------
    visits : sequence of (str, sequence of Touch)
        Name and touches of each, in the order of time.

    Raises
    ------
    CalibrationError
        There are fewer than two visits.
    """
    if len(visits) < MIN_VISITS:
        raise CalibrationError(
            sentence(
                "drift.too-few",
                "The witness was visited once, which tells nothing of a drift. Touch "
                "it before, during and after the session.",
            )
        )
    first, *others = [mean_point(touches) for _, touches in visits]
    moves = np.array([each.point_cam - first.point_cam for each in (first, *others)])
    variances = np.zeros_like(moves)
    for i, each in enumerate(others, start=1):
        row = each.sensitivity - first.sensitivity
        shared = row @ instrument.covariance @ row.T
        variances[i] = np.diag(shared + each.noise + first.noise)
    uncertainties = COVERAGE_FACTOR * np.sqrt(variances)
    names = tuple(name for name, _ in visits)
    return Drift(
        names=names,
        moves=moves,
        uncertainties=uncertainties,
        assessment=_assessment(names, moves, uncertainties, limits),
    )


def _assessment(
    names: tuple[str, ...],
    moves: FloatArray,
    uncertainties: FloatArray,
    limits: VerificationLimits,
) -> Conformity:
    lengths = np.linalg.norm(moves, axis=1)
    worst = int(np.argmax(lengths))
    axis = int(np.argmax(np.abs(moves[worst])))
    distance, uncertainty = float(lengths[worst]), float(uncertainties[worst, axis])
    if distance > max(limits.drift, uncertainty):
        return refused(
            sentence(
                "drift.moved",
                "The witness moved by {distance:.4f} mm between {first} and {visit} (U "
                "{uncertainty:.4f} mm, limit {limit:.4f} mm): the camera or the "
                "witness is not clamped, or the camera was not warm yet. What was "
                "measured in between is off by as much.",
                first=names[0],
                visit=names[worst],
                distance=distance,
                uncertainty=uncertainty,
                limit=limits.drift,
            ),
            VERIFY_AGAIN,
        )
    across, along = uncertainties[:, :2].max(), uncertainties[:, 2].max()
    largest = float(max(across, along / ALONG))
    if max(largest, distance) > limits.drift:
        return check(
            sentence(
                "drift.uncertain",
                "The witness stays within {distance:.4f} mm, but U of it is "
                "{uncertainty:.4f} mm, more than the limit of {limit:.4f} mm: a move "
                "of that size would not show.",
                distance=distance,
                uncertainty=float(uncertainties.max()),
                limit=limits.drift,
            ),
            TOUCH_LONGER,
        )
    return accepted(
        sentence(
            "drift.good",
            "The witness stays within {distance:.4f} mm (U {uncertainty:.4f} mm, limit "
            "{limit:.4f} mm).",
            distance=distance,
            uncertainty=uncertainty,
            limit=limits.drift,
        ),
        USE_TOUCHES,
    )
