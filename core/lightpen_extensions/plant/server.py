"""A server of a plant: how it is set up, what is delivered to it and fetched."""

import os
from bisect import bisect_left
from collections.abc import Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from threading import Event, Thread
from typing import Any

from sqlalchemy import create_engine, event
from sqlalchemy.dialects import postgresql
from sqlalchemy.engine import URL, make_url
from sqlalchemy.exc import ArgumentError
from sqlalchemy.schema import CreateIndex, CreateTable

from lightpen.archive.chains import (
    SHORT,
    StoredEntry,
    chain_at_home,
    chain_head,
    chain_names,
    hash_in,
)
from lightpen.archive.checks import check_archive
from lightpen.archive.store import (
    ENTRIES,
    RECORDS,
    VERSION,
    VERSION_TABLE,
    Database,
    known_version,
)
from lightpen.errors import ArchiveError, NameTakenError
from lightpen.formats.files import create_whole
from lightpen.messages import Message, message, printable
from lightpen.record.library.entered_files import make_folder
from lightpen_extensions.plant.copies import (
    CHAIN_WRITERS,
    batch_of,
    copy_entries,
    entries_of,
    given_up_in_time,
    records_of,
    reserve_number,
)

TLS = "verify-full"  # as libpq has it: encrypted, by a certificate for this name
_CALLING: Mapping[str, Any] = {
    "connect_timeout": 5,  # s
    "keepalives_idle": 5,
    "keepalives_interval": 2,
    "keepalives_count": 3,
    "tcp_user_timeout": 10_000,  # ms
}

# The server does the same, or it would wait for hours for a station whose line was
# cut, and hold its locks.
_SERVER_NOTICES = """\
SET tcp_keepalives_idle = 5;
SET tcp_keepalives_interval = 2;
SET tcp_keepalives_count = 3;
SET tcp_user_timeout = 10000;
SET idle_in_transaction_session_timeout = 60000;
SET lock_timeout = 30000"""


def open_server(address: str) -> Database:
    """Open the archive on a server.

    The address is ``postgresql://user@host/database`` with options of libpq such as
    ``?sslrootcert=FILE&passfile=FILE``.
    """
    url = _server_url(address)
    try:
        engine = create_engine(url, connect_args=dict(_CALLING))
        event.listen(engine, "connect", _ask_to_notice)
    except ModuleNotFoundError as error:
        raise ArchiveError("archive.no-driver") from error
    database = Database(engine, _without_password(url), watch=given_up_in_time)
    if known_version(database) is None:
        database.close()
        raise ArchiveError("archive.server-empty", name=database.name)
    return database


def _server_url(address: str) -> URL:
    """Return the URL of the driver; refuse an address that is not of PostgreSQL."""
    try:
        url = make_url(address)
        if url.get_backend_name() != "postgresql":
            raise ArgumentError("no PostgreSQL")
        if "@" in (url.host or ""):
            raise ArgumentError("a password with a sign that must be written as %40")
    except (ArgumentError, ValueError) as error:
        raise ArchiveError("archive.no-address") from error
    query = {"sslmode": TLS, **url.query}
    return url.set(drivername="postgresql+psycopg", query=query)


def _without_password(url: URL) -> str:
    """Return an address for display, without its password and options."""
    user = f"{url.username}@" if url.username else ""
    place = f"{url.host or 'localhost'}:{url.port}" if url.port else url.host or ""
    return printable(f"postgresql://{user}{place}/{url.database or ''}")


def _ask_to_notice(connection: Any, record: object) -> None:
    connection.autocommit = True  # a line cut here leaves nothing begun
    connection.execute(_SERVER_NOTICES)
    connection.autocommit = False


# SQL of the tables on a server and of the rights of its roles.
#
# A station adds entries and reads its own; it can change nothing. A chain belongs to
# the role that entered it first. Nothing on the server says how far a chain has come
# but the entries themselves, so that nothing there need ever be changed.


_HEADING = """\
-- The archive of Lightpen on PostgreSQL 13 or later. Run it once, in a database of its
-- own, as its owner:   lightpen archive server-sql | psql -v ON_ERROR_STOP=1 DATABASE
-- Each station gets its own role, and so does who reads the whole archive:
--     CREATE ROLE hall_2 LOGIN PASSWORD '...' IN ROLE lightpen_station;
--     CREATE ROLE quality LOGIN PASSWORD '...' IN ROLE lightpen_auditor;
-- A station whose role is replaced keeps its chain:
--     UPDATE archive_writers SET writer = 'hall_2_new' WHERE writer = 'hall_2';
BEGIN;
"""

