"""A pen as a table; see `lightpen.formats.pen_files`."""

import re
from dataclasses import replace

import numpy as np

from lightpen.errors import FileError
from lightpen.formats.pen_content import (
    LENGTHS,
    RANGES,
    UNIT_NAMES,
    UNITS,
    PenContent,
    agreed_unit,
    check_diameter,
    checked_number,
    stated_numbers,
    unit_normal,
)
from lightpen.formats.tables import Table, number_flaw
from lightpen.messages import message
from lightpen.model.pen import Pen

_LED_NAMES = (
    *("led", "no", "no.", "nr", "nr.", "number", "id", "point"),
    *("name", "label", "marker", "feature", "element", "led name", "led_name"),
)
_COORDINATES = (("x",), ("y",), ("z",))
_NOMINAL = " nominal"
_NORMALS = (("nx",), ("ny",), ("nz",))
_COLUMN = (
    r"(nx|ny|nz|x|y|z|diameter_sigma|diameter|led_sigma|scale_sigma)"
    r"(?:[\s_]*(act|actual|meas|measured|ist)|[\s_]*(nom|nominal|soll))?"
    r"(?:[\s_/]*(?:[\[(]\s*)?([a-zμ]+)\s*[\])]?)?"
)


def from_table(table: Table, units: str | None) -> PenContent:
    """Return the pen of a table; refuse an incomplete one.

    ``units`` apply to lengths of a file that states none; see `agreed_unit`.
    """
    table, row_of_units = _without_units(table)
    named = [_name_and_unit(column) for column in table.header]
    if not any(name in ("x", "y", "z") for name, _ in named):
        # Nominal coordinates are better than none.
        named = [(name.removesuffix(_NOMINAL), unit) for name, unit in named]
    if row_of_units:
        pairs = zip(named, row_of_units, strict=True)
        named = [(name, unit or below) for (name, unit), below in pairs]
    stated = {unit for name, unit in named if unit and name in ("x", "y", "z")}
    if len(stated) > 1:
        one, other = sorted(stated)[:2]
        raise FileError("pen-file.mixed-units", name=table.name, one=one, other=other)
    unit = agreed_unit(stated.pop() if stated else "", units, table.name)
    bare = replace(table, header=tuple(name for name, _ in named))
    with_normals = "nx" in bare.header or (not bare.header and bare.n_columns == 7)
    wanted = [_LED_NAMES, *_COORDINATES, *(_NORMALS if with_normals else ())]
    columns = bare.columns(wanted, message("table.of-leds"))
    _check_numbering(table, columns[0])
    numbers = table.numbers(columns[1:])
    diameter = None
    if "diameter" in bare.header:
        place = bare.header.index("diameter")
        diameter = _common(table, place, bare) * UNITS[named[place][1] or unit]
        check_diameter(diameter, table.name)
    further = {}
    for what in RANGES:
        if what in bare.header:
            place = bare.header.index(what)
            size = UNITS[named[place][1] or unit] if what in LENGTHS else 1.0
            number = _common(table, place, bare) * size
            further[what] = checked_number(what, number, table.name)
    normals = None
    if with_normals:
        normals = np.empty((len(numbers), 3))
        for i, line in enumerate(table.lines):
            where = message("pen-file.line", line=line, name=table.name)
            normals[i] = unit_normal(numbers[i, 3:], where)
    return PenContent(numbers[:, :3] * UNITS[unit], normals, diameter, stated=further)


def _name_and_unit(column: str) -> tuple[str, str]:
    """Return the name of a column without its unit, and the unit or an empty string."""
    match = re.fullmatch(_COLUMN, column)
    if not match:
        return column, ""
    unit = UNIT_NAMES.get(match[4] or "", "")
    name = match[1] + (_NOMINAL if match[3] else "")
    return (name, unit) if unit or not match[4] else (column, "")


def _without_units(table: Table) -> tuple[Table, list[str]]:
    """Return a table without its row of units, and the units; none without one."""
    first = [
        UNIT_NAMES.get(cell.strip("[]() ").casefold(), "") for cell in table.rows[0]
    ]
    if not table.header or sum(map(bool, first)) < 3 or len(table.rows) < 2:
        return table, []
    return replace(table, rows=table.rows[1:], lines=table.lines[1:]), first


def _check_numbering(table: Table, column: int) -> None:
    """Refuse LEDs that are not numbered 1, 2, 3 and so on from row to row.

    Names without numbers, or numbers from 0 in names, are in order.
    """
    cells = [row[column] for row in table.rows]
    if any(number_flaw(cell) for cell in cells):
        ends = [re.search(r"(?a)\d+$", cell) for cell in cells]
        if not all(ends) or not all(cells):
            if all(cells) and len(set(cells)) == len(cells) and not any(ends):
                return
            table.whole_numbers(column)  # names the line
        shown = [end[0] for end in ends if end is not None]
        least = min(int(shown[0]), 1)
        places = [str(int(each) - least + 1) for each in shown]
        rows = [[place] for place in places]
        table, column = replace(table, rows=rows), 0
    numbers = table.whole_numbers(column)
    wrong = numbers != np.arange(1, len(numbers) + 1)
    if not np.any(wrong):
        return
    row = int(np.argmax(wrong))
    found, needed = int(numbers[row]), row + 1
    earlier = np.flatnonzero(numbers[:row] == found)
    if len(earlier):
        flaw = message("pen-file.listed-twice", led=found, line=table.lines[earlier[0]])
    elif needed in numbers:
        flaw = message(
            "pen-file.out-of-order", led=found, needed=needed, n_leds=len(numbers)
        )
    else:
        flaw = message("pen-file.gap", led=found, needed=needed)
    raise table.error(row, flaw)


def _common(table: Table, column: int, bare: Table) -> float:
    """Return the number that all rows of a column share."""
    numbers = table.numbers([column])[:, 0]
    other = numbers != numbers[0]
    if np.any(other):
        raise table.error(
            int(np.argmax(other)),
            message(
                "pen-file.column-differs",
                what=bare.header[column],
                value=numbers[other][0],
                first=numbers[0],
            ),
        )
    return float(numbers[0])


def csv_text(pen: Pen) -> str:
    """Return the LEDs of a pen as a table."""
    stated = stated_numbers(pen)
    header = "led,x_mm,y_mm,z_mm,nx,ny,nz,diameter_mm"
    header += "".join(
        f",{what}_mm" if what in LENGTHS else f",{what}" for what in stated
    )
    lines = [header]
    for number, (led, normal) in enumerate(
        zip(pen.leds.tolist(), pen.normals.tolist(), strict=True), 1
    ):
        cells = [number, *led, *normal, float(pen.diameter), *stated.values()]
        lines.append(",".join(map(repr, cells)))
    return "\n".join(lines) + "\n"
