"""When a swing is due, and whether the one that began is still what is chosen."""

from dataclasses import replace

import pytest

from lightpen.messages import message
from lightpen.record.swings.header import Names
from lightpen.swing.preparation import Preparation
from lightpen.swing.status import OperatorPresence

WHY = message("system.full")


@pytest.fixture
def ready(prepared: Preparation) -> OperatorPresence:
    """Somebody is there and all is chosen."""
    return OperatorPresence(choices=prepared).arrived()


def test_a_swing_is_due_when_somebody_is_there_and_nothing_lacks(
    ready: OperatorPresence, prepared: Preparation
) -> None:
    lacking = replace(prepared, pen_file=None)

    assert ready.is_due
    assert not OperatorPresence(choices=prepared).is_due
    assert not OperatorPresence().arrived().is_due
    assert not replace(ready, choices=lacking).is_due
    assert not ready.left().is_due


def test_what_was_refused_is_not_due_until_somebody_comes_or_a_swing_begins(
    ready: OperatorPresence,
) -> None:
    refused = replace(ready, refusal=WHY)

    assert not refused.is_due
    assert not refused.left().is_due
    assert refused.arrived().is_due
    assert refused.begun().is_due


def test_nobody_is_away_before_somebody_has_left() -> None:
    assert not OperatorPresence().is_away
    assert not OperatorPresence().arrived().is_away
    assert OperatorPresence().arrived().left().is_away
    assert not OperatorPresence().arrived().left().arrived().is_away


def test_who_comes_or_begins_ends_a_pause_by_leaving(ready: OperatorPresence) -> None:
    paused = replace(ready.left(), paused_by_leaving=True)

    assert not paused.arrived().paused_by_leaving
    assert not paused.begun().paused_by_leaving
    assert paused.begun().is_away  # who begins may be elsewhere


def test_choices_are_others_from_when_a_swing_began_until_they_are_like_its_own(
    ready: OperatorPresence, prepared: Preparation
) -> None:
    others = replace(prepared, names=Names(operator="Bob"))
    begun = ready.begun()
    changed = replace(begun, choices=others)

    assert not ready.has_other_choices
    assert not begun.has_other_choices
    assert changed.has_other_choices
    assert not replace(changed, choices=prepared).has_other_choices
    assert not changed.begun().has_other_choices
    assert not replace(ready, choices=others).has_other_choices  # none began


def test_files_that_are_read_after_a_swing_was_resumed_are_no_other_choices(
    prepared: Preparation,
) -> None:
    unread = replace(prepared, camera_file=None, pen_file=None)
    resumed = OperatorPresence(choices=unread, begun_with=unread)

    read = resumed.choose(prepared)
    assert not read.has_other_choices

    assert prepared.pen_file is not None
    other = replace(prepared, pen_file=replace(prepared.pen_file))
    assert read.choose(other).has_other_choices
