"""Files of an exported calibration: content and names.

A name begins with pen, tip and date. No file is overwritten: a name in use gets a
number.
"""

from contextlib import suppress
from dataclasses import replace
from datetime import datetime
from itertools import chain, count
from pathlib import Path

from lightpen.arrays import FloatArray
from lightpen.errors import NameTakenError
from lightpen.estimation.reports.report import calibration_record
from lightpen.formats.files import create_whole
from lightpen.formats.json_records import record_bytes
from lightpen.model.origin import Origin
from lightpen.record.calibrations.calibrations import CalibrationFile, parse_calibration
from lightpen.record.swings.names import LONGEST_WORD, UNFIT, Names, not_reserved
from lightpen.record.swings.reading import open_record, recorded_limits
from lightpen.record.swings.solving import Solution, record_inputs


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
    limits = recorded_limits(open_record(solution.source.folder))
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
