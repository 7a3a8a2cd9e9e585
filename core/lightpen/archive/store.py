"""The database of an archive: its tables, opened for reading and writing."""

import sqlite3
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, closing, contextmanager, nullcontext
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from threading import Condition
from time import monotonic, sleep
from typing import Any

from sqlalchemy import (
    BigInteger,
    Boolean,
    Column,
    Connection,
    Engine,
    Executable,
    Index,
    Integer,
    MetaData,
    Row,
    String,
    Table,
    Text,
    create_engine,
    event,
    insert,
    inspect,
    select,
)
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.pool import QueuePool

from lightpen.errors import ArchiveError, FileError, NoArchiveError
from lightpen.formats.files import A_FILE, unreadable
from lightpen.messages import printable
from lightpen.record.library.entered_files import make_folder

# The tables of the archive: entries and records, on SQLite and PostgreSQL alike.
#
# The columns of an entry repeat its text: they serve the search, and
# `lightpen.archive.checks` compares them with it. Nothing but the entries says
# how far a chain has come.


METADATA = MetaData()

ENTRIES = Table(
    "archive_entries",
    METADATA,
    Column("chain", String(32), primary_key=True),
    Column("number", Integer, primary_key=True, autoincrement=False),
    Column("sha256", String(64), nullable=False),
    Column("since_us", BigInteger, nullable=False),  # since 1970 in UTC
    Column("kind", Text, nullable=False),
    Column("station", Text, nullable=False),
    Column("pen", Text, nullable=False),
    Column("tip", Text, nullable=False),
    Column("is_simulated", Boolean, nullable=False),
    Column("swing", Text, nullable=False),
    Column("result", Text, nullable=False),
    Column("concerns", String(64), nullable=False),
    Column("record_sha256", String(64), nullable=False),
    Column("text", Text, nullable=False),
    Column("at_us", BigInteger, nullable=False),  # by its own clock
    Column("signature", Text, nullable=False),  # as `lightpen.archive.chains`
    Index("archive_of_tip", "pen", "tip", "is_simulated", "kind", "since_us"),
    Index("archive_in_order", "since_us", "chain", "number"),
    Index("archive_of_station", "station", "since_us", "chain", "number"),
    Index("archive_of_swing", "chain", "swing"),
    Index("archive_of_result", "chain", "result"),
    Index("archive_of_entry", "concerns"),
    Index("archive_by_hash", "sha256"),
    Index("archive_by_record", "record_sha256"),
    Index("archive_by_clock", "at_us", "since_us", "chain", "number"),
)

RECORDS = Table(
    "archive_records",
    METADATA,
    Column("sha256", String(64), primary_key=True),
    Column("text", Text, nullable=False),
)


class UseCount:
    """Counts the users of an archive and admits no more once it is closing."""

    def __init__(self) -> None:
        self._changed = Condition()
        self._n = 0
        self._is_over = False

    @property
    def are_over(self) -> bool:
        """Whether new users are refused."""
        return self._is_over

    @contextmanager
    def one(self) -> Iterator[None]:
        """Use it."""
        with self._changed:
            if self._is_over:
                raise closed()
            self._n += 1
        try:
            yield
        finally:
            with self._changed:
                self._n -= 1
                self._changed.notify_all()

    def end(self, timeout_s: float) -> None:
        """Refuse new users and wait for the present ones, up to a time limit."""
        with self._changed:
            self._is_over = True
            self._changed.wait_for(lambda: self._n == 0, timeout_s)


def closed() -> ArchiveError:
    """Return the error that an archive is closed."""
    return ArchiveError("archive.closed")


# The database of an archive: a file of SQLite, or a server of PostgreSQL.
#
# It is examined before anything is written: one of another program, or of another
# version of this one, stays as it is. A new file gets the tables as they are now.


VERSION = "1"  # of the tables
VERSION_TABLE = "archive_version"
LONGEST_FAREWELL_S = 2  # for its users at closing
MALFORMED = "database disk image is malformed"  # as SQLite says it
LONGEST_WAIT_S = 10  # for another program to finish writing
PAUSE_S = 0.02  # between two attempts where SQLite does not retry

_VERSION = Table(
    VERSION_TABLE, MetaData(), Column("version_num", String(32), primary_key=True)
)


@dataclass(frozen=True)
class Database:
    """An archive that is open."""

    engine: Engine
    name: str  # file or address without the password, fit to be shown
    file: Path | None = None  # None of a server
    # Within which a connection is used.
    watch: Callable[[Connection], AbstractContextManager[object]] = nullcontext
    _uses: UseCount = field(
        default_factory=UseCount, init=False, repr=False, compare=False
    )

    @contextmanager
    def reading(self) -> Iterator[Connection]:
        """Read within one transaction."""
        with self._used(self.engine) as connection:
            yield connection

    def rows(
        self, wanted: Executable, values: Mapping[str, Any] | None = None
    ) -> Sequence[Row[Any]]:
        """Return the rows that a query finds, with values of its parameters."""
        with self.reading() as connection:
            return connection.execute(wanted, values).all()

    @contextmanager
    def writing(self) -> Iterator[Connection]:
        """Write within one exclusive transaction."""
        options = self.engine.execution_options(is_writing=True)
        with self._used(options) as connection:
            yield connection

    def close(self) -> None:
        """Close it after its present users have finished."""
        self._uses.end(LONGEST_FAREWELL_S)
        self.engine.pool.dispose()

    @contextmanager
    def _used(self, engine: Engine) -> Iterator[Connection]:
        with self._uses.one(), _converting_errors(self.name):
            try:
                with engine.begin() as connection, self.watch(connection):
                    yield connection
            finally:
                if self._uses.are_over:  # a late user closes its own connection
                    self.engine.pool.dispose()


