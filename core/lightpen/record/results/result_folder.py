"""The results as a folder: one file each, beside the records of swings.

A file is written once and never changed. Its name is a number: the order of acceptance.
Where its swing is recorded is written as a path from the data folder, so that the whole
of it can be moved, or copied to another machine. Results of simulated pens are in their
own folder.
"""

import logging
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from datetime import datetime
from pathlib import Path

from lightpen.errors import FileError
from lightpen.formats.files import LARGEST_RECORD, read_bytes
from lightpen.messages import message
from lightpen.model.names import folded_name
from lightpen.record.library.entered_files import (
    EnteredFiles,
    add_numbered,
    entered_files,
    numbered_files,
)
from lightpen.record.library.signing import SigningKey
from lightpen.record.library.supervision import (
    Signature,
    Supervision,
    approval_of_change,
    read_supervision,
)
from lightpen.record.library.tip_library import Library, read_library
from lightpen.record.results.results import (
    Result,
    ResultHeading,
    Withdrawal,
    parse_heading,
    parse_result,
    parse_withdrawal,
    result_bytes,
    withdrawal_bytes,
)
from lightpen.record.swings.reading import is_record

RECORDS, RESULTS = "records", "results"
SIMULATED = "simulated"  # folder of the files and results of the simulated pen
RESULT = message("file.result")

_logger = logging.getLogger(__name__)


class FolderArchive:
    """Keeps every result that was accepted; the newest of a pen and tip is current.

    Results are added and never changed or removed: a revoked one is kept, and its
    predecessor is current again. Results of a simulated pen are kept apart and are
    never current for a real one. All methods may take as long as a disk or a network
    does, and may be called from any thread. A result
    that is not entered in the archive is passed over.
    """

    def __init__(self, data: Path) -> None:
        self._data = data.absolute()

    @property
    def folder(self) -> Path:
        """Folder of the results of real pens."""
        return self._data / RESULTS

    def store(self, result: Result, supervisor: SigningKey | None = None) -> None:
        """Make a result current, approved by the supervisor whom it names.

        When this returns, the result is durable; when it raises or is killed, it is
        stored whole or not at all.
        """
        root, record = self._root(result.is_simulated), self.place_of(result.record)
        content = result_bytes(result, record)
        parse_result(content, root, Path)  # an unreadable result is never current
        add_numbered(self._data, root, content, supervisor)

    def revoke(
        self,
        result: Result,
        operator: str,
        now: datetime,
        reason: str = "",
        signature: Signature | None = None,
    ) -> None:
        """Make the result before the current one current again.

        It is one step, as `store`. With a supervisor password it needs a supervisor and
        a reason of the operator (`AcceptanceError`), as that result was not judged by
        the present limits. Raises `FileError` if the result is not current any more.
        """
        names, supervision = result.names, self.supervision()
        key = approval_of_change(supervision, signature, reason)
        is_simulated = result.is_simulated
        file = self.file_in_force(names.pen, names.tip, is_simulated=is_simulated)
        if file is None or not _is_same(self.read(file), result):
            raise FileError("results.not-in-force", tip=names.tip, pen=names.pen)
        withdrawal = Withdrawal(
            file.stem,
            now,
            replace(names, operator=operator),
            reason.strip(),
            supervisor=""
            if signature is None or key is None
            else signature.name.strip(),
        )
        add_numbered(self._data, file.parent, withdrawal_bytes(withdrawal), key)
        _logger.info("result withdrawn: %s, by %r", file, operator)

    def in_force(
        self, pen: str, tip: str, *, is_simulated: bool = False
    ) -> Result | None:
        """Return the last accepted result of a pen and a tip, or None.

        Raises `FileError` if a result that may be the current one cannot be read: an
        older one must not come into force again in silence.
        """
        file = self.file_in_force(pen, tip, is_simulated=is_simulated)
        return None if file is None else self.read(file)

    def file_in_force(
        self, pen: str, tip: str, *, is_simulated: bool = False
    ) -> Path | None:
        """Return the file of what `in_force` returns."""
        for file, heading in self._unrevoked(self._root(is_simulated)):
            names = heading.names
            if names is None or (
                folded_name(names.pen) == folded_name(pen)
                and folded_name(names.tip) == folded_name(tip)
            ):
                return file
        return None

    def files_of_pen(self, pen: str, *, is_simulated: bool = False) -> tuple[Path, ...]:
        """Return the results of a pen that are not revoked, the newest first."""
        root = self._root(is_simulated)
        return tuple(
            file
            for file, heading in self._unrevoked(root, passes_over_damage=True)
            if heading.names and folded_name(heading.names.pen) == folded_name(pen)
        )

    def supervision(self) -> Supervision:
        """Return the present limits and who guards them."""
        return read_supervision(self._data)

    def library(self) -> Library:
        """Return the pens, tips and cones that are known."""
        return read_library(self._data)

    def of_record(self, folder: Path) -> Result | None:
        """Return the last accepted result of the swing in a folder, or None.

        Results that cannot be read or that were revoked are passed over.
        """
        for root in self._roots():
            for file, heading in self._unrevoked(root, passes_over_damage=True):
                place = heading.record
                with suppress(FileError):
                    if place is not None and self._data / place == folder.absolute():
                        return self.read(file)
        return None

    def all_files(self) -> tuple[Path, ...]:
        """Return the files of all results and revocations, the oldest first."""
        roots = reversed(self._roots())
        return tuple(file for root in roots for file in reversed(numbered_files(root)))

    def content(self, file: Path) -> Result | Withdrawal:
        """Return the content of one of `all_files`."""
        content = read_bytes(file, RESULT, LARGEST_RECORD)
        if parse_heading(content, file).takes_back is None:
            return self.read(file)
        return parse_withdrawal(content, file)

    def place_of(self, path: Path) -> str:
        """Return the path of a file, relative to the data folder if inside."""
        absolute = path.absolute()
        inside = absolute.is_relative_to(self._data)
        return (absolute.relative_to(self._data) if inside else absolute).as_posix()

    def file_of(self, result: Result) -> Path:
        """Return the file of a result that is not revoked."""
        place, root = self.place_of(result.record), self._root(result.is_simulated)
        for file, heading in self._unrevoked(root, passes_over_damage=True):
            if heading.record == place and _is_same(self.read(file), result):
                return file
        names = result.names
        raise FileError("results.gone", tip=names.tip, pen=names.pen, folder=root)

    def _root(self, is_simulated: bool) -> Path:
        return (self._data / SIMULATED if is_simulated else self._data) / RESULTS

    def _roots(self) -> tuple[Path, Path]:
        """Return the folder of the results."""
        return self._root(True), self.folder

    def _unrevoked(
        self, root: Path, *, passes_over_damage: bool = False
    ) -> Iterator[tuple[Path, ResultHeading]]:
        """Yield the results that are not revoked, the newest first."""
        entered, present = entered_files(self._data), read_supervision(self._data).key
        revoked, files = set[str](), numbered_files(root)
        if not passes_over_damage:
            entered.require_all(root)
        for file in files:
            try:
                heading = _counted_heading(entered, file, present)
            except FileError:
                if passes_over_damage:
                    continue
                raise
            if heading is None:  # it is not entered
                continue
            if heading.takes_back is not None:
                revoked.add(heading.takes_back)
            elif file.stem not in revoked:
                yield file, heading

    def read(self, file: Path) -> Result:
        """Return the result in a file of the archive."""
        located = self._data.joinpath  # an absolute folder stays absolute
        return parse_result(read_bytes(file, RESULT, LARGEST_RECORD), file, located)


