"""Tests of `lightpen.verification.session.choices`."""

from lightpen.verification.session.choices import VerificationChoices
from lightpen.verification.tasks.circle import CIRCLE, CircleOptions
from lightpen.verification.tasks.drift import DRIFT
from lightpen.verification.tasks.fixed_point import FIXED_POINT, FixedPointOptions
from lightpen.verification.tasks.length import LENGTH


def test_tasks_are_added_and_removed_in_the_order_of_all() -> None:
    both = VerificationChoices((CIRCLE.kind,)).with_task(FIXED_POINT, is_chosen=True)

    assert both.kinds == (FIXED_POINT.kind, CIRCLE.kind)
    assert both.with_task(FIXED_POINT, is_chosen=False).kinds == (CIRCLE.kind,)
    assert both.with_task(LENGTH, is_chosen=False) == both
    assert both.with_task(CIRCLE, is_chosen=True) == both


def test_only_options_that_differ_from_the_usual_are_kept() -> None:
    ring = CircleOptions(20.0, 0.001)
    chosen = VerificationChoices().with_options(ring).with_options(FixedPointOptions())

    assert chosen.options == (ring,)
    assert chosen.options_of(CIRCLE) == ring
    assert chosen.options_of(FIXED_POINT) == FixedPointOptions()
    assert chosen.with_options(CircleOptions()).options == ()


def test_the_first_missing_entry_of_a_chosen_task_is_named() -> None:
    tasks = FIXED_POINT.kind, CIRCLE.kind, DRIFT.kind
    chosen = VerificationChoices(tasks)
    missing, none = chosen.missing(None), VerificationChoices(()).missing(None)

    assert missing is not None
    assert missing.code == "verification.no-radius"
    assert chosen.with_options(CircleOptions(20.0, 0.001)).missing(None) is None
    assert none is not None
    assert none.code == "verification.no-task"