def open_file(path: Path) -> Database:
    """Open the archive in a file, or make one."""
    name = printable(str(path))
    with _looking_at(path):
        is_there = path.exists()
    if is_there:
        with closing(_read_only(path)) as database:  # changes nothing
            known_version(database)
    try:
        make_folder(path.parent)
    except FileError as error:
        raise ArchiveError(error.message) from error

    def connect() -> sqlite3.Connection:
        with _closed_on_failure(_connected(str(path))) as connection:
            _write_ahead(connection)
            connection.execute("PRAGMA synchronous = FULL")
            return connection

    return _with_tables(Database(_sqlite_engine(connect), name, path))


def look_into(path: Path) -> Database:
    """Open the archive in a file read-only; nothing about it changes.

    Raises `NoArchiveError` if it is missing or nothing was ever entered.
    """
    database = _read_only(path)
    with _looking_at(path):
        is_there = path.is_file()
    if not is_there or known_version(database) is None:
        database.close()
        raise NoArchiveError("archive.missing", file=database.name)
    return database


def is_open(path: Path) -> bool:
    """Return whether a program has the archive in a file open, or was killed so."""
    with _looking_at(path):
        return Path(f"{path}-wal").exists()


def _read_only(path: Path) -> Database:
    mode = "mode=ro" if is_open(path) else "immutable=1"
    place = f"{path.absolute().as_uri()}?{mode}"
    engine = _sqlite_engine(partial(_connected, place))
    return Database(engine, printable(str(path)), path)


def _sqlite_engine(connect: Callable[[], sqlite3.Connection]) -> Engine:
    engine = create_engine("sqlite://", creator=connect, poolclass=QueuePool)
    event.listen(engine, "begin", _begin)
    return engine


def _connected(place: str) -> sqlite3.Connection:
    connection = sqlite3.connect(
        place,
        uri=place.startswith("file:"),
        timeout=LONGEST_WAIT_S,
        check_same_thread=False,
        # Transactions begin explicitly: by default, a writer's would
        # begin as a reader's, and two of them refuse each other.
        isolation_level=None,
    )
    # A text that was damaged is read all the same, to be named.
    connection.text_factory = lambda data: data.decode("utf-8", "surrogateescape")
    return connection


def _write_ahead(connection: sqlite3.Connection) -> None:
    """Let readers and a writer not hold up each other.

    For one who does so just then, or who writes, SQLite does not wait automatically.
    """
    deadline = monotonic() + LONGEST_WAIT_S
    while True:
        try:
            connection.execute("PRAGMA journal_mode = WAL")
            return
        except sqlite3.OperationalError as error:
            if error.sqlite_errorname != "SQLITE_BUSY" or monotonic() > deadline:
                raise
        sleep(PAUSE_S)


@contextmanager
def _closed_on_failure(connection: sqlite3.Connection) -> Iterator[sqlite3.Connection]:
    try:
        yield connection
    except BaseException:
        connection.close()
        raise


def _begin(connection: Connection) -> None:
    is_writing = connection.get_execution_options().get("is_writing", False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if is_writing else "BEGIN")


def known_version(database: Database) -> str | None:
    """Return the version of a database; None if it is empty.

    Raises `ArchiveError` if it is of another program or of another version of this one,
    and closes it.
    """
    try:
        with database.reading() as connection:
            found = _found_version(connection)
            if found is None and inspect(connection).get_table_names():
                raise ArchiveError("archive.of-other-program", name=database.name)
        if found not in (None, VERSION):
            raise ArchiveError("archive.later-version", name=database.name)
    except ArchiveError:
        database.close()
        raise
    return found


def _with_tables(database: Database) -> Database:
    """Make the tables of a new file; close it on failure."""
    try:
        with database.writing() as connection:
            if _found_version(connection) is None:
                for tables in (METADATA, _VERSION.metadata):
                    tables.create_all(connection, checkfirst=False)
                connection.execute(insert(_VERSION).values(version_num=VERSION))
    except ArchiveError:
        database.close()
        raise
    return database


def _found_version(connection: Connection) -> str | None:
    """Return the version of the tables; None if there are none."""
    if not inspect(connection).has_table(VERSION_TABLE):
        return None
    return connection.execute(select(_VERSION.c.version_num)).scalar_one_or_none()


@contextmanager
def _looking_at(path: Path) -> Iterator[None]:
    """Raise an error for a file that may not be read."""
    try:
        yield
    except OSError as error:
        raise ArchiveError(unreadable(path, A_FILE, error).message) from error


@contextmanager
def _converting_errors(name: str) -> Iterator[None]:
    """Translate errors of the database into messages for the user."""
    try:
        yield
    except SQLAlchemyError as error:
        cause = getattr(error, "orig", None)
        if getattr(cause, "sqlite_errorname", "").startswith("SQLITE_BUSY"):
            raise ArchiveError(
                "archive.busy", name=name, seconds=LONGEST_WAIT_S
            ) from error
        raise _unusable(name, _reason(error)) from error
    except UnicodeDecodeError as error:  # even SQLite's message is unreadable
        raise _unusable(name, MALFORMED) from error


def _reason(error: SQLAlchemyError) -> str:
    """Return the database's message without the statement."""
    said = str(getattr(error, "orig", None) or type(error).__name__).strip()
    return printable(said.splitlines()[0].strip().rstrip("."))


def _unusable(name: str, reason: str) -> ArchiveError:
    return ArchiveError("archive.unusable", name=name, reason=reason)
