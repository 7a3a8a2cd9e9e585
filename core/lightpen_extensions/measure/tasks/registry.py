"""The verification tasks in their order, and the task of a part."""

from typing import Any, TypeAlias

from lightpen_extensions.measure.tasks.drift import DRIFT
from lightpen_extensions.measure.tasks.fixed_point import FIXED_POINT
from lightpen_extensions.measure.tasks.part import PART
from lightpen_extensions.measure.tasks.task import VerificationTask

AnyTask: TypeAlias = VerificationTask[Any]

TASKS: tuple[AnyTask, ...] = (FIXED_POINT, DRIFT)
ALL_TASKS: tuple[AnyTask, ...] = (*TASKS, PART)  # with the task of the step Measure


def task_of(kind: str) -> AnyTask:
    """Return the task of a kind."""
    return next(task for task in ALL_TASKS if task.kind == kind)
