"""Records as JSON: what they begin with, and plain values out of arrays and sentences.

`lightpen.formats.own_json` reads what is written here.
"""

import json
from base64 import b64encode
from collections.abc import Mapping
from datetime import datetime
from math import isfinite
from typing import Any

import numpy as np

from lightpen import __version__
from lightpen.formats.hashes import InputFile
from lightpen.formats.own_json import with_checksum
from lightpen.sentences import Sentence


def record_heading(created: datetime) -> dict[str, Any]:
    """Return what every record begins with: the program, and when it was made."""
    return {
        "program": {"name": "lightpen", "version": __version__},
        "created": created.isoformat(timespec="seconds"),
    }


def file_entry(file: InputFile) -> dict[str, str]:
    """Return a file with its hash, and its content where that is kept."""
    named = {"file": file.path.name, "sha256": file.sha256}
    if file.content is not None:
        named["base64"] = b64encode(file.content).decode()
    return named


def plain(value: Any) -> Any:
    """Return arrays as lists, what is not a number as null, sentences with codes."""
    if value is None or isinstance(value, (str, int)):
        return value
    if isinstance(value, float):
        return float(value) if isfinite(value) else None
    if isinstance(value, dict):
        return {name: plain(entry) for name, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(entry) for entry in value]
    if isinstance(value, np.ndarray):
        if value.dtype.kind == "f" and np.isfinite(value).all():
            return value.tolist()
        return plain(value.tolist())
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, Sentence):
        return plain({"code": value.code, "text": str(value), "values": value.values})
    return value


def record_bytes(record: Mapping[str, Any]) -> bytes:
    """Return a record as JSON that tells when it was changed."""
    return with_checksum(json_bytes(record)) + b"\n"


def json_bytes(record: Mapping[str, Any]) -> bytes:
    """Return a record as JSON, readable: one line an entry, and one an image.

    The bytes of a file name that is no text in this system's encoding become JSON
    escapes.
    """
    lines = []
    for name, entry in record.items():
        if name == "frames":
            rows = ",\n    ".join(map(_dumps, entry))
            lines.append(f'  "frames": [\n    {rows}\n  ]')
        else:
            lines.append(f"  {_dumps(name)}: {_dumps(entry)}")
    text = "{\n" + ",\n".join(lines) + "\n}\n"
    return text.encode("utf-8", "backslashreplace")


def _dumps(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)
