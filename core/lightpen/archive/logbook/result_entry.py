"""The archive entry of a result; the archive is opened read-only."""

from contextlib import closing, suppress
from dataclasses import dataclass, replace
from pathlib import Path

from lightpen.errors import FileError, NoArchiveError
from lightpen.record.calibrations.calibrations import CalibrationFile
from lightpen.record.folder.verifications import data_folder_of_verification
from lightpen.record.results.opening import data_folder_of
from lightpen.record.results.result_folder import FolderArchive


@dataclass(frozen=True)
class ArchivePlace:
    """Entry of a calibration: number in its chain, from 1, and hashes."""

    number: int
    sha256: str
    previous: str


def with_entry(file: CalibrationFile) -> CalibrationFile:
    """Return a calibration that states, if accepted, whether it is entered."""
    if file.accepted is None:
        return file
    return replace(file, is_entered=entry_of_file(file.path, file.sha256) is not None)


def entry_of_file(result: Path, sha256: str) -> ArchivePlace | None:
    """Return the entry of a result or a verification with a checksum as read.

    None of a file in no data folder, and of one that is not entered yet. Raises
    `FileError` if it is not the file that was entered.
    """
    data = data_folder_of_verification(result) or data_folder_of(result)
    if data is None:
        return None
    # Imported here: it takes 0.2 s.
    from lightpen.archive.chains.chains import chain_at_home, entry_of_result
    from lightpen.archive.logbook.logbook import ARCHIVE
    from lightpen.archive.store.database import look_into

    found = None
    with suppress(NoArchiveError), closing(look_into(data / ARCHIVE)) as database:
        if chain := chain_at_home(database):
            place = FolderArchive(data).place_of(result)
            found = entry_of_result(database, chain, place)
    if found is None:
        return None
    entered = found.entry.event.result
    if entered is None or entered.sha256 != sha256:
        raise FileError("archive.another-result", file=result)
    return ArchivePlace(found.entry.number, found.sha256, found.entry.previous)
