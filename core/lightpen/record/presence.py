"""Which windows of the program use a data folder at the same time.

Each holds a file of its own locked for as long as it runs. The lock goes when the
process ends, however it ends; whoever looks next removes the file that is left. On a
disk that knows no locks each window seems to be alone.
"""

import os
from contextlib import suppress
from pathlib import Path
from uuid import uuid4

from lightpen.formats.file_locks import locked

WINDOWS = "windows"
SUFFIX = ".lock"


class Presence:
    """Tells other windows that this one uses a data folder, and counts them.

    Parameters
    ----------
    data : Path
        The data folder; it need not exist.
    """

    def __init__(self, data: Path) -> None:
        self._folder = data / WINDOWS
        self._file = self._folder / f"{uuid4().hex}{SUFFIX}"
        self._descriptor: int | None = None

    def count_others(self) -> int:
        """Return how many other windows use the folder, and let them know of this one.

        Where the folder cannot be written, nobody knows of anybody.
        """
        with suppress(OSError):
            self._announce()
            others = (f for f in self._folder.glob(f"*{SUFFIX}") if f != self._file)
            return sum(map(_is_held, others))
        return 0

    def leave(self) -> None:
        """Let the others know that this window is gone."""
        descriptor, self._descriptor = self._descriptor, None
        if descriptor is not None:
            os.close(descriptor)
            with suppress(OSError):
                self._file.unlink()

    def _announce(self) -> None:
        """Hold the file; another window that found it unlocked may have removed it."""
        before = self._descriptor
        if before is not None and not self._file.exists():
            self._descriptor = None
            os.close(before)
        if self._descriptor is None:
            self._folder.mkdir(parents=True, exist_ok=True)
            self._descriptor = os.open(self._file, os.O_RDWR | os.O_CREAT)
        locked(self._descriptor)


def _is_held(file: Path) -> bool:
    """Return whether another window holds its file; remove it if none does."""
    try:
        descriptor = os.open(file, os.O_RDWR)
    except FileNotFoundError:  # it has just left
        return False
    try:
        is_free = locked(descriptor)
    finally:
        os.close(descriptor)
    if is_free:
        with suppress(OSError):
            file.unlink()
    return not is_free
