"""Verifications as JSON records, text tables and control charts."""

from collections.abc import Sequence

import numpy as np

from lightpen.comparisons.assessment import VerificationAssessment
from lightpen.comparisons.records import COLUMN, verdict_lines
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.messages import Message, message
from lightpen.model.coverage import COVERAGE_FACTOR
from lightpen_extensions.measure.tasks.probed_point import ProbedPoint, RejectedFrame
from lightpen_extensions.measure.tasks.task import ResultRow, ResultTable

MOST_COLUMNS = 10  # runs beside each other
MOST_NAMED = 5  # images
NAME = 28  # characters


def found_text(
    tables: Sequence[ResultTable],
    assessment: VerificationAssessment,
    rejected: Sequence[RejectedFrame],
    rule: Message,
    remarks: Sequence[Message] = (),
) -> str:
    """Return the result of a task as text, with remarks on the instrument."""
    lines = [line for table in tables for line in _table(table)]
    lines += [*map(str, remarks), *_left_out(rejected)]
    return "\n".join([*lines, "", *verdict_lines(assessment, rule)])


def touches_text(
    touches: Sequence[ProbedPoint],
    instrument: Instrument,
    rejected: Sequence[RejectedFrame],
) -> str:
    """Return points with their uncertainty as text."""
    rows = []
    for touch in touches:
        spread = np.sqrt(np.diag(touch.covariance(instrument)))
        values = [*touch.point_cam.tolist(), *(COVERAGE_FACTOR * spread).tolist()]
        rows.append(ResultRow(touch.label, values))
    columns = (*"uvw", *(message("drift.axis", axis=axis) for axis in "uvw"))
    table = ResultTable(message("table.points"), columns, tuple(rows))
    lines = [*_table(table), "U has k = 2.", *map(str, instrument.remarks)]
    return "\n".join([*lines, *_left_out(rejected)])


def _table(table: ResultTable) -> list[str]:
    """Return a table as lines; one of many columns is parted."""
    lines, n_columns = [f"{table.title}"], len(table.columns)
    for first in range(0, n_columns, MOST_COLUMNS):
        own = slice(first, first + MOST_COLUMNS)
        heads = [str(head) for head in table.columns[own]]
        width = max(COLUMN, *(len(head) + 2 for head in heads))
        lines.append(" " * NAME + "".join(f"{head:>{width}}" for head in heads))
        for row in table.rows:
            cells = "".join(f"{text:>{width}}" for text in row.texts()[own])
            words = f"{str(row.name)[:NAME]:<{NAME}}{cells}"
            lines.append(f"{words}  {row.remark}" if row.remark else words)
    return [line.rstrip() for line in (*lines, *map(str, table.notes))]


def _left_out(rejected: Sequence[RejectedFrame]) -> list[str]:
    if not rejected:
        return []
    named = ", ".join(f"{each.name} ({each.reason})" for each in rejected[:MOST_NAMED])
    more = ", ..." if len(rejected) > MOST_NAMED else ""
    return [f"{len(rejected)} images left out: {named}{more}"]
