"""The history of the archive: one line for each entry, with its later events."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from sqlalchemy import Row, select

from lightpen.archive.chains.entries import Kind, StoredEntry
from lightpen.archive.chains.rows import READ, read_entries, sound_entry
from lightpen.archive.history.queries import (
    IN_ORDER,
    EntryFilter,
    condition_of,
    replaced,
    revoked,
)
from lightpen.archive.store.database import Database
from lightpen.archive.store.tables import ENTRIES


class TipState(StrEnum):
    """Later state of an accepted tip."""

    NONE = ""
    IN_FORCE = "in force"
    REPLACED = "replaced"
    TAKEN_BACK = "taken back"


@dataclass(frozen=True)
class Line:
    """An entry and its later events."""

    chain: str
    number: int
    entry: StoredEntry | None  # None if it was changed
    state: TipState = TipState.NONE


@dataclass(frozen=True)
class KnownNames:
    """Pairs of pen and tip, and stations, to filter entries by."""

    tips: tuple[tuple[str, str], ...] = ()
    stations: tuple[str, ...] = ()

    @property
    def pens(self) -> tuple[str, ...]:
        """The pens, each once."""
        return tuple(dict.fromkeys(pen for pen, _ in self.tips if pen))

    def tips_of(self, pen: str) -> tuple[str, ...]:
        """Return the tips of a pen; of all if it is empty."""
        tips = (tip for each, tip in self.tips if tip and pen in ("", each))
        return tuple(dict.fromkeys(tips))


def lines(
    database: Database, wanted: EntryFilter, first: int, n_lines: int
) -> tuple[Line, ...]:
    """Return a page of entries that match a filter, less the ``first`` newest."""
    newest_first = [column.desc() for column in IN_ORDER]
    places = (
        select(ENTRIES.c.chain, ENTRIES.c.number)
        .where(condition_of(database, wanted))
        .order_by(*newest_first)
        .offset(first)
        .limit(n_lines)
        .subquery()
    )
    found = (
        select(
            ENTRIES,
            revoked(ENTRIES).label("is_taken_back"),
            replaced(ENTRIES).label("is_replaced"),
        )
        .join(
            places,
            (ENTRIES.c.chain == places.c.chain) & (ENTRIES.c.number == places.c.number),
        )
        .order_by(*newest_first)
    )
    return tuple(map(_line, database.rows(found)))


def messages_on(database: Database, entry: StoredEntry) -> tuple[StoredEntry, ...]:
    """Return the entries on an entry: comments, revocation."""
    found = select(*READ).where(ENTRIES.c.concerns == entry.sha256).order_by(*IN_ORDER)
    return read_entries(database, found)


def known_names(database: Database) -> KnownNames:
    """Return the pens, tips and stations of all entries, in alphabetical order."""
    columns = (ENTRIES.c.pen, ENTRIES.c.tip)
    with database.reading() as connection:
        tips = connection.execute(select(*columns).distinct()).all()
        found = connection.execute(select(ENTRIES.c.station).distinct()).scalars()
        stations = tuple(sorted(filter(None, found)))
        return KnownNames(tuple(sorted((row.pen, row.tip) for row in tips)), stations)


def _line(row: Row[Any]) -> Line:
    entry = sound_entry(row)
    state = TipState.NONE
    if entry is not None and entry.entry.event.kind is Kind.ACCEPTED:
        state = TipState.REPLACED if row.is_replaced else TipState.IN_FORCE
        state = TipState.TAKEN_BACK if row.is_taken_back else state
    return Line(row.chain, row.number, entry, state)
