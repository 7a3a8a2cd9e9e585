"""What programs that were killed have left in the data folder, and nobody needs."""

import time
from contextlib import suppress
from pathlib import Path

from lightpen.errors import FileError
from lightpen.formats.part_files import sweep_parts
from lightpen.record.folder_archive import RECORDS, RESULTS, SIMULATED
from lightpen.record.header import HEADER
from lightpen.record.journal import JOURNAL, last_verdict
from lightpen.record.lock import is_locked
from lightpen.record.reading import IMAGES, OPENER
from lightpen.record.verifications import UNDER_WAY, VERIFICATIONS

OLDEST = 1.0  # s; after it nobody is between making a folder and locking its journal


def sweep_leftovers(data: Path) -> None:
    """Remove the parts of files, and folders of swings that never began.

    What a running program is writing is left alone, and so is all that it cannot be.
    """
    sweep_parts(data / RESULTS)
    for root in (data, data / SIMULATED):
        sweep_parts(root / VERIFICATIONS / UNDER_WAY)
    with suppress(OSError):  # the search for interrupted swings tells it
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
    """Return whether a record was being made here, and is not any more."""
    names = {path.name for path in folder.iterdir()}
    others = {name for name in names if not name.startswith(("camera.", "pen."))}
    if HEADER in names or not others <= {JOURNAL, IMAGES, OPENER}:
        return False
    if IMAGES in names and any((folder / IMAGES).iterdir()):
        return False
    journal = folder / JOURNAL
    return JOURNAL not in names or not (journal.stat().st_size or is_locked(journal))
