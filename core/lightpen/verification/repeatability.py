"""One tip calibrated several times: the paper's Table 1, and what a scatter points to.

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
from lightpen.errors import CalibrationError
from lightpen.model.limits import VerificationLimits
from lightpen.sentences import Sentence, sentence
from lightpen.verification.assessment import (
    CALIBRATE_AGAIN,
    VERIFY_AGAIN,
    Conformity,
    accepted,
    check,
    refused,
)
from lightpen.verification.fixed_point import Scatter

MIN_TIPS = 2
STUDY = 30  # repeats of a type-1 gauge study, at least
MOVING_RANGE = 1.128  # mean range of two over the standard deviation
CONTROL = 3.0  # standard deviations
BY_CHANCE = 2.58  # standard deviations of a logarithm of variances: 99 %
SHARE_OF_TOLERANCE = 0.2
CAPABLE = 1.33


@dataclass(frozen=True, eq=False)
class TipEstimate:
    """A tip by one calibration.

    Attributes
    ----------
    tip_pen, uncertainty : (3,) array
        The tip and U (k = 2) of it, mm.
    when : datetime or None
        When it was calibrated.
    """

    name: str
    tip_pen: FloatArray
    uncertainty: FloatArray
    when: datetime | None = None


@dataclass(frozen=True, eq=False)
class Capability:
    """A type-1 gauge study, per coordinate.

    Attributes
    ----------
    tolerance : float
        Width of the tolerance of a coordinate, mm.
    cg : (3,) array
        A fifth of the tolerance over six standard deviations.
    cgk : (3,) array or None
        The same less the bias; None without a reference.
    """

    tolerance: float
    cg: FloatArray
    cgk: FloatArray | None

    @property
    def is_capable(self) -> bool:
        """Whether all are 1.33 or more."""
        least = self.cg if self.cgk is None else np.minimum(self.cg, self.cgk)
        return bool(least.min() >= CAPABLE)


@dataclass(frozen=True, eq=False)
class ControlLimits:
    """A control chart of individual values: (3,) each, mm."""

    lower: FloatArray
    center: FloatArray
    upper: FloatArray


@dataclass(frozen=True, eq=False)
class Repeatability:
    """Calibrations of one tip.

    Attributes
    ----------
    fixed_point_deviation : (3,) array or None
        Standard deviation of a fixed point touched with the tip, mm.
    points_to : Sentence or None
        What the scatter points to beside that of the fixed point.
    """

    tips: tuple[TipEstimate, ...]
    control: ControlLimits
    capability: Capability | None
    fixed_point_deviation: FloatArray | None
    points_to: Sentence | None
    assessment: Conformity

    @property
    def scatter(self) -> Scatter:
        """Of the tips, in the pen frame."""
        return Scatter(np.array([tip.tip_pen for tip in self.tips]))

    @property
    def out_of_control(self) -> tuple[TipEstimate, ...]:
        """The tips beyond the limits of the control chart."""
        values, control = self.scatter.points, self.control
        beyond = (values < control.lower) | (values > control.upper)
        return tuple(self.tips[i] for i in np.flatnonzero(beyond.any(axis=1)))


def measure_repeatability(
    tips: Sequence[TipEstimate],
    limits: VerificationLimits,
    *,
    tolerance: float | None = None,
    reference: FloatArray | None = None,
    fixed_point: FloatArray | None = None,
) -> Repeatability:
    """Measure how well calibrations of one tip repeat.

    Parameters
    ----------
    tolerance : float, optional
        Width of the tolerance of a coordinate, mm, to study the capability.
    reference : (3,) array, optional
        The tip by a better instrument, mm.
    fixed_point : (N, 3) array, optional
        A point touched N times with the tip, camera frame, mm.

    Raises
    ------
    CalibrationError
        There are fewer than two.
    """
    if len(tips) < MIN_TIPS:
        raise CalibrationError(
            sentence(
                "repeatability.too-few",
                "{n_tips} calibration tells nothing of how well it repeats; give two "
                "at least, ten are usual.",
                n_tips=len(tips),
            )
        )
    scatter = Scatter(np.array([tip.tip_pen for tip in tips]))
    values, deviation = scatter.points, scatter.deviation
    fixed = None if fixed_point is None else Scatter(fixed_point).deviation
    n_touches = 0 if fixed_point is None else len(fixed_point)
    points_to = (
        None if fixed is None else _points_to(deviation, len(tips), fixed, n_touches)
    )
    return Repeatability(
        tips=tuple(tips),
        control=_control(values),
        capability=(
            None if tolerance is None else _capability(values, tolerance, reference)
        ),
        fixed_point_deviation=fixed,
        points_to=points_to,
        assessment=_assessment(tips, deviation, points_to, limits),
    )


def _control(values: FloatArray) -> ControlLimits:
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


def _points_to(
    tip: FloatArray, n_tips: int, point: FloatArray, n_touches: int
) -> Sentence | None:
    """Return what two scatters point to that differ by more than chance."""
    of_tip, of_point = float(np.linalg.norm(tip)), float(np.linalg.norm(point))
    n_free = 3 * (n_tips - 1), 3 * (n_touches - 1)
    apart = np.log(of_tip**2 / of_point**2) if of_point > 0 else np.inf
    by_chance = BY_CHANCE * np.sqrt(2 / n_free[0] + 2 / n_free[1])
    if apart > by_chance:
        return sentence(
            "repeatability.rode-with-pen",
            "The tip scatters by {of_tip:.4f} mm over the calibrations, a fixed point "
            "touched with it by only {of_point:.4f} mm. An error of the calibration "
            "would move both alike: so something moved with the pen between the "
            "calibrations. Look for a tip that is not screwed in firmly, a loose or "
            "knocked LED, or LEDs that were measured too coarsely.",
            of_tip=of_tip,
            of_point=of_point,
        )
    if apart < -by_chance:
        return sentence(
            "repeatability.point-moved",
            "A fixed point scatters by {of_point:.4f} mm, the tip by only "
            "{of_tip:.4f} mm over the calibrations. The tip is steady: the cone or the "
            "camera moved between the touches, the tip did not rest in the cone, or "
            "each touch was of too few images.",
            of_tip=of_tip,
            of_point=of_point,
        )
    return None


def _assessment(
    tips: Sequence[TipEstimate],
    deviation: FloatArray,
    points_to: Sentence | None,
    limits: VerificationLimits,
) -> Conformity:
    axis = int(np.argmax(deviation))
    stated = np.mean([tip.uncertainty for tip in tips], axis=0) / 2
    if deviation[axis] > limits.repeatability:
        return refused(
            points_to
            or sentence(
                "repeatability.scatters",
                "The tip scatters by {deviation:.4f} mm along {axis} (standard "
                "deviation, limit {limit:.4f} mm); its calibrations state {stated:.4f} "
                "mm. Touch a fixed point several times: whether that scatters alike "
                "tells what moved.",
                deviation=float(deviation[axis]),
                axis="xyz"[axis],
                limit=limits.repeatability,
                stated=float(stated[axis]),
            ),
            CALIBRATE_AGAIN,
        )
    if points_to is not None:
        return check(points_to, VERIFY_AGAIN)
    return accepted(
        sentence(
            "repeatability.good",
            "The tip repeats within {deviation:.4f} mm along {axis} (standard "
            "deviation, limit {limit:.4f} mm); its calibrations state {stated:.4f} mm.",
            deviation=float(deviation[axis]),
            axis="xyz"[axis],
            limit=limits.repeatability,
            stated=float(stated[axis]),
        )
    )
