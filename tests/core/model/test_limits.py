"""The limits of a station, and how long a tip may be used."""

from dataclasses import fields
from datetime import UTC, datetime, timedelta

import pytest

from lightpen.model.limits import (
    LIMITS,
    DueRule,
    StationLimits,
    SwingLimits,
    VerificationLimits,
)

NOON = datetime(2026, 1, 2, 12, tzinfo=UTC)


def test_a_tip_is_due_thirty_days_after_it_was_accepted_unless_chosen() -> None:
    assert DueRule().due(NOON) == NOON + timedelta(days=30)
    assert DueRule(7).due(NOON) == NOON + timedelta(days=7)


def test_a_rule_by_which_no_tip_can_be_in_force_is_refused() -> None:
    with pytest.raises(ValueError, match="No tip can be due by"):
        DueRule(0)


def test_every_limit_of_a_verification_and_of_due_tips_is_listed() -> None:
    listed = {(limit.part, limit.name) for limit in LIMITS}

    wanted = {("verification", each.name) for each in fields(VerificationLimits)}
    wanted |= {("due", each.name) for each in fields(DueRule)}
    assert wanted < listed
    assert {name for part, name in listed - wanted if part == "swing"} == {
        "max_uncertainty",
        "min_images",
        "max_images",
        "requires_temperature",
    }


def test_limits_are_changed_by_their_keys_and_counts_stay_whole() -> None:
    usual = StationLimits()
    values = {limit.key: usual.value(limit) for limit in LIMITS}
    assert len(values) == len(LIMITS)
    assert usual.with_values(values) == usual

    changed = usual.with_values({"max_radius_mm": 0.005, "min_images": 80.0})
    assert changed.verification == VerificationLimits(radius=0.005)
    assert changed.swing == SwingLimits(min_images=80)
    assert isinstance(changed.swing.min_images, int)
    strict = usual.with_values({"requires_temperature": 1.0})
    assert strict.swing == SwingLimits(requires_temperature=True)
    with pytest.raises(ValueError, match="requires_temperature"):
        usual.with_values({"requires_temperature": 2.0})
