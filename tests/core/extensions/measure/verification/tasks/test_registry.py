"""Tests of what holds for each verification task."""

from dataclasses import fields

import pytest
from msgspec import json

from lightpen.model.limits import VerificationLimits
from lightpen_extensions.measure.verification.session.choices import VerificationChoices
from lightpen_extensions.measure.verification.tasks.registry import (
    TASKS,
    AnyOptions,
    AnyTask,
    task_of,
)
from lightpen_extensions.measure.verification.tasks.task import TaskProgress

tasks = pytest.mark.parametrize("task", TASKS, ids=str)


def test_kinds_and_options_differ() -> None:
    assert len({task.kind for task in TASKS}) == len(TASKS)
    assert len({task.options for task in TASKS}) == len(TASKS)
    assert all(task_of(task.kind) is task for task in TASKS)


@tasks
def test_options_are_read_back_as_they_were(task: AnyTask) -> None:
    kept = json.encode((task.options(),))

    assert json.decode(kept, type=tuple[AnyOptions, ...]) == (task.options(),)


@tasks
def test_limits_are_those_of_a_verification(task: AnyTask) -> None:
    assert {*task.limits} <= {item.name for item in fields(VerificationLimits)}


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
