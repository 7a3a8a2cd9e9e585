"""The LED geometry of a pen as a table (CSV) or as JSON.

A table has the columns ``led,x_mm,y_mm,z_mm``, optionally ``nx,ny,nz`` (normals) and
``diameter_mm``. Without a header its columns stand in this order, the normals being
optional; three columns are coordinates alone. Units may be written as in ``x_mm``,
``x [mm]``, ``x (m)`` and ``x/inch``.
Standard uncertainties (k = 1) are optional columns, the same number in each row:
``led_sigma_mm`` of one LED coordinate, ``scale_sigma`` of all coordinates together
(relative: 1e-5 is 10 um a metre) and ``diameter_sigma_mm``. So are ``expansion``, that
of the pen in 1/K, ``expansion_sigma`` and ``temperature_c``, at which the
LEDs were measured.

The first column may have names that end in numbers, such as ``LED1``, or in none. Units
may stand in a row of their own. Of nominal and actual coordinates (``x_nom``, ``X
actual``) the actual ones are taken. The table may be a workbook (.xlsx, .ods, .xls), if
python-calamine is installed. Lists of other programs: `marker_lists`.

A JSON file has

================== ===================================================================
``units``       of all lengths: ``mm``, ``cm``, ``m``, ``um`` or ``inch``
``leds``        list of ``{"led": 1, "x": 0, "y": 0, "z": -30, "normal": [0, 0, 1]}``,
                ``normal`` being optional
``diameter``    of the LED discs, optional
``led_sigma``   standard uncertainty of one LED coordinate, optional
``scale_sigma`` of all coordinates together, relative, optional
``diameter_sigma`` of the diameter, optional
``normal_covariance`` of a rotation vector common to all normals, rad^2, 3 rows of 3,
                optional
``expansion``   of the pen, 1/K, optional
``expansion_sigma`` standard uncertainty of that, 1/K, optional
``temperature_c`` at which the LEDs were measured, degrees C, optional
``nominal_tip`` list of three coordinates, optional
``name``        name or serial number, optional
``led_covariance`` of all coordinates but for the scale, 3 L rows of 3 L, optional
``found_from``  of LEDs found from images (``lightpen discover``), optional: an LED
                centre of each of these ``images``, px, and ``diameter`` and
                ``led_covariance`` without them
``comment``     not read
================== ===================================================================

LEDs are numbered from 1, in ascending order. Normals are +z and discs 10 mm wide unless
the file says otherwise.
"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import FileError, UsageError
from lightpen.formats.documents import Tree, parse_json, parse_yaml
from lightpen.formats.entries import Entries
from lightpen.formats.files import MEGABYTE, quoted, write_whole
from lightpen.formats.pen_tables import (
    LARGEST_DIAMETER,
    LENGTHS,
    RANGES,
    UNIT_NAMES,
    UNITS,
    PenContent,
    agreed_unit,
    check_diameter,
    checked_number,
    csv_text,
    from_table,
    markers_of,
    refuse_foreign_list,
    stated_numbers,
    unit_normal,
)
from lightpen.formats.spreadsheets import table_text
from lightpen.formats.tables import parse_table
from lightpen.messages import message, printable
from lightpen.model.pen import DISC_DIAMETER, Pen, check_frame, check_leds, in_pen_frame
from lightpen.model.self_calibration import MARK_DIGITS, FoundPen

_LED_KEYS = {"led", "x", "y", "z", "normal"}
_FILE_KEYS = {
    *("units", "leds", "diameter", "nominal_tip", "name", "comment"),
    *("led_sigma", "scale_sigma", "diameter_sigma", "led_covariance"),
    "normal_covariance",
    *("expansion", "expansion_sigma", "temperature_c"),
    "found_from",
}
_FOUND_KEYS = {"images", "diameter", "led_covariance"}
ASYMMETRY = 1e-6  # of the largest variance


def from_json(tree: Tree, units: str | None, name: str) -> PenContent:
    """Return the pen of a JSON document, named as displayed; refuse an incomplete one.

    ``units`` apply to lengths of a file that states none; see `agreed_unit`.
    """
    if not isinstance(tree, dict):
        raise FileError("pen-file.list", name=name)
    entries = Entries.of(tree, name)
    entries.refuse_others(*_FILE_KEYS)
    stated = entries.word("units").casefold()
    if stated and stated not in UNIT_NAMES:
        raise FileError(
            "pen-file.unknown-units-in-file",
            name=name,
            unit=quoted(stated),
            known=", ".join(UNITS),
        )
    unit = UNITS[agreed_unit(UNIT_NAMES.get(stated, ""), units, name)]
    leds = _listed_leds(entries, name)
    coordinates = [[led.counted(1, axis)[0] for axis in "xyz"] for led in leds]
    diameter = None
    if entries.has("diameter"):
        diameter = float(entries.counted(1, "diameter")[0]) * unit
        check_diameter(diameter, name)
    nominal_tip = None
    if entries.has("nominal_tip") and entries.value("nominal_tip") is not None:
        nominal_tip = entries.counted(3, "nominal_tip") * unit
    covariance = of_normals = None
    if entries.has("led_covariance"):
        covariance = unit**2 * _covariance(entries, len(leds), "led_covariance")
    if entries.has("normal_covariance"):
        of_normals = _covariance(entries, 1, "normal_covariance")
    return PenContent(
        leds=np.array(coordinates) * unit,
        normals=_listed_normals(leds, name),
        diameter=diameter,
        nominal_tip=nominal_tip,
        name=printable(entries.word("name")),
        stated={
            what: checked_number(
                what,
                float(entries.counted(1, what)[0]) * (unit if what in LENGTHS else 1.0),
                name,
            )
            for what in RANGES
            if entries.has(what)
        },
        covariance=covariance,
        normal_covariance=of_normals,
        found=_found(entries, len(leds), unit, name),
    )


def _found(entries: Entries, n_leds: int, unit: float, name: str) -> FoundPen | None:
    if not entries.has("found_from"):
        return None
    part = entries.part("found_from")
    part.refuse_others(*_FOUND_KEYS)
    covariance = unit**2 * _covariance(part, n_leds, "led_covariance")
    diameter = float(part.counted(1, "diameter")[0]) * unit
    check_diameter(diameter, name)
    return FoundPen(part.points("images"), diameter, covariance)


def _covariance(entries: Entries, n_vectors: int, what: str) -> FloatArray:
    n = 3 * n_vectors
    matrix = entries.counted(n * n, what).reshape(n, n)
    off = float(np.abs(matrix - matrix.T).max())
    size = float(np.abs(np.diag(matrix)).max())
    if off > ASYMMETRY * size or np.linalg.eigvalsh(matrix)[0] < -ASYMMETRY * size:
        raise FileError("pen-file.no-covariance", what=what, name=entries.name)
    return matrix


def _listed_leds(entries: Entries, name: str) -> list[Entries]:
    listed = entries.value("leds")
    if not isinstance(listed, list) or not listed:
        raise FileError("pen-file.no-led-list", name=name)
    leds = []
    for number, tree in enumerate(listed, 1):
        place = message("pen-file.led", led=number, name=name)
        if not isinstance(tree, dict):
            raise FileError("pen-file.led-no-mapping", place=place)
        led = Entries.of(tree, place)
        led.refuse_others(*_LED_KEYS)
        if led.counted(1, "led")[0] != number:
            raise FileError(
                "pen-file.entry-out-of-order",
                number=number,
                name=name,
                led=led.counted(1, "led")[0],
            )
        leds.append(led)
    return leds


def _listed_normals(leds: list[Entries], name: str) -> FloatArray | None:
    given = [led.has("normal") for led in leds]
    if not any(given):
        return None
    if not all(given):
        raise FileError("pen-file.some-normals", led=given.index(False) + 1, name=name)
    return np.array([unit_normal(led.counted(3, "normal"), led.name) for led in leds])


def json_text(pen: Pen) -> str:
    """Return a pen as JSON."""
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
        *(f'"{what}": {number!r}' for what, number in stated_numbers(pen).items()),
        f'"nominal_tip": {json.dumps(tip, allow_nan=False)}',
        f'"leds": [\n    {rows}\n  ]',
    ]
    if pen.led_covariance is not None:
        entries.append(_matrix("led_covariance", pen.led_covariance))
    if pen.normal_covariance is not None:
        entries.append(_matrix("normal_covariance", pen.normal_covariance))
    if pen.found is not None:
        found = [
            _matrix("images", pen.found.marks.round(MARK_DIGITS)),
            f'"diameter": {json.dumps(float(pen.found.diameter), allow_nan=False)}',
            _matrix("led_covariance", pen.found.led_covariance),
        ]
        entries.append('"found_from": {\n  ' + ",\n  ".join(found) + "\n  }")
    return "{\n  " + ",\n  ".join(entries) + "\n}\n"


def _matrix(name: str, matrix: FloatArray) -> str:
    rows = ",\n    ".join(json.dumps(row, allow_nan=False) for row in matrix.tolist())
    return f'"{name}": [\n    {rows}\n  ]'


PEN_FILE = message("file.pen")
PEN_FILE_LIMIT = MEGABYTE


def read_pen(
    path: Path,
    units: str | None = None,
    diameter: float | None = None,
    nominal_tip: FloatArray | None = None,
) -> Pen:
    """Read a pen with LEDs in the pen frame; the module describes the layouts.

    The unit of lengths is one of `UNITS`, needed if the file does not state it. Disc
    diameter, mm, and nominal tip (3,), pen frame, mm, replace the values of the file.
    Raises `FileError` unless it is a complete pen, one of the paper's layout in the
    paper's frame, and `UsageError` if the units are neither in the file nor given, or
    both and different.
    """
    pen = _pen(_read(path, units), diameter, nominal_tip)
    try:
        check_leds(pen.leds, pen.diameter)
        check_frame(pen)
    except FileError as error:
        raise _flawed(path, error) from error
    return pen


def read_raw_pen(
    path: Path, units: str | None = None, diameter: float | None = None
) -> Pen:
    """Read a pen of the paper's layout from a measuring machine's coordinates.

    See `read_pen` for the file and the errors, and
    `lightpen.model.pen.pen_frame_from_raw` for the frame of the pen returned. A nominal
    tip of the file is moved with the LEDs.
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
    return pen


