"""Queries of an archive: the entries of a pen, a station or a period."""

from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import (
    Column,
    ColumnElement,
    Exists,
    FromClause,
    exists,
    func,
    select,
    true,
    tuple_,
)

from lightpen.archive.chains.entries import Entry, Kind, StoredEntry, since_us
from lightpen.archive.chains.rows import READ, read_entries, searchable
from lightpen.archive.store.database import Database
from lightpen.archive.store.tables import ENTRIES
from lightpen.model.names import folded_name

IN_ORDER = (ENTRIES.c.since_us, ENTRIES.c.chain, ENTRIES.c.number)


@dataclass(frozen=True)
class EntryFilter:
    """Filter for entries; an empty or None field matches all."""

    pen: str = ""
    tip: str = ""
    station: str = ""
    kinds: tuple[Kind, ...] = ()
    begin: datetime | None = None  # by the clock of the entry
    end: datetime | None = None  # before that time
    is_simulated: bool | None = None


def n_wanted(database: Database, wanted: EntryFilter) -> int:
    """Return the number of matching entries."""
    condition = condition_of(database, wanted)
    count = select(func.count()).select_from(ENTRIES).where(condition)
    with database.reading() as connection:
        return connection.execute(count).scalar_one()


def newest(
    database: Database, wanted: EntryFilter, n_entries: int, before: Entry | None = None
) -> tuple[StoredEntry, ...]:
    """Return a page of the entries that match a filter, the newest first.

    ``before`` is the last of those that were returned before.
    """
    condition = condition_of(database, wanted)
    if before is not None:
        place = (since_us(before.since), before.chain, before.number)
        condition &= tuple_(*IN_ORDER) < place
    found = (
        select(*READ)
        .where(condition)
        .order_by(*(column.desc() for column in IN_ORDER))
        .limit(n_entries)
    )
    return read_entries(database, found)


def _is_named(
    database: Database, column: Column[str], name: str
) -> ColumnElement[bool]:
    """Return the condition that a name is in a column, however it was typed."""
    folded = folded_name(searchable(name))
    found = (typed for (typed,) in database.rows(select(column).distinct()))
    return column.in_([each for each in found if folded_name(str(each)) == folded])


def last_accepted(
    database: Database,
    pen: str,
    tip: str,
    *,
    is_simulated: bool = False,
    chain: str | None = None,
) -> StoredEntry | None:
    """Return the last acceptance of a pen and tip that was not revoked.

    The names are as the entry has them: every acceptance spells them as the one before.
    The current result of a station is in its result files.
    """
    condition = (
        (ENTRIES.c.pen == searchable(pen))
        & (ENTRIES.c.tip == searchable(tip))
        & (ENTRIES.c.is_simulated == is_simulated)
        & (ENTRIES.c.kind == Kind.ACCEPTED.value)
        & ~revoked(ENTRIES)
    )
    if chain is not None:
        condition &= of_chain(chain)
    found = select(*READ).where(condition).order_by(ENTRIES.c.since_us.desc()).limit(1)
    return next(iter(read_entries(database, found)), None)


def of_chain(chain: str) -> ColumnElement[bool]:
    """Return a condition on the chain, for rare entries.

    No index of chains is used for it: most entries are of one.
    """
    return func.coalesce(ENTRIES.c.chain, "") == chain


def revoked(entries: FromClause) -> Exists:
    """Return the condition that an entry was revoked since."""
    back = ENTRIES.alias()
    return exists().where(
        back.c.concerns == entries.c.sha256,
        back.c.kind == Kind.TAKEN_BACK.value,
        func.coalesce(back.c.chain, "") == entries.c.chain,  # by the index of concerns
    )


def replaced(entries: FromClause) -> Exists:
    """Return the condition that a later tip came into force in the same chain."""
    later = ENTRIES.alias()
    return exists().where(
        later.c.pen == entries.c.pen,
        later.c.tip == entries.c.tip,
        later.c.is_simulated == entries.c.is_simulated,
        later.c.kind == Kind.ACCEPTED.value,
        later.c.since_us > entries.c.since_us,
        later.c.chain == entries.c.chain,
        ~revoked(later),
    )


def condition_of(database: Database, wanted: EntryFilter) -> ColumnElement[bool]:
    """Return the SQL condition of an entry filter."""
    condition: ColumnElement[bool] = true()
    names = {"pen": wanted.pen, "tip": wanted.tip, "station": wanted.station}
    for column, name in names.items():
        if name:
            condition &= _is_named(database, ENTRIES.c[column], name)
    if wanted.kinds:
        condition &= ENTRIES.c.kind.in_([kind.value for kind in wanted.kinds])
    if wanted.is_simulated is not None:
        condition &= ENTRIES.c.is_simulated == wanted.is_simulated
    if wanted.begin is not None:
        condition &= ENTRIES.c.at_us >= since_us(wanted.begin)
    if wanted.end is not None:
        condition &= ENTRIES.c.at_us < since_us(wanted.end)
    return condition
