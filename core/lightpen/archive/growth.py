"""How the chains of a database grow: by events, by copies, by what was lost."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial

from sqlalchemy import Connection, func, insert, select
from sqlalchemy.dialects import postgresql

from lightpen.archive.chains import (
    SHORT,
    ChainHead,
    Event,
    Kind,
    StoredEntry,
    chain_at_home,
    chain_in,
    chained,
    columns_of,
    entry_signature,
    hash_in,
    head_in,
    named_entry,
    of_limits,
    read_entry,
    searchable,
    signature_finding,
    text_sha256,
)
from lightpen.archive.store import CHAIN_WRITERS, ENTRIES, RECORDS, Database
from lightpen.errors import ArchiveError, FileError
from lightpen.formats.own_json import DamagedError
from lightpen.messages import Message, message
from lightpen.record.library.entered_files import require_own, require_remembered
from lightpen.record.library.signing import (
    UNAPPROVED,
    ChainKeys,
    remember_head,
    station_name,
)

# How the chains of a database grow: by events, by copies, by what was lost.
#
# A chain only grows by entries that follow its last one, signed by its keys; copies
# that differ from what is there are refused.


SET_ASIDE = (Kind.REFUSED, Kind.ABANDONED)


def own_chain(database: Database) -> str:
    """Return the chain of a file; the first call begins it with its station key."""
    chain = chain_at_home(database)
    if chain is not None:
        return chain
    assert database.file is not None
    try:
        return station_name(database.file.parent)
    except FileError as error:
        raise ArchiveError(error.message) from error


def append(
    database: Database, chain: str, event: Event, record: str | None = None
) -> StoredEntry | None:
    """Append an entry to the chain of a file.

    When this returns, the entry is durable; when it raises or is killed, it is stored
    whole or not at all. Of two programs that enter the same result file, or that the
    same swing was abandoned, one does; the other gets None. The event contains the hash
    of the record, which is JSON.
    """
    with database.writing() as connection:
        if _is_entered(connection, chain, event):
            return None
        _require_remembered(connection, chain, database)
        head = head_in(connection, chain)
        entry = chained(head, event)
        signature = entry_signature(head, event, entry.sha256)
        entry = replace(entry, signature=signature)
        if record is not None:
            _keep_records(connection, {text_sha256(record): record})
        _put(connection, [entry])
    remember_head(chain, entry.entry.number, entry.sha256)
    return entry


def copy_entries(
    database: Database,
    chain: str,
    entries: Iterable[StoredEntry],
    records: Mapping[str, str],
) -> int:
    """Let a chain grow by entries from elsewhere, in their order; return how many.

    It is the copy on a server, or the own chain in a file that lost them. Those that
    are there are passed. Raises `ArchiveError` if they do not continue the chain, or
    are not signed by its station.
    """
    with database.writing() as connection:
        if database.file is None:
            _begin_on_server(connection, chain)
        head = head_in(connection, chain)
        new = [each for each in entries if each.entry.number > head.number]
        if new and database.file and chain_in(connection) not in (None, chain):
            raise ArchiveError(_forked(new[0]))
        _require_next(head, new)
        if new:
            _require_signed(connection, chain, new)
        _keep_records(connection, _named(new, records))
        _put(connection, new)
    if new and database.file:
        remember_head(chain, new[-1].entry.number, new[-1].sha256)
    return len(new)


def _begin_on_server(connection: Connection, chain: str) -> None:
    """Begin a copy that is not there; no other program writes to it meanwhile."""
    connection.execute(select(func.pg_advisory_xact_lock(int(chain[:15], 16))))
    known = select(CHAIN_WRITERS.c.chain).where(CHAIN_WRITERS.c.chain == chain)
    if connection.execute(known).first() is None:
        connection.execute(insert(CHAIN_WRITERS).values(chain=chain))


def _require_remembered(connection: Connection, chain: str, database: Database) -> None:
    assert database.file is not None
    try:
        require_own(database.file.parent, chain)
        require_remembered(database.name, chain, partial(hash_in, connection, chain))
    except FileError as error:
        raise ArchiveError(error.message) from error


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


def _put(connection: Connection, entries: Sequence[StoredEntry]) -> None:
    if entries:
        connection.execute(insert(ENTRIES), list(map(columns_of, entries)))


def _keep_records(connection: Connection, records: Mapping[str, str]) -> None:
    """Keep records that are not there yet."""
    wanted = select(RECORDS.c.sha256).where(RECORDS.c.sha256.in_(list(records)))
    known = set(connection.execute(wanted).scalars())
    new = [{"sha256": n, "text": t} for n, t in records.items() if n not in known]
    if new:  # on a server, another role may have stored one invisible to this one
        put = postgresql.insert(RECORDS).on_conflict_do_nothing()
        is_server = connection.dialect.name == "postgresql"
        connection.execute(put if is_server else insert(RECORDS), new)


def _require_next(head: ChainHead, new: list[StoredEntry]) -> None:
    number, sha256 = head.number, head.sha256
    for each in new:
        if (each.entry.number, each.entry.previous) != (number + 1, sha256):
            raise ArchiveError(_forked(each))
        number, sha256 = each.entry.number, each.sha256


def _require_signed(
    connection: Connection, chain: str, new: Iterable[StoredEntry]
) -> None:
    limits = connection.execute(of_limits(chain))
    try:
        before = [read_entry(row.text, row.signature) for row in limits]
    except DamagedError as error:
        raise ArchiveError("archive.copy-damaged", chain=chain[:SHORT]) from error
    keys = ChainKeys(chain)
    for each in before:
        signature_finding(keys, each)
    for each in new:
        finding = signature_finding(keys, each)
        if finding is not None and finding.code != UNAPPROVED:
            raise ArchiveError(finding)


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
