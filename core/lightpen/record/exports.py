"""A solved swing for use elsewhere: as JSON, as tables, as text to be pasted.

Files are named by pen, tip and date, and nothing is ever overwritten: a name that is
taken gets a number.
"""

import csv
import io
from collections.abc import Iterable, Sequence
from contextlib import suppress
from datetime import datetime
from itertools import chain, count
from pathlib import Path

from lightpen.errors import NameTakenError
from lightpen.estimation.report import calibration_record
from lightpen.estimation.verdict import AXES
from lightpen.formats.files import create_whole
from lightpen.formats.json_records import record_bytes
from lightpen.model.origin import Origin
from lightpen.record.names import LONGEST_WORD, UNFIT, Names
from lightpen.record.reading import open_record, recorded_limits
from lightpen.record.solving import Solution, record_inputs


def export_stem(names: Names, moment: datetime, origin: Origin | None) -> str:
    """Return what the names of files of a tip begin with: pen, tip and date.

    What its images are of stands behind, unless they are of a live camera.
    """
    pen, tip = names.pen[:LONGEST_WORD], names.tip[:LONGEST_WORD]
    words = (pen, tip, f"{moment:%Y-%m-%d}", _mark(origin))
    return UNFIT.sub("-", "_".join(filter(None, words)))


def save_new(folder: Path, name: str, data: bytes) -> Path:
    """Write a file under a name that none has yet, and return where it is.

    Raises
    ------
    FileError
        It cannot be written.
    """
    path = folder / name
    for tail in chain([""], map("-{}".format, count(2))):
        free = path.with_name(f"{path.stem}{tail}{path.suffix}")
        with suppress(NameTakenError):
            create_whole(free, data)
            break
    return free


def calibration_json(solution: Solution) -> bytes:
    """Return the record of a solved swing, as the command line writes it.

    Raises
    ------
    FileError
        A file of the swing cannot be read.
    """
    limits = recorded_limits(open_record(solution.source.folder))
    inputs = record_inputs(solution.source)
    record = calibration_record(solution.calibration, inputs, "joint", limits)
    return record_bytes(record)


def tip_csv(solution: Solution, names: Names) -> bytes:
    """Return the tip as a table of one row: who, where, and U (k = 2)."""
    calibration, origin = solution.calibration, solution.source.origin
    head = ["station", "operator", "pen", "tip", "cone", "origin", "ball_diameter_mm"]
    head += [f"tip_{axis}_mm" for axis in AXES]
    head += [f"expanded_uncertainty_{axis}_mm" for axis in AXES]
    who = (names.station, names.operator, names.pen, names.tip, names.cone)
    row = [
        *(*who, origin or "", names.ball_diameter or ""),
        *calibration.joint.tip_pen.tolist(),
        *calibration.budget.expanded_uncertainty[:3].tolist(),
    ]
    return _table([head, row])


def images_csv(solution: Solution) -> bytes:
    """Return the images as a table: which take part, and how well each fits."""
    calibration = solution.calibration
    rows = zip(
        solution.numbers.tolist(),
        calibration.observations.names,
        calibration.used.tolist(),
        map(str, calibration.reasons),
        solution.misfits.tolist(),
        calibration.tips_cam.tolist(),
        strict=True,
    )
    head = ["image", "file", "used", "reason", "rms_px"]
    head += [f"tip_{axis}_cam_mm" for axis in "uvw"]
    return _table([head, *([*first, *tip] for *first, tip in rows)])


def tip_text(solution: Solution, origin: Origin | None) -> str:
    """Return the tip as a line to be pasted: x, y, z in mm, parted by tabs.

    What its images are of stands behind, unless they are of a live camera.
    """
    coordinates = map(repr, solution.calibration.joint.tip_pen.tolist())
    return "\t".join(filter(None, (*coordinates, _mark(origin))))


def _mark(origin: Origin | None) -> str:
    return "" if origin in (None, Origin.LIVE) else origin.upper()


def export_tables(solution: Solution, names: Names, folder: Path, stem: str) -> None:
    """Write the tip and the images as tables.

    Raises
    ------
    FileError
        They cannot be written.
    """
    save_new(folder, f"{stem}_tip.csv", tip_csv(solution, names))
    save_new(folder, f"{stem}_images.csv", images_csv(solution))


def export_json(solution: Solution, folder: Path, stem: str) -> None:
    """Write the record of the calibration.

    Raises
    ------
    FileError
        It cannot be written, or a file of the swing not be read.
    """
    save_new(folder, f"{stem}_calibration.json", calibration_json(solution))


def _table(rows: Iterable[Sequence[object]]) -> bytes:
    lines = io.StringIO()
    csv.writer(lines, lineterminator="\n").writerows(rows)
    return lines.getvalue().encode("utf-8", "backslashreplace")
