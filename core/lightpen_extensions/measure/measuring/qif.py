"""A measured part as QIF 3.0 results (ISO 23952), see `measuring.exports`.

Each characteristic has a definition with its tolerance, a nominal, an item and a
measurement; each feature has its place, direction, size and form in the part's frame.
As a plan can combine features freely, characteristics are user-defined linear or
angular ones that name what is measured.
"""

from collections.abc import Sequence
from itertools import count
from uuid import uuid4
from xml.etree import ElementTree as ET

import numpy as np

from lightpen import __version__
from lightpen.arrays import FloatArray
from lightpen.model.coverage import COVERAGE_FACTOR, Decision
from lightpen_extensions.measure.measuring.characteristics import Measured
from lightpen_extensions.measure.measuring.features import AXIS, PLACE
from lightpen_extensions.measure.measuring.part import (
    CharacteristicResult,
    MeasuredPart,
)
from lightpen_extensions.measure.measuring.surfaces import FeatureKind
from lightpen_resources import RESOURCES

NAMESPACE = "http://qifstandards.org/xsd/qif3"
STANDARD_ID = "1"
PARTS = ("Definition", "Nominal", "Item", "Measurement")  # of a characteristic
N_DECIMALS = 12
STATUS = {
    Decision.ACCEPTED: "PASS",
    Decision.REJECTED: "FAIL",
    Decision.OPEN: "INDETERMINATE",
    None: "NOT_ANALYZED",
}


def qif_text(part: MeasuredPart) -> str:
    """Return a QIF document with the characteristics of a part."""
    n, n_features = len(part.results), len(part.features)
    ids = map(str, count(2))  # after that of the standard
    root = ET.parse(RESOURCES / "plans" / "results.qif").getroot()
    root.set("xmlns", NAMESPACE)
    root.set("idMax", str(4 * n + n_features + 2))
    for place, text in (
        ("QPId", str(uuid4())),
        ("Header/Application/Name", f"Lightpen {__version__}"),
    ):
        for each in root.iterfind(place):
            each.text = text
    results = ET.Element("Results")
    of_set = ET.SubElement(results, "MeasurementResultsSet", {"n": "1"})
    if n:
        characteristics = ET.SubElement(root, "Characteristics")
        _text(characteristics, "FormalStandardId", STANDARD_ID)
        definitions, nominals, items = (
            ET.SubElement(characteristics, f"Characteristic{each}", {"n": str(n)})
            for each in ("Definitions", "Nominals", "Items")
        )
    root.append(results)
    one = ET.SubElement(of_set, "MeasurementResults", {"id": next(ids)})
    of_features = ET.SubElement(one, "MeasuredFeatures", {"n": str(n_features)})
    for name, feature in part.features.items():
        _add_feature(of_features, name, feature, part, next(ids))
    if n:
        measured = ET.SubElement(one, "MeasuredCharacteristics")
        group = ET.SubElement(measured, "CharacteristicMeasurements", {"n": str(n)})
        parents = (definitions, nominals, items, group)
        for result in part.results:
            own = [next(ids) for _ in parents]
            _add_characteristic(parents, result, own)
    status = ET.SubElement(one, "InspectionStatus")
    _text(status, "InspectionStatusEnum", _overall(part))
    ET.indent(root)
    return ET.tostring(root, encoding="unicode", xml_declaration=False) + "\n"


def _overall(part: MeasuredPart) -> str:
    decisions = {each.decision for each in part.results} - {None}
    for decision in (Decision.REJECTED, Decision.OPEN):
        if decision in decisions:
            return STATUS[decision]
    return STATUS[Decision.ACCEPTED if decisions else None]


def _number(value: float) -> str:
    return f"{value:.{N_DECIMALS}f}"  # a decimal has no exponent


def _text(parent: ET.Element, name: str, text: str) -> ET.Element:
    element = ET.SubElement(parent, name)
    element.text = text
    return element


