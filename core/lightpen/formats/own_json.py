"""Read back the program's own JSON files with types, ranges and checksum checked.

Records, results and settings all come in here. A text is converted to a declared type:
missing entries, other types and values out of range are refused, and so are leniencies
of Python's JSON, such as ``NaN``, a number too large for a float, or an entry given
twice. A checksum as the last entry shows damage that leaves the text well-formed.
"""

import json
import math
import os
from base64 import b64encode
from collections.abc import Mapping
from datetime import datetime
from hashlib import sha256
from math import isfinite
from pathlib import Path
from threading import Lock
from typing import Annotated, Any, NoReturn, Self, TypeAlias, TypeVar, Union

import numpy as np
from msgspec import Meta, Struct, convert, to_builtins

from lightpen import __version__
from lightpen.formats.opened_files import InputFile
from lightpen.messages import Message, Translate, Value, in_english

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
            return convert(tree, shape, dec_hook=_path)
    except (ValueError, OverflowError, RecursionError) as error:
        raise DamagedError(str(error)) from error


def _path(kind: type, value: Any) -> object:
    """Return the value of a type that `msgspec` does not know; `Path` is one."""
    if kind is not Path:
        return value
    require_path(value)
    return Path(value)


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


StoredValue: TypeAlias = Union[
    str, int, float, "StoredMessage", tuple["StoredMessage", ...], None
]


class StoredMessage(Struct, frozen=True):
    """A message with its English text for readers of the file.

    Attributes
    ----------
    code : str
        Code of a template in `messages.json`.
    values : mapping of str to StoredValue
        Values for the fields of the template; None for a value that is not finite.
    """

    code: str
    text: str
    values: Mapping[str, StoredValue]

    @classmethod
    def of(cls, message: Message) -> Self:
        """Return the stored form of a message."""
        values = {name: _stored(value) for name, value in message.values.items()}
        return cls(message.code, str(message), values)

    def worded(self, translate: Translate = in_english) -> str:
        """Return the words in the language of a translation.

        The text is returned where the catalogue has no such message any more.
        """
        try:
            return _message(self).text(translate)
        except (LookupError, TypeError, ValueError):
            return self.text


def _stored(value: Any) -> StoredValue:
    if isinstance(value, Message):
        return StoredMessage.of(value)
    if isinstance(value, tuple):
        return tuple(map(StoredMessage.of, value))
    if isinstance(value, str | int):
        return value
    number = float(value)
    return number if number - number == 0 else None


def _message(stored: StoredMessage) -> Message:
    values = {name: _value(value) for name, value in stored.values.items()}
    return Message(stored.code, values)


def _value(stored: StoredValue) -> Value:
    if isinstance(stored, StoredMessage):
        return _message(stored)
    if isinstance(stored, tuple):
        return tuple(map(_message, stored))
    return float("nan") if stored is None else stored


# Records as JSON: heading, and plain values of arrays and messages.
#
# `lightpen.formats.own_json` reads what is written here.


Plain: TypeAlias = str | int | float | bool | None


class ProgramName(Struct, frozen=True):
    """The program that wrote a file."""

    name: str
    version: str

    def __str__(self) -> str:
        return f"{self.name} {self.version}"


class FileRecord(Struct, frozen=True, omit_defaults=True):
    """A file that was read, with its content where the record needs it."""

    file: str
    sha256: Digest
    base64: str = ""

    def __post_init__(self) -> None:
        require_path(self.file)


THIS_PROGRAM = ProgramName("lightpen", __version__)


def record_heading(created: datetime) -> dict[str, Any]:
    """Return the common first entries of a record: program and time."""
    return {"program": THIS_PROGRAM, "created": created.isoformat(timespec="seconds")}


def file_entry(file: InputFile) -> FileRecord:
    """Return a file with its hash and, if stored, its content."""
    content = b64encode(file.content or b"").decode()
    return FileRecord(file.path.name, file.sha256, content)


def plain(value: Any) -> Any:
    """Return plain values: tuples of arrays, None for NaN, stored messages."""
    if value is None or isinstance(value, (str, int)):
        return value
    if isinstance(value, float):
        return float(value) if isfinite(value) else None
    if isinstance(value, dict):
        return {name: plain(entry) for name, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return tuple(map(plain, value))
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, Message):
        return to_builtins(StoredMessage.of(value))
    return value


def record_bytes(record: Mapping[str, Any] | Struct) -> bytes:
    """Return a record as JSON with its checksum."""
    return with_checksum(json_bytes(record)) + b"\n"


def json_bytes(record: Mapping[str, Any] | Struct) -> bytes:
    """Return a record as readable JSON: one line per entry, and one per image.

    Bytes of a file name that are no text in the encoding of this system become JSON
    escapes.
    """
    lines = []
    entries = to_builtins(record) if isinstance(record, Struct) else record
    for name, entry in entries.items():
        if name == "frames":
            rows = ",\n    ".join(map(_dumps, entry))
            lines.append(f'  "frames": [\n    {rows}\n  ]')
        else:
            lines.append(f"  {_dumps(name)}: {_dumps(entry)}")
    text = "{\n" + ",\n".join(lines) + "\n}\n"
    return text.encode("utf-8", "backslashreplace")


def _dumps(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False, default=to_builtins)


FORMAT = 1


class LaterFormatError(ValueError):
    """A file was written by a later version, which has the format ``number``."""

    def __init__(self, number: int) -> None:
        super().__init__(f"Format {number} is not known.")
        self.number = number


class _Format(Struct):
    format: Annotated[int, Meta(ge=1)]


def parse_stored(data: bytes, shape: type[T]) -> T:
    """Parse a text with checksum in the present format.

    Raises `DamagedError` if it has no checksum or is not of the format that it names,
    and `LaterFormatError` if that is a later one.
    """
    entries = parse_checked(data, dict[str, Any])
    require_format(entries)
    return in_shape(entries, shape)


def require_format(entries: dict[str, Any]) -> None:
    """Refuse entries of another format; see `parse_stored`."""
    number = in_shape(entries, _Format).format
    if number > FORMAT:
        raise LaterFormatError(number)
