"""Chains of signed entries, each with the hash of the one before."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from enum import StrEnum
from functools import partial
from hashlib import sha256
from typing import Annotated, Any, TypeAlias

from msgspec import Meta, Struct, to_builtins
from sqlalchemy import Column, Connection, Row, Select, func, insert, select
from sqlalchemy.dialects import postgresql

from lightpen import __version__
from lightpen.archive.store import ENTRIES, RECORDS, Database
from lightpen.errors import ArchiveError, FileError
from lightpen.formats.own_json import (
    DamagedError,
    Digest,
    Plain,
    StoredMessage,
    Vector,
    ZonedTime,
    parse_own_json,
    require_usual,
)
from lightpen.messages import Message, message, printable
from lightpen.model.names import Origin
from lightpen.record.folder import TrialOutcome
from lightpen.record.library.entered_files import (
    NOTHING_BEFORE,
    require_own,
    require_remembered,
)
from lightpen.record.library.signing import (
    STATION_KEY,
    ChainKeys,
    chain_of,
    entry_text,
    key_in,
    known_station_name,
    remember_head,
    station_key,
    station_name,
)
from lightpen.record.results.results import TipChange
from lightpen.record.swings.header import Names

# Entries of the archive: their canonical text, and their chain of hashes.
#
# An archive holds chains, one for each data folder that was ever entered in it. A chain
# grows only where its data folder is; everywhere else it is a copy of what was entered
# there. Each entry carries the hash of the previous one, so that a changed, missing or
# inserted entry invalidates all that follow.


TICK = timedelta(microseconds=1)
EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
SHORT = 8  # characters by which a chain is named

Chain: TypeAlias = Annotated[str, Meta(pattern="^[0-9a-f]{32}$")]


class Kind(StrEnum):
    """Kind of an entry."""

    ACCEPTED = "accepted"
    REFUSED = "refused"
    ABANDONED = "abandoned"
    REVOKED = "revoked"
    NOTE = "note"
    LIBRARY = "library"
    VERIFICATION = "verification"
    CAMERA = "camera calibration"
    LIMITS = "limits"


BESIDE_SWINGS = (Kind.VERIFICATION, Kind.CAMERA, Kind.LIMITS)


class FileHash(Struct, frozen=True):
    """A file that an entry refers to."""

    place: str  # from the data folder, or absolute if outside of it
    sha256: Digest
    n_bytes: Annotated[int, Meta(ge=0)] | None = None  # hashed beginning; None for all


class Event(Struct, frozen=True):
    """An event to be entered."""

    kind: Kind
    at: ZonedTime
    names: Names
    program: str
    origin: Origin | None = None
    grade: str = ""  # verdict on a calibration; else empty
    why: StoredMessage | None = None
    reason: str = ""  # reason given by the operator; of a comment, its text
    outcome: TrialOutcome | None = None
    tip_pen_mm: Vector | None = None
    expanded_uncertainty_mm: Vector | None = None
    change: TipChange | None = None
    swing: str = ""  # folder of its swing, as `FileHash.place`; may be empty
    settings: Mapping[str, Plain] = {}  # also a task, new limits or entries
    result: FileHash | None = None  # makes a tip current, revokes it, or states this
    files: tuple[FileHash, ...] = ()  # swing's record, touches' journals
    record_sha256: Digest | None = None  # of ``result`` as a text, or a calibration
    concerns: Digest | None = None  # the entry that it revokes or is on
    approval: str = ""  # of the supervisor whom the file names, see `approval_of`

    def __post_init__(self) -> None:
        require_usual(self.at)

    @property
    def is_simulated(self) -> bool:
        """Whether it is of no real pen."""
        return self.origin is Origin.SIMULATED


class Entry(Struct, frozen=True):
    """An event in its place."""

    chain: Chain
    number: Annotated[int, Meta(ge=1)]  # in the chain, from 1
    previous: Digest  # hash of the entry before
    since: ZonedTime  # never before the entry before it: one order of all stations
    event: Event


@dataclass(frozen=True)
class StoredEntry:
    """An entry as stored."""

    entry: Entry
    text: str  # canonical JSON: names sorted, no blanks, ASCII
    sha256: str
    signature: str = ""  # see `lightpen.archive.chains`


@dataclass(frozen=True)
class ChainHead:
    """Last entry of a chain."""

    chain: str
    number: int = 0  # 0 for an empty chain
    sha256: str = NOTHING_BEFORE
    since: datetime | None = None
    key: str = ""  # public key that signed it; empty for an empty chain


def chained(head: ChainHead, event: Event) -> StoredEntry:
    """Return the next entry of a chain."""
    since = event.at.astimezone(UTC)
    if head.since is not None:
        since = max(since, head.since + TICK)
    return written(Entry(head.chain, head.number + 1, head.sha256, since, event))


def written(entry: Entry) -> StoredEntry:
    """Return an entry with its text and hash."""
    text = json.dumps(
        to_builtins(entry), sort_keys=True, separators=(",", ":"), allow_nan=False
    )
    return StoredEntry(entry, text, text_sha256(text))


def read_entry(text: object, signature: object = "") -> StoredEntry:
    """Return an entry with its signature, or raise `DamagedError`."""
    if not (isinstance(text, str) and isinstance(signature, str)):
        raise DamagedError("It is no text.")  # SQLite stores any value anywhere
    try:
        data = text.encode("utf-8", "surrogateescape")
    except UnicodeEncodeError as error:  # half of a character
        raise DamagedError(str(error)) from error
    return StoredEntry(parse_own_json(data, Entry), text, text_sha256(text), signature)


def since_us(moment: datetime) -> int:
    """Return a moment as databases have it, in us since 1970."""
    return (moment - EPOCH) // TICK


def named_entry(chain: str, number: int, station: str = "") -> Message:
    """Return the name of an entry: with its station, if known."""
    if station:
        return message(
            "archive.entry-of-station", number=number, station=printable(station)
        )
    return message("archive.entry", number=number, chain=chain[:SHORT])


def text_sha256(text: str) -> str:
    """Return the SHA-256 digest of a text in UTF-8, in hexadecimal digits."""
    return sha256(text.encode("utf-8", "surrogateescape")).hexdigest()


def this_program() -> str:
    """Return name and version of the program for an entry."""
    return f"lightpen {__version__}"


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


def chain_at_home(database: Database) -> str | None:
    """Return the chain of a file, if it has begun; None of a server."""
    if database.file is None:
        return None
    with database.reading() as connection:
        chain = chain_in(connection)
    try:
        return chain or known_station_name(database.file.parent) or None
    except FileError as error:
        raise ArchiveError(error.message) from error


def chain_in(connection: Connection) -> str | None:
    """Return the chain of the entries in a file; None if it has none."""
    found = connection.execute(select(func.min(ENTRIES.c.chain))).scalar_one()
    return found if isinstance(found, str) else None


def chain_names(database: Database) -> tuple[str, ...]:
    """Return the names of all chains that have an entry."""
    wanted = select(ENTRIES.c.chain).distinct().order_by(ENTRIES.c.chain)
    return tuple(str(chain) for (chain,) in database.rows(wanted))


def chain_head(database: Database, chain: str) -> ChainHead:
    """Return the last entry of a chain as the entries have it."""
    with database.reading() as connection:
        return head_in(connection, chain)


def hash_in(connection: Connection, chain: str, number: int) -> str | None:
    """Return the SHA-256 of the entry of a number; None if there is none."""
    wanted = select(ENTRIES.c.sha256).where(
        ENTRIES.c.chain == chain, ENTRIES.c.number == number
    )
    return connection.execute(wanted).scalar_one_or_none()


def entry_of_result(database: Database, chain: str, place: str) -> StoredEntry | None:
    """Return the entry of the result file at a place, if there is one."""
    wanted = select(*READ).where(
        ENTRIES.c.chain == chain, ENTRIES.c.result == searchable(place)
    )
    with database.reading() as connection:
        row = connection.execute(wanted).one_or_none()
    return None if row is None else read_row(database, row)


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
    return kind not in (None, Kind.REVOKED.value)


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


# Signatures of entries: made as they are entered, and verified.
#
# An entry is signed over its hash, and so over all entries before it. The signature is
# kept beside the text: 64 hexadecimal digits of the public key, then 128 of the
# signature. As the name of a chain is the hash of its first key, nobody else can
# continue it, nor begin one of that name; how it gets another key, see
# `lightpen.record.library.signing`.


def entry_signature(head: ChainHead, event: Event, sha256: str) -> str:
    """Return the signature of an entry with a hash, by the chain before it.

    Raises `ArchiveError` if the key cannot be read or is not in this user account.
    """
    introduced = event.settings.get(STATION_KEY) if event.kind is Kind.LIMITS else None
    name = head.chain if not head.key else chain_of(head.key)
    if isinstance(introduced, str):
        name = chain_of(introduced)
    try:
        key = station_key(name)
    except FileError as error:
        raise ArchiveError(error.message) from error
    if key is None:
        raise ArchiveError("signing.key-missing", chain=head.chain[:SHORT])
    return key.public + key.sign(entry_text(sha256))


def signature_finding(keys: ChainKeys, entry: StoredEntry) -> Message | None:
    """Return the fault of the signature of the next entry; None if it is valid."""
    event, number = entry.entry.event, entry.entry.number
    found = event.kind, event.settings, entry.sha256, entry.signature
    return keys.finding(number, *found)


# A chain only grows by entries that follow its last one, signed by its keys.


UNUSED = (Kind.REFUSED, Kind.ABANDONED)


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
            keep_records(connection, {text_sha256(record): record})
        put_entries(connection, [entry])
    remember_head(chain, entry.entry.number, entry.sha256)
    return entry


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
    elif event.kind in UNUSED:
        kinds = [kind.value for kind in UNUSED]
        same = (ENTRIES.c.swing == searchable(event.swing)) & ENTRIES.c.kind.in_(kinds)
    else:
        return False
    wanted = select(ENTRIES.c.number).where(ENTRIES.c.chain == chain, same).limit(1)
    return connection.execute(wanted).one_or_none() is not None


def put_entries(connection: Connection, entries: Sequence[StoredEntry]) -> None:
    """Store entries behind those of their chains."""
    if entries:
        connection.execute(insert(ENTRIES), list(map(columns_of, entries)))


def keep_records(connection: Connection, records: Mapping[str, str]) -> None:
    """Keep records that are not there yet."""
    wanted = select(RECORDS.c.sha256).where(RECORDS.c.sha256.in_(list(records)))
    known = set(connection.execute(wanted).scalars())
    new = [{"sha256": n, "text": t} for n, t in records.items() if n not in known]
    if new:  # on a server, another role may have stored one invisible to this one
        put = postgresql.insert(RECORDS).on_conflict_do_nothing()
        is_server = connection.dialect.name == "postgresql"
        connection.execute(put if is_server else insert(RECORDS), new)
