"""The archive as a folder: one file a result, beside the records of the swings.

A file is written once and never changed. Its name is a number, one higher than that of
any before: the order of acceptance, which no clock that was set back can turn round. Of
two programs that take the same number one gets it, and the other the next. Where its
swing is recorded is written as a path from the data folder, so that the whole of it can
be moved, or copied to another machine.
"""

import os
from contextlib import suppress
from itertools import count
from pathlib import Path, PureWindowsPath

from lightpen.errors import FileError, NameTakenError
from lightpen.formats.files import (
    FOLDER,
    MEGABYTE,
    create_whole,
    printable,
    read_bytes,
    strerror,
    sync_folder,
    unreadable,
)
from lightpen.record.results import (
    Heading,
    Result,
    has_head,
    parse_heading,
    parse_result,
    result_bytes,
)
from lightpen.sentences import sentence

RECORDS, RESULTS = "records", "results"
WHAT = sentence("file.result", "result")
LIMIT = 64 * MEGABYTE
HEAD = 16_384  # bytes, in which the first entries of a result end, or it is read whole


class FolderArchive:
    """Keeps results in files.

    Of a result of another pen, tip or swing only the first entries are read, so that
    thousands of them cost little.

    Parameters
    ----------
    data : Path
        Folder of the records and the results; it need not exist.
    """

    def __init__(self, data: Path) -> None:
        self._data = data.absolute()

    @property
    def folder(self) -> Path:
        """That the files are in."""
        return self._data / RESULTS

    def store(self, result: Result) -> None:
        """Put a result in force; see `lightpen.record.archive.Archive`."""
        root = self.folder
        try:
            root.mkdir(parents=True, exist_ok=True)
            sync_folder(root.parent)
        except OSError as error:
            raise FileError(
                sentence(
                    "results.no-folder",
                    "The folder {folder} cannot be made: {reason}. Make sure that it "
                    "is yours to write.",
                    folder=printable(str(root)),
                    reason=strerror(error),
                )
            ) from error
        newest = self._files()[:1]
        number = 1 + (_number(newest[0]) if newest else 0)
        data = result_bytes(result, self._place_of(result.record))
        for free in count(number):
            with suppress(NameTakenError):  # by another program, just now
                create_whole(root / f"{free:06d}.json", data)
                return

    def in_force(self, pen: str, tip: str) -> Result | None:
        """Return the last accepted result of a pen and a tip, or None."""
        for file in self._files():
            heading = _read_heading(file)
            if heading.pen in (pen, None) and heading.tip in (tip, None):
                return self._read(file)
        return None

    def of_record(self, folder: Path) -> Result | None:
        """Return the last accepted result of the swing in a folder, or None."""
        for file in self._files():
            with suppress(FileError, ValueError):  # a name that no file can have
                place = _read_heading(file).record
                if place is not None and self._located(place) == folder.absolute():
                    return self._read(file)
        return None

    def _files(self) -> list[Path]:
        """Return the files of results, the newest first; others are left alone."""
        root = self.folder
        try:
            paths = list(root.iterdir()) if root.is_dir() else []
        except OSError as error:
            raise unreadable(root, FOLDER, error) from error
        files = [path for path in paths if path.suffix == ".json" and _number(path)]
        return sorted(files, key=lambda file: (_number(file), file.name), reverse=True)

    def _read(self, file: Path) -> Result:
        return parse_result(read_bytes(file, WHAT, LIMIT), file, self._located)

    def _place_of(self, record: Path) -> str:
        """Return where a record is, from the data folder if it is in there."""
        folder = record.absolute()
        inside = folder.is_relative_to(self._data)
        return (folder.relative_to(self._data) if inside else folder).as_posix()

    def _located(self, place: str) -> Path:
        """Return the folder of a record by what is written."""
        folder = self._data / place  # an absolute one stays what it is
        if not os.access(folder, os.F_OK):
            # Format 1 wrote absolute folders, which were elsewhere before a move.
            moved = self._data / RECORDS / PureWindowsPath(place).name
            if os.access(moved, os.F_OK):
                return moved
        return folder


def _number(file: Path) -> int:
    """Return the place of a file in the order of acceptance; 0 for a foreign file."""
    digits = file.stem.partition("_")[0]  # what follows were date and time of format 2
    return int(digits) if digits.isdecimal() else 0


def _read_heading(file: Path) -> Heading:
    """Read the first entries of a result, all of them if it has no calibration."""
    try:
        with file.open("rb") as stream:
            start = stream.read(HEAD)
    except OSError as error:
        raise unreadable(file, WHAT, error) from error
    if not has_head(start):
        start = read_bytes(file, WHAT, LIMIT)
    return parse_heading(start, file)
