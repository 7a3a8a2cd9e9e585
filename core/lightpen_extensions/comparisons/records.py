"""Verifications as JSON records."""

from collections.abc import Mapping
from typing import Any

from lightpen.arrays import FloatArray
from lightpen.formats.own_json import plain, record_heading
from lightpen.local_time import local_now
from lightpen.messages import Message
from lightpen.model.coverage import COVERAGE_FACTOR
from lightpen.model.limits import VerificationLimits, rule_in_words
from lightpen_extensions.comparisons.assessment import VerificationAssessment
from lightpen_extensions.comparisons.repeatability import Repeatability

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


# Comparisons of calibrations as text for the screen, in the tables of the paper.
#
# [1] S. Liu et al., "Portable light pen 3D vision coordinate measuring system - probe
# tip center calibration", Measurement Science Review 13 (2013) 194-199, table 1.


TITLE, COLUMN = 24, 10  # characters


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


def verdict_lines(assessment: VerificationAssessment, rule: Message) -> list[str]:
    """Return the lines of a verdict."""
    return [
        f"Verdict      {assessment.grade.upper()}: {assessment.reason}",
        f"             {assessment.next_step}",
        f"             {rule}",
    ]
