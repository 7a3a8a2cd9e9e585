"""The chains of a database: its own, which grows by events, and copies of others."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import timedelta
from typing import Any

from sqlalchemy import (
    Column,
    Connection,
    Row,
    Select,
    delete,
    func,
    insert,
    select,
    tuple_,
    update,
)
from sqlalchemy.dialects import postgresql

from lightpen.archive.chains.entries import (
    EPOCH,
    NOTHING_BEFORE,
    SHORT,
    ChainHead,
    Event,
    Kind,
    StoredEntry,
    chained,
    named_entry,
    read_entry,
    since_us,
    text_sha256,
)
from lightpen.archive.chains.signatures import (
    UNAPPROVED,
    ChainKeys,
    entry_signature,
    key_in,
)
from lightpen.archive.store.database import Database
from lightpen.archive.store.tables import CHAIN_WRITERS, CHAINS, ENTRIES, RECORDS
from lightpen.errors import ArchiveError, FileError
from lightpen.formats.own_json import DamagedError
from lightpen.messages import Message, message
from lightpen.record.library.signing.keys import chain_of, make_station_key
from lightpen.record.library.signing.station import station_name

SET_ASIDE = (Kind.REFUSED, Kind.ABANDONED)
_AT_HOME = select(CHAINS.c.chain).where(CHAINS.c.is_own)
# Of an entry to read.
READ: tuple[Column[Any], ...] = (
    *(ENTRIES.c.number, ENTRIES.c.sha256, ENTRIES.c.text, ENTRIES.c.signature),
)
BATCH = 200  # entries that are copied in one transaction


@dataclass(frozen=True)
class CopyResult:
    """Numbers of new and of known entries when entries are copied."""

    n_new: int
    n_known: int


def own_chain(database: Database) -> str:
    """Return the own chain of a database; it begins with the first call.

    With it begins its station key.
    """
    with database.writing() as connection:
        chain = connection.execute(_AT_HOME).scalar_one_or_none()
        if chain is None:
            try:
                chain = _new_chain(database)
            except FileError as error:
                raise ArchiveError(error.message) from error
            _begin(connection, chain, is_own=True)
    return chain


def chain_at_home(database: Database) -> str | None:
    """Return the own chain of a database, if it has begun."""
    if database.file is None:
        return None
    with database.reading() as connection:
        return connection.execute(_AT_HOME).scalar_one_or_none()


def append(
    database: Database, chain: str, event: Event, record: str | None = None
) -> StoredEntry | None:
    """Append an entry to the own chain of a database.

    When this returns, the entry is kept whatever happens next; when it raises, or is
    killed, it is kept whole or not at all. Of two programs that enter the same result
    file, or that the same swing was abandoned, one does; the other gets None. The event
    contains the hash of the record, which is JSON.
    """
    with database.writing() as connection:
        if _is_entered(connection, chain, event):
            return None
        head = _head(connection, chain)
        entry = chained(head, event)
        signature = entry_signature(head, event, entry.sha256)
        entry = replace(entry, signature=signature)
        if record is not None:
            _keep_records(connection, {text_sha256(record): record})
        _put(connection, chain, [entry])
    return entry


def copy_entries(
    database: Database,
    chain: str,
    entries: Iterable[StoredEntry],
    records: Mapping[str, str],
) -> CopyResult:
    """Let the copy of a chain grow by entries, in their order; known ones are passed.

    The own chain of the database grows by `append` alone. Raises `ArchiveError` if they
    do not continue the copy, are not signed by the station of the chain, are beyond the
    head of the own chain, or the copy says otherwise.
    """
    with database.writing() as connection:
        if _is_server(connection):
            connection.execute(select(func.pg_advisory_xact_lock(int(chain[:15], 16))))
        head = _head(connection, chain)
        if head.number == 0 and not _is_known(connection, chain):
            _begin(connection, chain, is_own=False)
        known, new = _parted(entries, head.number)
        _require_same(connection, chain, known)
        _require_next(head, new)
        if new:
            _require_elsewhere(connection, new[0])
            _require_signed(connection, chain, new)
        _keep_records(connection, _named(new, records))
        _put(connection, chain, new)
    return CopyResult(len(new), len(known))


def adopt_entries(
    database: Database,
    chain: str,
    entries: Sequence[StoredEntry],
    records: Mapping[str, str],
) -> None:
    """Let the own chain here grow by entries that this folder lost.

    Raises `ArchiveError` if they do not continue the chain, are not signed by its
    station, or the own chain is another one.
    """
    empty = delete(CHAINS).where(
        CHAINS.c.is_own, CHAINS.c.number == 0, CHAINS.c.chain != chain
    )
    with database.writing() as connection:
        connection.execute(empty)
        home = connection.execute(_AT_HOME).scalar_one_or_none()
        if home is None:
            if not _is_known(connection, chain):
                _begin(connection, chain, is_own=True)
            own = update(CHAINS).where(CHAINS.c.chain == chain).values(is_own=True)
            connection.execute(own)
        elif home != chain:
            raise ArchiveError(_forked(entries[0]))
        _require_next(_head(connection, chain), list(entries))
        _require_signed(connection, chain, entries)
        _keep_records(connection, _named(entries, records))
        _put(connection, chain, entries)


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
        found = select(CHAINS).order_by(CHAINS.c.chain)
    with database.reading() as connection:
        rows = connection.execute(found).all()
    return tuple(ChainHead(row.chain, row.number, row.sha256) for row in rows)


def chain_head(database: Database, chain: str) -> ChainHead:
    """Return the last entry of a chain as the entries have it."""
    with database.reading() as connection:
        return _head(connection, chain)


def delivered_number(database: Database, chain: str) -> int:
    """Return the number of the last entry of a chain that a server was given."""
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
    with database.reading() as connection:
        return {row.sha256: row.text for row in connection.execute(wanted)}


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
    return read_entries(database, _of_limits(chain))


class ArchivedFiles:
    """The paths of the result files and swings in a chain.

    What was read once is kept, so that of a long chain only its new entries are:
    they are never changed.
    """

    def __init__(self, database: Database, chain: str) -> None:
        self._database, self._chain = database, chain
        self._n_read = 0
        self._results = set[str]()
        self._kinds: dict[str, str] = {}  # of the last entry of a swing

    def read(self) -> None:
        """Read the entries added since the last call."""
        wanted = (
            select(ENTRIES.c.number, ENTRIES.c.result, ENTRIES.c.swing, ENTRIES.c.kind)
            .where(ENTRIES.c.chain == self._chain, ENTRIES.c.number > self._n_read)
            .order_by(ENTRIES.c.number)
        )
        with self._database.reading() as connection:
            for row in connection.execute(wanted):
                self._results.add(row.result)
                self._kinds[row.swing] = row.kind
                self._n_read = row.number

    def __contains__(self, place: str) -> bool:
        """Return whether a folder was entered, by the entries read.

        A swing whose result was revoked was not: it may still be abandoned.
        """
        revoked = Kind.TAKEN_BACK.value
        is_swing = self._kinds.get(searchable(place), revoked) != revoked
        return is_swing or searchable(place) in self._results


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
    if not isinstance(columns["text"], str):
        return None
    try:
        entry = read_entry(columns["text"], columns["signature"])
    except DamagedError:
        return None
    return entry if columns_of(entry) == columns else None


def searchable(text: str) -> str:
    """Return a text as every database can hold it."""
    return text.encode("utf-8", "backslashreplace").decode().replace("\0", "\\x00")


def _head(connection: Connection, chain: str) -> ChainHead:
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


def _is_entered(connection: Connection, chain: str, event: Event) -> bool:
    if event.result is not None:
        same = ENTRIES.c.result == searchable(event.result.place)
    elif event.kind in SET_ASIDE:
        kinds = [kind.value for kind in SET_ASIDE]
        same = (ENTRIES.c.swing == searchable(event.swing)) & ENTRIES.c.kind.in_(kinds)
    else:
        return False
    wanted = select(ENTRIES.c.number).where(ENTRIES.c.chain == chain, same).limit(1)
    return connection.execute(wanted).one_or_none() is not None


def _is_known(connection: Connection, chain: str) -> bool:
    table = CHAIN_WRITERS if _is_server(connection) else CHAINS
    wanted = select(table.c.chain).where(table.c.chain == chain)
    return connection.execute(wanted).one_or_none() is not None


def _new_chain(database: Database) -> str:
    """Return the name of the station key with which a chain begins."""
    if database.file is None:
        return chain_of(make_station_key().public)
    return station_name(database.file.parent)


def _begin(connection: Connection, chain: str, *, is_own: bool) -> None:
    if _is_server(connection):
        connection.execute(insert(CHAIN_WRITERS).values(chain=chain))
        return
    connection.execute(
        insert(CHAINS).values(
            chain=chain, is_own=is_own, number=0, sha256=NOTHING_BEFORE, delivered=0
        )
    )


def _is_server(connection: Connection) -> bool:
    return connection.dialect.name == "postgresql"


def _put(connection: Connection, chain: str, entries: Sequence[StoredEntry]) -> None:
    if not entries:
        return
    connection.execute(insert(ENTRIES), list(map(columns_of, entries)))
    if _is_server(connection):
        return
    last = entries[-1]
    connection.execute(
        update(CHAINS)
        .where(CHAINS.c.chain == chain)
        .values(number=last.entry.number, sha256=last.sha256)
    )


def _keep_records(connection: Connection, records: Mapping[str, str]) -> None:
    """Keep records that are not there yet."""
    wanted = select(RECORDS.c.sha256).where(RECORDS.c.sha256.in_(list(records)))
    known = set(connection.execute(wanted).scalars())
    new = [{"sha256": n, "text": t} for n, t in records.items() if n not in known]
    if new:  # of a server another role may have one that this one does not see
        put = postgresql.insert(RECORDS).on_conflict_do_nothing()
        connection.execute(put if _is_server(connection) else insert(RECORDS), new)


def _parted(
    entries: Iterable[StoredEntry], number: int
) -> tuple[list[StoredEntry], list[StoredEntry]]:
    """Return the entries up to a number, and the others."""
    known: list[StoredEntry] = []
    new: list[StoredEntry] = []
    for each in entries:
        (known if each.entry.number <= number else new).append(each)
    return known, new


def _require_same(connection: Connection, chain: str, known: list[StoredEntry]) -> None:
    numbers = [each.entry.number for each in known]
    wanted = select(ENTRIES.c.number, ENTRIES.c.sha256).where(
        ENTRIES.c.chain == chain, ENTRIES.c.number.in_(numbers)
    )
    there = {row.number: row.sha256 for row in connection.execute(wanted)}
    for each in known:
        if there.get(each.entry.number) != each.sha256:
            raise ArchiveError(_forked(each))


def _require_next(head: ChainHead, new: list[StoredEntry]) -> None:
    number, sha256 = head.number, head.sha256
    for each in new:
        if (each.entry.number, each.entry.previous) != (number + 1, sha256):
            raise ArchiveError(_forked(each))
        number, sha256 = each.entry.number, each.sha256


def _require_elsewhere(connection: Connection, new: StoredEntry) -> None:
    """Refuse an entry of the own chain that was not entered here."""
    if _is_server(connection):
        return
    if connection.execute(_AT_HOME).scalar_one_or_none() == new.entry.chain:
        raise ArchiveError("archive.own-chain-ahead", entry=_named_entry(new))


def _require_signed(
    connection: Connection, chain: str, new: Iterable[StoredEntry]
) -> None:
    limits = connection.execute(_of_limits(chain))
    try:
        before = [read_entry(row.text, row.signature) for row in limits]
    except DamagedError as error:
        raise ArchiveError("archive.copy-damaged", chain=chain[:SHORT]) from error
    keys = ChainKeys(chain, before)
    for each in new:
        finding = keys.finding(each)
        if finding is not None and finding.code != UNAPPROVED:
            raise ArchiveError(finding)


def _of_limits(chain: str) -> Select[Any]:
    return (
        select(*READ)
        .where(ENTRIES.c.chain == chain, ENTRIES.c.kind == Kind.LIMITS.value)
        .order_by(ENTRIES.c.number)
    )


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


def read_entries(database: Database, wanted: Select[Any]) -> tuple[StoredEntry, ...]:
    """Return the entries that a query for the columns `READ` finds."""
    with database.reading() as connection:
        rows = connection.execute(wanted).all()
    return tuple(read_row(database, row) for row in rows)


def read_row(database: Database, row: Row[Any]) -> StoredEntry:
    """Return the entry in a row with the columns `READ`; refuse a changed one."""
    damaged = ArchiveError(
        "archive.entry-damaged", number=row.number, archive=database.name
    )
    try:
        entry = read_entry(row.text, row.signature)
    except DamagedError as error:
        raise damaged from error
    if entry.sha256 != row.sha256:
        raise damaged
    return entry
