"""What a user account remembers of the archive of its station, beside the private keys.

The last entry of its chain: so an archive that was removed or replaced by an older copy
is found, whatever else was removed with it, and at whatever path. Which chain a data
folder has: so another one in its place is found. And the files that
the program is writing, until they are entered: after a power cut these are entered, and
no others.
"""

import logging
import os
from contextlib import suppress
from hashlib import sha256
from os.path import normcase
from pathlib import Path
from typing import TypeVar

from msgspec import Struct

from lightpen.errors import FileError
from lightpen.formats.files import MEGABYTE, read_bytes, write_whole
from lightpen.formats.json_records import json_bytes
from lightpen.formats.own_json import DamagedError, Digest, parse_own_json
from lightpen.record.library.signing.keys import (
    WHAT,
    SigningKey,
    is_signed,
    key_folder,
    make_private_folder,
)

S = TypeVar("S", bound=Struct)

_logger = logging.getLogger(__name__)


class RememberedHead(Struct, frozen=True):
    """Number and hash of the last entry of a chain."""

    number: int
    sha256: Digest


class _Folder(Struct, frozen=True):
    chain: str
    path: str


class OwedFile(Struct, frozen=True):
    """A file that the program wrote and will enter."""

    place: str  # from the data folder
    sha256: Digest
    approval: str = ""  # signature of a supervisor, see `approval_of`

    @property
    def name(self) -> str:
        """Name under which it is noted."""
        return sha256(f"{self.place}\n{self.sha256}".encode()).hexdigest()[:32]


def head_file(chain: str) -> Path:
    """Return the file in which this account remembers the last entry of a chain."""
    return key_folder() / f"head-{chain}.json"


def remembered_head(chain: str) -> RememberedHead | None:
    """Return the last entry of a chain that this account knows, if any."""
    file = head_file(chain)
    if not file.exists():
        return None
    return _read(file, RememberedHead)


def remember_head(chain: str, number: int, digest: str) -> None:
    """Remember an entry, once it is durable; an earlier one changes nothing.

    A full disk leaves the memory as it was: the next entry brings it up to date.
    """
    try:
        before = remembered_head(chain)
        if before is None or before.number < number:
            _write(head_file(chain), RememberedHead(number, digest))
    except FileError as error:
        _logger.warning("the last entry is not remembered: %s", error)


def remembered_chain(data: Path) -> str:
    """Return the chain that a data folder had in this account; empty if not known."""
    files = [file for file in _folder_files(data) if file.exists()]
    return _read(files[0], _Folder).chain if files else ""


def remember_chain(data: Path, chain: str) -> None:
    """Remember the chain of a data folder, by its path as it is given and as it is."""
    try:
        for file in _folder_files(data):
            if not file.exists() or _read(file, _Folder).chain != chain:
                _write(file, _Folder(chain, str(data)))
    except FileError as error:
        _logger.warning("the chain of %s is not remembered: %s", data, error)


def approval_of(key: SigningKey | None, chain: str, place: str, digest: str) -> str:
    """Return the signature by which a supervisor approves a file; empty without one."""
    return "" if key is None else key.sign(_approved(chain, place, digest))


def is_approved(
    public: str, approval: str, chain: str, place: str, digest: str
) -> bool:
    """Return whether the supervisor with a public key approved a file."""
    return is_signed(public, approval, _approved(chain, place, digest))


def owe(chain: str, file: OwedFile) -> None:
    """Note a file before it is written."""
    _write(_owed(chain) / f"{file.name}.json", file)


def owed_files(chain: str) -> tuple[OwedFile, ...]:
    """Return the files that are not entered yet, in the order of their writing."""
    found = []
    for note in _owed(chain).glob("*.json") if chain else ():
        with suppress(FileNotFoundError):  # it was entered just now
            found.append((note.stat().st_mtime_ns, note))
    return tuple(_read(note, OwedFile) for _, note in sorted(found) if note.exists())


def forget_owed(chain: str, file: OwedFile) -> None:
    """Forget a file that was entered, or not written; else the next start does."""
    with suppress(OSError):
        (_owed(chain) / f"{file.name}.json").unlink()


def _folder_files(data: Path) -> list[Path]:
    paths = {normcase(data.absolute()), normcase(data.resolve())}
    names = (sha256(os.fsencode(path)).hexdigest()[:32] for path in sorted(paths))
    return [key_folder() / f"folder-{name}.json" for name in names]


def _owed(chain: str) -> Path:
    return key_folder() / f"owed-{chain}"


def _approved(chain: str, place: str, digest: str) -> bytes:
    return f"lightpen approval\n{chain}\n{place}\n{digest}".encode()


def _read(file: Path, kind: type[S]) -> S:
    try:
        return parse_own_json(read_bytes(file, WHAT, MEGABYTE), kind)
    except DamagedError as error:
        raise FileError("signing.key-damaged", file=file) from error


def _write(file: Path, content: Struct) -> None:
    make_private_folder(file.parent)
    write_whole(file, json_bytes(content))
