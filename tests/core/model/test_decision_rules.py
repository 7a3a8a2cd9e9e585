"""Tests of `lightpen.model.coverage`."""

import numpy as np
import pytest

from lightpen.model.coverage import (
    Decision,
    DecisionRule,
    conformity_probability,
    decide,
)
from lightpen.model.limits import VerificationLimits


def test_the_probability_of_conformity_is_the_share_of_true_values_in_the_limits() -> (
    None
):
    rng = np.random.default_rng(1)
    true = rng.normal(0.7, 0.2, 200_000)  # U = 0.4

    found = conformity_probability(0.7, 0.4, lower=-1.0, upper=1.0)

    assert found == pytest.approx(np.mean(np.abs(true) <= 1.0), abs=0.003)
    assert conformity_probability(1.1, 0.0, upper=1.0) == 0.0
    assert conformity_probability(1.0, 0.4, upper=1.0) == pytest.approx(0.5)


# Upper limit 1, U = 0.2: the guard band is 0.165; 5 % of risk the same, one-sided.
@pytest.mark.parametrize(
    ("rule", "value", "wanted"),
    [
        (DecisionRule.SIMPLE, 1.0, Decision.ACCEPTED),
        (DecisionRule.SIMPLE, 1.001, Decision.REJECTED),
        (DecisionRule.GUARD_BAND, 0.83, Decision.ACCEPTED),
        (DecisionRule.GUARD_BAND, 0.84, Decision.OPEN),
        (DecisionRule.GUARD_BAND, 1.16, Decision.OPEN),
        (DecisionRule.GUARD_BAND, 1.17, Decision.REJECTED),
        (DecisionRule.RISK, 0.83, Decision.ACCEPTED),
        (DecisionRule.RISK, 0.84, Decision.OPEN),
        (DecisionRule.RISK, 1.17, Decision.REJECTED),
    ],
)
def test_each_rule_has_its_acceptance_limit(
    rule: DecisionRule, value: float, wanted: Decision
) -> None:
    assert decide(rule, value, 0.2, upper=1.0) is wanted


def test_a_smaller_risk_needs_more_room() -> None:
    assert decide(DecisionRule.RISK, 0.8, 0.2, upper=1.0) is Decision.ACCEPTED
    found = decide(DecisionRule.RISK, 0.8, 0.2, upper=1.0, max_risk=0.01)
    assert found is Decision.OPEN


def test_an_uncertainty_wider_than_the_limits_proves_nothing() -> None:
    limits = VerificationLimits(rule=DecisionRule.RISK)

    assert limits.decision(0.0, 0.1, 0.02) is Decision.OPEN
    assert limits.decision(0.0, 0.01, 0.02) is Decision.ACCEPTED
    assert limits.decision(-0.2, 0.01, 0.02) is Decision.REJECTED
