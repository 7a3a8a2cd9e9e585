"""Repeatability of one tip over its calibrations: the paper's Table 1."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lightpen.archive.chains import StoredEntry
from lightpen.archive.trends import ControlLimits, TipEstimate, control_limits, tip_of
from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.reports.verdict import Change, change_since
from lightpen.messages import Message, message
from lightpen.model.coverage import COVERAGE_FACTOR, Decision
from lightpen.model.limits import VerificationLimits
from lightpen_extensions.comparisons.assessment import (
    BY_SIMPLE_ACCEPTANCE,
    CALIBRATE_AGAIN,
    COLUMN,
    TITLE,
    Scatter,
    VerificationAssessment,
    accepted,
    check,
    refused,
    verdict_lines,
)

MIN_TIPS = 2
ENOUGH_TIPS = 5  # for a verdict, and
REPEAT_MORE = message("repeatability.repeat-more")
USE_NEWEST = message("repeatability.use-newest")


@dataclass(frozen=True, eq=False)
class Repeatability:
    """Calibrations of one tip."""

    tips: tuple[TipEstimate, ...]
    control: ControlLimits | None  # None for fewer than ten calibrations
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
    tips: Sequence[TipEstimate], limits: VerificationLimits
) -> Repeatability:
    """Return the repeatability of calibrations of one tip.

    Raises `CalibrationError` for fewer than two tips.
    """
    if len(tips) < MIN_TIPS:
        raise CalibrationError("repeatability.too-few", n_tips=len(tips))
    values = np.array([tip.tip_pen for tip in tips])
    judged = _assessment(tips, Scatter(values).deviation, limits)
    return Repeatability(tuple(tips), control_limits(values), judged)


def _assessment(
    tips: Sequence[TipEstimate], deviations: FloatArray, limits: VerificationLimits
) -> VerificationAssessment:
    if len(tips) < ENOUGH_TIPS:
        few = message("repeatability.few", n_tips=len(tips), needed=ENOUGH_TIPS)
        return check(few, REPEAT_MORE)
    axis = int(np.argmax(deviations))
    stated = float(np.mean([tip.uncertainty[axis] for tip in tips])) / COVERAGE_FACTOR
    deviation, limit = float(deviations[axis]), limits.repeatability
    scatters = message(
        "repeatability.scatters",
        deviation=deviation,
        axis="xyz"[axis],
        limit=limit,
        stated=stated,
    )
    # Of a standard deviation by n values, whose scatter is normal.
    uncertainty = COVERAGE_FACTOR * deviation / (2 * (len(tips) - 1)) ** 0.5
    decision = limits.decision(deviation, uncertainty, limit)
    if decision is Decision.REJECTED:
        return refused(scatters, CALIBRATE_AGAIN)
    if decision is Decision.OPEN:
        return check(scatters, REPEAT_MORE)
    good = message(
        "repeatability.good",
        deviation=deviation,
        axis="xyz"[axis],
        limit=limit,
        stated=stated,
    )
    return accepted(good, USE_NEWEST)


@dataclass(frozen=True, eq=False)
class Comparison:
    """Change from the earlier to the later of two calibrations."""

    earlier: StoredEntry
    later: StoredEntry
    change: Change
    is_same_tip: bool


def compare(one: StoredEntry, other: StoredEntry) -> Comparison:
    """Compare two entries that hold tips, in any order."""
    earlier, later = sorted((one, other), key=lambda each: each.entry.since)
    now, then = tip_of(later), tip_of(earlier)
    change = change_since(now.tip_pen, now.uncertainty, then.tip_pen, then.uncertainty)
    return Comparison(earlier, later, change, _subject(one) == _subject(other))


def repeatability_of(
    entries: tuple[StoredEntry, ...], limits: VerificationLimits
) -> Repeatability | None:
    """Return the repeatability; None for fewer than two calibrations or several tips.

    See `measure_repeatability`.
    """
    if len(entries) < MIN_TIPS or len({_subject(each) for each in entries}) > 1:
        return None
    in_order = sorted(entries, key=lambda each: each.entry.since)
    return measure_repeatability([tip_of(each) for each in in_order], limits)


def _subject(entry: StoredEntry) -> tuple[str, str, bool]:
    event = entry.entry.event
    return event.names.pen, event.names.tip, event.is_simulated


def repeatability_entries(found: Repeatability) -> dict[str, Any]:
    """Return the entries of a repeatability study."""
    control = found.control
    return {
        "mean_mm": found.scatter.mean,
        "std_mm": found.scatter.deviation,
        "range_mm": found.scatter.range,
        "control": (
            None
            if control is None
            else {
                "lower_mm": control.lower,
                "center_mm": control.center,
                "upper_mm": control.upper,
                "out_of_control": [tip.name for tip in found.out_of_control],
            }
        ),
        "tips": [
            {
                "name": tip.name,
                "tip_pen_mm": tip.tip_pen,
                "expanded_uncertainty_mm": tip.uncertainty,
                "when": None if tip.when is None else tip.when.isoformat(),
            }
            for tip in found.tips
        ],
    }


# As text, in the table of the paper.
#
# [1] S. Liu et al., "Portable light pen 3D vision coordinate measuring system - probe
# tip center calibration", Measurement Science Review 13 (2013) 194-199, table 1.


def repeatability_text(
    found: Repeatability, rule: Message = BY_SIMPLE_ACCEPTANCE
) -> str:
    """Return calibrations of one tip as text: the paper's Table 1."""

    def row(title: str, values: FloatArray, digits: int = 4) -> str:
        return f"{title:<{TITLE}}" + "".join(f"{x:{COLUMN}.{digits}f}" for x in values)

    lines = [
        "Center coordinates of the probe tip, mm",
        f"{'No. of test':<{TITLE}}"
        + "".join(f"{axis + '-axis':>{COLUMN}}" for axis in "xyz"),
        *(
            row(f"{i + 1:>3} {tip.name}"[:TITLE], tip.tip_pen)
            for i, tip in enumerate(found.tips)
        ),
        row("Ave", found.scatter.mean),
        row("Std", found.scatter.deviation),
        row("Range", found.scatter.range),
    ]
    if found.control is not None:
        lines += [
            row("Control limit, lower", found.control.lower),
            row("Control limit, upper", found.control.upper),
        ]
    out = found.out_of_control
    if out:
        lines.append("Out of control: " + ", ".join(tip.name for tip in out))
    return "\n".join([*lines, "", *verdict_lines(found.assessment, rule)])
