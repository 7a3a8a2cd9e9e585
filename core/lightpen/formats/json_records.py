"""Records as JSON: heading, and plain values of arrays and messages.

`lightpen.formats.own_json` reads what is written here.
"""

import json
from base64 import b64encode
from collections.abc import Mapping
from datetime import datetime
from math import isfinite
from typing import Any, TypeAlias

import numpy as np
from msgspec import Struct, to_builtins

from lightpen import __version__
from lightpen.formats.hashes import InputFile
from lightpen.formats.own_json import Digest, require_path, with_checksum
from lightpen.formats.stored_messages import StoredMessage
from lightpen.messages import Message

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
