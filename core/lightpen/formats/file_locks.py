"""Locks of the operating system on open files.

Such a lock is released when the file is closed or its process ends. It is advisory.
"""

import errno
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

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
