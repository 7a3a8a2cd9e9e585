"""Check of an archive for changes: its rows, chains and records."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sqlalchemy import Row, exists, select, text

from lightpen.archive.chains.chains import chain_at_home, heads
from lightpen.archive.chains.entries import SHORT, ChainHead, named_entry, text_sha256
from lightpen.archive.chains.rows import searchable, sound_entry
from lightpen.archive.chains.signatures import signature_finding
from lightpen.archive.checks.check_notes import check_notes
from lightpen.archive.checks.files_check import FilesCheck
from lightpen.archive.store.database import Database, is_open, look_into
from lightpen.archive.store.tables import CHAINS, ENTRIES, RECORDS
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
    ends, home = heads(database), chain_at_home(database)
    n_all = max(1, sum(head.number for head in ends))
    files = FilesCheck(data)
    stages = [_damage(database)]
    if data is not None:
        stages.append(_rolled_back(data))
    n_before = 0
    for head in ends:
        start, share = n_before / n_all, head.number / n_all

        def part(fraction: float, start: float = start, share: float = share) -> None:
            report(start + share * fraction)

        own = files if head.chain == home else None
        stages.append(_walked(database, head, own, part))
        n_before += head.number
    stages += [_strays(database), _changed_records(database), _lost_records(database)]
    findings = tuple(each for stage in stages for each in _findings(stage))
    notes = () if data is None else tuple(_findings(check_notes(database, data)))
    return ArchiveCheckResult(n_before, files.n_files, findings, notes)


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
    database: Database, head: ChainHead, files: FilesCheck | None, report: Report
) -> Iterator[Message]:
    """Check a chain from its first entry to its last, and yield the findings.

    Entries added meanwhile are checked as well.
    """
    number, previous, keys = 0, NOTHING_BEFORE, ChainKeys(head.chain)
    while True:
        rows = _rows_after(database, head.chain, number)
        if not rows:
            # The present state, or the last one of a lost chain.
            head = next((h for h in heads(database) if h.chain == head.chain), head)
            if number >= head.number or not _rows_after(database, head.chain, number):
                break
        sound = []
        for row in rows:
            if not isinstance(row.number, int):  # SQLite also stores a text there
                yield _changed(head.chain, number + 1)
                return
            if row.number > number + 1:
                yield _missing(head.chain, number + 1, row.number - 1)
                previous = ""
            entry = sound_entry(row)
            if entry is None:
                yield _changed(head.chain, row.number)
            elif previous not in ("", entry.entry.previous):
                yield message(
                    "archive.entry-unchained",
                    number=row.number,
                    chain=head.chain[:SHORT],
                )
            else:
                sound.append(entry)
                unsigned = signature_finding(keys, entry)
                if unsigned is not None and unsigned.code != UNAPPROVED:
                    yield unsigned
            number, previous = row.number, row.sha256
        if files is not None:
            yield from files.findings(sound)
        report(min(1.0, number / max(1, head.number)))
    if number < head.number:
        yield _missing(head.chain, number + 1, head.number)
    elif (number, previous) != (head.number, head.sha256) and previous:
        yield message("archive.head-changed", chain=head.chain[:SHORT])


def _rows_after(database: Database, chain: str, number: int) -> Sequence[Row[Any]]:
    rows = (
        select(ENTRIES)
        .where(ENTRIES.c.chain == chain, ENTRIES.c.number > number)
        .order_by(ENTRIES.c.number)
        .limit(BATCH)
    )
    return database.rows(rows)


def _strays(database: Database) -> Iterator[Message]:
    """Yield the entries of a file that belong to no chain."""
    if database.file is None:  # where a foreign key prevents it
        return
    known = select(CHAINS.c.chain)
    strays = select(ENTRIES.c.chain).where(ENTRIES.c.chain.not_in(known)).distinct()
    for (chain,) in database.rows(strays):
        yield message("archive.no-such-chain", chain=str(chain)[:SHORT])


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
