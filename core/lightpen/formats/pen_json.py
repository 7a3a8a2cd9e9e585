"""A pen as JSON; see `lightpen.formats.pen_files`."""

import json

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import FileError
from lightpen.formats.documents import Tree
from lightpen.formats.entries import Entries
from lightpen.formats.files import quoted
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
from lightpen.messages import message, printable
from lightpen.model.pen import Pen
from lightpen.model.self_calibration import MARK_DIGITS, FoundPen

_LED_KEYS = {"led", "x", "y", "z", "normal"}
_FILE_KEYS = {
    *("units", "leds", "diameter", "nominal_tip", "name", "comment"),
    *("led_sigma", "scale_sigma", "diameter_sigma", "led_covariance"),
    "normal_covariance",
    *("expansion", "expansion_sigma", "temperature_c"),
    "parent_sha256",
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


def json_text(pen: Pen, parent_sha256: str) -> str:
    """Return a pen as JSON, with the hash of the file it was improved from."""
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
        *([f'"parent_sha256": "{parent_sha256}"'] if parent_sha256 else []),
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
