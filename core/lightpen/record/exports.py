"""Tips for other programs: tables, DCC, trackers, robots, statistics."""

from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import datetime
from itertools import chain, count
from pathlib import Path

from lightpen.arrays import FloatArray
from lightpen.errors import NameTakenError
from lightpen.estimation.reports.report import calibration_record
from lightpen.estimation.reports.verdict import AXES
from lightpen.formats.files import FileFormat, create_whole
from lightpen.formats.own_json import record_bytes
from lightpen.formats.spreadsheets import csv_table
from lightpen.messages import Message, message
from lightpen.model.names import Laboratory, Origin
from lightpen.record.calibrations import CalibrationFile, parse_calibration, status_of
from lightpen.record.swings.header import LONGEST_WORD, UNFIT, Names, not_reserved
from lightpen.record.swings.reading import open_record
from lightpen.record.swings.solving import Solution, record_inputs

# Files of an exported calibration: content and names.
#
# A name begins with pen, tip and date. No file is overwritten: a name in use gets a
# number.


def export_stem(names: Names, moment: datetime, origin: Origin | None) -> str:
    """Return the common beginning of the file names: pen, tip and date.

    The origin stands behind, unless it is a live camera.
    """
    pen, tip = names.pen[:LONGEST_WORD], names.tip[:LONGEST_WORD]
    words = (pen, tip, f"{moment:%Y-%m-%d}", _mark(origin))
    return not_reserved(UNFIT.sub("-", "_".join(filter(None, words))))


def save_new(folder: Path, name: str, data: bytes) -> Path:
    """Write a file under an unused name, and return its path."""
    path = folder / name
    for tail in chain([""], map("-{}".format, count(2))):
        free = path.with_name(f"{path.stem}{tail}{path.suffix}")
        with suppress(NameTakenError):
            create_whole(free, data)
            break
    return free


def exported_solution(solution: Solution, names: Names) -> CalibrationFile:
    """Return a solved, not yet accepted swing for export."""
    limits = open_record(solution.source.folder).header.limits
    inputs = record_inputs(solution.source)
    record = calibration_record(solution.calibration, inputs, limits)
    data = record_bytes(record)
    file = parse_calibration(data, Path("calibration.json"))
    return replace(file, names=names)


def copied_tip(tip_pen: FloatArray, origin: Origin | None) -> str:
    """Return the tip as a line to be pasted: x, y, z in mm, separated by tabs.

    The origin stands behind, unless it is a live camera.
    """
    return "\t".join(filter(None, (*map(repr, tip_pen.tolist()), _mark(origin))))


def _mark(origin: Origin | None) -> str:
    return "" if origin in (None, Origin.LIVE) else origin.upper()


# A calibration as the record and as tables; extensions add formats of other programs.
#
# A format is a function from `CalibrationFile` to text. All state the tip, its origin
# (live, recorded, simulated), its grade and its status, see
# `lightpen.record.calibrations`; the record as JSON has no place for a
# status of the library.


@dataclass(frozen=True)
class ExportFormat(FileFormat):
    """A format of exported calibrations; its `text` takes a `CalibrationFile`."""

    description: Message
    needs_laboratory: bool = False  # `text` also takes a `Laboratory`
    has_status: bool = True  # states what the library says of pen and tip

    def content(
        self, file: CalibrationFile, laboratory: Laboratory | None = None
    ) -> bytes:
        """Return the content of a file, in UTF-8."""
        if not self.needs_laboratory:
            return self.encoded(file)
        if laboratory is None:
            raise ValueError(f"The format {self.name} needs a `laboratory`.")
        return self.encoded(file, laboratory)


def export_remark(file: CalibrationFile) -> str:
    """Return origin, grade, acceptance and status, for a comment."""
    accepted, status = file.accepted, status_of(file)
    return (
        f"origin: {file.origin or 'not stated'}; "
        f"grade: {file.grade.value}; "
        f"accepted: {'no' if accepted is None else accepted.isoformat()}"
        + (f"; status: {', '.join(status)}" if status else "")
    )


def _tip(file: CalibrationFile) -> str:
    """Return a table of one row: names, origin, tip and U (k = 2), time and grade."""
    calibration = file.calibration
    names, accepted = file.names, file.accepted
    row = {
        "station": names.station,
        "operator": names.operator,
        "pen": names.pen,
        "tip": names.tip,
        "cone": names.cone,
        "origin": file.origin or "",
        "ball_diameter_mm": names.ball_diameter or "",
    }
    row |= {f"tip_{a}_mm": x for a, x in zip(AXES, calibration.tip_pen_mm, strict=True)}
    spread = zip(AXES, calibration.expanded_uncertainty_mm, strict=True)
    row |= {f"expanded_uncertainty_{axis}_mm": U for axis, U in spread}
    row["calibrated"] = calibration.created.isoformat()
    row["accepted"] = "" if accepted is None else accepted.isoformat()
    row["grade"] = file.grade.value
    row["status"] = ", ".join(status_of(file))
    return csv_table([list(row), list(row.values())])


def _images(file: CalibrationFile) -> str:
    """Return a row for each image with its state and residual."""
    head = ["image", "file", "used", "reason", "rms_px"]
    head += [*(f"tip_{axis}_cam_mm" for axis in "uvw"), "camera", "origin", "grade"]
    head.append("status")
    rows: list[Sequence[object]] = [head]
    numbers, status = Counter[str](), ", ".join(status_of(file))
    for image in file.calibration.frames:
        numbers[image.camera] += 1
        fit = (image.reason, image.rms_px, *image.tip_cam_mm)
        of_all = (image.camera, file.origin or "", file.grade.value, status)
        rows.append([numbers[image.camera], image.file, image.used, *fit, *of_all])
    return csv_table(rows)


def _text(file: CalibrationFile) -> str:
    """Return x, y, z in mm, separated by tabs, and a comment."""
    tip = "\t".join(map(repr, file.calibration.tip_pen_mm))
    return as_lines(tip, f"# {export_remark(file)}")


def as_lines(*lines: str) -> str:
    """Return lines as a text that ends with a line break."""
    return "\n".join(lines) + "\n"


TABLE_FORMATS = (
    ExportFormat(
        "json",
        message("export.json"),
        "_calibration.json",
        lambda file: record_bytes(file.calibration).decode(),
        message("content.json"),
        has_status=False,
    ),
    ExportFormat(
        "csv", message("export.csv"), "_tip.csv", _tip, message("content.csv")
    ),
    ExportFormat(
        "images",
        message("export.images"),
        "_images.csv",
        _images,
        message("content.images"),
    ),
    ExportFormat(
        "text", message("export.text"), "_tip.txt", _text, message("content.text")
    ),
)