def _counted_heading(
    entered: EnteredFiles, file: Path, present: str
) -> ResultHeading | None:
    """Return the heading of a result, approved as it must be; None if not entered."""
    counted = entered.counted(file, read_bytes(file, RESULT, LARGEST_RECORD))
    if counted is None:
        return None
    heading = parse_heading(counted.content, file)
    if heading.supervisor:
        counted.require_approved(present)
    return heading


def _is_same(one: Result, other: Result) -> bool:
    """Return whether two results are of the same acceptance."""
    return (one.accepted, one.record) == (other.accepted, other.record)


# Opening a swing from outside the program, by any file that belongs to it.
#
# A record is a folder, and no system opens a folder with a program of its own choice:
# in each lies a small file whose name does. A result leads to the swing that it comes
# from.


def swing_folder(path: Path) -> Path:
    """Return the folder of a swing by itself, a file in it, or a result.

    Raises `FileError` if the path leads to no swing.
    """
    place = path.absolute()
    for folder in (place, place.parent):
        if is_record(folder):
            return folder
    data = data_folder_of(place)
    if data is not None:
        recorded = FolderArchive(data).read(place).record
        if is_record(recorded):
            return recorded
        raise FileError("opening.swing-moved", file=path, folder=recorded)
    raise FileError("opening.no-swing", path=path)


def data_folder_of(result: Path) -> Path | None:
    """Return the data folder that a file is a result of; None if it is in none."""
    place = result.absolute()
    if place.parent.name != RESULTS or place.suffix != ".json":
        return None
    return place.parents[2 if place.parents[1].name == SIMULATED else 1]
