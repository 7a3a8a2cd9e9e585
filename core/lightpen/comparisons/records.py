"""Verifications as JSON records."""

from collections.abc import Mapping
from typing import Any

from lightpen.comparisons.assessment import VerificationAssessment
from lightpen.comparisons.pen_health import Growth, PenHealth
from lightpen.comparisons.repeatability import Repeatability
from lightpen.formats.json_records import plain, record_heading
from lightpen.local_time import local_now
from lightpen.messages import Message
from lightpen.model.expanded_uncertainty import COVERAGE_FACTOR
from lightpen.model.limits import VerificationLimits, rule_in_words

BY_SIMPLE_ACCEPTANCE = rule_in_words(VerificationLimits())


def verification_record(
    kind: str,
    entries: Mapping[str, Any],
    assessment: VerificationAssessment | None,
    limits: Mapping[str, float],
    inputs: Mapping[str, Any],
    rule: Message = BY_SIMPLE_ACCEPTANCE,
) -> dict[str, Any]:
    """Return the record of a verification of a kind, of its entries and input files.

    The assessment is None of what is measured and not judged; the limits, mm, and the
    rule are those that it was judged by.
    """
    record = {
        **record_heading(local_now()),
        "verification": kind,
        "coverage_factor": COVERAGE_FACTOR,
        "verdict": None
        if assessment is None
        else {
            "grade": assessment.grade.value,
            **plain(assessment.reason),
            "next_step": assessment.next_step,
            "decision_rule": str(rule),
            "limits_mm": limits,
        },
        **entries,
        "inputs": inputs,
    }
    return {name: plain(entry) for name, entry in record.items()}


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


def pen_health_entries(found: PenHealth) -> dict[str, Any]:
    """Return the entries of a pen's history."""
    return {
        "moved_leds": found.moved,
        **_growth_entries(found.growth),
        "swings": [
            {
                "name": swing.name,
                "shifts_mm": swing.shifts,
                **_growth_entries(swing.growth),
            }
            for swing in found.swings
        ],
    }


def _growth_entries(found: Growth | None) -> dict[str, float | None]:
    relative, uncertainty = found or (None, None)
    return {"growth": relative, "growth_expanded_uncertainty": uncertainty}
