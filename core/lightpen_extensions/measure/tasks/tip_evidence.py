"""The error of the tip by points in one cone, and the pen's scale by lengths."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from math import inf
from typing import Any

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.comparisons.assessment import (
    CALIBRATE_AGAIN,
    RELEVANT,
    Scale,
    VerificationAssessment,
    check,
    refused,
)
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.messages import Message, message
from lightpen.model.coverage import COVERAGE_FACTOR, Decision, chi_square_quantile
from lightpen.model.limits import VerificationLimits
from lightpen_extensions.measure.measuring.part import MeasuredPart
from lightpen_extensions.measure.measuring.plan import CharacteristicKind
from lightpen_extensions.measure.tasks.probed_point import ProbedPoint, joint_covariance

BY_CHANCE = 0.01  # probability that a correct tip looks wrong
MISSED = 0.05  # probability that an error of the stated size is missed
TIP_SIGMA = 3.0  # mm, by which another tip may differ
LARGEST = 1.0  # mm; least detectable error above which there is no evidence


@dataclass(frozen=True, eq=False)
class TipEvidence:
    """The evidence of points on the tip."""

    change: FloatArray  # (3,), required less given tip, pen frame, mm
    covariance: FloatArray  # (3, 3), of the change of a correct tip, mm^2
    is_significant: bool  # whether it is more than chance
    detectable: float  # found with 95 % probability, mm; inf if never

    @property
    def uncertainty(self) -> FloatArray:
        """U (k = 2) of the change, (3,), mm."""
        return np.asarray(COVERAGE_FACTOR * np.sqrt(np.diag(self.covariance)))

    @property
    def known_change(self) -> FloatArray:
        """The component of the change that is known best for its size, (3,), mm.

        It lies along ``C^-1 d``, the direction in which the change is most standard
        deviations long; what the points do not determine is left out.
        """
        along = np.linalg.solve(self.covariance, self.change)
        squared = max(float(along @ along), np.finfo(float).tiny)
        return np.asarray(along * (float(along @ self.change) / squared))

    @property
    def known_uncertainty(self) -> float:
        """U (k = 2) of the length of that component, mm."""
        along = np.linalg.solve(self.covariance, self.change)
        along /= max(float(np.linalg.norm(along)), np.finfo(float).tiny)
        return COVERAGE_FACTOR * float(np.sqrt(along @ self.covariance @ along))

    def verifies_tip(self, limits: VerificationLimits) -> bool:
        """Return whether an error as large as the limit would be found."""
        return self.detectable <= limits.tip


def points_evidence(
    points: Sequence[ProbedPoint], instrument: Instrument, drift: FloatArray
) -> TipEvidence:
    """Return the evidence of points in one cone on the tip.

    ``drift`` (3,) is the standard uncertainty of a point by a camera that moved, mm.
    """
    n = len(points)
    places = np.array([point.point_cam for point in points])
    residuals = (places - places.mean(axis=0)).ravel()
    A = -np.concatenate([point.rotation for point in points])
    spread = joint_covariance(points, instrument) + np.diag(np.tile(drift**2, n))
    by_cone = np.tile(np.eye(3), (n, 1))
    W = np.linalg.inv(spread)
    WB = W @ by_cone
    W = W - WB @ np.linalg.solve(by_cone.T @ WB, WB.T)
    covariance = np.linalg.inv(A.T @ W @ A + np.eye(3) / TIP_SIGMA**2)
    change = covariance @ (A.T @ W @ residuals)
    left = residuals - A @ change
    n_free = max(len(residuals) - 6, 1)
    excess = float(left @ W @ left) / n_free
    if excess > chi_square_quantile(n_free, BY_CHANCE) / n_free:
        covariance = covariance * excess
    distance = float(change @ np.linalg.solve(covariance, change))
    return TipEvidence(
        change=change,
        covariance=covariance,
        is_significant=distance > chi_square_quantile(3, BY_CHANCE),
        detectable=_detectable(covariance),
    )


def _detectable(covariance: FloatArray) -> float:
    worst = float(np.sqrt(np.linalg.eigvalsh(covariance)[-1]))
    found = worst * _detected_deviations()
    return found if found < LARGEST else inf


@cache
def _detected_deviations() -> float:
    """Return the smallest detectable tip error in standard deviations."""
    from scipy.special import chndtrinc

    gate = chi_square_quantile(3, BY_CHANCE)
    return float(np.sqrt(chndtrinc(gate, 3, MISSED)))


def judged_tip(
    found: TipEvidence, limits: VerificationLimits
) -> VerificationAssessment | None:
    """Return the finding against the tip; None without one."""
    change, uncertainty = found.known_change, found.known_uncertainty
    distance = float(np.linalg.norm(change))
    if not found.is_significant or distance <= RELEVANT * limits.tip:
        return None
    x, y, z = change.tolist()
    if limits.decision(distance, uncertainty, limits.tip) is Decision.REJECTED:
        another = message(
            "tip.another",
            x=x,
            y=y,
            z=z,
            distance=distance,
            uncertainty=uncertainty,
            limit=limits.tip,
        )
        return refused(another, CALIBRATE_AGAIN)
    differs = message(
        "tip.differs",
        x=x,
        y=y,
        z=z,
        distance=distance,
        uncertainty=uncertainty,
        limit=limits.tip,
    )
    return check(differs, CALIBRATE_AGAIN)


def not_the_tip(found: TipEvidence, limits: VerificationLimits) -> Message:
    """Return the message that points cannot detect a tip error within the limit."""
    if found.detectable < inf:
        return message("tip.weak-power", detectable=found.detectable, limit=limits.tip)
    return message("tip.no-power", limit=limits.tip)


def tip_entries(found: TipEvidence) -> dict[str, Any]:
    """Return the entries of the evidence of points on the tip in a record."""
    return {
        "tip_change_mm": found.change,
        "tip_change_expanded_uncertainty_mm": found.uncertainty,
        "wants_other_tip": found.is_significant,
        "detectable_tip_error_mm": (
            found.detectable if found.detectable < inf else None
        ),
    }


# The scale of the pen by certified lengths.
#
# An error of the pen's scale leaves no residual and moves nothing that stands still; a
# length shows it. So lengths, with their covariance, determine the scale.


def scale_of(
    part: MeasuredPart, points: Sequence[ProbedPoint], instrument: Instrument
) -> Scale | None:
    """Return the scale from prior and lengths (least squares); None without lengths."""
    lengths = [
        (each.value.value - (each.planned.nominal or 0.0), each.planned.certified, each)
        for each in part.results
        if each.planned.quantity is CharacteristicKind.LENGTH and each.quantity
    ]
    rows = [e.quantity.by_inputs[0] for *_, e in lengths if e.quantity is not None]
    known = np.array([u for _, u, _ in lengths if u is not None])
    if not rows or len(known) < len(rows):
        return None
    errors, by_inputs = np.array([error for error, *_ in lengths]), np.array(rows)
    by_instrument = by_inputs[:, :-1] @ np.concatenate([p.sensitivity for p in points])
    leds = instrument.pen.leds - instrument.pen.leds.mean(axis=0)
    of_scale = np.zeros(len(instrument.covariance))
    of_scale[instrument.parameters.leds] = (leds / np.sum(leds**2)).ravel()
    shared = by_instrument @ instrument.covariance @ of_scale
    spread = by_inputs @ part.touches.inputs @ by_inputs.T
    spread += np.outer(known, known) / COVERAGE_FACTOR**2
    gain = np.linalg.solve(spread, shared)
    before = float(of_scale @ instrument.covariance @ of_scale)
    return Scale(
        factor=1.0 - float(gain @ errors),
        uncertainty=COVERAGE_FACTOR * max(before - float(gain @ shared), 0.0) ** 0.5,
        uncertainty_before=COVERAGE_FACTOR * before**0.5,
    )
