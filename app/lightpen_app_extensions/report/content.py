"""The content of the reports: of a calibration, and of a verification or a part."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PySide6.QtCore import QCoreApplication

from lightpen.archive.logbook import entry_of_file
from lightpen.estimation.reports.calibration_record import CalibrationRecord
from lightpen.estimation.reports.verdict import Grade
from lightpen.formats.files import A_FILE, LARGEST_RECORD, read_bytes
from lightpen.formats.opened_files import InputFile, with_content
from lightpen.local_time import local_now
from lightpen.model.coverage import COVERAGE_FACTOR
from lightpen.model.names import Laboratory, Origin
from lightpen.record.calibrations import (
    OVERDUE,
    RETIRED,
    CalibrationFile,
    TracedItem,
    certified_values,
    decision_rule,
    read_calibration,
    traced_items,
    with_status,
)
from lightpen.record.exports import export_stem
from lightpen.record.folder import (
    BALL_CENTRE,
    MEASURED_PART,
    StoredVerification,
    data_folder_of_verification,
    is_verification,
    read_verification,
)
from lightpen.record.library.entered_files import EntryPlace
from lightpen.record.library.tip_library import Library, read_library
from lightpen.record.swings.header import Names
from lightpen_app.look.languages import listed, worded
from lightpen_app.look.phrases import grade_text, origin_text, reason_text, share_text
from lightpen_app.look.words import AXES, MICROMETRES, decimals_for, number_text
from lightpen_app_extensions.report.charts import budget_plot, points_plot
from lightpen_app_extensions.report.pages import Margins, PrintReport
from lightpen_app_extensions.report.template import (
    ANCHOR,
    Content,
    Piece,
    facts,
    fill_template,
    markup,
    paragraph,
    printed_text,
    table,
)

translate = QCoreApplication.translate

MOST_IMAGES = 40  # number of excluded images that are named
NUMBER_LENGTH = 12  # digits of the SHA-256 that name a record
UNKNOWN = "\u2013"
TONES = {  # classes of the style sheet
    Grade.PASS: "good",
    Grade.SCALE: "accent",
    Grade.STEADY: "accent",
    Grade.CHECK: "warn",
    Grade.REPEAT: "bad",
}
# Entries of the record that are elsewhere in the report, or too long for it.
ELSEWHERE = {
    *("program", "created", "verification", "verdict", "session", "station"),
    *("operator", "pen", "tip", "origin", "inputs", "records", "checksum"),
    *("temperature_c", "humidity_percent", "camera_serials"),
    *("touches", "left_out", "rejected", "images", "covariance"),
}
DECIMALS = 4  # of a length in mm
N_DIGITS = 6  # of another number
LONGEST_TABLE = 50  # rows


@dataclass(frozen=True)
class KeptVerification:
    """A verification on the disk: its file with the content."""

    file: InputFile
    done: StoredVerification
    traced: tuple[TracedItem, ...] = ()


@dataclass(frozen=True)
class ReportContent:
    """Content of a report."""

    of: CalibrationFile | KeptVerification
    entered: EntryPlace | None = None  # its entry in the archive
    laboratory: Laboratory | None = None  # where it was made

    @property
    def stem(self) -> str:
        """Beginning of the default file name."""
        if isinstance(self.of, KeptVerification):
            name = f"{self.of.file.path.stem}_{self.of.done.verification}"
            return name.replace(" ", "-")
        if self.of.accepted is None:
            return self.of.path.stem
        return export_stem(self.of.names, self.of.accepted, self.of.origin)


def read_content(path: Path, laboratory: Laboratory | None) -> ReportContent:
    """Read the content of the report of a result.

    The result is an accepted one, or what ``lightpen calibrate``, ``verify`` or
    ``repeatability`` wrote. Raises `FileError` if it is not the one that was entered,
    `UsageError` if the file holds none, or lacks content of the report.
    """
    if not is_verification(read_bytes(path, A_FILE, LARGEST_RECORD)):
        found = with_status(read_calibration(path), local_now())
        return ReportContent(found, entry_of_file(path, found.sha256), laboratory)
    file = with_content(path)
    done = read_verification(file.content or b"", path)
    data = data_folder_of_verification(path)
    library = Library() if data is None else read_library(data)
    names = Names(done.station, done.operator, done.pen, done.tip)
    certified = certified_values(json.loads(file.content or b"{}"))
    traced = traced_items(library, names, done.camera_serials, certified)
    entered = entry_of_file(path, file.sha256)
    return ReportContent(KeptVerification(file, done, traced), entered, laboratory)


def print_report_of(content: ReportContent) -> PrintReport:
    """Return the pages of a report, in the selected language."""
    if isinstance(content.of, KeptVerification):
        return _verification_report(content, content.of)
    return _calibration_report(content, content.of)


def _proof(
    content: ReportContent,
    name: str,
    sha256: str,
    traced: Sequence[TracedItem],
    origin: Origin | None,
) -> dict[str, Any]:
    """Return what every report states: laboratory, equipment, file and origin."""
    known = content.laboratory or Laboratory()
    place = (known.street, f"{known.post_code} {known.city}".strip(), known.country)
    return {
        "laboratory": known.name,
        "place": listed(filter(None, place)),
        "procedure": known.procedure,
        "traced": traced,
        "file": name,
        "sha256": sha256,
        "entered": content.entered,
        "source": origin_text(origin),
    }


def _margins(
    title: str, subject: str, sha256: str, origin: Origin | None, badges: Sequence[str]
) -> Margins:
    digits = sha256[:NUMBER_LENGTH]
    number = " ".join(digits[i : i + 4] for i in range(0, NUMBER_LENGTH, 4))
    return Margins(
        title=title,
        subject=subject,
        number=translate("paper", "No. {0}").format(number),
        badges=(*([] if origin is Origin.LIVE else [origin_text(origin)]), *badges),
        foot=translate("paper", "SHA-256 of the JSON file: {0}").format(sha256),
    )


def _verdict(grade: Grade, lines: Sequence[str]) -> Piece:
    tone = TONES[grade]
    return Piece(
        f'<table width="100%" cellspacing="0"><tr>'
        f'<td class="verdict {tone} word" width="18%">'
        f'<h1 class="{tone}">{ANCHOR}{markup(grade_text(grade))}</h1></td>'
        f'<td class="verdict {tone} why" valign="middle">'
        f"{markup(chr(10).join(filter(None, lines)))}</td></tr></table>"
    )


# Of a calibration.


def _calibration_report(content: ReportContent, file: CalibrationFile) -> PrintReport:
    calibration, names = file.calibration, file.names
    excluded = [each for each in enumerate(calibration.frames, 1) if not each[1].used]
    factor = calibration.uncertainty.correlation_factor
    given = (names.pen, names.tip, names.cone, names.station, names.operator)
    dropped = calibration.images.dropped
    nominal, change = file.nominal_tip, file.change
    own = {
        **_proof(content, file.name, file.sha256, file.traced, file.origin),
        "correlation": factor if factor > 1 else None,
        "largest": calibration.weakest_direction.expanded_uncertainty_mm,
        "from_nominal": None if nominal is None else file.tip_pen - nominal,
        "change_u": None if change is None else max(change.expanded_uncertainty_mm),
        "status": _status(file),
        "signer": translate("paper", "Calibrated by"),
        "unprintable": any(
            printed_text(each) != each for each in (*given, file.reason)
        ),
        "excluded": excluded[:MOST_IMAGES],
        "n_excluded": len(excluded),
        "n_more": len(excluded) - MOST_IMAGES if len(excluded) > MOST_IMAGES else None,
        "dropped": listed(f"{n} {reason_text(each)}" for each, n in dropped.items()),
        "worst": max(
            (f.rms_px or 0.0 for f in calibration.frames if f.used), default=0
        ),
        "rules": decision_rule(calibration.verdict.limits),
        "files": _calibration_files(calibration),
        "n_observations": len(calibration.inputs.observations),
        **_budget(calibration),
    }
    filled = Content(
        (own, file, calibration),
        {"budget_plot": budget_plot(calibration)},
        {"verdict": [_verdict(file.grade, [worded(file.why), _acceptance(file)])]},
    )
    badges = [] if file.grade is Grade.PASS else [grade_text(file.grade)]
    if file.accepted is None:
        badges.append(translate("paper", "NOT ACCEPTED"))
    items = (each or UNKNOWN for each in (names.pen, names.tip, names.cone))
    margins = _margins(
        translate("paper", "Calibration report"),
        translate("paper", "Pen {0}, tip {1}, cone {2}").format(*items),
        file.sha256,
        file.origin,
        [*badges, *_library_status(file)],
    )
    return PrintReport(names.operator, margins, fill_template("calibration", filled))


def _acceptance(file: CalibrationFile) -> str:
    if file.accepted is None:
        return translate("paper", "This tip has not been accepted.")
    if file.origin is Origin.SIMULATED:
        return translate("paper", "Practice: not used for any pen.")
    if file.grade is Grade.PASS:
        return translate("paper", "The tip was accepted.")
    accepted = translate("paper", "The tip was accepted. Reason: {0}")
    return accepted.format(file.reason)


def _library_status(file: CalibrationFile) -> list[str]:
    """Return why pen or tip are not valid."""
    words = {
        RETIRED: translate("paper", "RETIRED"),
        OVERDUE: translate("paper", "OVERDUE"),
    }
    return [words[each] for each in file.library_status]


def _status(file: CalibrationFile) -> str:
    if file.origin is Origin.SIMULATED:
        return translate("paper", "practice")
    valid = "" if file.due is None else translate("paper", "valid")
    return listed(_library_status(file)) or valid


def _budget(calibration: CalibrationRecord) -> dict[str, Any]:
    """Return covariance and budget in micrometres, with their decimals."""
    covariance = MICROMETRES**2 * np.array(calibration.covariance)[:3, :3]
    decimals = decimals_for(float(np.diag(covariance).min()))
    u = MICROMETRES * np.array(calibration.expanded_uncertainty_mm)
    digits = 1 + max(map(decimals_for, u.tolist()))

    def micrometres(values: Sequence[float], places: int = digits) -> list[str]:
        return [number_text(each, places) for each in values]

    return {
        "covariance": [
            [axis, *micrometres(row, decimals)]
            for axis, row in zip(AXES, covariance.tolist(), strict=True)
        ],
        "contributions": [
            [
                share_text(share.name, is_whole=True),
                *micrometres([MICROMETRES * x for x in share.standard_uncertainty_mm]),
                *micrometres([MICROMETRES * share.weakest_expanded_uncertainty_mm]),
                translate("paper", "assumed") if share.assumed else "",
            ]
            for share in calibration.uncertainty.shares
        ],
        "combined": micrometres((u / COVERAGE_FACTOR).tolist()),
        "expanded": micrometres(u.tolist()),
        "expanded_weakest": number_text(
            MICROMETRES * calibration.weakest_direction.expanded_uncertainty_mm, digits
        ),
    }


def _calibration_files(calibration: CalibrationRecord) -> list[tuple[str, Any]]:
    inputs, words = calibration.inputs, translate
    rig = [] if inputs.rig is None else [(words("paper", "Rig"), inputs.rig)]
    cameras = inputs.cameras or (inputs.camera,)
    return [
        *rig,
        *((translate("paper", "Camera"), each) for each in cameras),
        (translate("paper", "Pen"), inputs.pen),
    ]


# Of a verification. The figures are taken from the JSON record, with its names, so that
# a new task needs no code here.


def _verification_report(content: ReportContent, kept: KeptVerification) -> PrintReport:
    file, done = kept.file, kept.done
    record: dict[str, Any] = json.loads(file.content or b"{}")
    is_part = done.verification == MEASURED_PART
    title = translate("paper", "Verification report")
    signer = translate("paper", "Verified by")
    if is_part:
        title = translate("paper", "Measurement report")
        signer = translate("paper", "Measured by")
    verdict, grades = done.verdict, []
    inputs = record.get("inputs", {})
    own = {
        **_proof(content, file.path.name, file.sha256, kept.traced, done.origin),
        "title": title,
        "signer": signer,
        "is_part": is_part,
        "program": str(done.program),
        "judged": verdict,
        "rule": verdict and (record["verdict"].get("decision_rule") or None),
        "limits": [(_title(n), x) for n, x in verdict.limits_mm.items()]
        if verdict
        else [],
        "n_observations": len(inputs.get("images", ())),
        "files": _verification_files(inputs),
    }
    drawn: dict[str, Sequence[Piece]] = {"verdict": ()}
    if verdict is not None:
        grade = Grade(verdict.grade)
        drawn["verdict"] = [_verdict(grade, [worded(done.why)])]
        grades = [] if grade is Grade.PASS else [grade_text(grade)]
    drawn["figures"] = _part(record) if is_part else tuple(_figures(record))
    parts = fill_template("verification", Content((own, done), drawn=drawn))
    items = (each or UNKNOWN for each in (done.pen, done.tip, done.verification))
    subject = translate("paper", "Pen {0}, tip {1}, {2}").format(*items)
    # What was computed from files may state no origin.
    origin = done.origin or Origin.LIVE
    margins = _margins(title, subject, file.sha256, origin, grades)
    return PrintReport(done.operator, margins, parts)


def _verification_files(inputs: Mapping[str, Any]) -> list[tuple[str, Any]]:
    """Return the files with their hashes."""
    named = [
        (name, each)
        for name, each in inputs.items()
        if isinstance(each, Mapping) and "file" in each
    ]
    live = [  # touches before a camera, whose images it lists
        ("touches", {"file": each["folder"], "sha256": each["journal_sha256"]})
        for each in inputs.get("touches", ())
    ]
    return [*named, *(("", each) for each in inputs.get("files", ())), *live]


def _figures(of: Mapping[str, Any]) -> Iterator[Piece]:
    """Yield numbers and words as facts, points as tables, and what is within."""
    of = {name: value for name, value in of.items() if name not in ELSEWHERE}
    short = {name: value for name, value in of.items() if _is_short(value)}
    yield from facts([(_title(n), _plain(n, v)) for n, v in short.items()], 1)
    for name, value in of.items():
        many = value if isinstance(value, list) else [value]
        if name in short or not many:
            continue
        if all(isinstance(each, Mapping) for each in many):
            for i, each in enumerate(many[:LONGEST_TABLE], 1):
                number = f" {i}" if many is value else ""
                yield paragraph(f"{_title(name)}{number}", "## ")
                yield from _figures(each)
            continue
        rows = [each if isinstance(each, list) else [each] for each in many]
        if all(map(_is_short, rows)):
            yield paragraph(_title(name), "## ")
            yield from _numbers(name, rows)


def _numbers(name: str, rows: Sequence[Sequence[float]]) -> tuple[Piece, ...]:
    n_columns = max(map(len, rows))
    filled = [
        [str(i), *(_number(name, x) for x in row), *[""] * (n_columns - len(row))]
        for i, row in enumerate(rows[:LONGEST_TABLE], 1)
    ]
    return table([""] * (n_columns + 1), ["0.5", *[">1"] * n_columns], filled)


def _title(name: str) -> str:
    words, unit = name, ""
    for end in ("_mm", "_px", "_deg"):
        if name.endswith(end):
            words, unit = name.removesuffix(end), f" / {end[1:]}"
    return words.replace("_", " ") + unit


def _is_short(value: Any) -> bool:
    if isinstance(value, list):
        return 0 < len(value) <= 3 and all(isinstance(x, (int, float)) for x in value)
    return isinstance(value, (str, int, float)) or value is None


def _plain(name: str, value: Any) -> str:
    if isinstance(value, list):
        return "  ".join(_number(name, each) for each in value)
    if isinstance(value, bool):
        return translate("paper", "yes") if value else translate("paper", "no")
    if isinstance(value, (int, float)):
        return _number(name, value)
    return str(value or "") or translate("paper", "not stated")


def _number(name: str, value: float) -> str:
    """Return a length with decimals, and any other number with significant digits."""
    is_length = isinstance(value, float) and name.endswith("_mm")
    return number_text(value, DECIMALS) if is_length else f"{value:.{N_DIGITS}g}"


def _part(record: Mapping[str, Any]) -> tuple[Piece, ...]:
    """Return characteristics, features, alignment, points and plan."""
    features = [
        {
            **each,
            "largest": max(each["expanded_uncertainty"][:3]),
            "kind": _kind(each),
            "sizes": dict(_sizes(each["sizes"])),
        }
        for each in record["features"]
    ]
    plots, texts = points_plot(record["touches"])
    scope = {**texts, "features": features}, record
    return fill_template("part", Content(scope, plots))


def _kind(feature: Mapping[str, Any]) -> str:
    """Return the kind of a feature, with the side of the ball and its evidence."""
    kind, by = feature["kind"], feature["side_by"]
    return str(kind) if by == BALL_CENTRE else f"{kind}, {feature['side']} ({by})"


def _sizes(sizes: Mapping[str, float]) -> Iterator[tuple[str, str]]:
    """Yield the sizes of a feature as a plan states them, mm and degrees."""
    if "radius" in sizes:
        yield "diameter", number_text(2 * sizes["radius"], DECIMALS)
    if "half_angle" in sizes:
        yield "angle", number_text(2 * np.rad2deg(sizes["half_angle"]), DECIMALS)
