"""The archive entry of a result or a verification."""

from dataclasses import replace
from pathlib import Path

from lightpen.errors import FileError
from lightpen.record.calibrations.calibrations import CalibrationFile
from lightpen.record.folder.verifications import data_folder_of_verification
from lightpen.record.library.entered_files import EntryPlace, entered_files
from lightpen.record.results.opening import data_folder_of


def with_entry(file: CalibrationFile) -> CalibrationFile:
    """Return a calibration that states, if accepted, whether it is entered."""
    if file.accepted is None:
        return file
    return replace(file, is_entered=entry_of_file(file.path, file.sha256) is not None)


def entry_of_file(result: Path, sha256: str) -> EntryPlace | None:
    """Return the entry of a result or a verification with a checksum as read.

    None of a file in no data folder, and of one that is not entered. Raises `FileError`
    if it is not the file that was entered.
    """
    data = data_folder_of_verification(result) or data_folder_of(result)
    if data is None:
        return None
    entered = entered_files(data)
    found = entered.files.get(entered.place_of(result))
    if found is None:
        return None
    if found.sha256 != sha256:
        raise FileError("archive.another-result", file=result)
    return found.entry
