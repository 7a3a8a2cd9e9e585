"""Temporary files for atomic writes, and their clean-up.

A part that a program left behind when it was killed is recognised by its age.
"""

import contextlib
import errno
import os
import re
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

# Locks of the operating system on open files.
#
# Such a lock is released when the file is closed or its process ends. It is advisory.


PAUSE = 0.01  # s between two attempts
LOCKED_BYTE = 2**30  # beyond any content, as Windows blocks reading locked bytes
TAKEN = (errno.EAGAIN, errno.EACCES, errno.EDEADLK)
NO_LOCKS = (errno.ENOSYS, errno.EOPNOTSUPP, errno.ENOLCK)


def locked(descriptor: int, *, shared: bool = False, patience_s: float = 0.0) -> bool:
    """Lock an open file within ``patience_s``; return whether it succeeded.

    Several processes may share a lock. Raises `OSError` if the disk fails or supports
    no locks (`NO_LOCKS`).
    """
    deadline = time.monotonic() + patience_s
    while True:
        try:
            _lock(descriptor, shared)
        except OSError as error:
            if error.errno not in TAKEN:
                raise
        else:
            return True
        if time.monotonic() >= deadline:
            return False
        time.sleep(PAUSE)


@contextmanager
def folder_locked(folder: Path, patience_s: float) -> Iterator[bool]:
    """Hold an advisory lock on a folder; yield whether it was acquired.

    On Windows and on file systems without locks it always succeeds. Raises `OSError` if
    there is no such folder.
    """
    if os.name != "posix":
        yield True
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        yield _is_alone(descriptor, patience_s)
    finally:
        os.close(descriptor)


def _is_alone(descriptor: int, patience_s: float) -> bool:
    try:
        return locked(descriptor, patience_s=patience_s)
    except OSError:
        return True


if sys.platform == "win32":
    import msvcrt

    def _lock(descriptor: int, shared: bool) -> None:
        _set_locking(descriptor, msvcrt.LK_NBLCK)

    def unlock(descriptor: int) -> None:
        """Release the lock of a file."""
        _set_locking(descriptor, msvcrt.LK_UNLCK)

    def _set_locking(descriptor: int, mode: int) -> None:
        # The lock begins at the file position, which is restored.
        place = os.lseek(descriptor, 0, os.SEEK_CUR)
        os.lseek(descriptor, LOCKED_BYTE, os.SEEK_SET)
        try:
            msvcrt.locking(descriptor, mode, 1)
        finally:
            os.lseek(descriptor, place, os.SEEK_SET)
else:
    import fcntl

    def _lock(descriptor: int, shared: bool) -> None:
        # Network file systems refuse exclusive locks of files open for reading.
        kind = fcntl.LOCK_SH if shared else fcntl.LOCK_EX
        fcntl.flock(descriptor, kind | fcntl.LOCK_NB)

    def unlock(descriptor: int) -> None:
        """Release the lock of a file."""
        fcntl.flock(descriptor, fcntl.LOCK_UN)


PATIENCE = 2.0  # s to wait for a scanner of viruses
LONGEST_WRITE = 600.0  # s, after which a part was left behind
_NAME = re.compile(r"\.[0-9a-f]{16}\.part")


@contextlib.contextmanager
def part_of(target: Path, data: bytes, mode: int = 0o666) -> Iterator[Path]:
    """Write data to a temporary file beside its target, of a mode as of `os.open`."""
    part = target.parent / f".{os.urandom(8).hex()}.part"
    try:
        with open(part, "xb", opener=partial(os.open, mode=mode)) as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
        yield part
    finally:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)


def renamed(rename: Callable[[Path], object], target: Path) -> None:
    """Rename a temporary file; on Windows, retry while it is open elsewhere.

    Scanners for viruses open what was just written, others the file that is replaced,
    and both keep Windows from renaming.
    """
    deadline = time.monotonic() + PATIENCE
    while True:
        try:
            rename(target)
        except PermissionError:
            if os.name != "nt" or time.monotonic() >= deadline:
                raise
            time.sleep(PAUSE)
        else:
            return


def sweep_parts(folder: Path) -> None:
    """Remove temporary files of interrupted writes from a folder, if possible."""
    with contextlib.suppress(OSError):  # they do no harm where they are
        for path in list(folder.iterdir()):
            if _NAME.fullmatch(path.name):
                _sweep(path)


def _sweep(part: Path) -> None:
    if time.time() - part.stat().st_mtime > LONGEST_WRITE:
        part.unlink()
