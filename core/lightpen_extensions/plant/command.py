"""``lightpen archive deliver``, ``fetch``, ``server-sql`` and ``check --server``."""

import argparse
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from lightpen.archive.logbook import Logbook
from lightpen.archive.store import Database, open_file
from lightpen.commands.arguments import data_of
from lightpen.commands.console import printing, shown
from lightpen.errors import UsageError
from lightpen.messages import Message
from lightpen.record.library.entered_files import ARCHIVE
from lightpen_extensions.plant.server import (
    SERVER,
    check_server,
    deliver,
    fetch,
    open_server,
    server_address,
    server_sql,
)


def checked_copy(database: Database) -> tuple[tuple[Message, ...], str]:
    """Return what was changed in the copy on the server, and a sentence on it."""
    with _server() as server:
        there = check_server(database, server)
    words = f" On the server: {there.n_entries} entries"
    return there.findings, words + f", {there.n_waiting} not delivered yet."


@printing
def deliver_entries(options: argparse.Namespace) -> None:
    """Deliver the entries of a data folder."""
    with closing(Logbook(data_of(options))) as logbook, _server() as server:
        for fault in logbook.enter_owed():
            print(shown(str(fault)))
        copied = deliver(logbook.database, logbook.chain, server)
    print(f"{copied.n_new} entries are new, {copied.n_known} were there already.")


@printing
def fetch_entries(options: argparse.Namespace) -> None:
    """Restore entries and files of a data folder."""
    data = data_of(options)
    with _opened(data) as database, _server() as server:
        fetched = fetch(database, data, server, options.chain)
    print(f"{fetched.n_entries} entries and {fetched.n_files} files were restored.")
    for place in fetched.lost:
        print(shown(f"Not on the server: {place}"))


@printing
def print_sql(options: argparse.Namespace) -> None:
    """Print what sets up a server."""
    print(server_sql(), end="")


@contextmanager
def _server() -> Iterator[Database]:
    address = server_address()
    if not address:
        raise UsageError("archive.no-server", variable=SERVER)
    with closing(open_server(address)) as server:
        yield server


@contextmanager
def _opened(data: Path) -> Iterator[Database]:
    database = open_file(data / ARCHIVE)
    try:
        yield database
    finally:
        database.close()
