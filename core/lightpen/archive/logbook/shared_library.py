"""The library of all stations: the newest change of each item counts everywhere.

Each change of a library is an entry with its file as the record. A station reads those
of the others from the server, which shows them to every station. A change that is newer
than its own change of the same item is taken over as a change of its own library, with
the time, station and operator of the original: so it travels no further than once, and
both stay in the archives.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

from msgspec import structs
from sqlalchemy import text

from lightpen.archive.chains.chains import chain_at_home
from lightpen.archive.chains.entries import StoredEntry, read_entry, text_sha256
from lightpen.archive.chains.signatures import signature_finding
from lightpen.archive.store.database import Database
from lightpen.formats.own_json import DamagedError
from lightpen.local_time import local_time
from lightpen.messages import Message, message, printable
from lightpen.record.library.library_changes import adopt_change
from lightpen.record.library.signing.chain_keys import ChainKeys
from lightpen.record.library.supervision import Signature
from lightpen.record.library.tip_library import (
    KIND_WORDS,
    AnyItem,
    ItemKind,
    LibraryChange,
    ListedTip,
    library_changes,
    parse_change,
)

CLOCKS_AGREE = timedelta(minutes=10)

_SHARED = text(  # see `lightpen.archive.replication.server_setup`
    "SELECT chain, number, sha256, text, signature, record FROM archive_library"
    " ORDER BY chain, number"
)


@dataclass(frozen=True)
class TakenOver:
    """A change of another station that counts here, and the one that counted before."""

    change: LibraryChange
    replaced: LibraryChange | None

    @property
    def message(self) -> Message:
        """Whose change counts now, and whose it replaces."""
        item, before = self.change.item, self.replaced
        kind, item_id = KIND_WORDS[item.kind], printable(item.id)
        by = _author_of(self.change)
        if item.is_retired:
            return message("library.shared-retired", kind=kind, id=item_id, by=by)
        if before is None:
            return message("library.shared", kind=kind, id=item_id, by=by)
        return message(
            "library.shared-replacing",
            kind=kind,
            id=item_id,
            by=by,
            before=_author_of(before),
        )


def newer_elsewhere(
    data: Path, database: Database, now: datetime, server: Database
) -> tuple[TakenOver, ...]:
    """Return the changes of other stations that are newer than those of this one.

    The database is the archive of the data folder, the server that of the plant. A
    change dated later than ``now``, by a clock that is
    ahead, does not count.
    """
    home = chain_at_home(database)
    newest = _newest(
        change
        for entry, change in _on_server(server)
        if entry.entry.chain != home and change.at <= now + CLOCKS_AGREE
    )
    own = _newest(change for _, change in library_changes(data))
    newer = []
    for key, change in newest.items():
        before = own.get(key)
        if before is not None and before.at >= change.at:
            continue
        change = structs.replace(change, item=_without_picture(change.item, data))
        if before is None or before.item != change.item:
            newer.append(TakenOver(change, before))
    return tuple(newer)


def take_over(
    data: Path,
    database: Database,
    now: datetime,
    server: Database,
    signature: Signature | None = None,
) -> tuple[TakenOver, ...]:
    """Take over the changes of other stations that are newer than those of this one.

    Arguments as of `newer_elsewhere`; a library with a supervisor password needs the
    signature of a supervisor (`AcceptanceError`).
    """
    newer = newer_elsewhere(data, database, now, server)
    for each in newer:
        adopt_change(data, each.change, signature)
    return newer


def _author_of(change: LibraryChange) -> str:
    who = " ".join(filter(None, (change.station, change.operator))) or "-"
    return f"{printable(who)}, {local_time(change.at):%Y-%m-%d %H:%M}"


def _newest(
    changes: Iterator[LibraryChange],
) -> dict[tuple[ItemKind, str], LibraryChange]:
    found = dict[tuple[ItemKind, str], LibraryChange]()
    for change in changes:
        key = change.item.kind, change.item.id
        if key not in found or change.at >= found[key].at:
            found[key] = change
    return found


def _on_server(server: Database) -> Iterator[tuple[StoredEntry, LibraryChange]]:
    """Yield the changes of all stations that the first key of their chain signed."""
    for row in server.rows(_SHARED):
        try:
            entry = read_entry(row.text, row.signature)
        except DamagedError:
            continue
        if signature_finding(ChainKeys(entry.entry.chain), entry) is None:
            yield from _changes(entry, row.record)


def _changes(
    entry: StoredEntry, record: str | None
) -> Iterator[tuple[StoredEntry, LibraryChange]]:
    event = entry.entry.event
    if record is None or event.record_sha256 != text_sha256(record):
        return
    try:
        change = parse_change(record.encode("utf-8", "surrogateescape"))
    except DamagedError:
        return
    yield entry, change


def _without_picture(item: AnyItem, data: Path) -> AnyItem:
    """Return an item without a picture that is not here."""
    if not isinstance(item, ListedTip) or item.picture is None:
        return item
    has_picture = (data / item.picture.place).exists()
    return item if has_picture else structs.replace(item, picture=None)
