"""Measured parts for other programs, in one table of formats.

CSV has a row for each characteristic, Q-DAS (AQDEF) a value for each, QIF 3.0 [1]_ the
results with their tolerances, and DXF (R12) the geometry in the frame of the part.

References
----------
.. [1] ISO 23952:2020, "Automation systems and integration. Quality information
   framework (QIF)".
"""

import numpy as np

from lightpen.formats.csv_cells import csv_table
from lightpen.formats.file_format import FileFormat
from lightpen.local_time import local_now
from lightpen.measuring.characteristics import Measured
from lightpen.measuring.drawing import outline_of
from lightpen.measuring.part import MeasuredPart
from lightpen.measuring.qif import qif_text
from lightpen.messages import message, printable

N_DECIMALS = 6
ENDS = ("10", "20", "30", "11", "21", "31")  # codes of x, y, z of a line in DXF


def _csv(part: MeasuredPart) -> str:
    head = ["characteristic", "quantity", "features", "unit", "nominal", "lower_limit"]
    head += ["upper_limit", "actual", "deviation", "expanded_uncertainty"]
    head += ["decision", "probability_of_conformity"]
    rows: list[list[object]] = [list(head)]
    for result in part.results:
        planned = result.planned
        limits = ["" if np.isinf(x) else x for x in planned.limits]
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
        for key, limit in zip(("K2110", "K2111"), planned.limits, strict=True):
            if np.isfinite(limit):
                lines.append(f"{key}/{i} {limit:.{N_DECIMALS}f}")
        lines.append(f"K2900/{i} U (k=2) {result.value.uncertainty:.{N_DECIMALS}f}")
    for i, result in enumerate(part.results, start=1):
        lines += [f"K0001/{i} {result.value.value:.{N_DECIMALS}f}", f"K0002/{i} 0"]
        lines.append(f"K0004/{i} {when}")
    return "\n".join(lines) + "\n"


def _dxf(part: MeasuredPart) -> str:
    """Return the lines of the features, each on a layer of its name."""
    entities = [
        line for name, one in part.features.items() for line in _drawn(name, one)
    ]
    pairs = ["0", "SECTION", "2", "HEADER", "9", "$ACADVER", "1", "AC1009"]
    pairs += ["0", "ENDSEC", "0", "SECTION", "2", "ENTITIES", *entities]
    return "\n".join([*pairs, "0", "ENDSEC", "0", "EOF"]) + "\n"


def _drawn(name: str, one: Measured) -> list[str]:
    layer = "".join(c if c.isalnum() and c.isascii() else "_" for c in name).upper()
    cells: list[str] = []
    for line in outline_of(one, in_part=True):
        for ends in np.hstack([line[:-1], line[1:]]).tolist():
            cells += ["0", "LINE", "8", layer]
            for code, value in zip(ENDS, ends, strict=True):
                cells += [code, f"{value:.{N_DECIMALS}f}"]
    return cells


EXPORTS = (
    FileFormat("csv", message("part.csv"), ".csv", _csv),
    FileFormat("qdas", message("part.qdas"), ".dfq", _qdas),
    FileFormat("qif", message("part.qif"), ".qif", qif_text),
    FileFormat("dxf", message("part.dxf"), ".dxf", _dxf),
)
