"""A calibration as a Digital Calibration Certificate of PTB, schema 3.2.1 [1]_.

It has the form of a certificate and states that it is none: it holds the record of a
calibration, without accreditation and without a statement of conformity.

References
----------
.. [1] S. Hackel et al., "The Digital Calibration Certificate", PTB-Mitteilungen 127
   (2017) 4, 75-81; https://www.ptb.de/dcc
"""

from datetime import datetime
from itertools import combinations_with_replacement
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from lightpen.estimation.reports.verdict import AXES
from lightpen.local_time import local_now
from lightpen.model.expanded_uncertainty import COVERAGE_FACTOR
from lightpen.model.laboratory import Laboratory
from lightpen.record.calibrations.calibrations import CalibrationFile
from lightpen.record.calibrations.decision_rule import decision_rule
from lightpen.record.calibrations.export_status import status_of
from lightpen.record.calibrations.traceability import TracedItem

VERSION = "3.2.1"
DCC, SI = "https://ptb.de/dcc", "https://ptb.de/si"
PLACE = f"{DCC}/v{VERSION}/dcc.xsd"
INSTANCE = "http://www.w3.org/2001/XMLSchema-instance"
PREFIXES = {"dcc": DCC, "si": SI, "xsi": INSTANCE}
LANGUAGE = "en"
MILLIMETRE, SQUARE_MILLIMETRE = r"\milli\metre", r"\milli\metre\tothe{2}"
DEGREE_CELSIUS, PERCENT = r"\degreecelsius", r"\percent"
PROBABILITY = 0.95
UNSTATED = "not stated"
NO_CERTIFICATE = (
    "Calibration record of a light pen and its tip. It is no certificate of an "
    "accredited laboratory, states no conformity, and relates only to the items named."
)


def dcc_text(file: CalibrationFile, laboratory: Laboratory) -> str:
    """Return a calibration as XML."""
    for prefix, uri in PREFIXES.items():
        ElementTree.register_namespace(prefix, uri)
    root = Element(
        _dcc("digitalCalibrationCertificate"),
        {"schemaVersion": VERSION, f"{{{INSTANCE}}}schemaLocation": f"{DCC} {PLACE}"},
    )
    _add_administrative_data(root, file, laboratory)
    results = _sub(root, "measurementResults")
    _add_result(_sub(results, "measurementResult"), file, laboratory)
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode", xml_declaration=False)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'


def _add_administrative_data(
    root: Element, file: CalibrationFile, laboratory: Laboratory
) -> None:
    data, names = _sub(root, "administrativeData"), file.names
    program = file.calibration.program
    _add_software(_sub(data, "dccSoftware"), program.name, program.version)
    core = _sub(data, "coreData")
    _value(core, "countryCodeISO3166_1", laboratory.country)
    _value(core, "usedLangCodeISO639_1", LANGUAGE)
    _value(core, "mandatoryLangCodeISO639_1", LANGUAGE)
    _value(core, "uniqueIdentifier", f"lightpen-{file.sha256}")
    identified = _sub(core, "identifications")
    _identify(identified, "SHA-256 of the JSON record", file.sha256)
    _identify(identified, "JSON record", file.name)
    begin, end = file.measured or file.calibration.created, file.calibration.created
    _value(core, "beginPerformanceDate", f"{begin:%Y-%m-%d}")
    _value(core, "endPerformanceDate", f"{max(begin, end):%Y-%m-%d}")
    _value(core, "performanceLocation", laboratory.place)
    _value(core, "issueDate", f"{local_now():%Y-%m-%d}")
    items = _sub(data, "items")
    _add_item(items, "Light pen", "Serial number", names.pen)
    _add_item(items, "Probe tip", "Identification", names.tip)
    _add_contact(_sub(_sub(data, "calibrationLaboratory"), "contact"), laboratory)
    persons = _sub(data, "respPersons")
    for name, role in ((names.operator, "operator"), (file.supervisor, "supervisor")):
        if name or role == "operator":
            person = _sub(persons, "respPerson")
            _text(_sub(person, "person"), "name", name or UNSTATED)
            _value(person, "role", role)
            is_main = (role == "supervisor") == bool(file.supervisor)
            _value(person, "mainSigner", str(is_main).lower())
    _add_contact(_sub(data, "customer"), laboratory)
    statements = _sub(data, "statements")
    declaration = _sub(_sub(statements, "statement"), "declaration")
    _content(declaration, NO_CERTIFICATE)


