"""Press test: a swing with usual pressure against one with firm pressure.

Same tip, cone, pen and camera. Both swings are fitted with one instrument held fixed,
first the instrument of one swing, then of the other, and the differences of tip and
cone are averaged: errors of camera, LEDs and scale cancel. The rest, due to different
postures, is about as large as the disagreement of the two differences.

A stylus, ball thread or seat that gives way by ``c`` times the sine of the lean
moves the tip of a fit along the pen, and its
cone along the cone's axis. What is left of the cone's move is a move of cone or camera.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import UsageError
from lightpen.estimation.bundle.seat_modes import axes_of_cone
from lightpen.estimation.calibrate import Calibration
from lightpen.estimation.contact.joint import JointFit
from lightpen.estimation.reports.verdict import Grade
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.messages import Message, message
from lightpen.model.expanded_uncertainty import COVERAGE_FACTOR
from lightpen.model.quantiles import chi_square_quantile
from lightpen.verification.history.led_file import fit_held
from lightpen.verification.tasks.assessment import (
    BY_CHANCE,
    VerificationAssessment,
    accepted,
    check,
)

PRESS_TEST = "press"  # kind of its record
ALONG_PEN = 1  # axis of the pen frame
CONE = slice(3, 6)  # of (tip, cone)
RESOLVED = 0.02  # mm, U of the move along the pen above which the test shows little
STIFFEN = message("press-test.stiffen")
CLAMP = message("press-test.clamp")
KEEP = message("press-test.keep")
MORE_IMAGES = message("press-test.more-images")


@dataclass(frozen=True, eq=False)
class PressTest:
    """Change of the tip by firm pressure."""

    # (6,), tip in the pen frame and cone in the camera frame, firm less usual, mm; the
    # cone without the move caused by that of the tip along the pen
    change: FloatArray
    uncertainty: FloatArray  # (6,), U (k = 2), mm
    assessment: VerificationAssessment

    @property
    def along(self) -> float:
        """Move of the tip along the pen, mm."""
        return float(self.change[ALONG_PEN])

    @property
    def words(self) -> tuple[Message, Message]:
        """Verdict and next step."""
        return self.assessment.reason, self.assessment.next_step

    @property
    def entries(self) -> dict[str, Any]:
        """Entries of a record."""
        return {
            "tip_change_mm": self.change[:3],
            "tip_change_expanded_uncertainty_mm": self.uncertainty[:3],
            "cone_change_mm": self.change[CONE],
            "cone_change_expanded_uncertainty_mm": self.uncertainty[CONE],
        }


def press_test(usual: Calibration, firm: Calibration) -> PressTest:
    """Compare a swing with firm pressure with the usual one.

    Raises `UsageError` if they are of different cameras or LEDs, and `CalibrationError`
    if the images of one do not fit the instrument of the other.
    """
    one, other = usual.instrument, firm.instrument
    if one.rig.n_cameras != other.rig.n_cameras or one.pen.n_leds != other.pen.n_leds:
        raise UsageError("press-test.another-station")
    (first, noise, by_pressure), (second, _, _) = (
        _difference(usual, firm, each) for each in (one, other)
    )
    uneven = 0.5 * (second - first)
    change = 0.5 * (first + second)
    covariance = noise + np.outer(uneven, uneven)
    # The cone without the move caused by the move of the tip along the pen.
    taken = np.eye(6)
    taken[CONE, ALONG_PEN] = -by_pressure[CONE] / by_pressure[ALONG_PEN]
    change = taken @ change
    covariance = taken @ covariance @ taken.T
    uncertainty = COVERAGE_FACTOR * np.sqrt(np.diag(covariance))
    return PressTest(change, uncertainty, _assessment(change, covariance))


def _difference(
    usual: Calibration, firm: Calibration, instrument: Instrument
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the change of (tip, cone), its covariance, and its share by compliance."""
    fits = [fit_held(each, instrument.rig, instrument.pen) for each in (usual, firm)]
    before, after = (np.r_[fit.tip_pen, fit.cone_cam] for fit in fits)
    # Effect of an unmodelled move of the cone on tip and cone.
    across = axes_of_cone(fits[1].rotations)[:2]
    moves = fits[1].rotations[:, :, 1] @ across.T @ across
    pulls = np.einsum("nij,nj->i", fits[1].information[..., CONE], moves)
    noise = _scatter(fits[0]) + _scatter(fits[1])
    return after - before, noise, fits[1].covariance @ pulls


def _scatter(fit: JointFit) -> FloatArray:
    """Return the covariance by noise, or by the scatter of the images if larger.

    With seat and jitter in them, the images scatter by more than their noise.
    """
    scores = fit.gradients - fit.gradients.mean(axis=0)
    n_images, noise = len(scores), fit.covariance
    scatter = scores.T @ scores * n_images / (n_images - 1)
    is_larger = float(np.trace(noise @ scatter)) > len(noise)
    return np.asarray(noise @ scatter @ noise) if is_larger else noise


def _assessment(change: FloatArray, covariance: FloatArray) -> VerificationAssessment:
    along, variance = change[ALONG_PEN], covariance[ALONG_PEN, ALONG_PEN]
    uncertainty = COVERAGE_FACTOR * float(np.sqrt(variance))
    if along**2 > chi_square_quantile(1, BY_CHANCE) * variance:
        reason = message(
            "press-test.gives-way", change=abs(float(along)), uncertainty=uncertainty
        )
        return check(reason, STIFFEN)
    moved, spread = change[CONE], covariance[CONE, CONE]
    known = np.linalg.solve(spread, moved)
    if float(moved @ known) > chi_square_quantile(3, BY_CHANCE):
        distance = float(np.linalg.norm(moved))
        across = moved / distance
        reason = message(
            "press-test.cone-moved",
            distance=distance,
            uncertainty=COVERAGE_FACTOR * float(np.sqrt(across @ spread @ across)),
        )
        return check(reason, CLAMP)
    if uncertainty > RESOLVED:
        return check(message("press-test.coarse", uncertainty=uncertainty), MORE_IMAGES)
    reason = message("press-test.steady", change=float(along), uncertainty=uncertainty)
    return accepted(reason, KEEP, Grade.STEADY)
