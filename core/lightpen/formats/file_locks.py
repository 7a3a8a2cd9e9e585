"""Locks of the operating system on open files.

Such a lock goes when the file is closed or its process ends, however it ends. It keeps
out those who ask for it, and nobody else.
"""

import errno
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

PAUSE = 0.01  # s between two attempts
LOCKED_BYTE = 2**30  # behind any content: Windows lets nobody read what is locked
TAKEN = (errno.EAGAIN, errno.EACCES, errno.EDEADLK)
NO_LOCKS = (errno.ENOSYS, errno.EOPNOTSUPP, errno.ENOLCK)


def locked(descriptor: int, *, shared: bool = False, patience_s: float = 0.0) -> bool:
    """Lock an open file, and return whether nobody else has it locked.

    Parameters
    ----------
    shared : bool
        Whether others may have it locked so, too.
    patience_s : float
        To wait for others to let go.

    Raises
    ------
    OSError
        The disk fails, or it knows no locks (`NO_LOCKS`).
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
    """Keep others who ask out of a folder, and yield whether nobody else had it.

    On Windows, and on a disk that knows no locks, it is as if nobody had.

    Raises
    ------
    OSError
        There is no such folder.
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
        """Let others lock a file."""
        _set_locking(descriptor, msvcrt.LK_UNLCK)

    def _set_locking(descriptor: int, mode: int) -> None:
        # What is locked begins where the file is at, and so does what is written next.
        place = os.lseek(descriptor, 0, os.SEEK_CUR)
        os.lseek(descriptor, LOCKED_BYTE, os.SEEK_SET)
        try:
            msvcrt.locking(descriptor, mode, 1)
        finally:
            os.lseek(descriptor, place, os.SEEK_SET)
else:
    import fcntl

    def _lock(descriptor: int, shared: bool) -> None:
        # Disks of the network let nobody keep others out of a file open for reading.
        kind = fcntl.LOCK_SH if shared else fcntl.LOCK_EX
        fcntl.flock(descriptor, kind | fcntl.LOCK_NB)

    def unlock(descriptor: int) -> None:
        """Let others lock a file."""
        fcntl.flock(descriptor, fcntl.LOCK_UN)
