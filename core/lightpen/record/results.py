"""An accepted calibration, and how it is written.

A result is one JSON object. Its first entries say who accepted what and when, and which
swing it comes from; the last, ``calibration``, is the whole record of the calibration,
as `lightpen.estimation.report` makes it. Results of format 1 had of it no more than tip
and uncertainty.
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import FileError
from lightpen.estimation.report import json_bytes
from lightpen.formats.files import printable
from lightpen.record.names import Names
from lightpen.sentences import sentence

FORMAT = 2
OLD = timedelta(days=30)  # after which a tip is better calibrated again
CALIBRATION = b',\n  "calibration": '  # ends the head; JSON has no line end in a text
SHAPES = {
    "tip_pen_mm": (3,),
    "expanded_uncertainty_mm": (3,),
    "cone_cam_mm": (3,),
    "covariance": (6, 6),
}
N_SHAPES_1 = 2  # of these, format 1 had the first


@dataclass(frozen=True, eq=False)
class Result:
    """An accepted calibration.

    Attributes
    ----------
    accepted : datetime
        With its time zone.
    grade : str
        Verdict on it when it was accepted, see `lightpen.estimation.verdict.Grade`.
    record : Path
        Folder of the swing that it comes from.
    images : tuple of int or None
        Numbers of the images of the swing that were not taken out; None if it was
        accepted by a version that did not keep them.
    calibration : mapping
        The whole record of the calibration, as README.md documents it; of a result of
        format 1 only ``tip_pen_mm`` and ``expanded_uncertainty_mm``.
    """

    names: Names
    accepted: datetime
    grade: str
    record: Path
    images: tuple[int, ...] | None
    calibration: Mapping[str, Any]

    @property
    def tip_pen(self) -> FloatArray:
        """Tip, pen frame, (3,), mm."""
        return np.array(self.calibration["tip_pen_mm"], dtype=np.float64)

    @property
    def uncertainty(self) -> FloatArray:
        """U (k = 2) of the tip along x, y and z, (3,), mm."""
        return np.array(self.calibration["expanded_uncertainty_mm"], dtype=np.float64)

    @property
    def cone_cam(self) -> FloatArray | None:
        """The tip's place in the camera frame, (3,), mm; None of format 1."""
        return self._numbers("cone_cam_mm")

    @property
    def covariance(self) -> FloatArray | None:
        """Of tip and cone, (6, 6), mm^2; None of format 1."""
        return self._numbers("covariance")

    def is_old(self, now: datetime) -> bool:
        """Return whether the tip is better calibrated again by its age alone."""
        return now - self.accepted > OLD

    def _numbers(self, key: str) -> FloatArray | None:
        numbers = self.calibration.get(key)
        return None if numbers is None else np.array(numbers, dtype=np.float64)


def result_bytes(result: Result, record: str) -> bytes:
    """Return a result as JSON.

    Parameters
    ----------
    record : str
        Where the folder of its swing is, as it is to be written.
    """
    names = result.names
    head = {
        "format": FORMAT,
        "accepted": result.accepted.isoformat(),
        "station": names.station,
        "operator": names.operator,
        "pen": names.pen,
        "tip": names.tip,
        "cone": names.cone,
        "ball_diameter_mm": names.ball_diameter,
        "grade": result.grade,
        "record": record,
        "images": result.images,
    }
    start = json_bytes(head).removesuffix(b"\n}\n")
    calibration = json_bytes(result.calibration).rstrip(b"\n")
    return start + CALIBRATION + calibration + b"\n}\n"


def head_of(start: bytes) -> bytes | None:
    """Return what comes before the calibration, as JSON of its own.

    Parameters
    ----------
    start : bytes
        Of a result, as much as was read; None is returned if that is too little, or
        there is no calibration.
    """
    head, found, _ = start.partition(CALIBRATION)
    return head + b"}" if found else None


def parse_entries(data: bytes, file: Path) -> Mapping[str, Any]:
    """Return the entries of a result or of its head; `file` is named if damaged.

    Raises
    ------
    FileError
        It is no JSON object.
    """
    try:
        entries = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise _damaged(file) from error
    if not isinstance(entries, dict):
        raise _damaged(file)
    return entries


def parse_result(data: bytes, file: Path, locate: Callable[[str], Path]) -> Result:
    """Return the result that a file holds.

    Parameters
    ----------
    file : Path
        For the sentence.
    locate : callable
        Returns the folder of a swing by what is written.

    Raises
    ------
    FileError
        It is damaged, or written by a later version of the program.
    """
    entries = parse_entries(data, file)
    try:
        number = int(entries["format"])
        if number > FORMAT:
            raise _of_later_version(file, number)
        keys = tuple(SHAPES)[: N_SHAPES_1 if number == 1 else None]
        calibration = (
            {key: entries[key] for key in keys}
            if number == 1
            else dict(entries["calibration"])
        )
        _require_numbers(calibration, keys)
        ball, images = entries["ball_diameter_mm"], entries.get("images")
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
            record=locate(str(entries["record"])),
            images=None if images is None else tuple(map(int, images)),
            calibration=calibration,
        )
        if result.accepted.tzinfo is None:
            raise ValueError(entries["accepted"])
    except (ValueError, KeyError, TypeError) as error:
        raise _damaged(file) from error
    return result


def _require_numbers(calibration: Mapping[str, Any], keys: tuple[str, ...]) -> None:
    for key in keys:
        numbers = np.array(calibration[key], dtype=np.float64)
        if numbers.shape != SHAPES[key] or not np.isfinite(numbers).all():
            raise ValueError(key)


def _damaged(file: Path) -> FileError:
    return FileError(
        sentence(
            "results.damaged",
            "The result {file} is damaged. Restore it from a copy, or move it away to "
            "go on without it.",
            file=printable(str(file)),
        )
    )


def _of_later_version(file: Path, number: int) -> FileError:
    return FileError(
        sentence(
            "results.later-version",
            "The result {file} was written by a later version of the program (format "
            "{number}; this version reads up to {known}). Use that version, or move "
            "the file away to go on without it.",
            file=printable(str(file)),
            number=number,
            known=FORMAT,
        )
    )