def read_unchecked_pen(path: Path, units: str | None = None) -> Pen:
    """Read a pen as `read_pen`, for inspection and repair, with its LEDs unchecked."""
    return _pen(_read(path, units), None, None)


def write_pen(pen: Pen, path: Path) -> None:
    """Write a pen as a table or as JSON, to be read back to the last digit.

    The name ends in .csv or .json; else, or where a table has no place for name,
    nominal tip or covariance of the pen, a `UsageError` is raised.
    """
    suffix = path.suffix.lower()
    if suffix == ".json":
        text = json_text(pen)
    elif suffix == ".csv":
        extras = pen.nominal_tip, pen.led_covariance, pen.normal_covariance
        if pen.name or any(each is not None for each in extras):
            raise UsageError("pen-file.table-has-no-place", name=printable(path.name))
        text = csv_text(pen)
    else:
        raise UsageError("pen-file.suffix", name=printable(path.name))
    write_whole(path, text.encode())


def _pen(
    content: PenContent, given: float | None, nominal_tip: FloatArray | None
) -> Pen:
    if given is not None and not 0 < given <= LARGEST_DIAMETER:
        raise UsageError(
            "pen-file.given-diameter", diameter=given, most=LARGEST_DIAMETER
        )
    if nominal_tip is None:
        nominal_tip = content.nominal_tip
    diameter = given or content.diameter or DISC_DIAMETER
    normals, found = content.normals, content.found
    if normals is None:
        normals = _facing_normals(len(content.leds))
    if found is not None:
        found = replace(found, diameter=given or found.diameter)
    return Pen(
        content.leds,
        normals,
        diameter,
        nominal_tip,
        content.name,
        **content.stated,
        led_covariance=content.covariance,
        normal_covariance=content.normal_covariance,
        found=found,
    )


