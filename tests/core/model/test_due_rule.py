"""How long a tip may be in force."""

from datetime import UTC, datetime, timedelta

import pytest

from lightpen.model.due_rule import DueRule

NOON = datetime(2026, 1, 2, 12, tzinfo=UTC)


def test_a_tip_is_due_thirty_days_after_it_was_accepted_unless_chosen() -> None:
    assert DueRule().due(NOON) == NOON + timedelta(days=30)
    assert DueRule(7).due(NOON) == NOON + timedelta(days=7)


@pytest.mark.parametrize(("days", "swings"), [(0, 0), (30, -1)])
def test_a_rule_by_which_no_tip_can_be_in_force_is_refused(
    days: int, swings: int
) -> None:
    with pytest.raises(ValueError, match="No tip can be due by"):
        DueRule(days, swings)
