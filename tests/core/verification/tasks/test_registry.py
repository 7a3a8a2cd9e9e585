"""Tests of what holds for each verification task."""

from dataclasses import fields

import pytest
from msgspec import json, structs

from lightpen.messages import message
from lightpen.model.limits import VerificationLimits
from lightpen.verification.session.choices import VerificationChoices
from lightpen.verification.tasks.circle import CircleOptions
from lightpen.verification.tasks.fixed_point import FixedPointOptions
from lightpen.verification.tasks.length import LengthOptions
from lightpen.verification.tasks.registry import TASKS, AnyOptions, AnyTask, task_of
from lightpen.verification.tasks.task import (
    NumberOption,
    Surface,
    TaskOptions,
    TaskProgress,
    certificate_option,
    count_option,
)

tasks = pytest.mark.parametrize("task", TASKS, ids=str)


def test_kinds_and_options_differ() -> None:
    assert len({task.kind for task in TASKS}) == len(TASKS)
    assert len({task.options for task in TASKS}) == len(TASKS)
    assert all(task_of(task.kind) is task for task in TASKS)


@tasks
def test_every_field_is_an_option_with_its_limits(task: AnyTask) -> None:
    usual = task.options()
    for option in task.fields:
        value = getattr(usual, option.name)
        if isinstance(option, NumberOption):
            assert option.least <= value <= option.most
        else:
            assert value is Surface.GROOVE
            assert len(option.labels) == len(Surface)


def test_counts_are_no_part_of_an_artefact_and_certificates_may_be_unknown() -> None:
    count = count_option("n_points", message("option.points"), 3, 50)
    assert (count.least, count.most, count.decimals) == (3, 50, 0)
    assert not count.is_of_artefact
    certificate = certificate_option("length_uncertainty")
    assert (certificate.least, certificate.most, certificate.decimals) == (0, 1, 4)
    assert certificate.is_of_artefact
    assert certificate.is_optional


@tasks
def test_options_are_read_back_as_they_were(task: AnyTask) -> None:
    kept = json.encode((task.options(),))

    assert json.decode(kept, type=tuple[AnyOptions, ...]) == (task.options(),)


@tasks
def test_limits_are_those_of_a_verification(task: AnyTask) -> None:
    assert {*task.limits} <= {item.name for item in fields(VerificationLimits)}


@tasks
def test_a_result_stays_valid_with_other_counts_but_not_with_another_artefact(
    task: AnyTask,
) -> None:
    usual = task.options()
    assert task.is_same_artefact(usual, task.options())
    for option in task.fields:
        if isinstance(option, NumberOption):
            value = getattr(usual, option.name)
            other = structs.replace(usual, **{option.name: value + 1})
            assert task.is_same_artefact(usual, other) is not option.is_of_artefact


@tasks
def test_the_usual_options_are_not_kept(task: AnyTask) -> None:
    assert VerificationChoices().with_options(task.options()).options == ()


@tasks
def test_a_task_at_its_start_says_what_to_do(task: AnyTask) -> None:
    options, progress = task.options(), TaskProgress()

    assert str(task.instruction(options, progress))
    assert str(task.counted(options, progress))
    assert str(task.headline(progress, is_next=False)) == str(task.first)
    assert task.done(options, progress) == 0.0


@pytest.mark.parametrize(
    ("options", "ball", "code"),
    [
        (CircleOptions(), 10.0, "verification.no-radius"),
        (CircleOptions(20.0), None, "verification.no-certificate-u"),
        (CircleOptions(20.0, 0.001), None, None),
        (
            CircleOptions(20.0, 0.001, surface=Surface.BORE),
            None,
            "verification.no-ball",
        ),
        (CircleOptions(20.0, 0.001, surface=Surface.BOSS), 10.0, None),
        (LengthOptions(), 10.0, "verification.no-length"),
        (LengthOptions(100.0), None, "verification.no-certificate-u"),
        (LengthOptions(100.0, 0.001), None, None),
        (
            LengthOptions(100.0, 0.001, surface=Surface.BOSS),
            None,
            "verification.no-ball",
        ),
        (LengthOptions(100.0, 0.001, surface=Surface.BORE), 10.0, None),
        (FixedPointOptions(), None, None),
    ],
)
def test_what_has_to_be_entered_before_is_named(
    options: TaskOptions, ball: float | None, code: str | None
) -> None:
    kind = str(type(options).__struct_config__.tag)
    missing = task_of(kind).missing(options, ball)

    assert (None if missing is None else missing.code) == code
