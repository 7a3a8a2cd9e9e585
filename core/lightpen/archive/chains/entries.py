"""Entries of the archive: their canonical text, and their chain of hashes.

An archive holds chains, one for each data folder that was ever entered in it. A chain
grows only where its data folder is; everywhere else it is a copy of what was entered
there. Each entry carries the hash of the previous one, so that a changed, missing or
inserted entry invalidates all that follow.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from enum import StrEnum
from hashlib import sha256
from typing import Annotated, TypeAlias

from msgspec import Meta, Struct, to_builtins

from lightpen import __version__
from lightpen.formats.json_records import Plain
from lightpen.formats.own_json import (
    DamagedError,
    Digest,
    Vector,
    ZonedTime,
    parse_own_json,
    require_usual,
)
from lightpen.formats.stored_messages import StoredMessage
from lightpen.messages import Message, message, printable
from lightpen.model.origin import Origin
from lightpen.record.folder.outcome import TrialOutcome
from lightpen.record.library.entered_files import NOTHING_BEFORE
from lightpen.record.results.results import TipChange
from lightpen.record.swings.names import Names

TICK = timedelta(microseconds=1)
EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
SHORT = 8  # characters by which a chain is named

Chain: TypeAlias = Annotated[str, Meta(pattern="^[0-9a-f]{32}$")]


class Kind(StrEnum):
    """Kind of an entry."""

    ACCEPTED = "accepted"
    REFUSED = "refused"
    ABANDONED = "abandoned"
    TAKEN_BACK = "taken back"
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
    files: tuple[FileHash, ...] = ()  # swing's record, touches' journals, picture
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
    signature: str = ""  # see `lightpen.archive.chains.signatures`


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
