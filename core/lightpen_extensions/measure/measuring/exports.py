"""Measured parts for other programs, in one table of formats.

CSV has a row for each characteristic, Q-DAS (AQDEF) a value for each, and QIF 3.0 [1]_
the results with their tolerances.

References
----------
.. [1] ISO 23952:2020, "Automation systems and integration. Quality information
   framework (QIF)".
"""

import numpy as np

from lightpen.formats.csv_cells import csv_table
from lightpen.formats.file_format import FileFormat
from lightpen.local_time import local_now
from lightpen.messages import message, printable
from lightpen_extensions.measure.measuring.part import MeasuredPart
from lightpen_extensions.measure.measuring.qif import qif_text

N_DECIMALS = 6


def _csv(part: MeasuredPart) -> str:
    head = ["characteristic", "quantity", "features", "unit", "nominal", "lower_limit"]
    head += ["upper_limit", "actual", "deviation", "expanded_uncertainty"]
    head += ["decision", "probability_of_conformity"]
    rows: list[list[object]] = [list(head)]
    for result in part.results:
        planned = result.planned
        limits = ["" if np.isinf(x) else x for x in (result.lower, result.upper)]
        rows.append(
            [
                *(planned.label, planned.quantity.value, " ".join(planned.of)),
                *(planned.unit, planned.nominal, *limits),
                *(result.value.value, result.deviation, result.value.uncertainty),
                "" if result.decision is None else result.decision.value,
                result.probability,
            ]
        )
    return csv_table([["" if x is None else x for x in row] for row in rows])


def _qdas(part: MeasuredPart) -> str:
    """Return the plan's characteristics and their values as Q-DAS."""
    name, when = printable(part.plan.name), f"{local_now():%d.%m.%Y/%H:%M:%S}"
    lines = [f"K0100 {len(part.results)}", f"K1001 {name}", f"K1002 {name}"]
    for i, result in enumerate(part.results, start=1):
        planned = result.planned
        lines += [f"K2001/{i} {i}", f"K2002/{i} {printable(planned.label)}"]
        lines += [f"K2022/{i} {N_DECIMALS}", f"K2142/{i} {planned.unit}"]
        if planned.nominal is not None:
            lines.append(f"K2101/{i} {planned.nominal:.{N_DECIMALS}f}")
        ends = result.lower, result.upper
        for key, limit in zip(("K2110", "K2111"), ends, strict=True):
            if np.isfinite(limit):
                lines.append(f"{key}/{i} {limit:.{N_DECIMALS}f}")
        lines.append(f"K2900/{i} U (k=2) {result.value.uncertainty:.{N_DECIMALS}f}")
    for i, result in enumerate(part.results, start=1):
        lines += [f"K0001/{i} {result.value.value:.{N_DECIMALS}f}", f"K0002/{i} 0"]
        lines.append(f"K0004/{i} {when}")
    return "\n".join(lines) + "\n"


EXPORTS = (
    FileFormat("csv", message("part.csv"), ".csv", _csv),
    FileFormat("qdas", message("part.qdas"), ".dfq", _qdas),
    FileFormat("qif", message("part.qif"), ".qif", qif_text),
)
