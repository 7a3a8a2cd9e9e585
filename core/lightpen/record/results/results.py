"""Accepted calibrations and revocations, and their files.

A result is one JSON object. Its first entries, the head, say who accepted what and
when, and which swing it comes from; they end with their checksum. The last entry,
``calibration``, is the whole record of the calibration, as
`lightpen.estimation.reports.report` makes it; its checksum is in the head, so that a
head is known to be sound without the rest. A result that is revoked stays: what
revokes it is a separate file, a head without a calibration.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from msgspec import Meta, Struct, to_builtins

from lightpen.arrays import FloatArray
from lightpen.errors import FileError
from lightpen.estimation.reports.calibration_record import CalibrationRecord
from lightpen.estimation.reports.verdict import Change, Grade
from lightpen.formats.own_json import (
    FORMAT,
    DamagedError,
    LaterFormatError,
    StoredMessage,
    Vector,
    ZonedTime,
    in_shape,
    json_bytes,
    parse_checked,
    parse_own_json,
    parse_stored,
    require_format,
    require_path,
    require_usual,
    with_checksum,
)
from lightpen.model.names import Origin
from lightpen.record.swings.header import Names

CALIBRATION = b',\n  "calibration": '  # ends the head; JSON has no line end in a text
END = b"\n}\n"


class ResultHeading(Struct):
    """The heading of a result, for look-ups."""

    format: Annotated[int, Meta(ge=1)]
    names: Names | None = None  # None if a later version omits it
    record: str | None = None  # as in `Result`, the same
    takes_back: str | None = None  # revoked file, without suffix
    supervisor: str = ""

    def __post_init__(self) -> None:
        require_path(self.record or "")


class Withdrawal(Struct, frozen=True):
    """Revocation of a result, by its file without suffix, and who approved it."""

    takes_back: str
    at: ZonedTime
    names: Names  # pen, tip, and the operator who revokes it
    reason: str = ""
    supervisor: str = ""

    def __post_init__(self) -> None:
        require_usual(self.at)


class TipChange(Struct, frozen=True):
    """Distance of a tip from its predecessor at acceptance.

    That one is the tip as found, the one that was accepted the tip as left.
    """

    accepted: ZonedTime  # when the tip as found was
    difference_mm: Vector  # now minus then, pen frame
    expanded_uncertainty_mm: Vector  # U (k = 2) of the difference
    as_found_mm: Vector  # current tip until then, pen frame
    as_found_expanded_uncertainty_mm: Vector  # U (k = 2) of it
    limit_mm: float | None = None  # limit of the tip; None if it has none

    @classmethod
    def of(cls, last: "Result", change: Change, limit: float | None = None) -> Self:
        """Return the stored form of a change."""
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
        """Distance of the tips."""
        return math.hypot(*self.difference_mm)

    @property
    def is_within(self) -> bool | None:
        """Whether the tip as found was within its limit; None if it had none."""
        return None if self.limit_mm is None else self.distance_mm <= self.limit_mm


def _vector(values: FloatArray) -> Vector:
    x, y, z = values.tolist()
    return x, y, z


@dataclass(frozen=True, eq=False, kw_only=True)
class JudgedCalibration:
    """A calibration with the verdict on it, accepted or not."""

    calibration: CalibrationRecord
    grade: Grade
    names: Names = field(default_factory=Names)  # empty if nobody accepted it
    accepted: ZonedTime | None = None
    origin: Origin | None = None  # None if neither it nor its swing states it
    reason: str = ""  # why it was accepted though it does not pass, by who did
    why: StoredMessage | None = None
    doubts: tuple[StoredMessage, ...] = ()
    change: TipChange | None = None  # since the previous result, if any
    supervisor: str = ""  # who approved it; empty if not needed

    def __post_init__(self) -> None:
        if self.accepted is not None:
            require_usual(self.accepted)

    @property
    def nominal_tip(self) -> FloatArray | None:
        """The tip by design that it was compared with, pen frame, (3,), mm."""
        nominal = self.calibration.nominal_tip_mm
        return None if nominal is None else np.array(nominal)

    @property
    def tip_pen(self) -> FloatArray:
        """Tip, pen frame, (3,), mm."""
        return np.array(self.calibration.tip_pen_mm)

    @property
    def uncertainty(self) -> FloatArray:
        """U (k = 2) of the tip along x, y and z, (3,), mm."""
        return np.array(self.calibration.expanded_uncertainty_mm)


@dataclass(frozen=True, eq=False, kw_only=True)
class Result(JudgedCalibration):
    """An accepted calibration."""

    names: Names
    accepted: ZonedTime
    record: Path  # folder of the swing that it comes from
    images: tuple[int, ...]  # not excluded

    @property
    def is_simulated(self) -> bool:
        """Whether it is of no real pen."""
        return self.origin is Origin.SIMULATED


def result_bytes(result: Result, record: str) -> bytes:
    """Return a result as JSON, with the path of the swing's folder as written there."""
    rest = CALIBRATION + json_bytes(result.calibration).rstrip(b"\n") + END
    head = {
        "format": FORMAT,
        **{each.name: getattr(result, each.name) for each in fields(result)},
        "record": record,
        "calibration_sha256": sha256(rest).hexdigest(),
    }
    del head["calibration"]
    return with_checksum(json_bytes(head)).removesuffix(b"}") + rest


def withdrawal_bytes(withdrawal: Withdrawal) -> bytes:
    """Return a revocation as JSON."""
    entries = {"format": FORMAT, **to_builtins(withdrawal)}
    return with_checksum(json_bytes(entries))


def parse_heading(content: bytes, file: Path) -> ResultHeading:
    """Parse the heading of a result file."""
    try:
        return parse_checked(head_of(content), ResultHeading)
    except DamagedError as error:
        raise _damaged(file) from error


def parse_withdrawal(data: bytes, file: Path) -> Withdrawal:
    """Parse a revocation."""
    try:
        return parse_stored(data, Withdrawal)
    except LaterFormatError as error:
        raise _of_later_version(file, error.number) from error
    except DamagedError as error:
        raise _damaged(file) from error


def parse_result(data: bytes, file: Path, locate: Callable[[str], Path]) -> Result:
    """Return the result that a file holds.

    ``locate`` returns the folder of a swing by what is written.
    """
    try:
        head = head_of(data)
        parse_checked(head, ResultHeading)
        whole = parse_own_json(data, dict[str, Any])
        require_format(whole)
        result = in_shape(whole, Result)
        if sha256(data[len(head) - 1 :]).hexdigest() != whole.get("calibration_sha256"):
            raise DamagedError("The checksum of the calibration is another one.")
        return replace(result, record=locate(str(result.record)))
    except LaterFormatError as error:
        raise _of_later_version(file, error.number) from error
    except DamagedError as error:
        raise _damaged(file) from error


def head_of(data: bytes) -> bytes:
    """Return the beginning of the file, before the calibration, as JSON."""
    head, found, _ = data.partition(CALIBRATION)
    return head + b"}" if found else data


def _damaged(file: Path) -> FileError:
    return FileError("results.damaged", file=file)


def _of_later_version(file: Path, number: int) -> FileError:
    return FileError("results.later-version", file=file, number=number, known=FORMAT)
