"""Entries as rows of the tables."""

from typing import Any

from sqlalchemy import Column, Row, Select

from lightpen.archive.chains.entries import StoredEntry, read_entry, since_us
from lightpen.archive.store.database import Database
from lightpen.archive.store.tables import ENTRIES
from lightpen.errors import ArchiveError
from lightpen.formats.own_json import DamagedError

# Of an entry to read.
READ: tuple[Column[Any], ...] = (
    *(ENTRIES.c.chain, ENTRIES.c.number, ENTRIES.c.sha256),
    *(ENTRIES.c.text, ENTRIES.c.signature),
)


def columns_of(entry: StoredEntry) -> dict[str, Any]:
    """Return the row of an entry."""
    event, names = entry.entry.event, entry.entry.event.names
    return {
        "chain": entry.entry.chain,
        "number": entry.entry.number,
        "sha256": entry.sha256,
        "since_us": since_us(entry.entry.since),
        "kind": event.kind.value,
        "station": searchable(names.station),
        "pen": searchable(names.pen),
        "tip": searchable(names.tip),
        "is_simulated": event.is_simulated,
        "swing": searchable(event.swing),
        "result": "" if event.result is None else searchable(event.result.place),
        "concerns": event.concerns or "",
        "record_sha256": event.record_sha256 or "",
        "text": entry.text,
        "at_us": since_us(event.at),
        "signature": entry.signature,
    }


def sound_entry(row: Row[Any]) -> StoredEntry | None:
    """Return the entry in a row with all columns, unless anything in it was changed."""
    columns = {column.name: row._mapping[column] for column in ENTRIES.c}
    try:
        entry = read_entry(columns["text"], columns["signature"])
    except DamagedError:
        return None
    return entry if columns_of(entry) == columns else None


def searchable(text: str) -> str:
    """Return a text as every database can hold it."""
    return text.encode("utf-8", "backslashreplace").decode().replace("\0", "\\x00")


def read_entries(database: Database, wanted: Select[Any]) -> tuple[StoredEntry, ...]:
    """Return the entries that a query for the columns `READ` finds."""
    return tuple(read_row(database, row) for row in database.rows(wanted))


def read_row(database: Database, row: Row[Any]) -> StoredEntry:
    """Return the entry in a row with the columns `READ`; refuse a changed one."""
    damaged = ArchiveError(
        "archive.entry-damaged", number=row.number, archive=database.name
    )
    try:
        entry = read_entry(row.text, row.signature)
    except DamagedError as error:
        raise damaged from error
    stated = (entry.entry.chain, entry.entry.number, entry.sha256)
    if stated != (row.chain, row.number, row.sha256):
        raise damaged
    return entry
