"""One program at a time writes to a record.

The lock is one of the operating system on the open journal: it goes when the process
ends, however it ends, and there is no file of its own that could be left behind. It
keeps writers from each other; reading needs no lock and is never kept out. A disk of
the network that knows no locks is written to as if nobody else did.
"""

import errno
import os
import sys
import time
from pathlib import Path
from typing import IO

from lightpen.errors import FileError
from lightpen.formats.files import printable
from lightpen.sentences import sentence

PATIENCE = 0.5  # s for one who only looks, or is about to close, to let go
PAUSE = 0.01  # s between two attempts
LOCKED_BYTE = 2**30  # behind any journal: Windows lets nobody read what is locked
TAKEN = (errno.EAGAIN, errno.EACCES, errno.EDEADLK)
NO_LOCKS = (errno.ENOSYS, errno.EOPNOTSUPP, errno.ENOLCK)


def lock_journal(journal: IO[bytes], folder: Path) -> None:
    """Keep other writers out until the journal is unlocked, or the process ends.

    Parameters
    ----------
    journal : file
        Open to be written.
    folder : Path
        Of its record, for the sentence.

    Raises
    ------
    FileError
        Another program writes to the record.
    OSError
        The disk fails.
    """
    if not _is_taken_over(journal.fileno(), shared=False):
        raise FileError(
            sentence(
                "record.locked",
                "Another program is writing to the swing in {folder}. Go on with it "
                "there, or close that program and try again.",
                folder=printable(str(folder)),
            )
        )


def unlock_journal(journal: IO[bytes]) -> None:
    """Let other writers in."""
    try:
        _unlock(journal.fileno())
    except OSError as error:
        if error.errno not in NO_LOCKS:
            raise


def is_locked(path: Path) -> bool:
    """Return whether anybody writes to the record of a journal.

    Raises
    ------
    OSError
        The journal cannot be read.
    """
    with path.open("rb") as journal:
        if not _is_taken_over(journal.fileno(), shared=True):
            return True
        unlock_journal(journal)
    return False


def _is_taken_over(descriptor: int, shared: bool) -> bool:
    deadline = time.monotonic() + PATIENCE
    while True:
        try:
            _lock(descriptor, shared)
        except OSError as error:
            if error.errno in NO_LOCKS:
                return True
            if error.errno not in TAKEN:
                raise
        else:
            return True
        if time.monotonic() > deadline:
            return False
        time.sleep(PAUSE)


if sys.platform == "win32":
    import msvcrt

    def _lock(descriptor: int, shared: bool) -> None:
        os.lseek(descriptor, LOCKED_BYTE, os.SEEK_SET)
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)

    def _unlock(descriptor: int) -> None:
        os.lseek(descriptor, LOCKED_BYTE, os.SEEK_SET)
        msvcrt.locking(descriptor, msvcrt.LK_UNLCK, 1)
else:
    import fcntl

    def _lock(descriptor: int, shared: bool) -> None:
        # Disks of the network let nobody keep others out of a file open for reading.
        kind = fcntl.LOCK_SH if shared else fcntl.LOCK_EX
        fcntl.flock(descriptor, kind | fcntl.LOCK_NB)

    def _unlock(descriptor: int) -> None:
        fcntl.flock(descriptor, fcntl.LOCK_UN)
