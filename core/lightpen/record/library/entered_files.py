"""The files of a data folder that count: those that its signed archive holds.

An entry has the SHA-256 of its file, and each entry the hash of the one before; the
last is signed by the station, and remembered in its user account. So one reading of the
chain proves every file. A file that the program wrote and has not entered yet counts by
the note in the user account. All others are not entered: they are passed over.
"""

import sqlite3
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass, field, replace
from hashlib import sha256
from itertools import count
from pathlib import Path
from threading import Lock
from typing import Any

import msgspec
from msgspec import Struct

from lightpen.errors import FileError, NameTakenError
from lightpen.formats.files import (
    FOLDER,
    create_whole,
    strerror,
    sync_folder,
    unreadable,
)
from lightpen.messages import printable
from lightpen.record.library.signing import (
    LIMITS,
    UNAPPROVED,
    ChainKeys,
    OwedFile,
    SigningKey,
    approval_of,
    forget_owed,
    head_file,
    is_approved,
    known_station_name,
    owe,
    owed_files,
    remember_chain,
    remembered_chain,
    remembered_head,
    station_name,
)

# A folder of JSON files that are written once, each named by its number in order.
#
# Numbers increase by one, so the order does not depend on clocks. Of two programs that
# try the same number, one gets it and the other the next. An empty ``000007.missing``
# reserves the number of a lost file.


MISSING = ".missing"


def numbered_file(folder: Path, number: int) -> Path:
    """Return the file of a number."""
    return folder / f"{number:06d}.json"


def newest_number(folder: Path) -> int:
    """Return the number of the newest file, lost ones counted; 0 without any."""
    return max(map(number_of, _paths_in(folder)), default=0)


def make_folder(folder: Path) -> None:
    """Create a folder and its parents."""
    try:
        new = [each for each in folder.parents if not each.exists()]
        folder.mkdir(parents=True, exist_ok=True)
        for each in (folder, *new):
            sync_folder(each.parent)
    except OSError as error:
        raise FileError(
            "results.no-folder", folder=folder, reason=strerror(error)
        ) from error


def numbered_files(folder: Path) -> list[Path]:
    """Return the files, the newest first; others are left alone."""
    files = [p for p in _paths_in(folder) if p.suffix == ".json" and number_of(p)]
    return sorted(files, key=lambda file: (number_of(file), file.name), reverse=True)


def _paths_in(folder: Path) -> list[Path]:
    try:
        paths = list(folder.iterdir()) if folder.is_dir() else []
    except OSError as error:
        raise unreadable(folder, FOLDER, error) from error
    return [path for path in paths if path.suffix in (".json", MISSING)]


def number_of(file: Path) -> int:
    """Return the place of a file in the order; 0 for a foreign file."""
    return int(file.stem) if file.stem.isdecimal() else 0


ARCHIVE = "archive.sqlite"
ROLLED_BACK = "archive.rolled-back"
NOTHING_BEFORE = "0" * 64  # in place of a hash, in the first entry of a chain
LONGEST_WAIT_S = 10  # for another program to finish writing


class _File(Struct, frozen=True):
    place: str
    sha256: str


class _Event(Struct, frozen=True):
    kind: str
    settings: Mapping[str, Any] = {}
    result: _File | None = None
    approval: str = ""


class _Entry(Struct, frozen=True):
    chain: str
    number: int
    previous: str
    event: _Event


@dataclass(frozen=True)
class EntryPlace:
    """Entry of a file: its chain, its number in it, from 1, and its hash."""

    chain: str
    number: int
    sha256: str


@dataclass(frozen=True)
class EnteredFile:
    """A file as it was entered."""

    sha256: str
    entry: EntryPlace
    approval: str = ""  # of a supervisor
    supervisor: str = ""  # public key of the supervisor then; empty without one


@dataclass(frozen=True)
class CountedFile:
    """A file that counts, with its content."""

    place: str
    content: bytes
    approval: str
    supervisor: str | None  # as of `EnteredFile`; None if it is not entered yet
    chain: str

    def is_approved_by(self, public: str) -> bool:
        """Return whether the supervisor with a public key approved it."""
        digest = sha256(self.content).hexdigest()
        return is_approved(public, self.approval, self.chain, self.place, digest)

    def require_approved(self, present: str) -> None:
        """Refuse a file that the supervisor then, or the present one, did not approve.

        Their public keys are empty without a password.
        """
        key = present if self.supervisor is None else self.supervisor
        if key and not self.is_approved_by(key):
            raise FileError("signing.unapproved", file=printable(self.place))