_RIGHTS = f"""\
ALTER TABLE archive_writers ALTER writer SET DEFAULT current_user;
ALTER TABLE archive_entries
    ADD FOREIGN KEY (chain) REFERENCES archive_writers,
    ADD CONSTRAINT entry_hash
        CHECK (sha256 = encode(sha256(convert_to(text, 'UTF8')), 'hex')),
    -- For statistics, see docs/grafana; what is checked is the text.
    ADD grade TEXT GENERATED ALWAYS AS
        (substring(text FROM '"grade":"([^"]*)"')) STORED,
    ADD tip_mm TEXT GENERATED ALWAYS AS
        (substring(text FROM '"tip_pen_mm":\\[([^]]*)\\]')) STORED,
    ADD uncertainty_mm TEXT GENERATED ALWAYS AS
        (substring(text FROM '"expanded_uncertainty_mm":\\[([^]]*)\\]')) STORED;
CREATE INDEX archive_verdicts ON archive_entries (at_us)
    INCLUDE (station, kind, is_simulated, grade);
ALTER TABLE archive_records
    ADD CONSTRAINT record_hash
        CHECK (sha256 = encode(sha256(convert_to(text, 'UTF8')), 'hex'));
CREATE TABLE {VERSION_TABLE} (version_num VARCHAR(32) PRIMARY KEY);
INSERT INTO {VERSION_TABLE} VALUES ('{VERSION}');

DO $$ BEGIN
    CREATE ROLE lightpen_station NOLOGIN;
EXCEPTION WHEN duplicate_object THEN NULL; END $$;
DO $$ BEGIN
    CREATE ROLE lightpen_auditor NOLOGIN;
EXCEPTION WHEN duplicate_object THEN NULL; END $$;
REVOKE ALL ON archive_writers, archive_entries, archive_records, {VERSION_TABLE}
    FROM PUBLIC;
GRANT SELECT, INSERT ON archive_writers, archive_entries, archive_records
    TO lightpen_station;
GRANT SELECT ON archive_writers, archive_entries, archive_records TO lightpen_auditor;
GRANT SELECT ON {VERSION_TABLE} TO lightpen_station, lightpen_auditor;

ALTER TABLE archive_writers ENABLE ROW LEVEL SECURITY;
CREATE POLICY own ON archive_writers TO lightpen_station
    USING (writer = current_user) WITH CHECK (writer = current_user);
CREATE POLICY audit ON archive_writers FOR SELECT TO lightpen_auditor USING (true);

ALTER TABLE archive_entries ENABLE ROW LEVEL SECURITY;
CREATE POLICY own ON archive_entries TO lightpen_station
    USING (chain IN (SELECT chain FROM archive_writers))
    WITH CHECK (chain IN (SELECT chain FROM archive_writers));
CREATE POLICY audit ON archive_entries FOR SELECT TO lightpen_auditor USING (true);

-- A record is known by its hash: who may read an entry with it may read it.
ALTER TABLE archive_records ENABLE ROW LEVEL SECURITY;
CREATE POLICY own ON archive_records FOR SELECT TO lightpen_station USING (EXISTS (
    SELECT FROM archive_entries WHERE record_sha256 = archive_records.sha256));
CREATE POLICY new ON archive_records FOR INSERT TO lightpen_station WITH CHECK (true);
CREATE POLICY audit ON archive_records FOR SELECT TO lightpen_auditor USING (true);
COMMIT;
"""


def server_sql() -> str:
    """Return the SQL that an administrator runs once in the database of a server."""
    dialect = postgresql.dialect()  # type: ignore[no-untyped-call]
    made: list[CreateTable | CreateIndex] = []
    for table in (CHAIN_WRITERS, ENTRIES, RECORDS):
        indices = sorted(table.indexes, key=lambda index: str(index.name))
        made += [CreateTable(table), *map(CreateIndex, indices)]
    texts = (str(each.compile(dialect=dialect)).strip() + ";\n" for each in made)
    return _HEADING + "".join(texts) + _RIGHTS


