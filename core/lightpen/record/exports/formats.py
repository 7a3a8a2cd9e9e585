"""A calibration as the record and as tables; extensions add formats of other programs.

A format is a function from `CalibrationFile` to text. All state the tip, its origin
(live, recorded, simulated), its grade and its status, see
`lightpen.record.calibrations.export_status`; the record as JSON has no place for a
status of the library.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from lightpen.estimation.reports.verdict import AXES
from lightpen.formats.csv_cells import csv_table
from lightpen.formats.file_format import FileFormat
from lightpen.formats.json_records import record_bytes
from lightpen.messages import Message, message
from lightpen.model.laboratory import Laboratory
from lightpen.record.calibrations.calibrations import CalibrationFile
from lightpen.record.calibrations.export_status import status_of


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


def _json(file: CalibrationFile) -> str:
    return record_bytes(file.calibration).decode()


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
        _json,
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
