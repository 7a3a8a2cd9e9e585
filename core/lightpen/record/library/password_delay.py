"""Delay after wrong passwords: from the third in a row, one second, doubled each time.

The count is kept beside the private keys, so that another start of the program does not
end it.
"""

import time
from contextlib import suppress
from pathlib import Path

from msgspec import Struct

from lightpen.errors import AcceptanceError, FileError
from lightpen.formats.files import read_bytes, write_whole
from lightpen.formats.json_records import json_bytes
from lightpen.formats.own_json import DamagedError, parse_own_json
from lightpen.messages import message
from lightpen.record.library.signing.keys import key_folder

FREE = 2  # wrong passwords without a delay
LONGEST_S = 300.0
_LIMIT = 1000  # bytes
_WHAT = message("file.limits")


class _Attempts(Struct, frozen=True):
    n_wrong: int = 0
    last_s: float = 0.0  # since 1970


def require_patience(key: str) -> None:
    """Refuse an attempt too soon after wrong ones, by the key of the right password."""
    before = _read(key)
    if before.n_wrong <= FREE:
        return
    delay = min(LONGEST_S, 2.0 ** (before.n_wrong - FREE - 1))
    left = before.last_s + delay - time.time()
    if 0 < left <= LONGEST_S:  # not of a clock that was set back
        raise AcceptanceError("supervisor.wait", seconds=max(1.0, left))


def note_attempt(key: str, *, succeeded: bool) -> None:
    """Count a wrong password, or forget those before a right one."""
    before = _read(key)
    if succeeded and not before.n_wrong:
        return
    now = _Attempts() if succeeded else _Attempts(before.n_wrong + 1, time.time())
    with suppress(FileError, OSError):  # a full disk must not keep supervisors out
        key_folder().mkdir(parents=True, exist_ok=True, mode=0o700)
        write_whole(_file_of(key), json_bytes(now))


def _read(key: str) -> _Attempts:
    file = _file_of(key)
    with suppress(FileError, DamagedError):
        if file.exists():
            return parse_own_json(read_bytes(file, _WHAT, _LIMIT), _Attempts)
    return _Attempts()


def _file_of(key: str) -> Path:
    return key_folder() / f"attempts-{key[:32]}.json"
