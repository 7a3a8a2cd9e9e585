"""A measured part as QIF 3.0 results (ISO 23952), see `measuring.exports`.

Each characteristic has a definition with its tolerance, a nominal, an item and a
measurement. As a plan can combine features freely, characteristics are user-defined
linear or angular ones that name what is measured.
"""

from uuid import uuid4
from xml.etree import ElementTree as ET

import numpy as np

from lightpen import __version__
from lightpen.estimation.uncertainty.budget import COVERAGE_FACTOR
from lightpen.measuring.characteristics import IS_ANGLE
from lightpen.measuring.part import CharacteristicResult, MeasuredPart
from lightpen.model.decision_rules import Decision

NAMESPACE = "http://qifstandards.org/xsd/qif3"
VERSION = "3.0.0"
N_DECIMALS = 12
STATUS = {
    Decision.ACCEPTED: "PASS",
    Decision.REJECTED: "FAIL",
    Decision.OPEN: "INDETERMINATE",
    None: "NOT_ANALYZED",
}


def qif_text(part: MeasuredPart) -> str:
    """Return a QIF document with the characteristics of a part."""
    n = len(part.results)
    ids = iter(range(1, 4 * n + 3))
    root = ET.Element(
        "QIFDocument",
        {"xmlns": NAMESPACE, "versionQIF": VERSION, "idMax": str(4 * n + 2)},
    )
    _text(root, "QPId", str(uuid4()))
    application = ET.SubElement(ET.SubElement(root, "Header"), "Application")
    _text(application, "Name", f"Lightpen {__version__}")
    _text(application, "Organization", "Lightpen")
    standard_id = str(next(ids))
    standards = ET.SubElement(root, "StandardsDefinitions", {"n": "1"})
    standard = ET.SubElement(standards, "Standard", {"id": standard_id})
    body = ET.SubElement(standard, "Organization")
    _text(body, "StandardsOrganizationEnum", "ISO")
    _text(standard, "Designator", "1101")
    _text(standard, "Year", "2017")
    _add_units(root)
    results = ET.Element("Results")
    of_set = ET.SubElement(results, "MeasurementResultsSet", {"n": "1"})
    if n:
        characteristics = ET.SubElement(root, "Characteristics")
        _text(characteristics, "FormalStandardId", standard_id)
        definitions, nominals, items = (
            ET.SubElement(characteristics, f"Characteristic{each}", {"n": str(n)})
            for each in ("Definitions", "Nominals", "Items")
        )
    root.append(results)
    one = ET.SubElement(of_set, "MeasurementResults", {"id": str(next(ids))})
    if n:
        measured = ET.SubElement(one, "MeasuredCharacteristics")
        group = ET.SubElement(measured, "CharacteristicMeasurements", {"n": str(n)})
        for result in part.results:
            own = tuple(str(next(ids)) for _ in range(4))
            _add_definition(definitions, result, own)
            _add_nominal(nominals, result, own)
            _add_item(items, result, own)
            _add_measurement(group, result, own)
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


def _add_units(root: ET.Element) -> None:
    primary = ET.SubElement(ET.SubElement(root, "FileUnits"), "PrimaryUnits")
    for kind, si, name, factor in (
        ("AngularUnit", "radian", "degree", float(np.pi / 180)),
        ("LinearUnit", "meter", "mm", 0.001),
    ):
        unit = ET.SubElement(primary, kind)
        _text(unit, "SIUnitName", si)
        _text(unit, "UnitName", name)
        conversion = ET.SubElement(unit, "UnitConversion")
        _text(conversion, "Factor", _number(factor))


def _kind(result: CharacteristicResult) -> str:
    is_angle = result.planned.quantity in IS_ANGLE
    return f"UserDefined{'Angular' if is_angle else 'Linear'}Characteristic"


def _add(
    parent: ET.Element, result: CharacteristicResult, part: str, id_: str
) -> ET.Element:
    return ET.SubElement(parent, f"{_kind(result)}{part}", {"id": id_})


def _add_definition(
    parent: ET.Element, result: CharacteristicResult, ids: tuple[str, ...]
) -> None:
    planned = result.planned
    element = _add(parent, result, "Definition", ids[0])
    _text(element, "Name", planned.label)
    lower, upper = planned.limits
    if np.isinf([lower, upper]).all():
        _text(element, "NonTolerance", "NOTOL")
    else:
        tolerance = ET.SubElement(element, "Tolerance")
        for name, limit in (("MaxValue", upper), ("MinValue", lower)):
            if np.isfinite(limit):
                _text(tolerance, name, _number(limit))
        _text(tolerance, "DefinedAsLimit", "true")
    what = f"{planned.quantity.value} of {', '.join(planned.of)}"
    datum = f", datum {planned.datum}" if planned.datum else ""
    _text(element, "WhatToMeasure", what + datum)


def _add_nominal(
    parent: ET.Element, result: CharacteristicResult, ids: tuple[str, ...]
) -> None:
    element = _add(parent, result, "Nominal", ids[1])
    _text(element, "CharacteristicDefinitionId", ids[0])
    _text(element, "Name", result.planned.label)
    if result.planned.nominal is not None:
        _text(element, "TargetValue", _number(result.planned.nominal))


def _add_item(
    parent: ET.Element, result: CharacteristicResult, ids: tuple[str, ...]
) -> None:
    element = _add(parent, result, "Item", ids[2])
    _text(element, "Name", result.planned.label)
    _text(element, "CharacteristicNominalId", ids[1])


def _add_measurement(
    parent: ET.Element, result: CharacteristicResult, ids: tuple[str, ...]
) -> None:
    element = _add(parent, result, "Measurement", ids[3])
    status = ET.SubElement(element, "Status")
    _text(status, "CharacteristicStatusEnum", STATUS[result.decision])
    _text(element, "CharacteristicItemId", ids[2])
    value = _text(element, "Value", _number(result.value.value))
    value.set("meanError", "0")  # QIF wants both or none
    value.set(
        "combinedUncertainty", _number(result.value.uncertainty / COVERAGE_FACTOR)
    )