@dataclass
class EnteredFiles:
    """The files that an archive holds, as far as it was read."""

    data: Path
    chain: str = ""  # empty without an archive
    files: dict[str, EnteredFile] = field(default_factory=dict)  # by their places
    owed: tuple[OwedFile, ...] = ()  # not entered yet
    station_key: str = ""  # public key that signed the last entry

    def place_of(self, file: Path) -> str:
        """Return the place of a file in the data folder."""
        return file.absolute().relative_to(self.data.absolute()).as_posix()

    def require_all(self, folder: Path) -> None:
        """Refuse a folder in which a file is missing that was entered."""
        start = f"{self.place_of(folder)}/"
        for place, entered in self.files.items():
            if place.startswith(start) and not (self.data / place).exists():
                raise FileError(
                    "entered.missing", file=place, number=entered.entry.number
                )

    def counted(self, file: Path, content: bytes) -> CountedFile | None:
        """Return a file that counts with its content; None if it is not entered.

        Raises `FileError` if it was changed after it was entered.
        """
        place, digest = self.place_of(file), sha256(content).hexdigest()
        entered = self.files.get(place)
        if entered is not None and entered.sha256 != digest:
            raise FileError("entered.changed", file=file, number=entered.entry.number)
        if entered is not None:
            found = entered.approval, entered.supervisor
            return CountedFile(place, content, *found, self.chain)
        owed = [each for each in self.owed if each.place == place]
        for each in owed:
            if each.sha256 == digest:
                return CountedFile(place, content, each.approval, None, self.chain)
        if owed:
            raise FileError("entered.changed-before", file=file)
        return None


class _Reading:
    """An archive as far as it was read and verified."""

    def __init__(self, data: Path, chain: str) -> None:
        self.found = EnteredFiles(data, chain)
        self.hashes: list[str] = []
        self._keys = ChainKeys(chain)

    def read_new(self, connection: sqlite3.Connection) -> None:
        """Read the entries that are new."""
        rows = connection.execute(
            "SELECT number, sha256, text, signature FROM archive_entries"
            " WHERE chain = ? AND number > ? ORDER BY number",
            (self.found.chain, len(self.hashes)),
        )
        last = None
        for row in rows:
            last = self._followed(*row)
        if last is not None:
            self._require_signed(*last)

    def _followed(
        self, number: Any, digest: Any, text: Any, signature: Any
    ) -> tuple[_Entry, str, str]:
        previous = self.hashes[-1] if self.hashes else NOTHING_BEFORE
        try:
            content = text.encode("utf-8", "surrogateescape")
            entry = msgspec.json.decode(content, type=_Entry)
        except (AttributeError, ValueError) as error:
            raise self._damaged(number) from error
        stated = (entry.chain, entry.number, entry.previous, number, digest)
        is_next = len(self.hashes) + 1
        if stated != (
            *(self.found.chain, is_next, previous, is_next),
            sha256(content).hexdigest(),
        ):
            raise self._damaged(number)
        self.hashes.append(digest)
        supervisor, event = self._keys.supervisor, entry.event
        if event.kind == LIMITS:
            self._require_signed(entry, digest, signature)
        if event.result is not None:
            self.found.files[event.result.place] = EnteredFile(
                event.result.sha256,
                EntryPlace(entry.chain, number, digest),
                event.approval,
                supervisor,
            )
        return entry, digest, signature

    def _require_signed(self, entry: _Entry, digest: str, signature: str) -> None:
        event = entry.event
        finding = self._keys.finding(
            entry.number, event.kind, event.settings, digest, str(signature)
        )
        if finding is not None and finding.code != UNAPPROVED:
            raise FileError(finding)
        self.found.station_key = self._keys.station

    def _damaged(self, number: object) -> FileError:
        archive = printable(str(self.found.data / ARCHIVE))
        return FileError("archive.entry-damaged", number=str(number), archive=archive)


_readings: dict[Path, _Reading] = {}
_reader = Lock()


def entered_files(data: Path) -> EnteredFiles:
    """Return the files that the archive of a data folder holds.

    Raises `FileError` if an entry was changed or removed, is not signed by the station,
    or the archive lacks the last one that this user account remembers.
    """
    data = data.absolute()
    with _reader:
        reading = _read(data)
        found, hashes = reading.found, reading.hashes
        require_remembered(
            *(data / ARCHIVE, found.chain),
            lambda number: hashes[number - 1] if number <= len(hashes) else None,
        )
        if hashes and remembered_head(found.chain) is not None:
            remember_chain(data, found.chain)
        return replace(found, owed=owed_files(found.chain))


