"""Check of an archive for changes: its rows, chains and records."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sqlalchemy import Row, exists, func, select, text

from lightpen.archive.chains.chains import chain_at_home, chain_names
from lightpen.archive.chains.entries import SHORT, named_entry, text_sha256
from lightpen.archive.chains.rows import searchable, sound_entry
from lightpen.archive.chains.signatures import signature_finding
from lightpen.archive.checks.check_notes import check_notes
from lightpen.archive.checks.files_check import FilesCheck
from lightpen.archive.store.database import Database, is_open, look_into
from lightpen.archive.store.tables import ENTRIES, RECORDS
from lightpen.errors import FileError, LightpenError
from lightpen.messages import Message, message
from lightpen.record.library.entered_files import (
    NOTHING_BEFORE,
    ROLLED_BACK,
    entered_files,
)
from lightpen.record.library.signing.chain_keys import UNAPPROVED, ChainKeys

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
