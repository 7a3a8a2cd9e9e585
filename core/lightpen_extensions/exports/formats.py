"""The formats of other programs in which a calibration is exported, in one table.

Another format is a function from `CalibrationFile` to text and an entry of
`MORE_FORMATS`, which the command ``lightpen export`` and the menu of the wizard offer.
Transforms keep the axes of the pen: the tip is the origin of a frame parallel to that
of the pen.
"""

from collections.abc import Sequence
from datetime import datetime
from itertools import combinations_with_replacement, product
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import yaml

from lightpen.estimation.reports.verdict import AXES
from lightpen.local_time import local_now, local_time
from lightpen.messages import message, printable
from lightpen.model.coverage import COVERAGE_FACTOR
from lightpen.model.names import Laboratory
from lightpen.record.calibrations import (
    CalibrationFile,
    TracedItem,
    decision_rule,
    status_of,
)
from lightpen.record.exports import TABLE_FORMATS, ExportFormat, as_lines, export_remark

# A calibration as a Digital Calibration Certificate of PTB, schema 3.2.1 [1]_.
#
# It has the form of a certificate and states that it is none: it holds the record of a
# calibration, without accreditation and without a statement of conformity.
#
# References
# ----------
# .. [1] S. Hackel et al., "The Digital Calibration Certificate", PTB-Mitteilungen 127
#    (2017) 4, 75-81; https://www.ptb.de/dcc


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


MILLIMETRES = 1000.0  # in a metre, the unit of ROS
N_DECIMALS = 6  # of a length in mm in a file for statistics
PEN_FRAME, TIP_FRAME = "pen", "tip"


def _slicer(file: CalibrationFile) -> str:
    """Return an ITK transform that 3D Slicer reads as pen_from_tip.

    ITK's axes point left and to the back where Slicer's point right and to the front,
    and Slicer takes its transforms to go from the parent: of a shift only the last
    entry changes sign.
    """
    x, y, z = file.calibration.tip_pen_mm
    return _itk_shift((x, y, -z), "for 3D Slicer alone", export_remark(file))


def _itk(file: CalibrationFile) -> str:
    """Return an ITK transform that maps points from the tip frame to the pen frame."""
    words = "TransformPoint maps from the tip frame to the pen frame, mm"
    return _itk_shift(file.calibration.tip_pen_mm, words, export_remark(file))


def _itk_shift(shift: Sequence[float], *remarks: str) -> str:
    return as_lines(
        "#Insight Transform File V1.0",
        *(f"# {remark}" for remark in remarks),
        "#Transform 0",
        "Transform: AffineTransform_double_3_3",
        f"Parameters: 1 0 0 0 1 0 0 0 1 {' '.join(map(repr, shift))}",
        "FixedParameters: 0 0 0",
    )


def _plus(file: CalibrationFile) -> str:
    """Return the ``CoordinateDefinitions`` of a device set of PLUS.

    ``Error`` is the residual of the pivot calibration, mm, as fCal writes it.
    """
    x, y, z = file.calibration.tip_pen_mm
    when = file.when.strftime("%m%d%y_%H%M%S")
    matrix = f"1 0 0 {x!r} 0 1 0 {y!r} 0 0 1 {z!r} 0 0 0 1"
    error = f"{file.calibration.rms_mm:.{N_DECIMALS}f}"
    return as_lines(
        f"<!-- {export_remark(file)} -->",
        "<CoordinateDefinitions>",
        f'  <Transform From="StylusTip" To="Stylus" Matrix="{matrix}"',
        f'    Error="{error}" Date="{when}" />',
        "</CoordinateDefinitions>",
    )


