"""Queries of an archive: entries by filters, the history of tips, what is due."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from datetime import datetime, timedelta
from enum import StrEnum
from pathlib import Path
from typing import Any

from sqlalchemy import (
    Column,
    ColumnElement,
    Exists,
    FromClause,
    Row,
    exists,
    func,
    select,
    true,
    tuple_,
)

from lightpen.archive.chains import (
    READ,
    Entry,
    Kind,
    StoredEntry,
    read_entries,
    searchable,
    since_us,
    sound_entry,
)
from lightpen.archive.store import ENTRIES, Database
from lightpen.estimation.reports.verdict import AXES
from lightpen.formats.files import write_whole
from lightpen.formats.spreadsheets import csv_table
from lightpen.model.limits import DueRule
from lightpen.model.names import folded_name
from lightpen.record.library.tip_library import Library

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
        back.c.kind == Kind.REVOKED.value,
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


class TipState(StrEnum):
    """Later state of an accepted tip."""

    NONE = ""
    IN_FORCE = "in force"
    REPLACED = "replaced"
    REVOKED = "revoked"


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
            revoked(ENTRIES).label("is_revoked"),
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
        state = TipState.REVOKED if row.is_revoked else state
    return Line(row.chain, row.number, entry, state)


EMPTY = Library()
CLOCKS_AGREE = timedelta(days=1)  # enough for an age in days


@dataclass(frozen=True)
class DueTip:
    """A current tip."""

    entry: StoredEntry  # of the acceptance
    calibrated: datetime
    due: datetime

    def is_due(self, now: datetime) -> bool:
        """Return whether it needs calibration before it is used.

        So it is where its age is not known: its day is still to come, by a clock that
        was set back, or was ahead then.
        """
        is_to_come = self.calibrated > now + CLOCKS_AGREE
        return now > self.due or is_to_come


def due_tips(
    database: Database, chain: str, rule: DueRule, library: Library = EMPTY
) -> tuple[DueTip, ...]:
    """Return the current tips of real pens at a station, the first due first.

    ``chain`` belongs to the data folder in which the tips are current. The station's
    rule is for tips without their own in the library; retired tips are omitted.
    """
    found = (
        last_accepted(database, pen, tip, chain=chain)
        for pen, tip in known_names(database).tips
        if pen and tip and not library.has_retired(tip)
    )
    tips = (_due_tip(entry, rule, library) for entry in found if entry is not None)
    return tuple(sorted(tips, key=lambda tip: tip.due))


def _due_tip(entry: StoredEntry, usual: DueRule, library: Library) -> DueTip:
    calibrated = entry.entry.event.at
    rule = library.rule_of(entry.entry.event.names.tip, usual)
    return DueTip(entry, calibrated, rule.due(calibrated))


Report = Callable[[float], None]


COLUMNS = (
    *("since", "station", "operator", "kind", "outcome", "grade"),
    *("pen", "tip", "cone"),
    *(f"tip_{axis}_mm" for axis in AXES),
    *(f"expanded_uncertainty_{axis}_mm" for axis in AXES),
    *("reason", "chain", "number", "sha256"),
)
BATCH = 1000  # entries that are read at one time


def save_entries(
    database: Database,
    wanted: EntryFilter,
    path: Path,
    report: Report = lambda fraction: None,
) -> int:
    """Write the entries of a filter as a table, newest first; return their number.

    ``report`` is called with the fraction done, 0 to 1; what it raises ends the work.
    """
    n_all, entries = n_wanted(database, wanted), []
    for entry in _all(database, wanted):
        entries.append(entry)
        report(min(1.0, len(entries) / max(n_all, 1)))
    write_whole(path, entries_csv(entries).encode("utf-8", "backslashreplace"))
    return len(entries)


def entries_csv(entries: Iterable[StoredEntry]) -> str:
    """Return entries as a table."""
    return csv_table([COLUMNS, *map(_row, entries)])


def _all(database: Database, wanted: EntryFilter) -> Iterator[StoredEntry]:
    last = None
    while batch := newest(database, wanted, BATCH, last):
        yield from batch
        last = batch[-1].entry


def _row(entry: StoredEntry) -> list[object]:
    event, nothing = entry.entry.event, ("", "", "")
    names = event.names
    return [
        *(event.at.isoformat(), names.station, names.operator, event.kind.value),
        event.outcome or "",
        *(event.grade, names.pen, names.tip, names.cone),
        *(event.tip_pen_mm or nothing),
        *(event.expanded_uncertainty_mm or nothing),
        *(event.reason, entry.entry.chain, entry.entry.number, entry.sha256),
    ]
