"""One program at a time writes to a record.

The lock is one of the operating system on the open journal: it goes when the process
ends, however it ends, and there is no file of its own that could be left behind. It
keeps writers from each other; reading needs no lock and is never kept out. A network
disk without locks is written to without this protection.
"""

from pathlib import Path
from typing import IO

from lightpen.errors import FileError
from lightpen.formats.file_locks import NO_LOCKS, locked, unlock

PATIENCE = 0.5  # s, wait for a reader or a closing process to release the lock


def lock_journal(journal: IO[bytes], folder: Path) -> None:
    """Keep other writers out until the journal is unlocked, or the process ends.

    Raises `FileError` if another program writes to the record.
    """
    if not _is_taken_over(journal.fileno(), shared=False):
        raise FileError("record.locked", folder=folder)


def unlock_journal(journal: IO[bytes]) -> None:
    """Let other writers in."""
    try:
        unlock(journal.fileno())
    except OSError as error:
        if error.errno not in NO_LOCKS:
            raise


def is_locked(path: Path) -> bool:
    """Return whether a program writes to the record of a journal."""
    with path.open("rb") as journal:
        if not _is_taken_over(journal.fileno(), shared=True):
            return True
        unlock_journal(journal)
    return False


def _is_taken_over(descriptor: int, shared: bool) -> bool:
    try:
        return locked(descriptor, shared=shared, patience_s=PATIENCE)
    except OSError as error:
        if error.errno in NO_LOCKS:
            return True
        raise
