"""The checks of a tip in their order, and artefacts measured by their plan."""

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.messages import Message, message
from lightpen.model.artefacts import Artefact, ArtefactKind
from lightpen_extensions.measure.measuring.plan import are_of_second_end, artefact_plan
from lightpen_extensions.measure.measuring.report import ResultRow, ResultTable
from lightpen_extensions.measure.measuring.surfaces import ROUND
from lightpen_extensions.measure.tasks.drift import DRIFT
from lightpen_extensions.measure.tasks.fixed_point import FIXED_POINT
from lightpen_extensions.measure.tasks.part import PART, Part, measure_by_plan, sizes_of
from lightpen_extensions.measure.tasks.task import (
    Conditions,
    Runs,
    VerificationChoices,
    VerificationTask,
)

AnyTask: TypeAlias = VerificationTask[Any]

TASKS: tuple[AnyTask, ...] = (FIXED_POINT, DRIFT)
ALL_TASKS: tuple[AnyTask, ...] = (*TASKS, PART)  # with the task of the step Measure


def task_of(kind: str) -> AnyTask:
    """Return the task of a kind."""
    return next(task for task in ALL_TASKS if task.kind == kind)


def measure_artefacts(
    name: str, artefacts: Sequence[Artefact], runs: Runs, conditions: Conditions
) -> Part:
    """Measure an artefact at each of several places.

    A run has the points of a place, in a length those of both ends. Raises
    `CalibrationError` if they do not determine the size.
    """
    plan = artefact_plan(name, artefacts, {})
    parted = []
    for (run, points), artefact in zip(runs, artefacts, strict=True):
        if artefact.kind is not ArtefactKind.LENGTH:
            parted.append(points)
            continue
        places = np.array([each.point_cam for each in points]).reshape(-1, 3)
        second = are_of_second_end(run, places, artefact.certified)
        ends = (np.flatnonzero(end) for end in (~second, second))
        parted += [[points[int(i)] for i in end] for end in ends]
    names = [each.name for each in plan.features]
    named = list(zip(names, parted, strict=True))
    return measure_by_plan(named, conditions, VerificationChoices(plan=plan))


def size_table(found: Part) -> ResultTable:
    """Return the sizes and their errors beside each other: the paper's Table 3."""
    results = sizes_of(found.part)
    n_runs = len(results)
    sizes = np.array([each.value.value for each in results])
    certified = np.array([each.planned.nominal or 0.0 for each in results])
    errors = sizes - certified

    def row(name: Message, values: FloatArray, decimals: int = 4) -> ResultRow:
        more = [float(values.mean()), float(values.std(ddof=1))] if n_runs > 1 else []
        return ResultRow(name, [*values.tolist(), *more], decimals)

    relative = 1e4 * errors / np.maximum(certified, np.finfo(float).tiny)
    of_each = [
        (message("table.uncertainty"), [each.value.uncertainty for each in results]),
        (message("table.limit"), [each.margin for each in results]),
    ]
    probed = [found.part.features[each.planned.of[0]] for each in results]
    forms = [e.feature.form_error for e in probed if e.kind in ROUND]
    if forms:
        of_each.append((message("part.form"), forms))
    rows = [
        row(message("artefact.size"), sizes),
        row(message("table.error"), errors),
        row(message("artefact.relative"), relative, 2),
        *(ResultRow(name, values) for name, values in of_each),
    ]
    columns: list[Message | str] = [str(i + 1) for i in range(n_runs)]
    if n_runs > 1:
        columns += [message("table.average"), message("table.deviation")]
    return ResultTable(message("artefact.table"), tuple(columns), tuple(rows))
