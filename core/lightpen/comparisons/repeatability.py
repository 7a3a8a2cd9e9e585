"""Repeatability of one tip: the paper's Table 1, and causes of scatter.

An error of the estimator, of the files or of the camera moves tip and fixed point
alike: both are the same poses, read once in the pen and once in the camera. So a tip
that scatters by more than a fixed point touched with it has really moved in its pen
between the calibrations, and a fixed point that scatters by more than the tips has
moved under the pen, or was not held.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.comparisons.assessment import (
    CALIBRATE_AGAIN,
    VERIFY_AGAIN,
    VerificationAssessment,
    accepted,
    check,
    refused,
)
from lightpen.errors import CalibrationError
from lightpen.messages import Message, message
from lightpen.model.decision_rules import Decision
from lightpen.model.expanded_uncertainty import COVERAGE_FACTOR
from lightpen.model.limits import VerificationLimits
from lightpen.model.quantiles import normal_quantile

MIN_TIPS = 2
ENOUGH_TIPS = 5  # for a verdict, and
FOR_CONTROL = 10  # for limits of a control chart
STUDY = 30  # repeats of a type-1 gauge study, at least
MOVING_RANGE = 1.128  # mean range of two over the standard deviation
CONTROL = 3.0  # standard deviations
BY_CHANCE = 0.01  # probability that equal variances differ as much
SHARE_OF_TOLERANCE = 0.2
CAPABLE = 1.33
TIGHTEN = message("repeatability.tighten")
WIDEN = message("repeatability.widen")
REPEAT_MORE = message("repeatability.repeat-more")
USE_NEWEST = message("repeatability.use-newest")


@dataclass(frozen=True, eq=False)
class Scatter:
    """Coordinates (N, 3) of a point measured several times, mm."""

    points: FloatArray

    @property
    def mean(self) -> FloatArray:
        """Of each coordinate, (3,)."""
        return np.asarray(self.points.mean(axis=0))

    @property
    def deviation(self) -> FloatArray:
        """Standard deviation of each coordinate, (3,)."""
        return np.asarray(self.points.std(axis=0, ddof=1))

    @property
    def range(self) -> FloatArray:
        """Largest minus smallest of each coordinate, (3,)."""
        return np.asarray(np.ptp(self.points, axis=0))

    @property
    def half_range(self) -> FloatArray:
        """Half the largest minus the smallest of each coordinate, (3,)."""
        return self.range / 2


@dataclass(frozen=True, eq=False)
class TipEstimate:
    """A tip by one calibration, and its U (k = 2), (3,), mm."""

    name: str
    tip_pen: FloatArray
    uncertainty: FloatArray
    when: datetime | None = None


@dataclass(frozen=True, eq=False)
class RepeatedPoint:
    """A fixed point touched several times with a tip."""

    points: FloatArray  # (N, 3), camera frame, mm
    expected_deviation: FloatArray  # (3,), of the touches, as is known of them, mm
    when: datetime

    @property
    def deviation(self) -> FloatArray:
        """Standard deviation of the touches, (3,), mm."""
        return Scatter(self.points).deviation


@dataclass(frozen=True, eq=False)
class Capability:
    """A type-1 gauge study, per coordinate."""

    tolerance: float  # width, per coordinate, mm
    cg: FloatArray  # (3,), a fifth of the tolerance over six standard deviations
    cgk: FloatArray | None  # (3,), less the bias; None without a reference

    @property
    def least(self) -> float:
        """The least of all."""
        least = self.cg if self.cgk is None else np.minimum(self.cg, self.cgk)
        return float(least.min())

    @property
    def is_capable(self) -> bool:
        """Whether all are 1.33 or more."""
        return self.least >= CAPABLE


@dataclass(frozen=True, eq=False)
class ControlLimits:
    """A control chart of individual values: (3,) each, mm."""

    lower: FloatArray
    center: FloatArray
    upper: FloatArray


@dataclass(frozen=True, eq=False)
class Repeatability:
    """Calibrations of one tip."""

    tips: tuple[TipEstimate, ...]
    control: ControlLimits | None  # None for fewer than ten calibrations
    capability: Capability | None
    touched: RepeatedPoint | None  # with the tip
    points_to: Message | None  # what the scatter indicates
    assessment: VerificationAssessment

    @property
    def scatter(self) -> Scatter:
        """Of the tips, in the pen frame."""
        return Scatter(np.array([tip.tip_pen for tip in self.tips]))

    @property
    def out_of_control(self) -> tuple[TipEstimate, ...]:
        """The tips beyond the limits of the control chart."""
        values, control = self.scatter.points, self.control
        if control is None:
            return ()
        beyond = (values < control.lower) | (values > control.upper)
        return tuple(self.tips[i] for i in np.flatnonzero(beyond.any(axis=1)))


def measure_repeatability(
    tips: Sequence[TipEstimate],
    limits: VerificationLimits,
    *,
    tolerance: float | None = None,
    reference: FloatArray | None = None,
    touched: RepeatedPoint | None = None,
) -> Repeatability:
    """Return the repeatability of calibrations of one tip.

    A ``tolerance``, the width of the tolerance of a coordinate, mm, adds the capability
    C_g, with a ``reference`` (3,), the tip by a better instrument, mm, also C_gk.
    ``touched`` is a fixed point touched with the tip. Raises `CalibrationError` for
    fewer than two tips.
    """
    if len(tips) < MIN_TIPS:
        raise CalibrationError("repeatability.too-few", n_tips=len(tips))
    scatter = Scatter(np.array([tip.tip_pen for tip in tips]))
    values, deviation = scatter.points, scatter.deviation
    points_to = None if touched is None else _points_to(deviation, len(tips), touched)
    study = None if tolerance is None else _capability(values, tolerance, reference)
    return Repeatability(
        tips=tuple(tips),
        control=control_limits(values),
        capability=study,
        touched=touched,
        points_to=points_to,
        assessment=_assessment(tips, deviation, points_to, study, limits),
    )


def control_limits(values: FloatArray) -> ControlLimits | None:
    """Return the limits of a control chart of values (N, 3), if they are enough."""
    if len(values) < FOR_CONTROL:
        return None
    sigma = np.abs(np.diff(values, axis=0)).mean(axis=0) / MOVING_RANGE
    center = values.mean(axis=0)
    return ControlLimits(center - CONTROL * sigma, center, center + CONTROL * sigma)


def _capability(
    values: FloatArray, tolerance: float, reference: FloatArray | None
) -> Capability:
    sigma = np.maximum(values.std(axis=0, ddof=1), np.finfo(float).tiny)
    cg = SHARE_OF_TOLERANCE * tolerance / (6 * sigma)
    cgk = None
    if reference is not None:
        bias = np.abs(values.mean(axis=0) - reference)
        cgk = (SHARE_OF_TOLERANCE / 2 * tolerance - bias) / (3 * sigma)
    return Capability(tolerance, cg, cgk)


def _points_to(tip: FloatArray, n_tips: int, touched: RepeatedPoint) -> Message | None:
    """Return the likely cause of two scatters that differ by more than chance.

    A point that scatters no more than its touches are expected to has not moved.
    """
    of_tip = float(np.linalg.norm(tip))
    of_point = float(np.linalg.norm(touched.deviation))
    expected = float(np.linalg.norm(touched.expected_deviation))
    n_free, n_free_point = 3 * (n_tips - 1), 3 * (len(touched.points) - 1)
    if _is_larger(of_tip, of_point, 2 / n_free + 2 / n_free_point):
        return message("repeatability.rode-with-pen", of_tip=of_tip, of_point=of_point)
    is_beyond_noise = _is_larger(of_point, expected, 2 / n_free_point)
    if is_beyond_noise and _is_larger(of_point, of_tip, 2 / n_free + 2 / n_free_point):
        return message("repeatability.point-moved", of_tip=of_tip, of_point=of_point)
    return None


def _is_larger(one: float, other: float, variance: float) -> bool:
    """Return whether a deviation is larger by more than chance, by its log variance."""
    if not (one > 0 and other > 0):
        return one > 0
    return 2 * float(np.log(one / other)) > (
        normal_quantile(BY_CHANCE / 2) * float(np.sqrt(variance))
    )


def _assessment(
    tips: Sequence[TipEstimate],
    deviation: FloatArray,
    points_to: Message | None,
    study: Capability | None,
    limits: VerificationLimits,
) -> VerificationAssessment:
    if len(tips) < ENOUGH_TIPS:
        few = message("repeatability.few", n_tips=len(tips), needed=ENOUGH_TIPS)
        return check(few, REPEAT_MORE)
    axis = int(np.argmax(deviation))
    stated = np.mean([tip.uncertainty for tip in tips], axis=0) / 2
    ridden = "repeatability.rode-with-pen"
    has_ridden = points_to is not None and points_to.code == ridden
    scatters = message(
        "repeatability.scatters",
        deviation=float(deviation[axis]),
        axis="xyz"[axis],
        limit=limits.repeatability,
        stated=float(stated[axis]),
    )
    # Of a standard deviation by n values, whose scatter is normal.
    uncertainty = COVERAGE_FACTOR * deviation[axis] / np.sqrt(2 * (len(tips) - 1))
    decision = limits.decision(
        float(deviation[axis]), float(uncertainty), limits.repeatability
    )
    if decision is Decision.REJECTED:
        why = points_to if points_to is not None and has_ridden else scatters
        return refused(why, CALIBRATE_AGAIN)
    if points_to is not None:
        return check(points_to, TIGHTEN if has_ridden else VERIFY_AGAIN)
    if study is not None and not study.is_capable:
        return check(
            message(
                "repeatability.not-capable",
                least=study.least,
                needed=CAPABLE,
                tolerance=study.tolerance,
            ),
            WIDEN,
        )
    if decision is Decision.OPEN:
        return check(scatters, REPEAT_MORE)
    return accepted(
        message(
            "repeatability.good",
            deviation=float(deviation[axis]),
            axis="xyz"[axis],
            limit=limits.repeatability,
            stated=float(stated[axis]),
        ),
        USE_NEWEST,
    )
