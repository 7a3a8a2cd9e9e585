"""An accepted calibration, the taking back of one, and how each is written.

A result is one JSON object. Its first entries, the head, say who accepted what and
when, and which swing it comes from; they end with their checksum. The last entry,
``calibration``, is the whole record of the calibration, as
`lightpen.estimation.report` makes it; its checksum is in the head, so that a head is
known to be sound without the rest. A result that is taken back stays as it is: what
takes it back is a file of its own, a head without a calibration. Results of format 3
did not say what their images are of, nor why one with doubts was accepted; those of
format 2 had no checksums, and those of format 1 of the calibration no more than tip and
uncertainty.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import datetime
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Any, Self, TypeAlias

import numpy as np
from msgspec import Meta, Struct, to_builtins

from lightpen.arrays import FloatArray
from lightpen.errors import FileError
from lightpen.estimation.verdict import Change
from lightpen.formats.files import printable
from lightpen.formats.json_records import json_bytes
from lightpen.formats.own_json import (
    DamagedError,
    Digest,
    Moment,
    Vector,
    has_checksum,
    in_shape,
    parse_own_json,
    require_path,
    require_usual,
    with_checksum,
)
from lightpen.model.origin import Origin
from lightpen.record.names import Names
from lightpen.sentences import Sentence, sentence

FORMAT = 4
FIRST_WITH_CHECKSUM = 3
CALIBRATION = b',\n  "calibration": '  # ends the head; JSON has no line end in a text
END = b"\n}\n"

Row: TypeAlias = tuple[float, float, float, float, float, float]


class Heading(Struct):
    """What tells whether a result is the one that is looked for.

    Attributes
    ----------
    pen, tip, record : str or None
        None where a later version does not say; else as `Names` and `Result`.
    origin : str or None
        What its images are of; None where an earlier version did not say.
    takes_back : str or None
        Name of the result's file, without suffix, that is taken back; None of a result.
    """

    format: Annotated[int, Meta(ge=1)]
    pen: str | None = None
    tip: str | None = None
    record: str | None = None
    takes_back: str | None = None
    origin: str | None = None

    def __post_init__(self) -> None:
        require_path(self.record or "")


class Withdrawal(Struct, frozen=True):
    """What takes a result back.

    Attributes
    ----------
    takes_back : str
        Name of the result's file, without suffix.
    operator : str
        Who takes it back.
    """

    takes_back: str
    at: Moment
    operator: str
    pen: str
    tip: str

    def __post_init__(self) -> None:
        require_usual(self.at)


class Why(Struct, frozen=True):
    """A sentence of the core, as it is kept: its code and its words in English."""

    code: str
    text: str

    @classmethod
    def of(cls, told: Sentence) -> Self:
        """Return what is kept of a sentence."""
        return cls(told.code, str(told))


class Since(Struct, frozen=True):
    """How far a tip lies from the one that was in force before, when it was accepted.

    That one is the tip as found, the one that was accepted the tip as left.

    Attributes
    ----------
    accepted : datetime
        When the tip as found was.
    difference_mm : triple of float
        Now minus then, pen frame.
    expanded_uncertainty_mm : triple of float
        U (k = 2) of the difference.
    as_found_mm, as_found_expanded_uncertainty_mm : triple of float or None
        The tip that was in force until then, pen frame, and its U (k = 2); None where
        an earlier version did not say.
    limit_mm : float or None
        Of the tip for its distance from there; None if it had none.
    """

    accepted: Moment
    difference_mm: Vector
    expanded_uncertainty_mm: Vector
    as_found_mm: Vector | None = None
    as_found_expanded_uncertainty_mm: Vector | None = None
    limit_mm: float | None = None

    @classmethod
    def of(cls, last: "Result", change: Change, limit: float | None = None) -> Self:
        """Return what is kept of a change since the result in force."""
        return cls(
            last.accepted,
            _vector(change.difference),
            _vector(change.expanded_uncertainty),
            _vector(last.tip_pen),
            _vector(last.uncertainty),
            limit,
        )

    @property
    def distance_mm(self) -> float:
        """How far apart the tips lie."""
        return math.hypot(*self.difference_mm)

    @property
    def is_within(self) -> bool | None:
        """Whether the tip as found was within its limit; None if it had none."""
        return None if self.limit_mm is None else self.distance_mm <= self.limit_mm


def _vector(values: FloatArray) -> Vector:
    x, y, z = values.tolist()
    return x, y, z


class _Entries(Struct):
    format: int
    accepted: Moment
    station: str
    operator: str
    pen: str
    tip: str
    cone: str
    ball_diameter_mm: float | None
    grade: str
    record: str
    images: tuple[int, ...] | None = None
    origin: Origin | None = None
    reason: str = ""
    supervisor: str = ""
    why: Why | None = None
    doubts: tuple[Why, ...] = ()
    change: Since | None = None
    restores: Digest | None = None
    calibration_sha256: Digest | None = None

    def __post_init__(self) -> None:
        require_usual(self.accepted)
        require_path(self.record)


class _Calibration1(Struct):
    tip_pen_mm: Vector
    expanded_uncertainty_mm: Vector


class _Calibration(_Calibration1):
    cone_cam_mm: Vector
    covariance: tuple[Row, Row, Row, Row, Row, Row]


class _Whole(Struct):
    calibration: dict[str, Any]


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
    origin : Origin or None
        What its images are of; None where neither it nor its swing says.
    reason : str
        Why it was accepted though its grade is no pass, in the words of who did.
    supervisor : str
        Who accepted it beyond the limit of its station; empty where nobody had to.
    why : Why or None
        What its grade is for.
    doubts : tuple of Why
        What else there was to look into.
    change : Since or None
        Since the result that was in force; None if there was none.
    restores : str or None
        Hash of the entry in the archive whose tip it puts in force again.
    """

    names: Names
    accepted: datetime
    grade: str
    record: Path
    images: tuple[int, ...] | None
    calibration: Mapping[str, Any]
    origin: Origin | None = None
    reason: str = ""
    why: Why | None = None
    doubts: tuple[Why, ...] = ()
    change: Since | None = None
    supervisor: str = ""
    restores: str | None = None

    @property
    def is_simulated(self) -> bool:
        """Whether it is of no real pen."""
        return self.origin is Origin.SIMULATED

    @property
    def nominal_tip(self) -> FloatArray | None:
        """The tip by design that it was compared with, (3,), mm."""
        return self._numbers("nominal_tip_mm")

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
    rest = CALIBRATION + json_bytes(result.calibration).rstrip(b"\n") + END
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
        "origin": result.origin,
        "reason": result.reason,
        "supervisor": result.supervisor,
        "why": to_builtins(result.why),
        "doubts": to_builtins(result.doubts),
        "change": to_builtins(result.change),
        "restores": result.restores,
        "calibration_sha256": sha256(rest).hexdigest(),
    }
    return with_checksum(json_bytes(head)).removesuffix(b"}") + rest


