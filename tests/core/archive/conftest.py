"""Archives and what is entered in them; a PostgreSQL server of this machine."""

import os
import socketserver
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from threading import Thread

import pytest
from benchmarks.postgres_server import Postgres, postgres_programs

from lightpen.archive.chains import (
    Event,
    Kind,
    StoredEntry,
    append,
    own_chain,
    text_sha256,
)
from lightpen.archive.store import Database, open_file
from lightpen.record.swings.header import Names

NOON = datetime(2026, 1, 2, 12, tzinfo=UTC)


def accepted(n: int, station: str = "Hall 2", tip: str = "T-10") -> tuple[Event, str]:
    """Return the acceptance of a tip, and its record."""
    record = f'{{"n": {n}, "inputs": {{"observations": []}}}}'
    event = Event(
        kind=Kind.ACCEPTED,
        at=NOON + timedelta(minutes=n),
        names=Names(station, "Ann", "LP-04", tip, "C-1", 10.0),
        program="lightpen 1",
        grade="pass",
        tip_pen_mm=(float(n), 0.0, -1.5),
        expanded_uncertainty_mm=(0.001, 0.002, 0.001),
        record_sha256=text_sha256(record),
    )
    return event, record


@dataclass(frozen=True)
class Station:
    """A data folder with an archive in which its chain is at home."""

    database: Database
    chain: str
    name: str

    def enter(self, n_entries: int, first: int = 0) -> list[StoredEntry]:
        entries = []
        for n in range(first, first + n_entries):
            entry = append(self.database, self.chain, *accepted(n, self.name))
            assert entry is not None
            entries.append(entry)
        return entries


@pytest.fixture
def make_station(tmp_path: Path) -> Iterator[Callable[[str], Station]]:
    opened: list[Database] = []

    def make(name: str = "Hall 2") -> Station:
        database = open_file(tmp_path / name / "archive.sqlite")
        opened.append(database)
        return Station(database, own_chain(database), name)

    yield make
    for database in opened:
        database.close()


@pytest.fixture
def station(make_station: Callable[[str], Station]) -> Station:
    return make_station("Hall 2")


@pytest.fixture(scope="session")
def postgres() -> Iterator[Postgres]:
    programs = postgres_programs()
    if programs is None:
        if os.environ.get("LIGHTPEN_POSTGRES") == "required":
            pytest.fail("PostgreSQL is not installed.")
        pytest.skip("PostgreSQL is not installed.")
    # Not among the folders of the tests: those of root nobody else may enter.
    with tempfile.TemporaryDirectory(prefix="lightpen-postgres-") as folder:
        server = Postgres(Path(folder), programs)
        yield server
        server.stop()


@pytest.fixture
def gopher() -> Iterator[int]:
    """Return the port of a server that speaks another language."""

    class Greeting(socketserver.BaseRequestHandler):
        def handle(self) -> None:
            self.request.recv(100)
            self.request.sendall(b"iWelcome to this gopher server\r\n")

    with socketserver.ThreadingTCPServer(("127.0.0.1", 0), Greeting) as server:
        Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
        yield server.server_address[1]
        server.shutdown()
