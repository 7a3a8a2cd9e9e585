"""Tests of what holds for each verification task."""

from dataclasses import fields, replace

import pytest
from msgspec import json

from lightpen.model.limits import VerificationLimits
from lightpen_extensions.measure.measuring.plan import free_plan
from lightpen_extensions.measure.tasks.drift import DRIFT
from lightpen_extensions.measure.tasks.part import PART
from lightpen_extensions.measure.tasks.registry import TASKS, AnyTask, task_of
from lightpen_extensions.measure.tasks.task import TaskProgress, VerificationChoices

tasks = pytest.mark.parametrize("task", TASKS, ids=[each.kind for each in TASKS])
PLANNED = VerificationChoices(PART.kind, free_plan("Part"))


def test_kinds_differ() -> None:
    assert len({task.kind for task in TASKS}) == len(TASKS)
    assert all(task_of(task.kind) is task for task in TASKS)


def test_choices_are_read_back_as_they_were() -> None:
    assert json.decode(json.encode(PLANNED), type=VerificationChoices) == PLANNED


def test_the_missing_entry_of_the_chosen_task_is_named() -> None:
    missing = PART.missing(replace(PLANNED, plan=None), None)

    assert missing is not None
    assert missing.code == "part.no-plan"
    assert PART.missing(PLANNED, None) is None
    assert DRIFT.missing(VerificationChoices(), None) is None


@tasks
def test_limits_are_those_of_a_verification(task: AnyTask) -> None:
    assert {*task.limits} <= {item.name for item in fields(VerificationLimits)}


@tasks
def test_a_task_at_its_start_says_what_to_do(task: AnyTask) -> None:
    choices, progress = VerificationChoices(), TaskProgress()

    assert str(task.instruction(choices, progress))
    assert str(task.counted(choices, progress))
    assert str(task.headline(progress, is_next=False)) == str(task.first)
    assert task.done(choices, progress) == 0.0
