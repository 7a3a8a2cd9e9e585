"""Tests of `lightpen_extensions.comparisons.assessment`."""

import pytest

from lightpen.estimation.reports.verdict import Grade
from lightpen.messages import message
from lightpen.model.coverage import DecisionRule
from lightpen.model.limits import VerificationLimits
from lightpen_extensions.comparisons.assessment import (
    VERIFY_AGAIN,
    accepted,
    check,
    graded,
    worst,
)

REASON = message("drift.too-few")


# Limit 0.02 mm: relevant from 0.005 mm on.
@pytest.mark.parametrize(
    ("value", "uncertainty", "rule", "grade"),
    [
        (0.004, 0.001, DecisionRule.SIMPLE, Grade.PASS),  # certain, but irrelevant
        (-0.018, 0.02, DecisionRule.SIMPLE, Grade.PASS),  # may be chance
        (-0.018, 0.01, DecisionRule.SIMPLE, Grade.CHECK),  # more than chance
        (0.021, 0.001, DecisionRule.SIMPLE, Grade.REPEAT),
        (0.0, 0.025, DecisionRule.GUARD_BAND, Grade.CHECK),  # nothing is proven
        (0.004, 0.01, DecisionRule.GUARD_BAND, Grade.PASS),
    ],
)
def test_a_significant_and_relevant_error_is_never_accepted_in_silence(
    value: float, uncertainty: float, rule: DecisionRule, grade: Grade
) -> None:
    limits = VerificationLimits(rule=rule)

    assert graded(value, uncertainty, 0.02, limits) is grade


def test_of_tasks_that_pass_one_that_verifies_the_tip_counts() -> None:
    scale, tip = accepted(REASON, REASON, Grade.SCALE), accepted(REASON)
    doubt = check(REASON, VERIFY_AGAIN)

    assert worst([scale, tip]) is tip
    assert worst([scale, tip, doubt]) is doubt
