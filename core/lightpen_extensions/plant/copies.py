"""Copies of chains: how they grow by entries from elsewhere.

Copies that differ from what is there are refused.
"""

import socket
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Timer
from typing import Any

from sqlalchemy import (
    Column,
    Connection,
    FetchedValue,
    MetaData,
    Select,
    String,
    Table,
    Text,
    func,
    insert,
    select,
)

from lightpen.archive.chains import (
    READ,
    SHORT,
    ChainHead,
    Kind,
    StoredEntry,
    chain_in,
    head_in,
    keep_records,
    named_entry,
    put_entries,
    read_entries,
    read_entry,
    signature_finding,
    text_sha256,
)
from lightpen.archive.store import ENTRIES, RECORDS, Database
from lightpen.errors import ArchiveError, NameTakenError
from lightpen.formats.files import create_whole
from lightpen.formats.own_json import DamagedError
from lightpen.messages import Message, message
from lightpen.record.library.entered_files import MISSING, make_folder
from lightpen.record.library.signing import UNAPPROVED, ChainKeys, remember_head

CHAIN_WRITERS = Table(  # of a server
    "archive_writers",
    MetaData(),
    Column("chain", String(32), primary_key=True),
    Column("writer", Text, nullable=False, server_default=FetchedValue()),  # its role
)

# A proxy may keep a connection open whose other end is gone.
LONGEST_ANSWER_S = 120.0


@contextmanager
def given_up_in_time(connection: Connection) -> Iterator[None]:
    """Close the connection to a server that does not answer in time."""
    line = connection.connection.dbapi_connection
    assert line is not None
    with socket.fromfd(line.fileno(), socket.AF_INET, socket.SOCK_STREAM) as end:
        watch = Timer(LONGEST_ANSWER_S, _shut_down, (end,))
        watch.daemon = True
        watch.start()
        try:
            yield
        finally:
            watch.cancel()
            watch.join()


def _shut_down(end: socket.socket) -> None:
    with suppress(OSError):  # it is closed already
        end.shutdown(socket.SHUT_RDWR)


BATCH = 200  # entries that are copied in one transaction


def entries_of(database: Database, chain: str) -> Iterator[StoredEntry]:
    """Yield the entries of a chain, in their order."""
    after = 0
    while True:
        batch = batch_of(database, chain, after)
        yield from batch
        if len(batch) < BATCH:
            return
        after = batch[-1].entry.number


def batch_of(database: Database, chain: str, after: int) -> tuple[StoredEntry, ...]:
    """Return the next few entries of a chain, as `entries_of`."""
    wanted = (
        select(*READ)
        .where(ENTRIES.c.chain == chain, ENTRIES.c.number > after)
        .order_by(ENTRIES.c.number)
        .limit(BATCH)
    )
    return read_entries(database, wanted)


def records_of(database: Database, entries: Sequence[StoredEntry]) -> dict[str, str]:
    """Return the records that entries refer to, by their hash."""
    names = [each.entry.event.record_sha256 for each in entries]
    wanted = select(RECORDS).where(RECORDS.c.sha256.in_([n for n in names if n]))
    rows = database.rows(wanted)
    return {row.sha256: row.text for row in rows if isinstance(row.text, str)}


def copy_entries(
    database: Database,
    chain: str,
    entries: Iterable[StoredEntry],
    records: Mapping[str, str],
) -> int:
    """Let a chain grow by entries from elsewhere, in their order; return how many.

    It is the copy on a server, or the own chain in a file that lost them. Those that
    are there are passed. Raises `ArchiveError` if they do not continue the chain, or
    are not signed by its station.
    """
    with database.writing() as connection:
        if database.file is None:
            _begin_on_server(connection, chain)
        head = head_in(connection, chain)
        new = [each for each in entries if each.entry.number > head.number]
        if new and database.file and chain_in(connection) not in (None, chain):
            raise ArchiveError(_forked(new[0]))
        _require_next(head, new)
        if new:
            _require_signed(connection, chain, new)
        keep_records(connection, _named(new, records))
        put_entries(connection, new)
    if new and database.file:
        remember_head(chain, new[-1].entry.number, new[-1].sha256)
    return len(new)


def _begin_on_server(connection: Connection, chain: str) -> None:
    """Begin a copy that is not there; no other program writes to it meanwhile."""
    connection.execute(select(func.pg_advisory_xact_lock(int(chain[:15], 16))))
    known = select(CHAIN_WRITERS.c.chain).where(CHAIN_WRITERS.c.chain == chain)
    if connection.execute(known).first() is None:
        connection.execute(insert(CHAIN_WRITERS).values(chain=chain))


def _require_next(head: ChainHead, new: list[StoredEntry]) -> None:
    number, sha256 = head.number, head.sha256
    for each in new:
        if (each.entry.number, each.entry.previous) != (number + 1, sha256):
            raise ArchiveError(_forked(each))
        number, sha256 = each.entry.number, each.sha256


def _require_signed(
    connection: Connection, chain: str, new: Iterable[StoredEntry]
) -> None:
    limits = connection.execute(of_limits(chain))
    try:
        before = [read_entry(row.text, row.signature) for row in limits]
    except DamagedError as error:
        raise ArchiveError("archive.copy-damaged", chain=chain[:SHORT]) from error
    keys = ChainKeys(chain)
    for each in before:
        signature_finding(keys, each)
    for each in new:
        finding = signature_finding(keys, each)
        if finding is not None and finding.code != UNAPPROVED:
            raise ArchiveError(finding)


def _named(
    entries: Sequence[StoredEntry], records: Mapping[str, str]
) -> dict[str, str]:
    """Return the records that entries refer to, after reading each."""
    named = {}
    for each in entries:
        wanted = each.entry.event.record_sha256
        if wanted is None:
            continue
        text = records.get(wanted)
        if text is None or text_sha256(text) != wanted:
            raise ArchiveError("archive.record-missing", entry=_named_entry(each))
        named[wanted] = text
    return named


def _forked(entry: StoredEntry) -> Message:
    return message("archive.forked", entry=_named_entry(entry))


def _named_entry(entry: StoredEntry) -> Message:
    place = entry.entry
    return named_entry(place.chain, place.number, place.event.names.station)


def reserve_number(lost: Path) -> None:
    """Reserve the number of a lost file."""
    make_folder(lost.parent)
    with suppress(NameTakenError):
        create_whole(lost.with_suffix(MISSING), b"")


def of_limits(chain: str) -> Select[Any]:
    """Return the query for the entries of limits of a chain, the oldest first."""
    return (
        select(*READ)
        .where(ENTRIES.c.chain == chain, ENTRIES.c.kind == Kind.LIMITS.value)
        .order_by(ENTRIES.c.number)
    )
