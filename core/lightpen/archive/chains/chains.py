"""The chain of a file, and those of a server, with their entries."""

from collections.abc import Iterator, Sequence
from datetime import timedelta
from typing import Any

from sqlalchemy import Connection, Select, func, select, tuple_, update

from lightpen.archive.chains.entries import EPOCH, ChainHead, Kind, StoredEntry
from lightpen.archive.chains.rows import READ, read_entries, read_row, searchable
from lightpen.archive.store.database import Database
from lightpen.archive.store.tables import CHAINS, ENTRIES, RECORDS
from lightpen.record.library.signing.chain_keys import key_in

AT_HOME = select(CHAINS.c.chain)
BATCH = 200  # entries that are copied in one transaction


def chain_at_home(database: Database) -> str | None:
    """Return the chain of a file, if it has begun; None of a server."""
    if database.file is None:
        return None
    with database.reading() as connection:
        return connection.execute(AT_HOME).scalar_one_or_none()


def heads(database: Database) -> tuple[ChainHead, ...]:
    """Return the head of each chain."""
    if database.file is None:
        place = tuple_(ENTRIES.c.chain, ENTRIES.c.number)
        ends = select(ENTRIES.c.chain, func.max(ENTRIES.c.number))
        found = (
            select(ENTRIES.c.chain, ENTRIES.c.number, ENTRIES.c.sha256)
            .where(place.in_(ends.group_by(ENTRIES.c.chain)))
            .order_by(ENTRIES.c.chain)
        )
    else:
        found = select(CHAINS)
    return tuple(
        ChainHead(row.chain, row.number, row.sha256) for row in database.rows(found)
    )


def chain_head(database: Database, chain: str) -> ChainHead:
    """Return the last entry of a chain as the entries have it."""
    with database.reading() as connection:
        return head_in(connection, chain)


def delivered_number(database: Database, chain: str) -> int:
    """Return the number of the last entry of a chain delivered to a server."""
    wanted = select(CHAINS.c.delivered).where(CHAINS.c.chain == chain)
    with database.reading() as connection:
        return connection.execute(wanted).scalar_one_or_none() or 0


def note_delivered(database: Database, chain: str, number: int) -> None:
    """Note the number of the last entry of a chain that a server has."""
    noted = update(CHAINS).where(CHAINS.c.chain == chain, CHAINS.c.delivered != number)
    with database.writing() as connection:
        connection.execute(noted.values(delivered=number))


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


def entries_of_limits(database: Database, chain: str) -> tuple[StoredEntry, ...]:
    """Return the entries of limits of a chain, the oldest first."""
    return read_entries(database, of_limits(chain))


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
