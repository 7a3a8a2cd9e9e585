"""Read back the program's own JSON files with types, ranges and checksum checked.

Records, results and settings all come in here. A text is converted to a declared type:
missing entries, other types and values out of range are refused, and so are leniencies
of Python's JSON, such as ``NaN``, a number too large for a float, or an entry given
twice. A checksum as the last entry shows damage that leaves the text well-formed.
"""

import json
import math
import os
from datetime import datetime
from hashlib import sha256
from threading import Lock
from typing import Annotated, Any, NoReturn, TypeAlias, TypeVar

from msgspec import Meta, convert

CHECKSUM = b', "checksum": "'  # no text in JSON holds quotation marks as they are
MOST_VALUES = 2_000_000  # 5000 images of four cameras take less; some 300 MB
_BEFORE_VALUES = (b",", b"[", b"{")
FIRST_YEAR, LAST_YEAR = 1970, 9998  # of dates that exist in any time zone

ZonedTime: TypeAlias = Annotated[datetime, Meta(tz=True)]
Length: TypeAlias = Annotated[float, Meta(ge=-1e7, le=1e7)]  # mm or px
Vector: TypeAlias = tuple[Length, Length, Length]
Digest: TypeAlias = Annotated[str, Meta(pattern="^[0-9a-f]{64}$")]

T = TypeVar("T")

# msgspec 0.22 crashes where two threads make it learn of one dataclass for the first
# time at once.
_ONE_READER = Lock()


class DamagedError(ValueError):
    """A text is not as the program wrote it; the caller reports the file."""


def parse_own_json(data: bytes, shape: type[T]) -> T:
    """Parse a text strictly as a type for `msgspec`; unknown entries are ignored.

    Raises `DamagedError` if it does not hold that, or more values than the program ever
    writes.
    """
    if sum(map(data.count, _BEFORE_VALUES)) > MOST_VALUES:
        raise DamagedError("There are too many values.")
    try:
        tree = json.loads(
            data,
            object_pairs_hook=_entries,
            parse_float=_finite,
            parse_constant=_refuse,
        )
    except (ValueError, RecursionError) as error:
        raise DamagedError(str(error)) from error
    return in_shape(tree, shape)


def parse_checked(data: bytes, shape: type[T]) -> T:
    """Parse a text and verify its required checksum."""
    if not has_checksum(data):
        raise DamagedError("There is no checksum.")
    return parse_own_json(data, shape)


def in_shape(tree: Any, shape: type[T]) -> T:
    """Convert a parsed value; see `parse_own_json`."""
    try:
        with _ONE_READER:
            return convert(tree, shape)
    except (ValueError, OverflowError, RecursionError) as error:
        raise DamagedError(str(error)) from error


def with_checksum(text: bytes) -> bytes:
    """Return the text of an object with its checksum as the last entry."""
    body = text.rstrip().removesuffix(b"}").rstrip()
    return body + CHECKSUM + _digest(body) + b'"}'


def has_checksum(text: bytes) -> bool:
    """Return whether the text of an object has a checksum, and verify it."""
    body, mark, end = text.rstrip().rpartition(CHECKSUM)
    if mark and end != _digest(body) + b'"}':
        raise DamagedError("The checksum is another one.")
    return bool(mark)


def require_usual(moment: datetime) -> None:
    """Raise `ValueError` for a date outside the range of all time zones."""
    if not FIRST_YEAR <= moment.year <= LAST_YEAR:
        raise ValueError(f"{moment} is too far away.")


def require_path(text: str) -> None:
    """Refuse an impossible file name, as `require_usual` does a date."""
    if b"\0" in os.fsencode(text):
        raise ValueError("A file's name holds a zero.")


def _digest(body: bytes) -> bytes:
    return sha256(body).hexdigest().encode()


def _entries(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    entries = dict(pairs)
    if len(entries) < len(pairs):
        raise ValueError("An entry is given twice.")
    return entries


def _finite(text: str) -> float:
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(f"{text} is too large.")
    return number


def _refuse(constant: str) -> NoReturn:
    raise ValueError(f"{constant} is no number of JSON.")
