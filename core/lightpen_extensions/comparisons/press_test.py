"""Press test: the effective tip of a firm swing less that of a light one.

Same tip, cone, pen and camera. A stylus, ball thread or seat that gives way across
the pen in proportion to the lean moves the effective tip along the pen. Both swings
are fitted with one instrument held fixed, first that of one swing, then that of the
other, and the differences of the tips are averaged: errors of camera, LEDs and scale
cancel. The rest, due to different postures, is about as large as the disagreement of
the two differences.
"""

from dataclasses import dataclass
from datetime import date, datetime
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import structs

from lightpen.arrays import FloatArray
from lightpen.errors import UsageError
from lightpen.estimation.calibrate import Calibration
from lightpen.estimation.contact.joint import ContactModel, JointFit, fit_contact
from lightpen.estimation.contact.single_images import steadied
from lightpen.estimation.reports.verdict import Grade
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.messages import Message, message
from lightpen.model.bending import ASSUMED, MeasuredBending, measured_on
from lightpen.model.coverage import COVERAGE_FACTOR, chi_square_quantile
from lightpen.record.library.library_changes import Author, add_item, change_item
from lightpen.record.library.tip_library import Library, ListedTip, read_library
from lightpen_extensions.comparisons.assessment import (
    BY_CHANCE,
    VerificationAssessment,
    accepted,
    check,
)

PRESS_TEST = "press"  # kind of its record
ALONG_PEN = 1  # axis of the pen frame
RESOLVED = 0.02  # mm, U of the bending above which the test shows little
STIFFEN = message("press-test.stiffen")
KEEP = message("press-test.keep")
MORE_IMAGES = message("press-test.more-images")


@dataclass(frozen=True, eq=False)
class PressTest:
    """Change of the effective tip by firm pressure."""

    change: FloatArray  # (3,), pen frame, firm less light, mm
    uncertainty: FloatArray  # (3,), U (k = 2), mm
    assessment: VerificationAssessment

    @property
    def words(self) -> tuple[Message, Message]:
        """Verdict and next step."""
        return self.assessment.reason, self.assessment.next_step

    @property
    def entries(self) -> dict[str, Any]:
        """Entries of a record."""
        return {
            "tip_change_mm": self.change,
            "tip_change_expanded_uncertainty_mm": self.uncertainty,
        }

    def bending(self, day: date) -> MeasuredBending | None:
        """Return the bending by a test of a day; None if it is too coarse to count."""
        if self.uncertainty[ALONG_PEN] > RESOLVED:
            return None
        change, uncertainty = self.change[ALONG_PEN], self.uncertainty[ALONG_PEN]
        return measured_on(day, float(change), float(uncertainty))


def press_test(light: Calibration, firm: Calibration) -> PressTest:
    """Compare a swing with firm pressure with a light one.

    Raises `UsageError` if they are of different cameras or LEDs, and `CalibrationError`
    if the images of one do not fit the instrument of the other.
    """
    one, other = light.instrument, firm.instrument
    if one.rig.n_cameras != other.rig.n_cameras or one.pen.n_leds != other.pen.n_leds:
        raise UsageError("press-test.another-station")
    (first, noise), (second, _) = (
        _difference(light, firm, each) for each in (one, other)
    )
    uneven = 0.5 * (second - first)
    variances = noise + uneven**2
    change, uncertainty = 0.5 * (first + second), COVERAGE_FACTOR * np.sqrt(variances)
    found = float(change[ALONG_PEN]), float(uncertainty[ALONG_PEN])
    return PressTest(change, uncertainty, _assessment(*found))


def _difference(
    light: Calibration, firm: Calibration, instrument: Instrument
) -> tuple[FloatArray, FloatArray]:
    """Return the tip of the firm swing less that of the light one, and variances."""
    fits = [_fit_held(each, instrument) for each in (light, firm)]
    before, after = (fit.tip_pen for fit in fits)
    scatter = _scatter(fits[0]) + _scatter(fits[1])
    return after - before, np.diag(scatter)[:3]


def _fit_held(calibration: Calibration, instrument: Instrument) -> JointFit:
    """Fit tip and cone of a swing with cameras and LEDs held as they are."""
    rig = instrument.rig
    joint = calibration.joint
    views = [
        np.where(
            each.used[:, None, None],
            steadied(camera, each.observations, each.path).pixels,
            np.nan,
        )
        for camera, each in zip(rig.cameras, calibration.cameras, strict=True)
    ]
    model = ContactModel(rig, instrument.pen, np.stack(views, axis=1)[calibration.used])
    return fit_contact(
        model, joint.rotations[joint.used.any(axis=1)], joint.tip_pen, joint.cone_cam
    )


def _scatter(fit: JointFit) -> FloatArray:
    """Return the covariance by noise, or by the scatter of the images if larger.

    With seat and jitter in them, the images scatter by more than their noise.
    """
    scores = fit.gradients - fit.gradients.mean(axis=0)
    n_images, noise = len(scores), fit.covariance
    scatter = scores.T @ scores * n_images / (n_images - 1)
    is_larger = float(np.trace(noise @ scatter)) > len(noise)
    return np.asarray(noise @ scatter @ noise) if is_larger else noise


def _assessment(bending: float, uncertainty: float) -> VerificationAssessment:
    if uncertainty > RESOLVED:
        return check(message("press-test.coarse", uncertainty=uncertainty), MORE_IMAGES)
    sigma = uncertainty / COVERAGE_FACTOR
    is_bent = bending**2 > chi_square_quantile(1, BY_CHANCE) * sigma**2
    shown = abs(bending)
    if is_bent and abs(bending) > ASSUMED:
        said = message("press-test.gives-way", bending=shown, uncertainty=uncertainty)
        return check(said, STIFFEN)
    said = message("press-test.steady", bending=shown, uncertainty=uncertainty)
    return accepted(said, KEEP, Grade.STEADY)


def keep_bending(
    data: Path, tip: str, bending: MeasuredBending, by: Author, now: datetime
) -> Library:
    """Store a press test with its tip in the library; see `add_item`."""
    listed = read_library(data).tips.get(tip)
    if listed is None:
        return add_item(data, ListedTip(id=tip, bending=bending), by, now)
    return change_item(data, structs.replace(listed, bending=bending), by, now, listed)
