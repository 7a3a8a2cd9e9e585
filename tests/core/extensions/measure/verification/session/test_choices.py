"""Tests of `lightpen_extensions.measure.verification.session.choices`."""

from lightpen_extensions.measure.measuring.plan import free_plan
from lightpen_extensions.measure.verification.session.choices import VerificationChoices
from lightpen_extensions.measure.verification.tasks.drift import DRIFT
from lightpen_extensions.measure.verification.tasks.fixed_point import (
    FIXED_POINT,
    FixedPointOptions,
)
from lightpen_extensions.measure.verification.tasks.part import PART
from lightpen_extensions.measure.verification.tasks.part_course import PartOptions

PLAN = PartOptions(free_plan("Part"))


def test_only_options_that_differ_from_the_usual_are_kept() -> None:
    chosen = VerificationChoices().with_options(PLAN).with_options(FixedPointOptions())

    assert chosen.options == (PLAN,)
    assert chosen.options_of(PART) == PLAN
    assert chosen.options_of(FIXED_POINT) == FixedPointOptions()
    assert chosen.with_options(PartOptions()).options == ()


def test_the_missing_entry_of_the_chosen_task_is_named() -> None:
    chosen = VerificationChoices(PART.kind)
    missing = chosen.missing(None)

    assert missing is not None
    assert missing.code == "part.no-plan"
    assert chosen.with_options(PLAN).missing(None) is None
    assert VerificationChoices(DRIFT.kind).missing(None) is None
