"""The database of an archive: a file of SQLite, or a server of PostgreSQL.

It is looked at before anything is written: one of another program, or of a later
version of this one, stays as it is. One of an earlier version is brought up to date by
the steps in the folder ``migrations``.
"""

import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from sqlalchemy import (
    Connection,
    Engine,
    String,
    column,
    create_engine,
    event,
    inspect,
    select,
    table,
    text,
)
from sqlalchemy.engine import make_url
from sqlalchemy.exc import ArgumentError, SQLAlchemyError
from sqlalchemy.pool import QueuePool

from lightpen.archive.uses import Uses
from lightpen.errors import ArchiveError
from lightpen.formats.files import printable, strerror
from lightpen.sentences import sentence

VERSION = "1"  # of the tables, as the last of the migrations says
VERSION_TABLE = "archive_version"
MIGRATIONS = Path(__file__).with_name("migrations")
MIGRATING = 0x4C504152  # key of the lock by which one station at a time migrates
LONGEST_FAREWELL_S = 2  # for those who use it when it closes
LONGEST_WAIT_S = 10  # for another program to finish what it writes
# A server that does not answer, or not any more, is given up.
_CALLING = {
    "connect_timeout": 5,  # s
    "keepalives_idle": 5,
    "keepalives_interval": 2,
    "keepalives_count": 3,
    "tcp_user_timeout": 10_000,  # ms
}

_VERSION = table(VERSION_TABLE, column("version_num", String))


@dataclass(frozen=True)
class Database:
    """An archive that is open.

    Attributes
    ----------
    name : str
        File or address without the password, fit to be shown.
    file : Path or None
        None of a server.
    """

    engine: Engine
    name: str
    file: Path | None = None
    _uses: Uses = field(default_factory=Uses, init=False, repr=False, compare=False)

    @contextmanager
    def reading(self) -> Iterator[Connection]:
        """Read what is there at one moment.

        Raises
        ------
        ArchiveError
            It cannot be read, or was closed.
        """
        with self._uses.one(), _telling(self.name), self.engine.begin() as connection:
            yield connection

    @contextmanager
    def writing(self) -> Iterator[Connection]:
        """Write all of something or nothing of it; others wait meanwhile.

        Raises
        ------
        ArchiveError
            It cannot be written, or was closed.
        """
        options = self.engine.execution_options(is_writing=True)
        with self._uses.one(), _telling(self.name), options.begin() as connection:
            yield connection

    def close(self) -> None:
        """Let go of it, once those who use it now are done.

        A connection that is still in use would stay open after the others.
        """
        self._uses.end(LONGEST_FAREWELL_S)
        self.engine.dispose()


def open_file(path: Path) -> Database:
    """Open the archive in a file, or make one.

    Raises
    ------
    ArchiveError
        It is not of this program, or cannot be used.
    """
    name = printable(str(path))
    if path.exists():
        with closing(look_into(path)):  # which changes nothing
            pass
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise _unusable(name, strerror(error)) from error

    def connect() -> sqlite3.Connection:
        connection = _connected(str(path))
        connection.execute("PRAGMA journal_mode = WAL")
        connection.execute("PRAGMA synchronous = FULL")
        return connection

    return _brought_up_to_date(Database(_sqlite_engine(connect), name, path))


def look_into(path: Path) -> Database:
    """Open the archive in a file to be read only; nothing about it changes.

    Raises
    ------
    ArchiveError
        It is not of this program, or cannot be used.
    """
    name = printable(str(path))
    if not path.is_file():
        raise ArchiveError(
            sentence(
                "archive.missing",
                "There is no archive {file}. Check the data folder.",
                file=name,
            )
        )
    # With a journal beside it, somebody writes, or was killed while writing.
    mode = "mode=ro" if Path(f"{path}-wal").exists() else "immutable=1"
    place = f"{path.absolute().as_uri()}?{mode}"
    database = Database(_sqlite_engine(lambda: _connected(place)), name, path)
    return _looked_at(database)