# Comparison of a chain with its copy on a server.
#
# Each entry contains the hash of the one before: where one is the same on both sides,
# so are all before it.


@dataclass(frozen=True)
class ServerCheckResult:
    """Entries on a server, all examined, those not delivered yet, and discrepancies."""

    n_entries: int
    n_waiting: int
    findings: tuple[Message, ...]


def check_server(database: Database, server: Database) -> ServerCheckResult:
    """Check every entry and record on a server, and compare both sides.

    A server may show a station its own chain alone.
    """
    checked = check_archive(server)
    home = chain_at_home(database) or ""
    here, there = (chain_head(each, home).number for each in (database, server))
    found = [message("archive.on-server", finding=each) for each in checked.findings]
    return ServerCheckResult(
        n_entries=checked.n_entries,
        n_waiting=max(0, here - there),
        findings=(*found, *_findings(database, home, server)),
    )


def require_same(database: Database, chain: str, server: Database) -> None:
    """Refuse a server that is ahead of the own chain or differs."""
    for each in _findings(database, chain, server):
        raise ArchiveError(each)


def first_difference(
    database: Database, chain: str, server: Database, end: int
) -> int | None:
    """Return the number of the first entry, up to one, in which both sides differ."""

    def differs(number: int) -> bool:
        with database.reading() as here, server.reading() as there:
            return hash_in(here, chain, number) != hash_in(there, chain, number)

    if end == 0 or not differs(end):
        return None
    return 1 + bisect_left(range(1, end), True, key=differs)


def _findings(database: Database, chain: str, server: Database) -> Iterator[Message]:
    here, there = (chain_head(each, chain).number for each in (database, server))
    different = first_difference(database, chain, server, min(here, there))
    if different is not None:
        yield message("archive.server-differs", number=different, chain=chain[:SHORT])
    elif there > here:
        yield message("archive.server-ahead", here=here, there=there)


# Restores a data folder from the server: the entries of its chain, and their files.
#
# An entry of a result, a verification, a camera calibration or a change of the library
# has the file that states it, so that these are made again byte by byte. Swings and
# their images are on no server; limits may have the hash of a password, and are set
# again.


_UNSAFE = {"..", "."}


@dataclass(frozen=True)
class FetchResult:
    """Result of fetching."""

    n_entries: int
    n_files: int  # that were missing
    lost: tuple[str, ...]  # files of entries that are neither here nor on the server


def fetch(
    database: Database, data: Path, server: Database, chain: str = ""
) -> FetchResult:
    """Add the entries that a data folder lacks from its chain on a server, with files.

    ``chain`` is the start of the name of the chain of a folder that has none yet; not
    needed where the server shows one alone. Raises `ArchiveError` if the server has no
    such chain, or other entries than those that are here.
    """
    home = chain_at_home(database)
    if home is None or chain_head(database, home).number == 0:
        home = _chosen(server, chain)
    n_here, n_there = (chain_head(each, home).number for each in (database, server))
    if n_there == 0:
        raise ArchiveError("archive.nothing-to-fetch", name=server.name)
    number = first_difference(database, home, server, min(n_here, n_there))
    if number is not None:
        raise ArchiveError("archive.server-differs", number=number, chain=home[:SHORT])
    last = n_here
    while batch := batch_of(server, home, last):
        copy_entries(database, home, batch, records_of(server, batch))
        last = batch[-1].entry.number
    n_files, lost = _restore_files(database, data, home)
    return FetchResult(last - n_here, n_files, lost)


def _chosen(server: Database, start: str) -> str:
    """Return the chain of a server that is meant."""
    found = [chain for chain in chain_names(server) if chain.startswith(start)]
    if not found:
        raise ArchiveError("archive.nothing-to-fetch", name=server.name)
    if len(found) > 1:
        names = (_named(server, chain) for chain in found)
        raise ArchiveError("archive.which-chain", chains=", ".join(names))
    return found[0]


def _named(server: Database, chain: str) -> str:
    (last,) = batch_of(server, chain, chain_head(server, chain).number - 1)
    return f"{chain[:SHORT]} ({last.entry.event.names.station or '-'})"


