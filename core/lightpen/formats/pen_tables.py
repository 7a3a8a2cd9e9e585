"""A pen as a table; see `lightpen.formats.pen_files`."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import FileError, UsageError
from lightpen.formats.documents import Tree
from lightpen.formats.entries import Entries
from lightpen.formats.files import foreign_program, quoted
from lightpen.formats.tables import Table, number_flaw
from lightpen.messages import Message, message
from lightpen.model.pen import Pen
from lightpen.model.self_calibration import FoundPen

UNITS = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "um": 0.001, "inch": 25.4}
LARGEST_DIAMETER = 100.0  # mm
LARGEST_DEVIATION = 0.5  # mm, of a coordinate
NORMAL_TOLERANCE = 0.01  # of the length of a normal in the file
_SPELLINGS = {
    "mm": ("mm", "millimeter", "millimetre", "millimeters", "millimetres", "毫米"),
    "cm": ("cm", "厘米"),
    "m": ("m", "meter", "metre", "meters", "metres", "米"),
    "um": ("um", "μm", "micron", "microns", "微米"),
    "inch": ("inch", "in", "inches", "英寸"),
}
UNIT_NAMES = {name: unit for unit, names in _SPELLINGS.items() for name in names}
LENGTHS = {"led_sigma", "diameter_sigma"}  # in the unit of the file
# From above the first to the second: mm, relative, 1/K, degrees C.
RANGES = {
    "led_sigma": (0.0, 10.0),
    "scale_sigma": (0.0, 0.01),
    "diameter_sigma": (0.0, 10.0),
    "expansion": (-1e-5, 1e-4),
    "expansion_sigma": (0.0, 1e-4),
    "temperature_c": (-50.0, 100.0),
}


@dataclass(frozen=True, eq=False)
class PenContent:
    """The content of a pen file, mm; None where it states nothing."""

    leds: FloatArray
    normals: FloatArray | None
    diameter: float | None
    nominal_tip: FloatArray | None = None
    name: str = ""
    stated: Mapping[str, float] = field(default_factory=dict)
    covariance: FloatArray | None = None
    normal_covariance: FloatArray | None = None
    found: FoundPen | None = None


def agreed_unit(stated: str, given: str | None, name: str) -> str:
    """Return the unit of a file's lengths, as stated in the file or given by the user.

    Raises `UsageError` if neither says it, or they differ.
    """
    if stated and given and stated != given:
        raise UsageError(
            "pen-file.contradicting-units", name=name, stated=stated, given=given
        )
    unit = stated or given
    if not unit:
        raise UsageError("pen-file.no-units", name=name)
    return unit


def checked_number(what: str, number: float, name: str) -> float:
    """Return a number of a file, checked against `RANGES`."""
    least, most = RANGES[what]
    if not least < number <= most:
        raise FileError(
            "pen-file.number",
            name=name,
            what=what,
            number=number,
            least=least,
            most=most,
        )
    return number


def check_diameter(diameter: float, name: str) -> None:
    """Refuse an implausible disc diameter, mm."""
    if not 0 < diameter <= LARGEST_DIAMETER:
        raise FileError(
            "pen-file.diameter", name=name, diameter=diameter, most=LARGEST_DIAMETER
        )


def unit_normal(normal: FloatArray, place: str | Message) -> FloatArray:
    """Return a normal (3,) of unit length; refuse one that is far from it."""
    squared = float(normal @ normal) if np.abs(normal).max() < 2 else np.inf
    if abs(squared - 1) > 2 * NORMAL_TOLERANCE:
        raise FileError(
            "pen-file.normal-length",
            place=place,
            normal=" ".join(f"{c:g}" for c in normal),
        )
    return normal if abs(squared - 1) < 1e-9 else normal / np.sqrt(squared)


def stated_numbers(pen: Pen) -> dict[str, float]:
    """Return the numbers stated for a pen, by the names of `RANGES`."""
    return {
        what: float(number)
        for what in RANGES
        if (number := getattr(pen, what)) is not None
    }


_LED_NAMES = (
    *("led", "no", "no.", "nr", "nr.", "number", "id", "point"),
    *("name", "label", "marker", "feature", "element", "led name", "led_name"),
)
_COORDINATES = (("x",), ("y",), ("z",))
_NOMINAL = " nominal"
_NORMALS = (("nx",), ("ny",), ("nz",))
_ACTUAL = r"(?:actual|act|measured|meas|istwert|ist)"
_OF_PLAN = r"(nominal|nom|sollwert|soll)"
_PLACE = r"(?:pos(?:ition)?|axis|cent(?:er|re)|[ck]oord(?:inate)?|坐标)"
_COLUMN = (
    rf"(?:{_ACTUAL}[\s_-]+|{_OF_PLAN}[\s_-]+)?"
    rf"(?:{_PLACE}[\s_.-]*)?"
    r"(nx|ny|nz|x|y|z|diameter_sigma|diameter|led_sigma|scale_sigma)"
    rf"(?:[\s_.-]*(?:{_PLACE}|value|wert|轴|值))?"
    rf"(?:[\s_-]*{_ACTUAL}|[\s_-]*{_OF_PLAN})?"
    r"(?:[\s_/,]*(?:in\s+)?(?:[\[(]\s*)?([^\W\d_]+)\s*[\])]?)?"
)
_OTHER_COORDINATE = r"[xyz]\b(?! nominal|.*(tol|dev|diff|abw|err|sigma|std))"


def from_table(table: Table, units: str | None) -> PenContent:
    """Return the pen of a table; refuse an incomplete one.

    ``units`` apply to lengths of a file that states none; see `agreed_unit`.
    """
    table, row_of_units = without_units(table)
    named = [_name_and_unit(column) for column in table.header]
    others = [name for name, _ in named if re.match(_OTHER_COORDINATE, name)]
    if not others and not any(name in ("x", "y", "z") for name, _ in named):
        # Nominal coordinates are better than none.
        named = [(name.removesuffix(_NOMINAL), unit) for name, unit in named]
    if row_of_units:
        pairs = zip(named, row_of_units, strict=True)
        named = [(name, unit or below) for (name, unit), below in pairs]
    stated = {unit for name, unit in named if unit and name in ("x", "y", "z")}
    if len(stated) > 1:
        one, other = sorted(stated)[:2]
        raise FileError("pen-file.mixed-units", name=table.name, one=one, other=other)
    bare = replace(table, header=tuple(name for name, _ in named))
    with_normals = "nx" in bare.header or _has_normals(bare)
    if not bare.header and bare.n_columns == 7 and not with_normals:
        bare = replace(bare, rows=[row[:4] for row in bare.rows])
    names: tuple[str, ...] = _LED_NAMES
    is_named = any(name in names for name in bare.header)
    # Three columns without names are coordinates, unless they begin with LED 1.
    are_places = bare.n_columns == 3 and bare.rows[0][0] not in ("0", "1")
    if not (is_named or bare.header[:1] == ("x",) or (not bare.header and are_places)):
        # What a measuring program calls its elements, not their groups.
        before = range(bare.header.index("x") if "x" in bare.header else 0)
        own = [
            i for i in before if len({row[i] for row in bare.rows}) == len(bare.rows)
        ]
        names += tuple(bare.header[i] for i in (*own, 0)[:1] if bare.header)
        is_named = True
    wanted = [*_COORDINATES, *(_NORMALS if with_normals else ())]
    columns = bare.columns([names, *wanted][not is_named :], message("table.of-leds"))
    unit = agreed_unit(stated.pop() if stated else "", units, table.name)
    if is_named:
        table = _in_number_order(table, columns.pop(0))
    numbers = table.numbers(columns)
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


def _has_normals(table: Table) -> bool:
    """Return whether 7 columns without names end in normals, not in deviations."""
    if table.header or table.n_columns != 7:
        return False
    last = table.numbers(range(4, 7))
    return not np.all((last > 0) & (last < LARGEST_DEVIATION))


def _name_and_unit(column: str) -> tuple[str, str]:
    """Return the name of a column without its unit, and the unit or an empty string."""
    match = re.fullmatch(_COLUMN, column)
    if not match:
        return column, ""
    unit = UNIT_NAMES.get(match[4] or "", "")
    name = match[2] + (_NOMINAL if match[1] or match[3] else "")
    return (name, unit) if unit or not match[4] else (column, "")


def without_units(table: Table) -> tuple[Table, list[str]]:
    """Return a table without its row of units, and the units; none without one."""
    first = [
        UNIT_NAMES.get(cell.strip("[]() ").casefold(), "") for cell in table.rows[0]
    ]
    if not table.header or sum(map(bool, first)) < 3 or len(table.rows) < 2:
        return table, []
    return replace(table, rows=table.rows[1:], lines=table.lines[1:]), first


def _in_number_order(table: Table, column: int) -> Table:
    """Return a table with its LEDs in the order of their numbers, from 1 without gaps.

    Names without numbers, or numbers from 0 in names, are in order.
    """
    cells = [row[column] for row in table.rows]
    numbered = [cell for cell in cells if not cell or re.search(r"(?a)\d$", cell)]
    if not numbered and len(set(cells)) == len(cells):
        return table
    others = [i for i, cell in enumerate(cells) if re.fullmatch(r"\D+", cell)]
    if numbered and others:
        cell = quoted(cells[others[0]])
        raise table.error(others[0], message("pen-file.no-led", cell=cell))
    numbers = table.whole_numbers(column)
    if number_flaw(cells[0]) and numbers.min() == 0:
        numbers += 1
    order = np.argsort(numbers, kind="stable")
    in_order = numbers[order]
    wrong = np.flatnonzero(in_order != np.arange(1, len(numbers) + 1))
    if not len(wrong):
        return table.only(order.tolist())
    twice = np.flatnonzero(np.diff(in_order) == 0)
    if len(twice):
        first, second = map(int, order[twice[0] : twice[0] + 2])
        led, line = int(numbers[first]), table.lines[first]
        raise table.error(second, message("pen-file.listed-twice", led=led, line=line))
    led = int(in_order[wrong[0]])
    flaw = message("pen-file.gap", led=led, needed=int(wrong[0]) + 1)
    raise table.error(int(order[wrong[0]]), flaw)


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


# LED coordinates in the files of other programs, and in workbooks.
#
# A list is found by its name: points as three numbers, with three more of the normal,
# or as mappings with x y z, position and normal; in a mapping, each point has its own
# name. A document that has nothing but points is such a list.


# Where programs list markers, and in what unit if they always use the same.
LISTS = (
    ("marker_positions", "m"),  # rpg_monocular_pose_estimator
    ("TrackedObject/ModelPoints", "m"),  # Rift
    ("lighthouse_config/modelPoints", "m"),  # Vive
    ("ModelPoints", "m"),
    ("fiducials", ""),  # Atracsys, saw
    *((name, "") for name in ("markers", "MarkerPositions", "points", "leds")),
    *(
        (f"{body}/markers", "")
        for body in ("RigidBody", "RigidBodies", "asset", "tool")
    ),
)
_PLACES = ("position", "pos", "xyz", "location", "offset", "coordinates")
_NORMAL_FIELDS = ("normal", "direction", "dir")
_IDS = ("id", "led", "number", "name", "label", "marker")
_AXES = ("x", "y", "z")
_ROM = b"NDI\x00"


class Markers(NamedTuple):
    """Points of a list, in its own unit."""

    points: FloatArray  # (L, 3)
    normals: FloatArray | None  # (L, 3)
    unit: str  # empty if it does not go without saying


def refuse_foreign_list(data: bytes, name: str) -> None:
    """Refuse the file of a program whose points cannot be read, by name."""
    if data.startswith(_ROM):
        raise FileError("pen-file.rom", name=name)
    if program := foreign_program(data, "pens")[0]:
        raise FileError("pen-file.foreign", name=name, program=program)


def markers_of(tree: Tree, name: str) -> Markers | None:
    """Return the points of a document of another program; None if it lists none."""
    own = _in_order(tree) if isinstance(tree, dict) else tree
    if isinstance(own, list) and len(own) > 2 and all(map(_is_point, own)):
        return _markers(_by_id(own), "", name)
    if not isinstance(tree, dict):
        return None
    for path, unit in LISTS:
        found: Tree = tree
        for key in path.split("/"):
            if isinstance(found, list) and len(found) == 1:  # of rigid bodies
                found = found[0]
            entries = Entries.of(found, name) if isinstance(found, dict) else None
            found = None
            if entries is not None and entries.has(key):
                found = entries.value(key)
        if isinstance(found, dict):
            found = _in_order(found)
        if isinstance(found, list) and found:
            return _markers(_by_id(found), unit, name)
    return None


def _in_order(points: dict[str, Tree]) -> list[Tree]:
    """Return points in the order of the numbers that end their names, if all do."""
    ends = [re.search(r"(?a)\d+$", name) for name in points]
    numbers = [int(end[0]) for end in ends if end is not None]
    values = list(points.values())
    if len(numbers) < len(points):
        return values
    return [values[i] for i in np.argsort(numbers, kind="stable")]


def _by_id(points: list[Tree]) -> list[Tree]:
    """Return points in the order of their numbers, if each has its own."""
    each = [point for point in points if isinstance(point, dict)]
    ids = [str(point[key]) for point in each for key in _IDS if key in point]
    if len(set(ids)) < len(points) or len(ids) > len(points):
        return points
    return _in_order(dict(zip(ids, points, strict=True)))


def _is_point(value: Tree) -> bool:
    """Return whether a value is three numbers, or has x, y and z or a place."""
    if isinstance(value, dict):
        names = {str(key).casefold() for key in value}
        return set(_AXES) <= names or not names.isdisjoint(_PLACES)
    return isinstance(value, list) and len(value) == len(_AXES)


def _markers(listed: list[Tree], unit: str, name: str) -> Markers:
    rows: list[list[float]] = []
    for number, point in enumerate(listed, 1):
        place = message("pen-file.led", led=number, name=name)
        entries = Entries.of(
            point if isinstance(point, dict) else {"position": point}, place
        )
        if entries.has(*_PLACES) and isinstance(entries.value(*_PLACES), dict):
            entries = entries.part(*_PLACES)
        if entries.has(*_AXES):
            row = [float(entries.counted(1, axis)[0]) for axis in _AXES]
        else:
            row = entries.numbers(*_PLACES).tolist()
        if entries.has(*_NORMAL_FIELDS):
            row = [*row[:3], *entries.counted(3, *_NORMAL_FIELDS).tolist()]
        if len(row) < 3 or len(row) != len(rows[0] if rows else row):
            raise FileError("pen-file.no-point", place=place, count=len(row))
        rows.append(row)
    values = np.array(rows)
    normals = values[:, 3:6] if values.shape[1] >= 6 else None
    return Markers(values[:, :3], normals, unit)