def open_server(address: str) -> Database:
    """Open the archive on a server, or make its tables.

    Parameters
    ----------
    address : str
        ``postgresql://user:password@host/database``.

    Raises
    ------
    ArchiveError
        It does not answer, or not as an archive of this program.
    """
    try:
        url = make_url(address)
        if url.get_backend_name() != "postgresql":
            raise ArgumentError("no PostgreSQL")
        url = url.set(drivername="postgresql+psycopg")
        engine = create_engine(
            url,
            pool_pre_ping=True,  # a server that was restarted is called again
            connect_args=_CALLING,
        )
    except (ArgumentError, ValueError) as error:
        raise ArchiveError(
            sentence(
                "archive.no-address",
                "The address of the archive's server cannot be read. It has the form "
                "postgresql://user:password@host/database.",
            )
        ) from error
    except ModuleNotFoundError as error:
        raise ArchiveError(
            sentence(
                "archive.no-driver",
                "An archive on a server needs the package psycopg, which is not "
                'installed. Install it with: pip install "lightpen[postgres]".',
            )
        ) from error
    return _brought_up_to_date(Database(engine, url.render_as_string()))


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
        # Transactions begin where they are told to: by themselves, a writer's would
        # begin as a reader's, and two of them refuse each other.
        isolation_level=None,
    )
    # A text that was damaged is read all the same, to be named.
    connection.text_factory = lambda data: data.decode("utf-8", "surrogateescape")
    return connection


def _begin(connection: Connection) -> None:
    is_writing = connection.get_execution_options().get("is_writing", False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if is_writing else "BEGIN")


def _looked_at(database: Database) -> Database:
    """Return a database that holds nothing yet, or an archive that can be read."""
    try:
        with database.reading() as connection:
            found = _found_version(connection)
            if found is None and inspect(connection).get_table_names():
                raise _of_other_program(database.name)
        if found not in (None, VERSION):
            raise _of_later_version(database.name)
    except ArchiveError:
        database.close()
        raise
    return database


def _brought_up_to_date(database: Database) -> Database:
    _looked_at(database)
    try:
        with database.writing() as connection:
            if _found_version(connection) != VERSION:
                _migrate(connection)
    except ArchiveError:
        database.close()
        raise
    return database


def _found_version(connection: Connection) -> str | None:
    """Return of which version the tables are; None where there are none."""
    if not inspect(connection).has_table(VERSION_TABLE):
        return None
    return connection.execute(select(_VERSION.c.version_num)).scalar_one_or_none()


def _migrate(connection: Connection) -> None:
    """Bring the tables up to date, if nobody else has done so meanwhile."""
    # Half a second, which only the first start of a version takes.
    from alembic.migration import MigrationContext
    from alembic.operations import Operations
    from alembic.script import ScriptDirectory

    if connection.dialect.name == "postgresql":
        connection.execute(text(f"SELECT pg_advisory_xact_lock({MIGRATING})"))
    found = _found_version(connection) or "base"
    script = ScriptDirectory(str(MIGRATIONS))
    context = MigrationContext.configure(
        connection, opts={"version_table": VERSION_TABLE}
    )
    with Operations.context(context):
        for step in reversed(list(script.iterate_revisions("head", found))):
            step.module.upgrade()
    context.stamp(script, "head")


@contextmanager
def _telling(name: str) -> Iterator[None]:
    """Say what is the matter with a database as the user can understand it."""
    try:
        yield
    except SQLAlchemyError as error:
        raise _unusable(name, _reason(error)) from error


def _reason(error: SQLAlchemyError) -> str:
    """Return what the database says, without what was asked of it."""
    said = str(getattr(error, "orig", None) or type(error).__name__).strip()
    return printable(said.splitlines()[0].strip().rstrip("."))


def _unusable(name: str, reason: str) -> ArchiveError:
    return ArchiveError(
        sentence(
            "archive.unusable",
            "The archive {name} cannot be used: {reason}. See that its disk is not "
            "full and yours to write, or that its server runs and knows the user and "
            "the password.",
            name=name,
            reason=reason,
        )
    )


def _of_other_program(name: str) -> ArchiveError:
    return ArchiveError(
        sentence(
            "archive.of-other-program",
            "{name} holds the tables of another program, and stays as it is. Give the "
            "archive a database of its own.",
            name=name,
        )
    )


def _of_later_version(name: str) -> ArchiveError:
    return ArchiveError(
        sentence(
            "archive.later-version",
            "The archive {name} was written by a later version of the program, and "
            "stays as it is. Use that version.",
            name=name,
        )
    )
