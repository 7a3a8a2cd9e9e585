"""The LED geometry of a pen as a table (CSV) or as JSON.

A table has the columns ``led,x_mm,y_mm,z_mm``, optionally ``nx,ny,nz`` (normals) and
``diameter_mm``. Without a header its columns stand in this order, the normals being
optional. Units may be written as in ``x_mm``, ``x [mm]``, ``x (m)`` and ``x/inch``.
Standard uncertainties (k = 1) are optional columns, the same number in each row:
``led_sigma_mm`` of one LED coordinate, ``scale_sigma`` of all coordinates together
(relative: 1e-5 is 10 um a metre) and ``diameter_sigma_mm``. So are ``expansion``, that
of the pen by warmth in 1/K, ``expansion_sigma`` and ``temperature_c``, at which the
LEDs were measured.

A JSON file has

================== ===================================================================
``units``       of all lengths: ``mm``, ``cm``, ``m``, ``um`` or ``inch``
``leds``        list of ``{"led": 1, "x": 0, "y": 0, "z": -30, "normal": [0, 0, 1]}``,
                ``normal`` being optional
``diameter``    of the LED discs, optional
``led_sigma``   standard uncertainty of one LED coordinate, optional
``scale_sigma`` of all coordinates together, relative, optional
``diameter_sigma`` of the diameter, optional
``expansion``   of the pen by warmth, 1/K, optional
``expansion_sigma`` standard uncertainty of that, 1/K, optional
``temperature_c`` at which the LEDs were measured, degrees C, optional
``nominal_tip`` list of three coordinates, optional
``name``        name or serial number, optional
``led_covariance`` of all coordinates but for the scale, 3 L rows of 3 L, optional
``parent_sha256`` of the file that this one was made better from, not read
``comment``     not read
================== ===================================================================

LEDs are numbered from 1, in ascending order. Normals are +z and discs 10 mm wide unless
the file says otherwise.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import FileError, UsageError
from lightpen.formats.documents import Tree, parse_json
from lightpen.formats.entries import Entries
from lightpen.formats.files import MEGABYTE, printable, quoted, read_text, write_whole
from lightpen.formats.tables import Table, parse_table
from lightpen.model.pen import (
    DISC_DIAMETER,
    Pen,
    check_frame,
    check_leds,
    in_pen_frame,
)
from lightpen.sentences import Sentence, sentence

PEN_FILE = sentence("file.pen", "pen file")
PEN_FILE_LIMIT = MEGABYTE
UNITS = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "um": 0.001, "inch": 25.4}
LARGEST_DIAMETER = 100.0  # mm
NORMAL_TOLERANCE = 0.01  # of the length of a normal in the file

_SPELLINGS = {
    "mm": ("mm", "millimeter", "millimetre", "millimeters", "millimetres"),
    "cm": ("cm",),
    "m": ("m", "meter", "metre", "meters", "metres"),
    "um": ("um", "μm", "micron", "microns"),
    "inch": ("inch", "in", "inches"),
}
_UNIT_NAMES = {name: unit for unit, names in _SPELLINGS.items() for name in names}
_LED_NAMES = ("led", "no", "no.", "nr", "nr.", "number", "id", "point")
_COORDINATES = (("x",), ("y",), ("z",))
_NORMALS = (("nx",), ("ny",), ("nz",))
_COLUMN = (
    r"(nx|ny|nz|x|y|z|diameter_sigma|diameter|led_sigma|scale_sigma)"
    r"(?:[\s_/]*(?:[\[(]\s*)?([a-zμ]+)\s*[\])]?)?"
)
_LED_KEYS = {"led", "x", "y", "z", "normal"}
_FILE_KEYS = {
    *("units", "leds", "diameter", "nominal_tip", "name", "comment"),
    *("led_sigma", "scale_sigma", "diameter_sigma", "led_covariance"),
    *("expansion", "expansion_sigma", "temperature_c"),
    "parent_sha256",
}
ASYMMETRY = 1e-6  # of the largest variance
_LENGTHS = {"led_sigma", "diameter_sigma"}  # in the unit of the file
# From above the first to the second: mm, relative, 1/K, degrees C.
_RANGES = {
    "led_sigma": (0.0, 10.0),
    "scale_sigma": (0.0, 0.01),
    "diameter_sigma": (0.0, 10.0),
    "expansion": (-1e-5, 1e-4),
    "expansion_sigma": (0.0, 1e-4),
    "temperature_c": (-50.0, 100.0),
}


def read_pen(
    path: Path,
    units: str | None = None,
    diameter: float | None = None,
    nominal_tip: FloatArray | None = None,
) -> Pen:
    """Read a pen whose LEDs are given in the pen frame; see the module for the layouts.

    Parameters
    ----------
    units : {"mm", "cm", "m", "um", "inch"} or None
        Unit of the file's lengths; needed if the file does not state it.
    diameter : float or None
        Diameter of the LED discs, mm, in place of the file's.
    nominal_tip : (3,) array or None
        Nominal tip in the pen frame, mm, in place of the file's.

    Raises
    ------
    FileError
        The file cannot be read, is not a complete pen, or a pen of the paper's layout
        is not in the paper's frame.
    UsageError
        The units are neither in the file nor given, or both and different.
    """
    pen = _pen(_read(path, units), diameter, nominal_tip)
    try:
        check_leds(pen.leds, pen.diameter)
        check_frame(pen)
    except FileError as error:
        raise _flawed(path, error) from error
    return pen


def read_raw_pen(
    path: Path,
    units: str | None = None,
    diameter: float | None = None,
    nominal_tip: FloatArray | None = None,
) -> Pen:
    """Read a pen of the paper's layout from a measuring machine's coordinates.

    Parameters
    ----------
    path : Path
        File as for `read_pen`, in any right-handed frame.
    units, diameter, nominal_tip
        As for `read_pen`.

    Returns
    -------
    Pen
        In the pen frame; see `lightpen.model.pen.pen_frame_from_raw`. A nominal tip of
        the file is moved with the LEDs.

    Raises
    ------
    FileError
        The file cannot be read, or its LEDs do not define the pen frame.
    UsageError
        As for `read_pen`.
    """
    content = _read(path, units)
    raw = _pen(content, diameter, None)
    try:
        check_leds(raw.leds, raw.diameter)
        pen = in_pen_frame(raw)
        if content.normals is None:
            pen = replace(pen, normals=_facing_normals(pen.n_leds))
        check_frame(pen)
    except FileError as error:
        raise _flawed(path, error) from error
    return pen if nominal_tip is None else replace(pen, nominal_tip=nominal_tip)


def read_unchecked_pen(path: Path, units: str | None = None) -> Pen:
    """Read a pen to be looked at and mended: its LEDs may stand anywhere.

    Parameters
    ----------
    path, units
        As for `read_pen`.

    Raises
    ------
    FileError
        The file cannot be read, or a cell is not what it should be.
    UsageError
        As for `read_pen`.
    """
    return _pen(_read(path, units), None, None)


def write_pen(pen: Pen, path: Path, parent_sha256: str = "") -> None:
    """Write a pen as a table or as JSON, to be read back to the last digit.

    Parameters
    ----------
    path : Path
        Name that ends in .csv or .json.
    parent_sha256 : str, optional
        Of the file that the pen was made better from.

    Raises
    ------
    UsageError
        The name ends otherwise, or the pen has a name, a nominal tip or a covariance,
        for which a table has no place.
    FileError
        The file cannot be written.
    """
    suffix = path.suffix.lower()
    if suffix == ".json":
        text = _json_text(pen, parent_sha256)
    elif suffix == ".csv":
        extras = pen.nominal_tip, pen.led_covariance
        if pen.name or any(each is not None for each in extras):
            raise UsageError(
                sentence(
                    "pen-file.table-has-no-place",
                    "{name} is a table, which has no place for the name, the nominal "
                    "tip and the covariance of the pen. Choose a name that ends in "
                    ".json.",
                    name=printable(path.name),
                )
            )
        text = _csv_text(pen)
    else:
        raise UsageError(
            sentence(
                "pen-file.suffix",
                "A pen is written as .csv or .json, but {name} ends in neither. "
                "Choose such a name.",
                name=printable(path.name),
            )
        )
    write_whole(path, text.encode())


@dataclass(frozen=True, eq=False)
class _Content:
    """What a pen file states, in mm; None is what it leaves out."""

    leds: FloatArray
    normals: FloatArray | None
    diameter: float | None
    nominal_tip: FloatArray | None = None
    name: str = ""
    stated: Mapping[str, float] = field(default_factory=dict)
    covariance: FloatArray | None = None


def _pen(
    content: _Content, diameter: float | None, nominal_tip: FloatArray | None
) -> Pen:
    if diameter is not None and not 0 < diameter <= LARGEST_DIAMETER:
        raise UsageError(
            sentence(
                "pen-file.given-diameter",
                "The LED discs cannot be {diameter:g} mm wide. Give a diameter of "
                "up to {most:g} mm.",
                diameter=diameter,
                most=LARGEST_DIAMETER,
            )
        )
    if nominal_tip is None:
        nominal_tip = content.nominal_tip
    if diameter is None:
        diameter = DISC_DIAMETER if content.diameter is None else content.diameter
    normals = content.normals
    if normals is None:
        normals = _facing_normals(len(content.leds))
    return Pen(
        content.leds,
        normals,
        diameter,
        nominal_tip,
        content.name,
        **content.stated,
        led_covariance=content.covariance,
    )


def _flawed(path: Path, flaw: FileError) -> FileError:
    return FileError(
        sentence(
            "pen-file.flawed",
            "{name}: {flaw}",
            name=printable(path.name),
            flaw=flaw.sentence,
        )
    )


def _facing_normals(n_leds: int) -> FloatArray:
    return np.tile([0.0, 0.0, 1.0], (n_leds, 1))


def _read(path: Path, units: str | None) -> _Content:
    if units is not None and units not in UNITS:
        raise UsageError(
            sentence(
                "pen-file.unknown-unit",
                "{unit} is not a unit of length known here. Choose one of {known}.",
                unit=quoted(units),
                known=", ".join(UNITS),
            )
        )
    text = read_text(path, PEN_FILE, PEN_FILE_LIMIT)
    name = printable(path.name)
    if text.lstrip().startswith(("{", "[")):
        return _from_json(parse_json(text, name), units, name)
    return _from_table(parse_table(text, name), units)


def _from_table(table: Table, units: str | None) -> _Content:
    named = [_name_and_unit(column) for column in table.header]
    stated = {unit for name, unit in named if unit and name in ("x", "y", "z")}
    if len(stated) > 1:
        one, other = sorted(stated)[:2]
        raise FileError(
            sentence(
                "pen-file.mixed-units",
                "{name} has coordinates in {one} and in {other}. Give all of them "
                "in one unit.",
                name=table.name,
                one=one,
                other=other,
            )
        )
    unit = _agreed_unit(stated.pop() if stated else "", units, table.name)
    bare = replace(table, header=tuple(name for name, _ in named))
    with_normals = "nx" in bare.header or (not bare.header and bare.n_columns == 7)
    wanted = [_LED_NAMES, *_COORDINATES, *(_NORMALS if with_normals else ())]
    columns = bare.columns(wanted, sentence("table.of-leds", "the LEDs of a pen"))
    _check_numbering(table, columns[0])
    numbers = table.numbers(columns[1:])
    diameter = None
    if "diameter" in bare.header:
        place = bare.header.index("diameter")
        diameter = _common(table, place, bare) * UNITS[named[place][1] or unit]
        _check_diameter(diameter, table.name)
    further = {}
    for what in _RANGES:
        if what in bare.header:
            place = bare.header.index(what)
            size = UNITS[named[place][1] or unit] if what in _LENGTHS else 1.0
            number = _common(table, place, bare) * size
            further[what] = _checked(what, number, table.name)
    normals = None
    if with_normals:
        normals = np.empty((len(numbers), 3))
        for i, line in enumerate(table.lines):
            where = sentence(
                "pen-file.line", "Line {line} of {name}", line=line, name=table.name
            )
            normals[i] = _unit(numbers[i, 3:], where)
    return _Content(numbers[:, :3] * UNITS[unit], normals, diameter, stated=further)


def _name_and_unit(column: str) -> tuple[str, str]:
    """Return the name of a column without its unit, and the unit or an empty string."""
    match = re.fullmatch(_COLUMN, column)
    if not match:
        return column, ""
    unit = _UNIT_NAMES.get(match[2] or "", "")
    return (match[1], unit) if unit or not match[2] else (column, "")


def _agreed_unit(stated: str, given: str | None, name: str) -> str:
    if stated and given and stated != given:
        raise UsageError(
            sentence(
                "pen-file.contradicting-units",
                "{name} states its lengths in {stated}, but the unit {given} is "
                "given. Leave the unit away, or correct the file.",
                name=name,
                stated=stated,
                given=given,
            )
        )
    unit = stated or given
    if not unit:
        raise UsageError(
            sentence(
                "pen-file.no-units",
                "{name} does not say which units its coordinates have. Name them, "
                "or write them into the header: led,x_mm,y_mm,z_mm.",
                name=name,
            )
        )
    return unit


def _check_numbering(table: Table, column: int) -> None:
    """Refuse LEDs that are not numbered 1, 2, 3 and so on from row to row."""
    numbers = table.whole_numbers(column)
    wrong = numbers != np.arange(1, len(numbers) + 1)
    if not np.any(wrong):
        return
    row = int(np.argmax(wrong))
    found, needed = int(numbers[row]), row + 1
    earlier = np.flatnonzero(numbers[:row] == found)
    if len(earlier):
        flaw = sentence(
            "pen-file.listed-twice",
            "LED {led} is listed already on line {line}.",
            led=found,
            line=table.lines[earlier[0]],
        )
    elif needed in numbers:
        flaw = sentence(
            "pen-file.out-of-order",
            "LED {led} stands where LED {needed} is needed. List the LEDs from 1 to "
            "{n_leds} in ascending order.",
            led=found,
            needed=needed,
            n_leds=len(numbers),
        )
    else:
        flaw = sentence(
            "pen-file.gap",
            "LED {led} stands where LED {needed} is needed, and no line has LED "
            "{needed}. Number the LEDs from 1 without gaps.",
            led=found,
            needed=needed,
        )
    raise table.error(row, flaw)


def _common(table: Table, column: int, bare: Table) -> float:
    """Return the number that all rows of a column share."""
    numbers = table.numbers([column])[:, 0]
    other = numbers != numbers[0]
    if np.any(other):
        raise table.error(
            int(np.argmax(other)),
            sentence(
                "pen-file.column-differs",
                "the {what} is {value:g} where the first LED has {first:g}. It must be "
                "the same for all LEDs of a pen.",
                what=bare.header[column],
                value=numbers[other][0],
                first=numbers[0],
            ),
        )
    return float(numbers[0])


def _checked(what: str, number: float, name: str) -> float:
    least, most = _RANGES[what]
    if not least < number <= most:
        raise FileError(
            sentence(
                "pen-file.number",
                "{name} has the {what} {number:g}. A number above {least:g} and up to "
                "{most:g} is needed; leave it away if it is not known.",
                name=name,
                what=what,
                number=number,
                least=least,
                most=most,
            )
        )
    return number


def _check_diameter(diameter: float, name: str) -> None:
    if not 0 < diameter <= LARGEST_DIAMETER:
        raise FileError(
            sentence(
                "pen-file.diameter",
                "{name} has LED discs {diameter:g} mm wide. A diameter of up to "
                "{most:g} mm is needed; check its units.",
                name=name,
                diameter=diameter,
                most=LARGEST_DIAMETER,
            )
        )


def _unit(normal: FloatArray, place: str | Sentence) -> FloatArray:
    """Return a normal of unit length, unchanged if it has it but for rounding."""
    squared = float(normal @ normal) if np.abs(normal).max() < 2 else np.inf
    if abs(squared - 1) > 2 * NORMAL_TOLERANCE:
        raise FileError(
            sentence(
                "pen-file.normal-length",
                "{place}: the normal {normal} does not have the length 1. Correct "
                "it, or leave the normals away if all discs face +z.",
                place=place,
                normal=" ".join(f"{c:g}" for c in normal),
            )
        )
    return normal if abs(squared - 1) < 1e-9 else normal / np.sqrt(squared)


def _from_json(tree: Tree, units: str | None, name: str) -> _Content:
    if not isinstance(tree, dict):
        raise FileError(
            sentence(
                "pen-file.list",
                "{name} is a list; a pen file is a mapping with leds and units. "
                "Write it so.",
                name=name,
            )
        )
    entries = Entries.of(tree, name)
    entries.refuse_others(*_FILE_KEYS)
    stated = entries.word("units").casefold()
    if stated and stated not in _UNIT_NAMES:
        raise FileError(
            sentence(
                "pen-file.unknown-units-in-file",
                "{name} has the units {unit}, which are not known here. Use one of "
                "{known}.",
                name=name,
                unit=quoted(stated),
                known=", ".join(UNITS),
            )
        )
    unit = UNITS[_agreed_unit(_UNIT_NAMES.get(stated, ""), units, name)]
    leds = _listed_leds(entries, name)
    coordinates = [[led.counted(1, axis)[0] for axis in "xyz"] for led in leds]
    diameter = None
    if entries.has("diameter"):
        diameter = float(entries.counted(1, "diameter")[0]) * unit
        _check_diameter(diameter, name)
    nominal_tip = None
    if entries.has("nominal_tip") and entries.value("nominal_tip") is not None:
        nominal_tip = entries.counted(3, "nominal_tip") * unit
    return _Content(
        leds=np.array(coordinates) * unit,
        normals=_listed_normals(leds, name),
        diameter=diameter,
        nominal_tip=nominal_tip,
        name=printable(entries.word("name")),
        stated={
            what: _checked(
                what,
                float(entries.counted(1, what)[0])
                * (unit if what in _LENGTHS else 1.0),
                name,
            )
            for what in _RANGES
            if entries.has(what)
        },
        covariance=_covariance(entries, len(leds), unit, name),
    )


def _covariance(
    entries: Entries, n_leds: int, unit: float, name: str
) -> FloatArray | None:
    if not entries.has("led_covariance"):
        return None
    n = 3 * n_leds
    matrix = entries.counted(n * n, "led_covariance").reshape(n, n) * unit**2
    off = float(np.abs(matrix - matrix.T).max())
    size = float(np.abs(np.diag(matrix)).max())
    if off > ASYMMETRY * size or np.linalg.eigvalsh(matrix)[0] < -ASYMMETRY * size:
        raise FileError(
            sentence(
                "pen-file.no-covariance",
                "The led_covariance of {name} is none: it must be symmetric, and no "
                "variance below 0. Leave it away, or give it as it was written.",
                name=name,
            )
        )
    return matrix


def _listed_leds(entries: Entries, name: str) -> list[Entries]:
    listed = entries.value("leds")
    if not isinstance(listed, list) or not listed:
        raise FileError(
            sentence(
                "pen-file.no-led-list",
                "leds in {name} is no list of LEDs. Write it as "
                '[{{"led": 1, "x": 0, "y": 0, "z": -30}}, ...].',
                name=name,
            )
        )
    leds = []
    for number, tree in enumerate(listed, 1):
        place = sentence("pen-file.led", "LED {led} of {name}", led=number, name=name)
        if not isinstance(tree, dict):
            raise FileError(
                sentence(
                    "pen-file.led-no-mapping",
                    "{place} is no mapping. Write it as "
                    '{{"led": 1, "x": 0, "y": 0, "z": -30}}.',
                    place=place,
                )
            )
        led = Entries.of(tree, place)
        led.refuse_others(*_LED_KEYS)
        if led.counted(1, "led")[0] != number:
            raise FileError(
                sentence(
                    "pen-file.entry-out-of-order",
                    "Entry {number} of leds in {name} is LED {led:g}. List the LEDs "
                    "from 1 in ascending order, each once.",
                    number=number,
                    name=name,
                    led=led.counted(1, "led")[0],
                )
            )
        leds.append(led)
    return leds


def _listed_normals(leds: list[Entries], name: str) -> FloatArray | None:
    given = [led.has("normal") for led in leds]
    if not any(given):
        return None
    if not all(given):
        raise FileError(
            sentence(
                "pen-file.some-normals",
                "LED {led} of {name} has no normal, but others have. Give the "
                "normals of all LEDs or of none.",
                led=given.index(False) + 1,
                name=name,
            )
        )
    return np.array([_unit(led.counted(3, "normal"), led.name) for led in leds])


def _stated(pen: Pen) -> dict[str, float]:
    return {
        what: float(number)
        for what in _RANGES
        if (number := getattr(pen, what)) is not None
    }


def _csv_text(pen: Pen) -> str:
    stated = _stated(pen)
    header = "led,x_mm,y_mm,z_mm,nx,ny,nz,diameter_mm"
    header += "".join(
        f",{what}_mm" if what in _LENGTHS else f",{what}" for what in stated
    )
    lines = [header]
    for number, (led, normal) in enumerate(
        zip(pen.leds.tolist(), pen.normals.tolist(), strict=True), 1
    ):
        cells = [number, *led, *normal, float(pen.diameter), *stated.values()]
        lines.append(",".join(map(repr, cells)))
    return "\n".join(lines) + "\n"


def _json_text(pen: Pen, parent_sha256: str) -> str:
    import json

    leds = [
        {"led": number, "x": led[0], "y": led[1], "z": led[2], "normal": normal}
        for number, (led, normal) in enumerate(
            zip(pen.leds.tolist(), pen.normals.tolist(), strict=True), 1
        )
    ]
    rows = ",\n    ".join(json.dumps(led, allow_nan=False) for led in leds)
    tip = None if pen.nominal_tip is None else pen.nominal_tip.tolist()
    entries = [
        f'"name": {json.dumps(pen.name)}',
        '"units": "mm"',
        f'"diameter": {json.dumps(float(pen.diameter), allow_nan=False)}',
        *(f'"{what}": {number!r}' for what, number in _stated(pen).items()),
        f'"nominal_tip": {json.dumps(tip, allow_nan=False)}',
        *([f'"parent_sha256": "{parent_sha256}"'] if parent_sha256 else []),
        f'"leds": [\n    {rows}\n  ]',
    ]
    if pen.led_covariance is not None:
        of_leds = ",\n    ".join(map(json.dumps, pen.led_covariance.tolist()))
        entries.append(f'"led_covariance": [\n    {of_leds}\n  ]')
    return "{\n  " + ",\n  ".join(entries) + "\n}\n"