def _add_characteristic(
    parents: Sequence[ET.Element], result: CharacteristicResult, ids: Sequence[str]
) -> None:
    """Add definition, nominal, item and measurement, each referring to the last."""
    planned = result.planned
    kind = "Linear" if planned.unit == "mm" else "Angular"
    definition, nominal, item, measured = (
        ET.SubElement(parent, f"UserDefined{kind}Characteristic{part}", {"id": id_})
        for parent, part, id_ in zip(parents, PARTS, ids, strict=True)
    )
    _text(definition, "Name", planned.label)
    lower, upper = result.lower, result.upper
    if np.isinf([lower, upper]).all():
        _text(definition, "NonTolerance", "MEASURED")
    else:
        tolerance = ET.SubElement(definition, "Tolerance")
        for name, limit in (("MaxValue", upper), ("MinValue", lower)):
            if np.isfinite(limit):
                _text(tolerance, name, _number(limit))
        _text(tolerance, "DefinedAsLimit", "true")
    what = f"{planned.quantity.value} of {', '.join(planned.of)}"
    datum = f", datum {planned.datum}" if planned.datum else ""
    _text(definition, "WhatToMeasure", what + datum)
    _text(nominal, "CharacteristicDefinitionId", ids[0])
    _text(nominal, "Name", planned.label)
    if planned.nominal is not None:
        _text(nominal, "TargetValue", _number(planned.nominal))
    _text(item, "Name", planned.label)
    _text(item, "CharacteristicNominalId", ids[1])
    status = ET.SubElement(measured, "Status")
    _text(status, "CharacteristicStatusEnum", STATUS[result.decision])
    _text(measured, "CharacteristicItemId", ids[2])
    _value(measured, "Value", result.value.value, result.value.uncertainty)


def _value(parent: ET.Element, name: str, value: float, uncertainty: float) -> None:
    """Add a value with its U (k = 2)."""
    element = _text(parent, name, _number(value))
    element.set("meanError", "0")  # QIF wants both or none
    element.set("combinedUncertainty", _number(uncertainty / COVERAGE_FACTOR))


def _vector(
    parent: ET.Element,
    name: str,
    vector: FloatArray,
    uncertainties: FloatArray | None = None,
) -> None:
    """Add a direction, or a place with U (k = 2) of its coordinates."""
    element = _text(parent, name, " ".join(map(_number, vector.tolist())))
    if uncertainties is not None:
        for axis, u in zip("xyz", uncertainties.tolist(), strict=True):
            element.set(f"{axis}MeanError", "0")
            element.set(f"{axis}CombinedUncertainty", _number(u / COVERAGE_FACTOR))


def _add_feature(
    parent: ET.Element, name: str, one: Measured, part: MeasuredPart, id_: str
) -> None:
    """Add place, direction, size and form of a feature in the frame of the part."""
    kind = one.kind.value.capitalize()
    element = ET.SubElement(parent, f"{kind}FeatureMeasurement", {"id": id_})
    _text(element, "FeatureName", name)
    values, spread = one.in_part.values, part.uncertainty(name)
    place, axis = values[PLACE], values[AXIS]

    def add_diameter() -> None:
        _value(element, "Diameter", 2 * values[6], 2 * spread[6])

    match one.kind:
        case FeatureKind.CYLINDER | FeatureKind.CONE:
            line = ET.SubElement(element, "Axis")
            _vector(line, "AxisPoint", place, spread[PLACE])
            _vector(line, "Direction", axis)
            add_diameter()
            if one.kind is FeatureKind.CONE:
                angle, u = 2 * np.rad2deg([values[7], spread[7]])
                _value(element, "FullAngle", angle, u)
        case _:
            _vector(element, "Location", place, spread[PLACE])
            if one.kind is FeatureKind.LINE:
                _vector(element, "Direction", axis)
            elif one.kind in {FeatureKind.PLANE, FeatureKind.CIRCLE}:
                _vector(element, "Normal", axis)
            if one.kind in {FeatureKind.CIRCLE, FeatureKind.SPHERE}:
                add_diameter()
    if one.kind is not FeatureKind.POINT:
        _text(element, "Form", _number(one.feature.form_error))
