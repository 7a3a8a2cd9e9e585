"""Accepted calibrations, one file each; the newest of a pen and tip is in force.

A file is written once and never changed, so an older result is never lost. Its name
begins with a number, one higher than that of any before: the order of acceptance, which
no clock that was set back can turn round.
"""

import json
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import FileError
from lightpen.formats.files import (
    MEGABYTE,
    printable,
    read_bytes,
    strerror,
    write_whole,
)
from lightpen.record.names import Names
from lightpen.sentences import sentence

FORMAT = 1
LIMIT = MEGABYTE
OLD = timedelta(days=30)  # after which a tip is better calibrated again


@dataclass(frozen=True, eq=False)
class Result:
    """An accepted calibration.

    Attributes
    ----------
    names : Names
    accepted : datetime
        With its time zone.
    grade : str
        Verdict on it when it was accepted, see `lightpen.estimation.verdict.Grade`.
    tip_pen : (3,) array
        Tip, pen frame, mm.
    uncertainty : (3,) array
        U (k = 2) along x, y and z, mm.
    record : str
        Folder of the swing that it comes from.
    """

    names: Names
    accepted: datetime
    grade: str
    tip_pen: FloatArray
    uncertainty: FloatArray
    record: str

    def is_old(self, now: datetime) -> bool:
        """Return whether the tip is better calibrated again by its age alone."""
        return now - self.accepted > OLD


def store_result(root: Path, result: Result) -> Path:
    """Put an accepted calibration beside the earlier ones and return its file.

    Raises
    ------
    FileError
        It cannot be written; the earlier result stays in force.
    """
    try:
        root.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(
            sentence(
                "results.no-folder",
                "The folder {folder} cannot be made: {reason}. Make sure that it is "
                "yours to write.",
                folder=printable(str(root)),
                reason=strerror(error),
            )
        ) from error
    newest = _files(root)[:1]
    number = 1 + (_number(newest[0]) if newest else 0)
    stamp = f"{result.accepted.astimezone(UTC):%Y%m%dT%H%M%S.%fZ}"
    path = root / f"{number:06d}_{stamp}.json"
    names = result.names
    entries = {
        "format": FORMAT,
        "accepted": result.accepted.isoformat(),
        "station": names.station,
        "operator": names.operator,
        "pen": names.pen,
        "tip": names.tip,
        "cone": names.cone,
        "ball_diameter_mm": names.ball_diameter,
        "grade": result.grade,
        "tip_pen_mm": result.tip_pen.tolist(),
        "expanded_uncertainty_mm": result.uncertainty.tolist(),
        "record": result.record,
    }
    write_whole(path, json.dumps(entries, indent=1, ensure_ascii=False).encode())
    return path


def last_result(root: Path, pen: str, tip: str) -> Result | None:
    """Return the result in force for a pen and a tip, or None if there is none.

    Raises
    ------
    FileError
        A result newer than the one that was found is damaged.
    """
    for file in _files(root):
        result = _read(file)
        if (result.names.pen, result.names.tip) == (pen, tip):
            return result
    return None


def _files(root: Path) -> list[Path]:
    """Return the files of results, the newest first; others in the folder are none."""
    files = [file for file in root.glob("*.json") if _number(file)]
    return sorted(files, key=lambda file: (_number(file), file.name), reverse=True)


def _number(file: Path) -> int:
    """Return the place of a file in the order of acceptance; 0 for a foreign file."""
    digits = file.name.partition("_")[0]
    return int(digits) if digits.isdecimal() else 0


def _read(file: Path) -> Result:
    data = read_bytes(file, sentence("file.result", "result"), LIMIT)
    try:
        entries = json.loads(data)
        ball = entries["ball_diameter_mm"]
        result = Result(
            names=Names(
                station=entries["station"],
                operator=entries["operator"],
                pen=entries["pen"],
                tip=entries["tip"],
                cone=entries["cone"],
                ball_diameter=None if ball is None else float(ball),
            ),
            accepted=datetime.fromisoformat(entries["accepted"]),
            grade=str(entries["grade"]),
            tip_pen=np.array(entries["tip_pen_mm"], dtype=np.float64).reshape(3),
            uncertainty=np.array(
                entries["expanded_uncertainty_mm"], dtype=np.float64
            ).reshape(3),
            record=str(entries["record"]),
        )
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise _damaged(file) from error
    whole = np.isfinite([result.tip_pen, result.uncertainty]).all()
    if not whole or result.accepted.tzinfo is None:
        raise _damaged(file)
    return result


def _damaged(file: Path) -> FileError:
    return FileError(
        sentence(
            "results.damaged",
            "The result {file} is damaged. Restore it from a copy, or move it away "
            "to go on without it.",
            file=printable(str(file)),
        )
    )