def _read(data: Path) -> _Reading:
    file = data / ARCHIVE
    try:
        if not file.is_file():
            return _not_begun(data)
        with closing(_connected(file)) as connection:
            chain = _chain_in(connection)
            if not chain:
                return _not_begun(data)
            require_own(data, chain)
            reading = _readings.get(data)
            if reading is None or not _is_continued(connection, reading, chain):
                reading = _Reading(data, chain)
            _readings.pop(data, None)  # unless the rest is sound
            reading.read_new(connection)
            _readings[data] = reading
            return reading
    except (sqlite3.Error, UnicodeDecodeError, OSError) as error:
        name = printable(str(file))
        raise FileError("archive.unusable", name=name, reason=str(error)) from error


def _chain_in(connection: sqlite3.Connection) -> str:
    """Return the chain of the entries; empty if there is none."""
    tables = "SELECT 1 FROM sqlite_master WHERE name = 'archive_entries'"
    if connection.execute(tables).fetchone() is None:
        return ""
    first, last = connection.execute(
        "SELECT (SELECT min(chain) FROM archive_entries),"
        " (SELECT max(chain) FROM archive_entries)"
    ).fetchone()
    if first != last:
        raise sqlite3.DatabaseError("it has several chains")
    return str(first or "")


def _connected(file: Path) -> sqlite3.Connection:
    """Open an archive read-only; nothing about it changes."""
    mode = "mode=ro" if Path(f"{file}-wal").exists() else "immutable=1"
    place = f"{file.as_uri()}?{mode}"
    connection = sqlite3.connect(place, uri=True, timeout=LONGEST_WAIT_S)
    # A text that was damaged is read all the same, to be named.
    connection.text_factory = lambda data: data.decode("utf-8", "surrogateescape")
    return connection


def _is_continued(
    connection: sqlite3.Connection, reading: _Reading, chain: str
) -> bool:
    """Return whether an archive still has the last entry that was read."""
    if chain != reading.found.chain:
        return False
    if not reading.hashes:
        return True
    row = connection.execute(
        "SELECT sha256 FROM archive_entries WHERE chain = ? AND number = ?",
        (chain, len(reading.hashes)),
    ).fetchone()
    return row is not None and row[0] == reading.hashes[-1]


def _not_begun(data: Path) -> _Reading:
    chain = known_station_name(data)
    require_own(data, chain)
    return _Reading(data, chain)


def require_own(data: Path, chain: str) -> None:
    """Refuse another chain than the one that this user account remembers here.

    ``station.pub`` names it as well, where the folder was moved.
    """
    for before in (remembered_chain(data), known_station_name(data)):
        if before not in ("", chain):
            require_remembered(data / ARCHIVE, before, lambda number: None)


def require_remembered(
    archive: Path | str, chain: str, hash_of: Callable[[int], str | None]
) -> None:
    """Refuse an archive that lacks the last entry that this user account remembers.

    ``hash_of`` returns the SHA-256 of the entry of a number, None without one.
    """
    head = remembered_head(chain) if chain else None
    if head is not None and hash_of(head.number) != head.sha256:
        raise FileError(
            "archive.rolled-back",
            archive=archive,
            number=head.number,
            memory=head_file(chain),
        )


def write_counted(
    data: Path,
    file: Path,
    content: bytes,
    supervisor: SigningKey | None = None,
    mode: int = 0o666,
) -> None:
    """Write a new file that counts; a supervisor approves it.

    When this returns, it is durable; when it raises or is killed, it is stored whole or
    not at all. Raises `NameTakenError` if there is one.
    """
    known = entered_files(data)
    chain, place = known.chain or station_name(data), known.place_of(file)
    digest = sha256(content).hexdigest()
    owed = OwedFile(place, digest, approval_of(supervisor, chain, place, digest))
    owe(chain, owed)
    try:
        create_whole(file, content, mode)
    except FileError:
        forget_owed(chain, owed)
        raise


def add_numbered(
    data: Path, folder: Path, content: bytes, supervisor: SigningKey | None = None
) -> Path:
    """Write a file that counts as the newest of a folder; see `write_counted`."""
    make_folder(folder)
    for free in count(1 + newest_number(folder)):
        file = numbered_file(folder, free)
        try:
            write_counted(data, file, content, supervisor)
        except NameTakenError:  # by another program, just now
            continue
        return file
    raise AssertionError
