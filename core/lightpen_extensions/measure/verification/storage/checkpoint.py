"""The checkpoint of an open verification, from which it is resumed after a crash.

It has its own file beside the records of verifications, replaced whole at each
step, and locked by the window that it is in; the lock goes when the process ends,
however it ends. The file is removed with the conclusion. One without a lock was
interrupted. What was touched is in the records of the touches; the file says which
of them count, and for what.
"""

import json
import os
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from msgspec import Struct, to_builtins

from lightpen.errors import FileError
from lightpen.formats.file_locks import NO_LOCKS, locked
from lightpen.formats.files import (
    LARGEST_RECORD,
    MEGABYTE,
    read_bytes,
    sync_folder,
    unreadable,
    write_whole,
)
from lightpen.formats.own_json import (
    DamagedError,
    Digest,
    ZonedTime,
    parse_checked,
    parse_own_json,
    require_usual,
    with_checksum,
)
from lightpen.messages import Message, message, printable
from lightpen.model.origin import Origin
from lightpen.record.folder.verifications import CONCLUSION, UNDER_WAY, VERIFICATIONS
from lightpen.record.library.numbered_files import make_folder, numbered_files
from lightpen.record.results.result_folder import SIMULATED
from lightpen.record.swings.names import Names, folder_name
from lightpen_extensions.measure.verification.session.choices import VerificationChoices

SUFFIX, LOCK, DAMAGED = ".json", ".lock", ".damaged"
WHAT = message("file.under-way")


class CountingRun(Struct, frozen=True):
    """A run of live touches that counts."""

    folder: str  # of its record, in the folder of touches
    is_last: bool = False  # the task ended with it


class VerificationCheckpoint(Struct, frozen=True):
    """A verification that began and is not concluded."""

    began: ZonedTime
    names: Names
    origin: Origin
    tip_file: str  # name of the result that is verified
    tip_sha256: Digest
    pen_sha256: Digest
    seen_by: tuple[Digest, ...]  # of the camera files
    choices: VerificationChoices
    runs: tuple[CountingRun, ...] = ()  # in order of time

    def __post_init__(self) -> None:
        require_usual(self.began)


@dataclass(frozen=True)
class InterruptedVerification:
    """A verification that no window holds, or why it cannot be resumed."""

    path: Path
    under_way: VerificationCheckpoint | None
    fault: Message | None = None


class CheckpointFile:
    """Keeps the file of one verification, see `under_way_path`, and holds it."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._descriptor: int | None = None
        self._written: VerificationCheckpoint | None = None

    def hold(self) -> None:
        """Keep other windows from offering it; refuse if another one holds it."""
        if self._descriptor is not None:
            return
        make_folder(self._path.parent)
        lock = self._path.with_suffix(LOCK)
        try:
            descriptor = os.open(lock, os.O_RDWR | os.O_CREAT)
        except OSError as error:
            raise unreadable(lock, WHAT, error) from error
        with suppress(OSError):  # a disk that supports no locks
            if not locked(descriptor):
                os.close(descriptor)
                raise FileError("under-way.held", file=printable(self._path.name))
        self._descriptor = descriptor

    def note(self, value: VerificationCheckpoint) -> None:
        """Write the checkpoint if it has changed."""
        if value == self._written:
            return
        self.hold()
        text = json.dumps(to_builtins(value), allow_nan=False)
        write_whole(self._path, with_checksum(text.encode()))
        self._written = value

    def release(self) -> None:
        """Release the lock."""
        descriptor, self._descriptor = self._descriptor, None
        self._written = None
        if descriptor is not None:
            os.close(descriptor)

    def conclude(self) -> None:
        """Remove it: the verification is concluded."""
        with suppress(OSError):
            self._path.unlink(missing_ok=True)
            sync_folder(self._path.parent)
        self.release()
        with suppress(OSError):
            self._path.with_suffix(LOCK).unlink(missing_ok=True)

    def put_aside(self) -> None:
        """Rename a damaged file, so that it is not offered."""
        try:
            self._path.replace(self._path.with_suffix(DAMAGED))
        except OSError as error:
            raise unreadable(self._path, WHAT, error) from error
        self.conclude()


def under_way_path(folder: Path, names: Names, began: datetime) -> Path:
    """Return the file of a verification in the folder of the verifications."""
    name = f"{folder_name(names, began)}-{began.microsecond:06d}-{os.getpid()}"
    return folder / UNDER_WAY / f"{name}{SUFFIX}"


def find_interrupted(data: Path) -> tuple[InterruptedVerification, ...]:
    """Return the verifications that no window holds, the newest first."""
    found: list[InterruptedVerification] = []
    for root in (data, data / SIMULATED):
        folder = root / VERIFICATIONS / UNDER_WAY
        try:
            paths = folder.glob(f"*{SUFFIX}")
            found += (_read(path) for path in paths if not _is_held(path))
        except OSError as error:
            raise unreadable(folder, WHAT, error) from error
    open_ones = [each for each in found if not _is_concluded(each)]
    return tuple(sorted(open_ones, key=lambda each: each.path.name, reverse=True))


@dataclass(frozen=True)
class SessionRecords:
    """Records of a verification with their tasks, the oldest first."""

    files: tuple[str, ...] = ()
    kinds: tuple[str, ...] = ()


def written_since(folder: Path, under_way: VerificationCheckpoint) -> SessionRecords:
    """Return the files written after the file of a verification."""
    session = under_way.began.isoformat(timespec="seconds")
    since: list[tuple[str, str]] = []
    for file in numbered_files(folder):
        try:
            record = parse_own_json(read_bytes(file, WHAT, LARGEST_RECORD), _OfSession)
        except (FileError, DamagedError):
            continue  # reported by whoever reads the archive
        if record.created < under_way.began.replace(microsecond=0):
            break
        if record.session == session:
            since.insert(0, (file.name, record.verification))
    return SessionRecords(*zip(*since, strict=True)) if since else SessionRecords()


class _OfSession(Struct):
    created: ZonedTime
    verification: str
    session: str = ""


def _is_concluded(found: InterruptedVerification) -> bool:
    """Return whether it is concluded; then its left-over file is deleted."""
    if found.under_way is None:
        return False
    since = written_since(found.path.parent.parent, found.under_way)
    if CONCLUSION not in since.kinds:
        return False
    CheckpointFile(found.path).conclude()
    return True


def _is_held(path: Path) -> bool:
    try:
        descriptor = os.open(path.with_suffix(LOCK), os.O_RDWR)
    except FileNotFoundError:
        return False
    try:
        return not locked(descriptor)
    except OSError as error:
        if error.errno not in NO_LOCKS:
            raise
        return path.stem.endswith(f"-{os.getpid()}")  # of this window, as it seems
    finally:
        os.close(descriptor)


def _read(path: Path) -> InterruptedVerification:
    try:
        data = read_bytes(path, WHAT, MEGABYTE)
        return InterruptedVerification(
            path, parse_checked(data, VerificationCheckpoint)
        )
    except FileError as error:
        return InterruptedVerification(path, None, error.message)
    except DamagedError:
        why = message("under-way.damaged", file=path)
        return InterruptedVerification(path, None, why)
