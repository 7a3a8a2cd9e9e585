"""The archive on a server: address, password and name.

A line to a server is encrypted, and the server proves its name, unless the address
says otherwise. A server that does not answer, or not any more, is given up.
"""

from collections.abc import Mapping
from typing import Any

from sqlalchemy import create_engine, event
from sqlalchemy.engine import URL, make_url
from sqlalchemy.exc import ArgumentError

from lightpen.archive.store.database import Database, known_version
from lightpen.errors import ArchiveError
from lightpen.messages import printable

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
    database = Database(engine, _without_password(url))
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
