"""Checks of an archive and of the files that it refers to."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any

from sqlalchemy import Row, exists, func, select, text

from lightpen.archive.chains import (
    SHORT,
    Entry,
    FileHash,
    StoredEntry,
    chain_at_home,
    chain_names,
    entry_of_result,
    named_entry,
    searchable,
    signature_finding,
    sound_entry,
    text_sha256,
)
from lightpen.archive.events import station_files
from lightpen.archive.store import ENTRIES, RECORDS, Database, is_open, look_into
from lightpen.errors import FileError, LightpenError
from lightpen.formats.files import start_sha256
from lightpen.messages import Message, message, printable
from lightpen.record.library.entered_files import (
    NOTHING_BEFORE,
    ROLLED_BACK,
    entered_files,
)
from lightpen.record.library.signing import (
    UNAPPROVED,
    ChainKeys,
    owed_files,
    remembered_head,
    station_key,
)
from lightpen.record.library.tip_library import library_files
from lightpen.record.results.result_folder import FolderArchive
from lightpen.record.swings.reading import (
    JOURNAL,
    RecordedImage,
    image_name,
    journal_bytes,
    open_record,
    parse_lines,
)

# Observations of an archive check that prove no change.
#
# A power cut leaves files that are not entered yet, and a data folder may move to
# another computer. Neither proves a change.


def check_notes(database: Database, data: Path) -> Iterator[Message]:
    """Yield notes on the archive of a data folder.

    A chain that is not known here, and files without entries.
    """
    home = chain_at_home(database)
    if home is not None:
        yield from _unknown_here(home)
        yield from _not_entered(database, data, home)


def _unknown_here(home: str) -> Iterator[Message]:
    if station_key(home) is None and remembered_head(home) is None:
        yield message("archive.unknown-here", chain=home[:SHORT])


def _not_entered(database: Database, data: Path, home: str) -> Iterator[Message]:
    results = FolderArchive(data)
    files = (*results.all_files(), *library_files(data), *station_files(data))
    owed = {each.place for each in owed_files(home)}
    for file in files:
        place = results.place_of(file)
        if entry_of_result(database, home, place) is not None:
            continue
        if place in owed:
            yield message("archive.file-owed", file=printable(place))
        else:
            yield message("archive.file-not-entered", file=printable(place))


# Check of results, swings and images against the hashes in their entries.
#
# An entry has the hash of the journal of its swing as far as it went then, and each
# line of that the hashes of the images of all cameras: so the entry refers to every
# image.


class FilesCheck:
    """Reads each file once, however many entries refer to it, and counts them.

    Without a data folder there are no files to be read.
    """

    def __init__(self, data: Path | None) -> None:
        self._data = data
        self._seen = set[FileHash]()
        self._swings = set[str]()
        self.n_files = 0

    def findings(self, entries: Iterable[StoredEntry]) -> Iterator[Message]:
        """Check the files of entries and yield the findings."""
        if self._data is None:
            return
        for each in entries:
            yield from self._findings(self._data, each.entry)

    def _findings(self, data: Path, entry: Entry) -> Iterator[Message]:
        event = entry.event
        files = [] if event.result is None else [event.result]
        if event.files and not event.swing:
            files += _with_images(data, event.files)
        elif event.files:
            if (data / event.swing).is_dir():
                files += _with_images(data, event.files)
                yield from self._unreadable(data, event.swing)
            elif event.swing not in self._swings:
                yield message(
                    "archive.swing-missing",
                    folder=printable(event.swing),
                    number=entry.number,
                )
            self._swings.add(event.swing)
        new = [file for file in files if file not in self._seen]
        self._seen.update(new)
        self.n_files += len(new)
        if new:
            with ThreadPoolExecutor() as executor:
                found = executor.map(partial(file_finding, data, entry.number), new)
                yield from filter(None, found)

    def _unreadable(self, data: Path, swing: str) -> Iterator[Message]:
        """Yield damage of a swing after the part that its entries cover."""
        if swing in self._swings:
            return
        try:
            open_record(data / swing)
        except FileError as error:
            yield error.message


def _with_images(data: Path, files: Iterable[FileHash]) -> Iterator[FileHash]:
    """Yield files, and after each journal the images that it names."""
    for file in files:
        yield file
        if Path(file.place).name == JOURNAL:
            yield from _images(data, file)


def _images(data: Path, journal: FileHash) -> Iterator[FileHash]:
    """Yield the images of all cameras that a journal named when it was entered."""
    path = data / journal.place
    try:
        content = journal_bytes(path.parent)[: journal.n_bytes]
        if sha256(content).hexdigest() != journal.sha256:
            return  # that is a separate finding
        lines = parse_lines(content.splitlines(), path.parent)
    except FileError:
        return
    folder = Path(journal.place).parent.as_posix()
    for line in lines:
        if isinstance(line, RecordedImage):
            digests = [line.sha256, *(other.sha256 for other in line.others)]
            for c, digest in enumerate(digests):
                yield FileHash(f"{folder}/{image_name(line.number, c)}", digest)


def file_finding(data: Path, number: int, file: FileHash) -> Message | None:
    """Return the differences between a file and its entry."""
    path = data / file.place
    if not path.exists():
        return message(
            "archive.vouched-missing", file=printable(file.place), number=number
        )
    try:
        if start_sha256(path, file.n_bytes) == file.sha256:
            return None
    except FileError as error:
        return error.message
    return message("archive.vouched-changed", file=printable(file.place), number=number)


BATCH = 200  # rows that are read at one time
SOUND = "ok"  # SQLite's word for a file without damage

Report = Callable[[float], None]


@dataclass(frozen=True)
class ArchiveCheckResult:
    """Result of a check."""

    n_entries: int
    n_files: int  # images included
    findings: tuple[Message, ...]
    notes: tuple[Message, ...] = ()  # prove no change, see `check_notes`


def check_archive(
    database: Database, data: Path | None = None, report: Report = lambda fraction: None
) -> ArchiveCheckResult:
    """Check every entry, record and file that an archive refers to.

    A given data folder is examined as well. ``report`` is called with the fraction
    done, 0 to 1; what it raises ends the check.
    """
    chains, home = chain_names(database), chain_at_home(database)
    ((n_entries,),) = database.rows(select(func.count()).select_from(ENTRIES))
    files = FilesCheck(data)
    stages = [_damage(database)]
    if data is not None:
        stages.append(_rolled_back(data))
    for chain in chains:
        if home in (None, chain):
            stages.append(_walked(database, chain, files, report, n_entries))
        else:
            stages.append(iter([message("archive.other-chain", chain=chain[:SHORT])]))
    stages += [_changed_records(database), _lost_records(database)]
    found = [each for stage in stages for each in _findings(stage)]
    findings = tuple(each for each in found if each.code != UNAPPROVED)
    notes = [each for each in found if each.code == UNAPPROVED]
    notes += [] if data is None else _findings(check_notes(database, data))
    return ArchiveCheckResult(n_entries, files.n_files, findings, tuple(notes))


def check_file(archive: Path, data: Path, report: Report) -> ArchiveCheckResult:
    """Check an archive in a file, and the files that it refers to; see `check_archive`.

    A file that a program began to write meanwhile counts as damaged only if a second
    check finds it so. Raises `ArchiveError` if the archive is missing or cannot be read
    at all.
    """
    while True:
        before = _last_written(archive)
        with closing(look_into(archive)) as database:
            checked = check_archive(database, data, report)
        if not checked.findings or before is None or before == _last_written(archive):
            return checked


def _last_written(archive: Path) -> int | None:
    """Return when a closed file was last written, ns; None if a program has it open."""
    if is_open(archive) or not archive.exists():
        return None
    return archive.stat().st_mtime_ns


def _findings(stage: Iterator[Message]) -> Iterator[Message]:
    """Yield the findings of a stage, and the error that ended it."""
    try:
        yield from stage
    except LightpenError as error:
        yield error.message


def _damage(database: Database) -> Iterator[Message]:
    """Yield what SQLite itself finds in its file."""
    if database.file is None:
        return
    for (found,) in database.rows(text("PRAGMA integrity_check(10)")):
        if found != SOUND:
            yield message("archive.file-damaged", file=database.name, what=str(found))


def _rolled_back(data: Path) -> Iterator[Message]:
    """Yield that the archive lacks what this user account remembers of the folder."""
    try:
        entered_files(data)
    except FileError as error:
        if error.message.code == ROLLED_BACK:  # the rest is found below
            yield error.message


def _walked(
    database: Database, chain: str, files: FilesCheck, report: Report, n_all: int
) -> Iterator[Message]:
    """Check a chain from its first entry to its last, and yield the findings.

    A key that nobody approved is among them. Entries added meanwhile are checked.
    """
    number, previous, keys = 0, NOTHING_BEFORE, ChainKeys(chain)
    while rows := _rows_after(database, chain, number):
        sound = []
        for row in rows:
            if not isinstance(row.number, int):  # SQLite also stores a text there
                yield _changed(chain, number + 1)
                return
            if row.number > number + 1:
                yield _missing(chain, number + 1, row.number - 1)
                previous = ""
            entry = sound_entry(row)
            if entry is None:
                yield _changed(chain, row.number)
            elif previous not in ("", entry.entry.previous):
                yield message(
                    "archive.entry-unchained", number=row.number, chain=chain[:SHORT]
                )
            else:
                sound.append(entry)
                unsigned = signature_finding(keys, entry)
                if unsigned is not None:
                    yield unsigned
            number, previous = row.number, row.sha256
        yield from files.findings(sound)
        report(min(1.0, number / n_all))


def _rows_after(database: Database, chain: str, number: int) -> Sequence[Row[Any]]:
    rows = (
        select(ENTRIES)
        .where(ENTRIES.c.chain == chain, ENTRIES.c.number > number)
        .order_by(ENTRIES.c.number)
        .limit(BATCH)
    )
    return database.rows(rows)


def _changed_records(database: Database) -> Iterator[Message]:
    n_read = 0  # not paged by hash, which may be damaged
    in_order = select(RECORDS).order_by(RECORDS.c.sha256).limit(BATCH)
    while True:
        found = database.rows(in_order.offset(n_read))
        for row in found:
            if not isinstance(row.text, str) or text_sha256(row.text) != row.sha256:
                name = searchable(str(row.sha256))
                yield message(
                    "archive.record-changed",
                    record=name[:SHORT],
                    entries=_entries_of(database, name),
                )
        if len(found) < BATCH:
            return
        n_read += BATCH


def _lost_records(database: Database) -> Iterator[Message]:
    """Yield entries without their record."""
    is_there = exists().where(RECORDS.c.sha256 == ENTRIES.c.record_sha256)
    lost = select(ENTRIES.c.chain, ENTRIES.c.number).where(
        ENTRIES.c.record_sha256 != "", ~is_there
    )
    for row in database.rows(lost):
        yield message("archive.record-lost", entry=named_entry(row.chain, row.number))


def _entries_of(database: Database, record: str) -> tuple[Message, ...]:
    vouching = select(ENTRIES.c.chain, ENTRIES.c.number).where(
        ENTRIES.c.record_sha256 == record
    )
    found = tuple(named_entry(row.chain, row.number) for row in database.rows(vouching))
    return found or (message("archive.no-entry"),)


def _changed(chain: str, number: int) -> Message:
    return message("archive.entry-changed", number=number, chain=chain[:SHORT])


def _missing(chain: str, first: int, last: int) -> Message:
    if first == last:
        return message("archive.entry-missing", number=first, chain=chain[:SHORT])
    return message(
        "archive.entries-missing", first=first, last=last, chain=chain[:SHORT]
    )