def _ros(file: CalibrationFile) -> str:
    """Return a ``geometry_msgs/TransformStamped`` of ROS as YAML, in metres."""
    metres = [x / MILLIMETRES for x in file.calibration.tip_pen_mm]
    seconds = file.when.timestamp()
    stamp = {"sec": int(seconds), "nanosec": int(seconds % 1 * 1e6) * 1000}
    transform = {
        "header": {"stamp": stamp, "frame_id": PEN_FRAME},
        "child_frame_id": TIP_FRAME,
        "transform": {
            "translation": dict(zip(AXES, metres, strict=True)),
            "rotation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
        },
    }
    comment = f"# {export_remark(file)}\n"
    return comment + yaml.safe_dump(transform, sort_keys=False)


def _qdas(file: CalibrationFile) -> str:
    """Return a file of Q-DAS (AQDEF): x, y and z of the tip, and U of each.

    Each calibration is one value of six characteristics of a part, the pen with its
    tip, so that the files of many make the series. Operator, station and pen are those
    of the catalogues of operators, machines and gauges. Where the tip has a limit of
    change, the specification limits lie that far from the tip as found.
    """
    calibration, names, change = file.calibration, file.names, file.change
    pen, tip = printable(names.pen), printable(names.tip)
    values = [*calibration.tip_pen_mm, *calibration.expanded_uncertainty_mm]
    titles = map("".join, product(("Tip ", "U (k=2) of tip "), AXES))
    nominal = calibration.nominal_tip_mm or (None,) * 3
    limits: list[tuple[float, float] | None] = [None] * 3
    if change is not None and change.limit_mm is not None:
        limit = change.limit_mm
        limits = [(x - limit, x + limit) for x in change.as_found_mm]
    limits += [(0.0, calibration.verdict.limits.max_uncertainty_mm)] * 3
    lines = [
        f"K0100 {len(values)}",
        f"K1001 {pen}",
        f"K1002 Light pen {pen}, tip {tip}",
        f"K1003 {tip}",
        f"K1900 {export_remark(file)}",
        f"K4062/1 {printable(names.station)}",
        f"K4063/1 Station {printable(names.station)}",
        f"K4072/1 {pen}",
        f"K4073/1 Light pen {pen}",
        f"K4092/1 {printable(names.operator)}",
    ]
    each = zip(titles, (*nominal, None, None, None), limits, strict=True)
    for i, (title, target, bounds) in enumerate(each, start=1):
        lines += [f"K2001/{i} {i}", f"K2002/{i} {title}"]
        lines += [f"K2022/{i} {N_DECIMALS}", f"K2142/{i} mm"]
        if target is not None:
            lines.append(f"K2101/{i} {target:.{N_DECIMALS}f}")
        if bounds is not None:
            lower, upper = bounds
            lines.append(f"K2110/{i} {lower:.{N_DECIMALS}f}")
            lines.append(f"K2111/{i} {upper:.{N_DECIMALS}f}")
    when = f"{local_time(file.when):%d.%m.%Y/%H:%M:%S}"
    for i, value in enumerate(values, start=1):
        lines += [f"K0001/{i} {value:.{N_DECIMALS}f}", f"K0002/{i} 0"]  # 0: valid
        lines += [f"K0004/{i} {when}", f"K0008/{i} 1", f"K0010/{i} 1", f"K0012/{i} 1"]
    return as_lines(*lines)


MORE_FORMATS = (
    ExportFormat(
        "slicer",
        message("export.slicer"),
        "_tip.tfm",
        _slicer,
        message("content.slicer"),
    ),
    ExportFormat(
        "itk", message("export.itk"), "_itk.tfm", _itk, message("content.itk")
    ),
    ExportFormat(
        "plus", message("export.plus"), "_plus.xml", _plus, message("content.plus")
    ),
    ExportFormat(
        "ros", message("export.ros"), "_tip.yaml", _ros, message("content.ros")
    ),
    ExportFormat(
        "qdas", message("export.qdas"), "_tip.dfq", _qdas, message("content.qdas")
    ),
    ExportFormat(
        "dcc",
        message("export.dcc"),
        "_dcc.xml",
        dcc_text,
        message("content.dcc"),
        needs_laboratory=True,
    ),
)
FORMATS = (*TABLE_FORMATS, *MORE_FORMATS)
