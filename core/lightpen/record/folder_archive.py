"""The archive as a folder: one file a result, beside the records of the swings.

A file is written once and never changed. Its name is a number: the order of acceptance.
Where its swing is recorded is written as a path from the data folder, so that the whole
of it can be moved, or copied to another machine. Results of simulated pens are in a
folder of their own; those of earlier versions stand among the others, and are told by
the swing that they come from. One whose swing is gone counts as real, and says nothing
of it.
"""

import os
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from datetime import datetime
from pathlib import Path, PureWindowsPath

from lightpen.errors import FileError
from lightpen.formats.files import MEGABYTE, printable, read_bytes, unreadable
from lightpen.model.origin import Origin
from lightpen.record.numbered_files import add_numbered, numbered_files
from lightpen.record.reading import open_record, recorded_origin
from lightpen.record.results import (
    Heading,
    Result,
    Withdrawal,
    has_head,
    parse_heading,
    parse_result,
    parse_withdrawal,
    result_bytes,
    withdrawal_bytes,
)
from lightpen.record.supervision import Supervision, read_supervision
from lightpen.record.tip_library import Library, read_library
from lightpen.sentences import sentence

RECORDS, RESULTS = "records", "results"
SIMULATED = "simulated"  # that the files of the simulated pen, and its results, are in
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
        """That the files of real pens are in."""
        return self._data / RESULTS

    def store(self, result: Result) -> None:
        """Put a result in force; see `lightpen.record.archive.Archive`."""
        data = result_bytes(result, self.place_of(result.record))
        add_numbered(self._root(result.is_simulated), data)

    def take_back(self, result: Result, operator: str, now: datetime) -> None:
        """Let the result before be in force; see `lightpen.record.archive.Archive`."""
        names = result.names
        is_simulated = result.is_simulated
        file = self.file_in_force(names.pen, names.tip, is_simulated=is_simulated)
        if file is None or not _is_same(self.read(file), result):
            raise FileError(
                sentence(
                    "results.not-in-force",
                    "This result of tip {tip}, pen {pen}, is not the one in force any "
                    "more. Look at which one is before you take it back.",
                    tip=names.tip,
                    pen=names.pen,
                )
            )
        add_numbered(file.parent, withdrawal_bytes(result, file.stem, operator, now))

    def in_force(
        self, pen: str, tip: str, *, is_simulated: bool = False
    ) -> Result | None:
        """Return the last accepted result of a pen and a tip, or None."""
        file = self.file_in_force(pen, tip, is_simulated=is_simulated)
        return None if file is None else self.read(file)

    def file_in_force(
        self, pen: str, tip: str, *, is_simulated: bool = False
    ) -> Path | None:
        """Return the file of what `in_force` returns."""
        for root in self._roots(is_simulated):
            # Damage among the results of real pens is no matter to a simulated one.
            passes = is_simulated and root == self.folder
            for file, heading in self._standing(root, passes_over_damage=passes):
                is_named = heading.pen in (pen, None) and heading.tip in (tip, None)
                if is_named and self._is_simulated(heading) is is_simulated:
                    return file
        return None

    def tips(self, pen: str, *, is_simulated: bool = False) -> tuple[str, ...]:
        """Return the tips of a pen that have a result in force, the newest first."""
        found = [
            heading.tip
            for root in self._roots(is_simulated)
            for _, heading in self._standing(root, passes_over_damage=True)
            if heading.pen == pen and self._is_simulated(heading) is is_simulated
        ]
        return tuple(filter(None, dict.fromkeys(found)))

    def files_of_pen(self, pen: str, *, is_simulated: bool = False) -> tuple[Path, ...]:
        """Return the results of a pen that are not taken back, the newest first.

        Raises
        ------
        FileError
            The archive cannot be read at all.
        """
        return tuple(
            file
            for root in self._roots(is_simulated)
            for file, heading in self._standing(root, passes_over_damage=True)
            if heading.pen == pen and self._is_simulated(heading) is is_simulated
        )

    def supervision(self) -> Supervision:
        """Return what supervisors have laid down."""
        return read_supervision(self._data)

    def library(self) -> Library:
        """Return the pens, tips and cones that are known."""
        return read_library(self._data)

    def of_record(self, folder: Path) -> Result | None:
        """Return the last accepted result of the swing in a folder, or None."""
        for root in self._roots(is_simulated=True):
            for file, heading in self._standing(root, passes_over_damage=True):
                place = heading.record
                with suppress(FileError, ValueError):  # a name that no file can have
                    if place is not None and self._located(place) == folder.absolute():
                        return self.read(file)
        return None

    def all_files(self) -> tuple[Path, ...]:
        """Return the files of all results and takings back, the oldest first.

        Raises
        ------
        FileError
            The archive cannot be read at all.
        """
        roots = reversed(self._roots(is_simulated=True))
        return tuple(file for root in roots for file in reversed(numbered_files(root)))

    def content(self, file: Path) -> Result | Withdrawal:
        """Return what one of `all_files` holds.

        Raises
        ------
        FileError
            It cannot be read, or is damaged.
        """
        if _read_heading(file).takes_back is None:
            return self.read(file)
        return parse_withdrawal(read_bytes(file, WHAT, LIMIT), file)

    def place_of(self, path: Path) -> str:
        """Return where a file or folder is, from the data folder if it is in there."""
        absolute = path.absolute()
        inside = absolute.is_relative_to(self._data)
        return (absolute.relative_to(self._data) if inside else absolute).as_posix()

    def file_of(self, result: Result) -> Path:
        """Return the file of a result that is not taken back.

        Raises
        ------
        FileError
            There is none any more.
        """
        place = self.place_of(result.record)
        for root in self._roots(result.is_simulated):
            for file, heading in self._standing(root, passes_over_damage=True):
                if heading.record == place and _is_same(self.read(file), result):
                    return file
        names = result.names
        raise FileError(
            sentence(
                "results.gone",
                "The file of the result of tip {tip}, pen {pen}, is not in {folder} "
                "any more. Restore it from a copy.",
                tip=names.tip,
                pen=names.pen,
                folder=printable(str(self._root(result.is_simulated))),
            )
        )

    def _root(self, is_simulated: bool) -> Path:
        return (self._data / SIMULATED if is_simulated else self._data) / RESULTS

    def _roots(self, is_simulated: bool) -> tuple[Path, ...]:
        """Return where such results may be, the newer ones first."""
        return (self._root(True), self.folder) if is_simulated else (self.folder,)

    def _is_simulated(self, heading: Heading) -> bool:
        origin = heading.origin
        if origin is None and heading.record is not None:
            origin = self._origin_of_swing(self._located(heading.record))
        return origin == Origin.SIMULATED

    def _origin_of_swing(self, folder: Path) -> Origin | None:
        """Return what the images of a swing are of, if it is there and says so."""
        with suppress(FileError, ValueError):  # a name that no file can have
            return recorded_origin(open_record(folder))
        return None

    def _standing(
        self, root: Path, *, passes_over_damage: bool = False
    ) -> Iterator[tuple[Path, Heading]]:
        """Yield the results that are not taken back, the newest first."""
        taken_back = set[str]()
        for file in numbered_files(root):
            try:
                heading = _read_heading(file)
            except FileError:
                if passes_over_damage:
                    continue
                raise
            if heading.takes_back is not None:
                taken_back.add(heading.takes_back)
            elif file.stem not in taken_back:
                yield file, heading

    def read(self, file: Path) -> Result:
        """Return the result in a file of the archive.

        Raises
        ------
        FileError
            It cannot be read.
        """
        result = parse_result(read_bytes(file, WHAT, LIMIT), file, self._located)
        if result.origin is not None:
            return result
        return replace(result, origin=self._origin_of_swing(result.record))

    def _located(self, place: str) -> Path:
        """Return the folder of a record by what is written."""
        folder = self._data / place  # an absolute one stays what it is
        if not os.access(folder, os.F_OK):
            # Format 1 wrote absolute folders, which were elsewhere before a move.
            moved = self._data / RECORDS / PureWindowsPath(place).name
            if os.access(moved, os.F_OK):
                return moved
        return folder


def _is_same(one: Result, other: Result) -> bool:
    """Return whether two results are of the same acceptance."""
    return (one.accepted, one.record) == (other.accepted, other.record)


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
