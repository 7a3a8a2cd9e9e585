"""The verdict on a calibration: PASS, CHECK or REPEAT, with its reason."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.detection.labelling.causes import UNKNOWN_CAUSE
from lightpen.detection.reasons import Reason
from lightpen.estimation.bundle.image_fields import FieldName
from lightpen.estimation.bundle.led_quality import DISPLACED
from lightpen.estimation.calibrate import Calibration
from lightpen.estimation.contact.single_images import USUAL_SIGMA
from lightpen.estimation.reports.report_warnings import (
    MOST,
    late_cameras,
    rejected_centres,
    reported,
    two_stage_difference,
)
from lightpen.estimation.uncertainty.budget import (
    IMAGES_SHRINK,
    ContributionName,
    SplitHalfCheck,
    of_fields,
)
from lightpen.messages import (
    NO_TEMPERATURE,
    Code,
    Message,
    file_uncertain,
    message,
    too_little_tilt,
)
from lightpen.model.coverage import dial_counts
from lightpen.model.limits import SwingLimits

FAR_OFF = 3.0  # times the limit of U: no result to work with
FAR_MOVED = 3.0  # times the limit of U: corrected motion of cone or camera
STEP_MATTERS = 0.5  # times U: a step that moves the tip by a part of it
MANY_REJECTED = 0.1  # of the LED centres
MANY_DROPPED = 0.2  # of the images that show the pen
HALVES_GATE = 1.5  # times U (k = 2) of their difference: 3 standard deviations
FAR_FROM_NOMINAL = 3.0  # mm; pens of one design differ by some 2
CHANGE_GATE = 1.2  # times U (k = 2) of a change: 95 % of three axes by chance alone
AXES = "xyz"
TINY = 1e-12  # mm


class Grade(StrEnum):
    """Grade of a calibration or verification; of these two verify no tip."""

    PASS = "pass"
    SCALE = "scale ok"  # a certified size is within its limit
    STEADY = "steady"  # what should stand still does
    CHECK = "check"
    REPEAT = "repeat"


class NextStep(StrEnum):
    """Next step after a verdict."""

    ACCEPT = "accept"
    CAPTURE_MORE = "capture more"
    REPEAT = "repeat"
    REPORT_JOINT = "report joint fit"
    USE_PART = "use longer part"
    CHECK_FILES = "check files"
    CHECK_CAMERA = "check camera file"
    CHECK_LEDS = "check LED file"
    CHECK_RIG = "check rig file"
    SEE_TO_CAUSE = "see to the cause"
    CHECK_TIP = "check tip"
    CLAMP = "clamp"

    @property
    def message(self) -> Message:
        """The reason as text."""
        return _TOLD[self]


_TOLD = {
    NextStep.ACCEPT: message("next-step.accept"),
    NextStep.CAPTURE_MORE: message("next-step.capture-more"),
    NextStep.REPEAT: message("next-step.repeat"),
    NextStep.REPORT_JOINT: message("next-step.report-joint"),
    NextStep.USE_PART: message("next-step.use-part"),
    NextStep.CHECK_FILES: message("next-step.check-files"),
    NextStep.CHECK_CAMERA: message("next-step.check-camera"),
    NextStep.CHECK_LEDS: message("next-step.check-leds"),
    NextStep.CHECK_RIG: message("next-step.check-rig"),
    NextStep.SEE_TO_CAUSE: message("next-step.see-to-cause"),
    NextStep.CHECK_TIP: message("next-step.check-tip"),
    NextStep.CLAMP: message("next-step.clamp"),
}


@dataclass(frozen=True)
class Verdict:
    """A grade, and the reason that counts most."""

    grade: Grade
    reason: Message

    @property
    def can_be_accepted(self) -> bool:
        """Whether the tip may be accepted."""
        return self.grade is not Grade.REPEAT

    @property
    def next_step(self) -> NextStep:
        """The one thing to do that answers the reason."""
        causes = (_BY_CAUSE.get(part.code) for part in self.reason.parts())
        return next(filter(None, causes), _NEXT_STEPS[Code(self.reason.code)])


# Causes of a large U, each with the remedy.
_CAUSES = {
    ContributionName.LEDS: (message("share.leds"), NextStep.CHECK_LEDS),
    ContributionName.FORM: (message("share.form"), NextStep.SEE_TO_CAUSE),
    ContributionName.DIAMETER: (message("share.diameter"), NextStep.CHECK_LEDS),
    ContributionName.CAMERA: (message("share.camera"), NextStep.CHECK_CAMERA),
    ContributionName.EXTRINSICS: (message("share.rig"), NextStep.CHECK_RIG),
    ContributionName.LENS: (message("share.lens"), NextStep.CHECK_CAMERA),
}
# By the value that a reason names, as its code alone is ambiguous.
_BY_CAUSE = {
    **{advice.code: step for advice, step in _CAUSES.values()},
    "warning.camera-file-contradicted": NextStep.CHECK_CAMERA,
    "warning.images-turned": NextStep.CHECK_CAMERA,
    "warning.rig-file-contradicted": NextStep.CHECK_RIG,
    "warning.base-contradicted": NextStep.CHECK_FILES,
    "warning.scale-contradicted": NextStep.CHECK_FILES,
    "warning.pen-file-contradicted": NextStep.CHECK_LEDS,
}

_NEXT_STEPS = {
    Code.GOOD: NextStep.ACCEPT,
    Code.GOOD_UNCHECKED: NextStep.ACCEPT,
    Code.UNCERTAIN: NextStep.CAPTURE_MORE,
    Code.CAMERA_TILTS: NextStep.CAPTURE_MORE,
    Code.TWO_STAGE_OFF: NextStep.REPORT_JOINT,
    Code.STEP: NextStep.USE_PART,
    Code.TOO_FEW_IMAGES: NextStep.CAPTURE_MORE,
    Code.TOO_LITTLE_TILT: NextStep.CAPTURE_MORE,
    Code.HALVES_DIFFER: NextStep.REPEAT,
    Code.MANY_DROPPED: NextStep.REPEAT,
    Code.MANY_EXCLUDED: NextStep.REPEAT,
    Code.CENTRES_REJECTED: NextStep.SEE_TO_CAUSE,
    Code.LED_REJECTED: NextStep.SEE_TO_CAUSE,
    Code.LEDS_OFF: NextStep.CHECK_LEDS,
    Code.LED_DISPLACED: NextStep.CHECK_LEDS,
    Code.LEDS_MISFIT: NextStep.CHECK_FILES,
    Code.FILE_UNCERTAIN: NextStep.CHECK_FILES,
    Code.FILE_ASSUMED: NextStep.CHECK_FILES,
    Code.FILE_CONTRADICTED: NextStep.CHECK_FILES,
    Code.NOT_SIMULTANEOUS: NextStep.REPEAT,
    Code.CAMERA_MOVED: NextStep.CLAMP,
    Code.NO_TEMPERATURE: NextStep.SEE_TO_CAUSE,
    Code.TIP_CHANGED: NextStep.CHECK_TIP,
    Code.CHANGE_BEYOND_LIMIT: NextStep.CHECK_TIP,
    Code.LAST_UNKNOWN: NextStep.CHECK_TIP,
}


@dataclass(frozen=True, eq=False)
class Change:
    """Change of a tip since an earlier calibration."""

    difference: FloatArray  # (3,), now minus then, pen frame, mm
    expanded_uncertainty: FloatArray  # (3,), U (k = 2) of the difference, mm

    @property
    def distance(self) -> float:
        """Distance of the tips, mm."""
        return float(np.linalg.norm(self.difference))

    @property
    def is_unexplained(self) -> bool:
        """Whether it is more than both uncertainties explain."""
        beyond = np.abs(self.difference) > CHANGE_GATE * self.expanded_uncertainty
        return bool(beyond.any())

    def remark(self, date: str) -> Message:
        """Return the verdict as text, with the date of the earlier tip."""
        lengths = np.abs(self.difference)
        axis = int(np.argmax(lengths / np.maximum(self.expanded_uncertainty, TINY)))
        return message(
            Code.TIP_CHANGED,
            distance=self.distance,
            date=date,
            axis=AXES[axis],
            difference=float(lengths[axis]),
            uncertainty=float(self.expanded_uncertainty[axis]),
        )


def repeats(doubt: Message, reason: Message) -> bool:
    """Return whether a warning repeats the reason of the verdict."""
    if (doubt.code, reason.code) == ("warning.led-displaced", Code.LED_DISPLACED):
        return doubt.values["led"] == reason.values["led"]
    return doubt.code == reason.code


def change_since(
    tip_pen: FloatArray,
    uncertainty: FloatArray,
    tip_then: FloatArray,
    uncertainty_then: FloatArray,
) -> Change:
    """Compare a tip with an earlier one: both (3,), pen frame, with U (k = 2), mm."""
    return Change(tip_pen - tip_then, np.hypot(uncertainty, uncertainty_then))


def change_doubt(change: Change, date: str, limit: float | None) -> Message | None:
    """Return why a change needs checking, by a limit of its distance, mm, or None."""
    if limit is not None and change.distance > limit:
        return message(
            Code.CHANGE_BEYOND_LIMIT, distance=change.distance, date=date, limit=limit
        )
    return change.remark(date) if change.is_unexplained else None


def judge_change(
    verdict: Verdict, change: Change | None, date: str, limit: float | None = None
) -> Verdict:
    """Judge a passing tip by its change since the current result, if there is one.

    Findings of the verdict on the tip alone take precedence; see `change_doubt`.
    """
    if verdict.grade is not Grade.PASS or change is None:
        return verdict
    doubt = change_doubt(change, date, limit)
    return verdict if doubt is None else Verdict(Grade.CHECK, doubt)


def judge_unknown(verdict: Verdict, why: Message) -> Verdict:
    """Judge a tip that would pass where the one before cannot be read."""
    if verdict.grade is not Grade.PASS:
        return verdict
    return Verdict(Grade.CHECK, message(Code.LAST_UNKNOWN, why=why))


def distance_from_nominal(
    tip_pen: FloatArray, nominal_tip: FloatArray | None
) -> float | None:
    """Return the deviation of a tip from nominal, mm, if it is too large."""
    if nominal_tip is None:
        return None
    distance = float(np.linalg.norm(tip_pen - nominal_tip))
    return distance if distance > FAR_FROM_NOMINAL else None


def halves_agree(halves: SplitHalfCheck) -> bool:
    """Return whether the odd and the even images differ no more than by chance."""
    within = np.abs(halves.difference) <= HALVES_GATE * halves.expanded_uncertainty
    return bool(within.all())


def judge(calibration: Calibration, limits: SwingLimits) -> Verdict:
    """Judge a calibration by U of the reported tip and by its residuals.

    Only images that show the pen count, copies once. What else there is depends on how
    long a camera ran before and after, and a swing that is captured does not keep it.
    """
    uncertainty = reported(calibration).budget.weakest_uncertainty
    step = calibration.step
    if step is not None and step.size > STEP_MATTERS * uncertainty:
        return Verdict(Grade.REPEAT, step.told(len(calibration.used)))
    if uncertainty > FAR_OFF * limits.max_uncertainty:
        late = late_cameras(calibration)
        why = late[0] if late else _why_uncertain(calibration, limits)
        return Verdict(Grade.REPEAT, why)
    for finding in _findings(calibration, limits):
        return Verdict(Grade.CHECK, finding)
    return Verdict(Grade.PASS, _good(calibration, uncertainty))


def _good(calibration: Calibration, uncertainty: float) -> Message:
    """Return a verdict without findings, and what the images cannot check."""
    what, is_rig = message("unchecked.scale"), len(calibration.cameras) > 1
    if calibration.stated.reading is None:
        of_rig, of_one = message("unchecked.discs"), message("unchecked.diameter")
        what = of_rig if is_rig else of_one
    elif is_rig:
        return message(Code.GOOD, uncertainty=uncertainty)
    return message(Code.GOOD_UNCHECKED, uncertainty=uncertainty, what=what)


def _why_uncertain(calibration: Calibration, limits: SwingLimits) -> Message:
    """Return what makes U large: too few images, or a contribution that stays."""
    budget, limit = reported(calibration).budget, limits.max_uncertainty
    uncertainty, largest = budget.weakest_uncertainty, budget.largest_share
    if largest.name is ContributionName.METHOD:
        return message(
            Code.TWO_STAGE_OFF,
            uncertainty=uncertainty,
            limit=limit,
            distance=float(np.linalg.norm(two_stage_difference(calibration)[:3])),
            bias=float(np.linalg.norm(calibration.projection_bias[:3])),
        )
    if largest.name in IMAGES_SHRINK:
        return message(Code.UNCERTAIN, uncertainty=uncertainty, limit=limit)
    share, sigma = budget.weakest_share(largest), calibration.led_sigma
    if largest.name is ContributionName.CAMERA:
        # No file states a camera that turns with the lean; more images tell.
        covariance = of_fields(calibration.bundle, FieldName.TILT)
        by_tilt = budget.weakest_share(replace(largest, covariance=covariance))
        if 2 * by_tilt**2 > share**2:
            return message(
                Code.CAMERA_TILTS, uncertainty=uncertainty, limit=limit, share=by_tilt
            )
    if largest.name is ContributionName.LEDS and sigma > DISPLACED:
        return message(Code.LEDS_OFF, sigma=sigma, uncertainty=share)
    advice, _ = _CAUSES[largest.name]
    return file_uncertain(uncertainty, limit, share, advice, largest.assumed)


def _findings(calibration: Calibration, limits: SwingLimits) -> Iterator[Message]:
    """Yield what needs checking, the most important first."""
    limit, halves = limits.max_uncertainty, calibration.halves
    differences = np.abs(halves.difference)
    by_chance = HALVES_GATE * halves.expanded_uncertainty
    # A difference that is certain but smaller than what is allowed does not matter.
    apart = (differences > by_chance) & (differences > limit)
    if apart.any():
        worst = int(np.argmax(np.where(apart, differences, 0)))
        usual = float(halves.expanded_uncertainty[worst])
        difference = float(differences[worst])
        yield message(Code.HALVES_DIFFER, difference=difference, usual=usual)
    yield from late_cameras(calibration)
    if calibration.contradictions:
        worst_one = max(calibration.contradictions, key=lambda each: each.deviations)
        why = calibration.cause_of_misfit or worst_one.message
        yield message(Code.FILE_CONTRADICTED, why=why)
    if calibration.moved > FAR_MOVED * limit:
        yield message(Code.CAMERA_MOVED, distance=calibration.moved)
    sigma = calibration.bundle.sigma  # without a moving seat, which has its own finding
    if sigma > USUAL_SIGMA:
        found = calibration.cause_of_misfit or UNKNOWN_CAUSE
        yield message(Code.LEDS_MISFIT, sigma=sigma, usual=USUAL_SIGMA, cause=found)
    if len(calibration.leds.displaced) > 1:
        cause = calibration.cause_of_misfit
        if cause is not None and "cause.moved" not in {c.code for c in cause.parts()}:
            yield message(Code.FILE_CONTRADICTED, why=cause)
    if calibration.leds.displaced:
        lengths = np.linalg.norm(calibration.leds.displacement, axis=1)
        led = max(calibration.leds.displaced, key=lambda each: lengths[each - 1])
        distance = float(lengths[led - 1])
        yield message(Code.LED_DISPLACED, led=led, distance=distance)
    centres = rejected_centres(calibration)
    if centres.share > MANY_REJECTED:
        percent = 100 * centres.share
        yield message(Code.CENTRES_REJECTED, percent=percent, where=centres.where)
    if centres.worst_share > MOST:
        percent = 100 * centres.worst_share
        yield message(Code.LED_REJECTED, led=centres.worst_led, percent=percent)
    reasons = list(calibration.reasons)
    n_images = sum(each.shows_pen and each is not Reason.COPY for each in reasons)
    n_dropped = n_images - int(calibration.used.sum())
    n_excluded = reasons.count(Reason.TAKEN_OUT)
    if n_dropped > MANY_DROPPED * n_images:
        if 2 * n_excluded > n_dropped:
            yield message(Code.MANY_EXCLUDED, n_excluded=n_excluded)
        yield message(Code.MANY_DROPPED, n_dropped=n_dropped, n_images=n_images)
    if reported(calibration).budget.weakest_uncertainty > limit:
        yield _why_uncertain(calibration, limits)
    if limits.requires_temperature and calibration.assumptions.temperature_c is None:
        yield NO_TEMPERATURE
    if n_images < limits.min_images:
        yield message(Code.TOO_FEW_IMAGES, n_kept=n_images, needed=limits.min_images)
    bare = np.flatnonzero(dial_counts(calibration.joint.rotations)[1:].sum(axis=0) == 0)
    if len(bare) and limits.min_per_field:
        yield too_little_tilt(limits.min_per_field * len(bare), map(int, bare))
