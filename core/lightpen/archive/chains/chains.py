"""The chain of a file, and those of a server, with their entries."""

from collections.abc import Iterator, Sequence
from datetime import timedelta
from typing import Any

from sqlalchemy import Connection, Select, func, select

from lightpen.archive.chains.entries import EPOCH, ChainHead, Kind, StoredEntry
from lightpen.archive.chains.rows import READ, read_entries, read_row, searchable
from lightpen.archive.store.database import Database
from lightpen.archive.store.tables import ENTRIES, RECORDS
from lightpen.errors import ArchiveError, FileError
from lightpen.record.library.signing.chain_keys import key_in
from lightpen.record.library.signing.station import known_station_name

BATCH = 200  # entries that are copied in one transaction


def chain_at_home(database: Database) -> str | None:
    """Return the chain of a file, if it has begun; None of a server."""
    if database.file is None:
        return None
    with database.reading() as connection:
        chain = chain_in(connection)
    try:
        return chain or known_station_name(database.file.parent) or None
    except FileError as error:
        raise ArchiveError(error.message) from error


def chain_in(connection: Connection) -> str | None:
    """Return the chain of the entries in a file; None if it has none."""
    found = connection.execute(select(func.min(ENTRIES.c.chain))).scalar_one()
    return found if isinstance(found, str) else None


def chain_names(database: Database) -> tuple[str, ...]:
    """Return the names of all chains that have an entry."""
    wanted = select(ENTRIES.c.chain).distinct().order_by(ENTRIES.c.chain)
    return tuple(str(chain) for (chain,) in database.rows(wanted))


def chain_head(database: Database, chain: str) -> ChainHead:
    """Return the last entry of a chain as the entries have it."""
    with database.reading() as connection:
        return head_in(connection, chain)


def hash_in(connection: Connection, chain: str, number: int) -> str | None:
    """Return the SHA-256 of the entry of a number; None if there is none."""
    wanted = select(ENTRIES.c.sha256).where(
        ENTRIES.c.chain == chain, ENTRIES.c.number == number
    )
    return connection.execute(wanted).scalar_one_or_none()


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


def entry_of_result(database: Database, chain: str, place: str) -> StoredEntry | None:
    """Return the entry of the result file at a place, if there is one."""
    wanted = select(*READ).where(
        ENTRIES.c.chain == chain, ENTRIES.c.result == searchable(place)
    )
    with database.reading() as connection:
        row = connection.execute(wanted).one_or_none()
    return None if row is None else read_row(database, row)


def is_swing_entered(database: Database, chain: str, place: str) -> bool:
    """Return whether a swing was entered; if its result was revoked, it was not."""
    last = (
        select(ENTRIES.c.kind)
        .where(ENTRIES.c.chain == chain, ENTRIES.c.swing == searchable(place))
        .order_by(ENTRIES.c.number.desc())
        .limit(1)
    )
    with database.reading() as connection:
        kind = connection.execute(last).scalar_one_or_none()
    return kind not in (None, Kind.TAKEN_BACK.value)


def head_in(connection: Connection, chain: str) -> ChainHead:
    """Return the last entry of a chain as the entries have it."""
    last = (
        select(
            ENTRIES.c.number, ENTRIES.c.sha256, ENTRIES.c.since_us, ENTRIES.c.signature
        )
        .where(ENTRIES.c.chain == chain)
        .order_by(ENTRIES.c.number.desc())
        .limit(1)
    )
    row = connection.execute(last).one_or_none()
    if row is None:
        return ChainHead(chain)
    since = EPOCH + timedelta(microseconds=row.since_us)
    return ChainHead(chain, row.number, row.sha256, since, key_in(row.signature))


def of_limits(chain: str) -> Select[Any]:
    """Return the query for the entries of limits of a chain, the oldest first."""
    return (
        select(*READ)
        .where(ENTRIES.c.chain == chain, ENTRIES.c.kind == Kind.LIMITS.value)
        .order_by(ENTRIES.c.number)
    )
