"""Entries as a table for other programs."""

from collections.abc import Iterable, Iterator
from pathlib import Path

from lightpen.archive.chains.entries import StoredEntry
from lightpen.archive.history.queries import EntryFilter, newest
from lightpen.archive.store.database import Database
from lightpen.estimation.reports.verdict import AXES
from lightpen.formats.csv_cells import csv_table
from lightpen.formats.files import write_whole

COLUMNS = (
    *("since", "station", "operator", "kind", "outcome", "grade"),
    *("pen", "tip", "cone"),
    *(f"tip_{axis}_mm" for axis in AXES),
    *(f"expanded_uncertainty_{axis}_mm" for axis in AXES),
    *("reason", "chain", "number", "sha256"),
)
BATCH = 1000  # entries that are read at one time


def save_entries(database: Database, wanted: EntryFilter, path: Path) -> int:
    """Write the entries of a filter as a table, newest first; return their number."""
    entries = tuple(_all(database, wanted))
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
