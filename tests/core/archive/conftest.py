"""Archives and what is entered in them; a PostgreSQL server of this machine."""

import os
import secrets
import shutil
import socket
import socketserver
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from threading import Thread

import pytest

from lightpen.archive.chains import append, own_chain
from lightpen.archive.database import Database, open_file
from lightpen.archive.entries import Event, Kind, Written, text_sha256
from lightpen.record.names import Names

NOON = datetime(2026, 1, 2, 12, tzinfo=UTC)
PASSWORD = "a-secret-of-the-plant"
START_S = 60.0  # of a server, on a machine that does other things besides


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

    def enter(self, n_entries: int, first: int = 0) -> list[Written]:
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


class Postgres:
    """A server on the loopback, which can be stopped and started again."""

    def __init__(self, folder: Path, programs: Path) -> None:
        self._folder, self._programs = folder, programs
        with socket.create_server(("127.0.0.1", 0)) as free:
            self._port = free.getsockname()[1]
        self._user = "postgres" if os.geteuid() == 0 else None
        secret = folder / "password"
        secret.write_text(PASSWORD)
        if self._user is not None:
            for path in (folder, secret):
                shutil.chown(path, self._user)
        self._run(
            *("initdb", "--no-sync", "--auth=scram-sha-256", "--username=plant"),
            f"--pwfile={secret}",
        )
        self.start()

    def start(self) -> None:
        options = f"-p {self._port} -c listen_addresses=127.0.0.1 -k {self._folder}"
        self._run(
            *("pg_ctl", "start", "--wait", f"--timeout={START_S:.0f}"),
            *(f"--log={self._folder / 'log'}", f"--options={options}"),
        )

    def stop(self) -> None:
        self._run("pg_ctl", "stop", "--wait", "--mode=immediate")

    def new_database(self) -> str:
        """Return the address of a database that is made anew."""
        from sqlalchemy import create_engine, text

        name = f"plant_{secrets.token_hex(4)}"
        address = self.address("postgres").replace("://", "+psycopg://")
        engine = create_engine(address, isolation_level="AUTOCOMMIT")
        with engine.connect() as connection:
            connection.execute(text(f"CREATE DATABASE {name}"))
        engine.dispose()
        return self.address(name)

    def address(self, name: str, password: str = PASSWORD) -> str:
        return f"postgresql://plant:{password}@127.0.0.1:{self._port}/{name}"

    def _run(self, program: str, *words: str) -> None:
        subprocess.run(
            [self._programs / program, f"--pgdata={self._folder / 'data'}", *words],
            user=self._user,
            cwd=self._folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            check=True,
        )


@pytest.fixture(scope="session")
def postgres() -> Iterator[Postgres]:
    programs = sorted(Path("/usr/lib/postgresql").glob("*/bin/initdb"))
    if not programs:
        if os.environ.get("LIGHTPEN_POSTGRES") == "required":
            pytest.fail("PostgreSQL is not installed.")
        pytest.skip("PostgreSQL is not installed.")
    # Not among the folders of the tests: those of root nobody else may enter.
    with tempfile.TemporaryDirectory(prefix="lightpen-postgres-") as folder:
        server = Postgres(Path(folder), programs[-1].parent)
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