def _flawed(path: Path, flaw: FileError) -> FileError:
    return FileError("pen-file.flawed", name=printable(path.name), flaw=flaw.message)


def _facing_normals(n_leds: int) -> FloatArray:
    return np.tile([0.0, 0.0, 1.0], (n_leds, 1))


def _read(path: Path, units: str | None) -> PenContent:
    if units is not None and units not in UNITS:
        raise UsageError(
            "pen-file.unknown-unit", unit=quoted(units), known=", ".join(UNITS)
        )
    text = table_text(path, PEN_FILE, PEN_FILE_LIMIT, refuse_foreign_list)
    name = printable(path.name)
    if path.suffix.lower() in (".yaml", ".yml"):
        return _of_document(parse_yaml(text, name), units, name)
    if text.lstrip().startswith(("{", "[")):
        return _of_document(parse_json(text, name), units, name)
    return from_table(parse_table(text, name), units)


def _of_document(tree: Tree, units: str | None, name: str) -> PenContent:
    """Return the pen of a document of this or of another program."""
    markers = None
    if not (isinstance(tree, dict) and "leds" in tree):
        markers = markers_of(tree, name)
    if markers is None and isinstance(tree, dict) and "leds" not in tree:
        raise FileError("pen-file.no-led-list", name=name)
    if markers is None:
        return from_json(tree, units, name)
    stated = ""
    if isinstance(tree, dict):
        entries = Entries.of(tree, name)
        stated = UNIT_NAMES.get(entries.word("units", "unit").casefold(), "")
    if units is None:
        stated = stated or markers.unit
    size = UNITS[agreed_unit(stated, units, name)]
    normals = markers.normals
    if normals is not None:
        normals = np.array(
            [
                unit_normal(normal, message("pen-file.led", led=number, name=name))
                for number, normal in enumerate(normals, 1)
            ]
        )
    return PenContent(markers.points * size, normals, None)