def withdrawal_bytes(result: Result, name: str, operator: str, now: datetime) -> bytes:
    """Return what takes a result back, as JSON.

    Parameters
    ----------
    name : str
        Of the result's file, without suffix.
    operator : str
        Who takes it back.
    """
    return with_checksum(
        json_bytes(
            {
                "format": FORMAT,
                "takes_back": name,
                "at": now.isoformat(),
                "operator": operator,
                "pen": result.names.pen,
                "tip": result.names.tip,
            }
        )
    )


def has_head(start: bytes) -> bool:
    """Return whether the start of a result, as much as was read, has its head."""
    return CALIBRATION in start


def parse_heading(start: bytes, file: Path) -> Heading:
    """Return whose result a file holds, by its start with the head, or the whole of it.

    Parameters
    ----------
    file : Path
        For the sentence.

    Raises
    ------
    FileError
        It is damaged.
    """
    try:
        return _heading(_head_of(start))
    except DamagedError as error:
        raise _damaged(file) from error


def parse_withdrawal(data: bytes, file: Path) -> Withdrawal:
    """Return what a file holds that takes a result back.

    Parameters
    ----------
    file : Path
        For the sentence.

    Raises
    ------
    FileError
        It is damaged.
    """
    try:
        _heading(data)
        return parse_own_json(data, Withdrawal)
    except DamagedError as error:
        raise _damaged(file) from error


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
    try:
        head = _head_of(data)
        number = _heading(head).format
        if number > FORMAT:
            raise _of_later_version(file, number)
        entries = parse_own_json(head if number > 1 else data, _Entries)
        if number >= FIRST_WITH_CHECKSUM:
            _require_digest(data[len(head) - 1 :], entries.calibration_sha256)
        return Result(
            names=Names(
                station=entries.station,
                operator=entries.operator,
                pen=entries.pen,
                tip=entries.tip,
                cone=entries.cone,
                ball_diameter=entries.ball_diameter_mm,
            ),
            accepted=entries.accepted,
            grade=entries.grade,
            record=locate(entries.record),
            images=entries.images,
            calibration=_calibration(data, number),
            origin=entries.origin,
            reason=entries.reason,
            supervisor=entries.supervisor,
            why=entries.why,
            doubts=entries.doubts,
            change=entries.change,
            restores=entries.restores,
        )
    except DamagedError as error:
        raise _damaged(file) from error


def _head_of(data: bytes) -> bytes:
    """Return what comes before the calibration, as JSON of its own."""
    head, found, _ = data.partition(CALIBRATION)
    return head + b"}" if found else data


def _heading(head: bytes) -> Heading:
    is_sound = has_checksum(head)
    heading = parse_own_json(head, Heading)
    if heading.format >= FIRST_WITH_CHECKSUM and not is_sound:
        raise DamagedError("There is no checksum.")
    return heading


def _calibration(data: bytes, number: int) -> Mapping[str, Any]:
    if number == 1:
        first = parse_own_json(data, _Calibration1)
        return {
            "tip_pen_mm": list(first.tip_pen_mm),
            "expanded_uncertainty_mm": list(first.expanded_uncertainty_mm),
        }
    calibration = parse_own_json(data, _Whole).calibration
    in_shape(calibration, _Calibration)
    return calibration


def _require_digest(rest: bytes, digest: str | None) -> None:
    if sha256(rest).hexdigest() != digest:
        raise DamagedError("The checksum of the calibration is another one.")


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