def _restore_files(
    database: Database, data: Path, chain: str
) -> tuple[int, tuple[str, ...]]:
    """Write the files that are missing; return how many, and which are lost."""
    n_files, lost = 0, []
    for entry in entries_of(database, chain):
        file = _missing_file(entry, data)
        if file is None:
            continue
        content = _content(database, entry)
        if content is None:
            reserve_number(file)
            lost.append(file.relative_to(data).as_posix())
            continue
        make_folder(file.parent)
        try:
            create_whole(file, content)
        except NameTakenError:  # by another program, just now
            continue
        n_files += 1
    return n_files, tuple(lost)


def _missing_file(entry: StoredEntry, data: Path) -> Path | None:
    """Return the file that states an entry, if it is of this folder and missing."""
    result = entry.entry.event.result
    if result is None:
        return None
    place = PurePosixPath(result.place)
    if place.is_absolute() or _UNSAFE & set(place.parts) or place.suffix != ".json":
        raise ArchiveError(
            "archive.fetched-damaged",
            finding=message(
                "archive.vouched-missing", file=str(place), number=entry.entry.number
            ),
        )
    file = data / place
    return None if file.exists() else file


def _content(database: Database, entry: StoredEntry) -> bytes | None:
    event = entry.entry.event
    if event.result is None or event.record_sha256 != event.result.sha256:
        return None
    text = records_of(database, [entry]).get(event.record_sha256)
    return None if text is None else text.encode("utf-8", "surrogateescape")


# Delivery of entries to a server.
#
# Entries are delivered in their order, and what is there already is passed over: a
# delivery that was cut off is simply made again.


DELIVERED = 20  # entries at one time: some MB, which a slow line carries in time


@dataclass(frozen=True)
class Delivery:
    """Numbers of entries that a server got now, and had before."""

    n_new: int
    n_known: int


def deliver(database: Database, chain: str, server: Database) -> Delivery:
    """Copy the entries of a chain that a server lacks.

    Raises `ArchiveError` if it does not answer, is ahead of this chain, or holds other
    entries of it.
    """
    require_same(database, chain, server)
    known = last = chain_head(server, chain).number
    n_new = 0
    while batch := batch_of(database, chain, last)[:DELIVERED]:
        n_new += copy_entries(server, chain, batch, records_of(database, batch))
        last = batch[-1].entry.number
    return Delivery(n_new, known)


# Replication of a station's entries to a server whenever it is reachable.
#
# The archive of the station itself is what waits to be delivered: it has every entry
# before the server does, and keeps it. So nothing is lost while the server is away, and
# as entries are copied in their order and known ones passed over, none is doubled.
#
# The connection to the server is closed after each delivery: it has many stations to
# serve, and a line that is kept may be dead without either end knowing.


AGAIN_S = 30.0  # after a server did not answer
LOOK_S = 300.0  # interval of looking for entries of other programs


class Replicator:
    """Replicates the chain of a data folder to a server in its own thread.

    For the address see `lightpen_extensions.plant.server.open_server`. The server
    has ``n_delivered`` entries, None until it answered first; the fault is why the
    last attempt failed.
    """

    def __init__(self, database: Database, chain: str, address: str) -> None:
        self._database = database
        self._chain = chain
        self._address = address
        self._is_due, self._is_ending = Event(), Event()
        self.n_delivered: int | None = None
        self.fault: Message | None = None
        self._thread = Thread(target=self._run, name="delivery", daemon=True)
        self._is_due.set()
        self._thread.start()

    def wake(self) -> None:
        """Deliver soon."""
        self._is_due.set()

    def close(self, timeout_s: float) -> None:
        """Finish the current transfer, within a time limit, and end."""
        self._is_ending.set()
        self._is_due.set()
        self._thread.join(timeout_s)

    def _run(self) -> None:
        while True:
            self._is_due.wait(LOOK_S if self.fault is None else AGAIN_S)
            self._is_due.clear()
            try:
                with closing(open_server(self._address)) as server:
                    copied = deliver(self._database, self._chain, server)
                self.n_delivered = copied.n_known + copied.n_new
                self.fault = None
            except ArchiveError as error:
                self.fault = error.message
            if self._is_ending.is_set():
                break


SERVER = "LIGHTPEN_ARCHIVE"  # names the variable with the address of a server


def server_address() -> str:
    """Return the server address, by environment variable."""
    return os.environ.get(SERVER, "")
