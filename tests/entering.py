"""Entering what a test wrote in the archive of its data folder."""

from contextlib import closing
from datetime import datetime
from hashlib import sha256
from pathlib import Path

from msgspec import structs
from sqlalchemy import select

from lightpen.archive.chains import READ, StoredEntry, read_entries
from lightpen.archive.logbook import Logbook
from lightpen.archive.store import ENTRIES, RECORDS, Database
from lightpen.record.library.library_changes import Author, change_item
from lightpen.record.library.signing import (
    OwedFile,
    forget_owed,
    owe,
    owed_files,
    station_name,
)
from lightpen.record.library.tip_library import ItemKind, Library, read_library


def enter_in(data: Path) -> None:
    """Enter everything that is owed, as a start of the program does."""
    with closing(Logbook(data)) as logbook:
        assert logbook.enter_owed() == ()


def entries_of(database: Database, chain: str) -> tuple[StoredEntry, ...]:
    """Return the entries of a chain, in their order."""
    wanted = select(*READ).where(ENTRIES.c.chain == chain).order_by(ENTRIES.c.number)
    return read_entries(database, wanted)


def records_in(database: Database) -> dict[str, str]:
    """Return all records of an archive, by their hash."""
    return {row.sha256: row.text for row in database.rows(select(RECORDS))}


def put_in(data: Path, file: Path, content: bytes) -> None:
    """Put a file in a data folder as if the program had written it."""
    place = file.absolute().relative_to(data.absolute()).as_posix()
    for each in owed_files(station_name(data)):
        if each.place == place:
            forget_owed(station_name(data), each)
    owe(station_name(data), OwedFile(place, sha256(content).hexdigest()))
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(content)


def retire_item(
    data: Path,
    kind: ItemKind,
    name: str,
    by: Author,
    now: datetime,
    *,
    is_retired: bool = True,
) -> Library:
    """Retire an item of the library, or bring it back; see `add_item`."""
    item = read_library(data).items(kind)[name]
    retired = structs.replace(item, is_retired=is_retired)
    return change_item(data, retired, by, now, before=item)
