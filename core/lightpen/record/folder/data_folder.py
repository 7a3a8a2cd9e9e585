"""Whether the data folder can be written."""

import os
import time
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryFile
from uuid import uuid4

from lightpen.errors import FileError
from lightpen.formats.file_locks import locked
from lightpen.formats.files import why_unwritten
from lightpen.formats.part_files import sweep_parts
from lightpen.record.results.result_folder import RECORDS, RESULTS
from lightpen.record.swings.header import HEADER
from lightpen.record.swings.journal import JOURNAL, last_verdict
from lightpen.record.swings.lock import is_locked
from lightpen.record.swings.reading import IMAGES, OPENER


def check_writable(data: Path) -> None:
    """Check by a temporary file that a folder can be written; create it if missing."""
    try:
        data.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=data) as file:
            file.write(b"\n")
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        raise FileError(
            "data-folder.unwritable", folder=data, reason=why_unwritten(error)
        ) from error


WINDOWS = "windows"
SUFFIX = ".lock"


class Presence:
    """Tells other windows that this one uses a data folder, and counts them."""

    def __init__(self, data: Path) -> None:
        self._folder = data / WINDOWS
        self._file = self._folder / f"{uuid4().hex}{SUFFIX}"
        self._descriptor: int | None = None

    def count_others(self) -> int:
        """Count the other windows that use the folder, and announce this one.

        In a folder that cannot be written, windows do not count each other.
        """
        with suppress(OSError):
            self._announce()
            others = (f for f in self._folder.glob(f"*{SUFFIX}") if f != self._file)
            return sum(map(_is_held, others))
        return 0

    def leave(self) -> None:
        """Remove this window from the list of open windows."""
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


OLDEST = 1.0  # s; longest time between creating a folder and locking its journal


def sweep_leftovers(data: Path) -> None:
    """Remove the parts of files, and folders of swings that never began.

    Files that a running program is writing are left alone, and so are all other files.
    """
    sweep_parts(data / RESULTS)
    with suppress(OSError):  # the search for interrupted swings shows it
        for folder in list((data / RECORDS).iterdir()):
            with suppress(OSError, FileError):
                _sweep_record(folder)


def _sweep_record(folder: Path) -> None:
    with suppress(FileNotFoundError):
        if last_verdict(folder) is not None:
            return
    is_fresh = time.time() - folder.stat().st_mtime < OLDEST
    sweep_parts(folder)
    sweep_parts(folder / IMAGES)
    if not is_fresh and _has_never_begun(folder):
        for path in folder.iterdir():
            path.rmdir() if path.name == IMAGES else path.unlink()
        folder.rmdir()


def _has_never_begun(folder: Path) -> bool:
    """Return whether a record was made here and was not completed."""
    names = {path.name for path in folder.iterdir()}
    others = {name for name in names if not name.startswith(("camera.", "pen."))}
    if HEADER in names or not others <= {JOURNAL, IMAGES, OPENER}:
        return False
    if IMAGES in names and any((folder / IMAGES).iterdir()):
        return False
    journal = folder / JOURNAL
    return JOURNAL not in names or not (journal.stat().st_size or is_locked(journal))
