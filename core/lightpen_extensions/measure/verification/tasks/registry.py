"""The verification tasks in their order, and the task of a part."""

from functools import reduce
from operator import or_
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from lightpen_extensions.measure.verification.tasks.drift import DRIFT
from lightpen_extensions.measure.verification.tasks.fixed_point import FIXED_POINT
from lightpen_extensions.measure.verification.tasks.part import PART
from lightpen_extensions.measure.verification.tasks.task import (
    TaskOptions,
    VerificationTask,
)

AnyTask: TypeAlias = VerificationTask[Any, Any]

TASKS: tuple[AnyTask, ...] = (FIXED_POINT, DRIFT)
ALL_TASKS: tuple[AnyTask, ...] = (*TASKS, PART)  # with the task of the step Measure

_BY_KIND = {task.kind: task for task in ALL_TASKS}

if TYPE_CHECKING:
    TaskKind: TypeAlias = str
    AnyOptions: TypeAlias = TaskOptions
else:  # makes msgspec accept exactly the registered ones
    TaskKind = Literal[tuple(_BY_KIND)]
    AnyOptions = reduce(or_, (task.options for task in ALL_TASKS))


def task_of(kind: TaskKind) -> AnyTask:
    """Return the task of a kind."""
    return _BY_KIND[kind]