def _add_result(result: Element, file: CalibrationFile, laboratory: Laboratory) -> None:
    calibration, names = file.calibration, file.names
    _text(result, "name", "Position of the tip in the frame of the pen")
    methods = _sub(result, "usedMethods")
    method = _sub(methods, "usedMethod")
    _text(method, "name", "Pivot calibration by a swing about a fixed cone")
    images = calibration.images
    _rich(
        method,
        "description",
        f"Estimator: {calibration.method}. {images.used} of {images.total} images "
        f"used; residuals {calibration.rms_px:.4f} px rms. Station: "
        f"{names.station or UNSTATED}; cone: {names.cone or UNSTATED}; images: "
        f"{calibration.origin or file.origin or UNSTATED}.",
        *map(str, decision_rule(calibration.verdict.limits)),
    )
    if laboratory.procedure:
        _text(_sub(methods, "usedMethod"), "name", laboratory.procedure)
    program = calibration.program
    _add_software(_sub(result, "usedSoftware"), program.name, program.version)
    equipment = _sub(result, "measuringEquipments")
    inputs = calibration.inputs
    for name, given in (("Intrinsics file", inputs.camera), ("LED file", inputs.pen)):
        _add_file(equipment, name, given.file, given.sha256)
    for each in file.traced:
        _add_traced(equipment, each)
    _add_conditions(result, file)
    data = _sub(_sub(result, "results"), "result")
    _text(data, "name", "Centre of the tip")
    verdict = f"Verdict: {file.grade.value}. {file.why.text}"
    listed = _sub(data, "data")
    status = f"Status: {', '.join(status_of(file))}" if status_of(file) else ""
    _rich(listed, "text", *filter(None, (verdict, status, file.reason)))
    tip, spread = calibration.tip_pen_mm, calibration.expanded_uncertainty_mm
    for axis, value, uncertainty in zip(AXES, tip, spread, strict=True):
        real = _quantity(listed, f"Tip {axis}", value, MILLIMETRE, calibration.created)
        expanded = SubElement(real, _si("expandedUnc"))
        SubElement(expanded, _si("uncertainty")).text = repr(uncertainty)
        SubElement(expanded, _si("coverageFactor")).text = f"{COVERAGE_FACTOR:g}"
        SubElement(expanded, _si("coverageProbability")).text = f"{PROBABILITY:g}"
        SubElement(expanded, _si("distribution")).text = "normal"
    for i, k in combinations_with_replacement(range(len(AXES)), 2):
        name = f"Covariance of tip {AXES[i]} and {AXES[k]}"
        _quantity(listed, name, calibration.covariance[i][k], SQUARE_MILLIMETRE)


def _add_software(parent: Element, name: str, release: str) -> None:
    software = _sub(parent, "software")
    _text(software, "name", name)
    _value(software, "release", release)


def _add_item(items: Element, what: str, by: str, name: str) -> None:
    item = _sub(items, "item")
    _text(item, "name", what)
    _text(_sub(item, "manufacturer"), "name", UNSTATED)
    _identify(_sub(item, "identifications"), by, name or UNSTATED, "owner")


def _add_file(equipment: Element, what: str, name: str, sha256: str) -> None:
    part = _sub(equipment, "measuringEquipment")
    _text(part, "name", what)
    identified = _sub(part, "identifications")
    _identify(identified, "File", name)
    _identify(identified, "SHA-256", sha256)


def _add_traced(equipment: Element, traced: TracedItem) -> None:
    """Add an item of the measuring equipment with its certificate."""
    part, item = _sub(equipment, "measuringEquipment"), traced.item
    _text(part, "name", traced.kind.value)
    if item is not None and item.certificate:
        dated = "" if item.certified is None else f" of {item.certified}"
        due = "" if item.due is None else f", due {item.due}"
        description = f"Certificate {item.certificate}{dated}{due}."
        _rich(part, "description", description)
    _identify(_sub(part, "identifications"), "Identification", traced.id, "owner")


def _add_conditions(result: Element, file: CalibrationFile) -> None:
    """Add temperature and humidity where they were measured."""
    assumed = file.calibration.assumptions
    measured = [
        ("Temperature of the pen", assumed.temperature_c, DEGREE_CELSIUS),
        ("Relative humidity", assumed.humidity_percent, PERCENT),
    ]
    given = [(name, value, unit) for name, value, unit in measured if value is not None]
    if not given:
        return
    conditions = _sub(result, "influenceConditions")
    for name, value, unit in given:
        condition = _sub(conditions, "influenceCondition")
        _text(condition, "name", name)
        _quantity(_sub(condition, "data"), name, value, unit)


def _add_contact(contact: Element, laboratory: Laboratory) -> None:
    _text(contact, "name", laboratory.name)
    _value(contact, "eMail", laboratory.email)
    location = _sub(contact, "location")
    for name, words in (
        ("street", laboratory.street),
        ("postCode", laboratory.post_code),
        ("city", laboratory.city),
        ("countryCode", laboratory.country),
    ):
        if words:
            _value(location, name, words)


def _identify(
    parent: Element, what: str, name: str, issuer: str = "calibrationLaboratory"
) -> None:
    identification = _sub(parent, "identification")
    _value(identification, "issuer", issuer)
    _value(identification, "value", name)
    _text(identification, "name", what)


def _quantity(
    data: Element, name: str, value: float, unit: str, at: datetime | None = None
) -> Element:
    quantity = _sub(data, "quantity")
    _text(quantity, "name", name)
    real = SubElement(quantity, _si("real"))
    SubElement(real, _si("value")).text = repr(value)
    SubElement(real, _si("unit")).text = unit
    if at is not None:
        SubElement(real, _si("dateTime")).text = at.isoformat(timespec="seconds")
    return real


def _text(parent: Element, tag: str, words: str) -> None:
    _content(_sub(parent, tag), words)


def _rich(parent: Element, tag: str, *paragraphs: str) -> None:
    rich = _sub(parent, tag)
    for words in paragraphs:
        _content(rich, words)


def _content(parent: Element, words: str) -> None:
    _value(parent, "content", words).set("lang", LANGUAGE)


def _value(parent: Element, tag: str, words: str) -> Element:
    """Add a text as XML can hold it: without control characters or outer blanks."""
    element = _sub(parent, tag)
    plain = "".join(c if c.isprintable() else " " for c in words)
    element.text = " ".join(plain.split()) or UNSTATED
    return element


def _sub(parent: Element, tag: str) -> Element:
    return SubElement(parent, _dcc(tag))


def _dcc(tag: str) -> str:
    return f"{{{DCC}}}{tag}"


def _si(tag: str) -> str:
    return f"{{{SI}}}{tag}"
