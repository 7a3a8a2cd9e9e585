"""Two stations that replicate to one PostgreSQL server, which fails at times.

Usage: python benchmarks/archive_plant.py

Two processes accept a tip every tenth of a second. Meanwhile the server is stopped at
once and started again, then the line to it is refused for a minute, then silent for a
minute, with what was open then silent for ever. In the end the server must have each
station's chain, entry for entry and in its order, and each append must have been quick
all the time.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from contextlib import closing
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.machine import description
from benchmarks.postgres_server import Postgres, postgres_programs
from benchmarks.relay import Line, Relay
from benchmarks.rows import Row, table

from lightpen.archive.chains.chains import chain_at_home, entries_of, heads
from lightpen.archive.checks.check import check_archive
from lightpen.archive.logbook.lazy_logbook import SERVER
from lightpen.archive.logbook.logbook import Logbook
from lightpen.archive.replication.server import open_server
from lightpen.archive.store.database import look_into
from lightpen.errors import ArchiveError
from lightpen.record.library.entered_files import ARCHIVE

STATIONS = ("Hall 2", "Hall 3")
WORKING_S, AWAY_S = 10.0, 60.0
STOPPED_S = 5.0  # that the server itself is down
LONGEST_DELIVERY_S = 300.0  # after all is well again
MAX_APPEND_S = 1.0
WRITER = Path(__file__).with_name("enter_for_plant.py")


def plant_rows(away_s: float = AWAY_S) -> list[Row]:
    """Return what two stations and their server come to."""
    what = "archive, two stations at one PostgreSQL, restarted, refused and silent"
    programs = postgres_programs()
    if programs is None:
        return [Row(what, "needs PostgreSQL")]
    with tempfile.TemporaryDirectory(prefix="lightpen-plant-") as folder:
        (Path(folder) / "server").mkdir()
        Path(folder).chmod(0o755)  # for the user of the server
        server = Postgres(Path(folder) / "server", programs)
        try:
            return _rows(what, Path(folder), server, away_s)
        finally:
            server.stop()


def _rows(what: str, folder: Path, server: Postgres, away_s: float) -> list[Row]:
    direct = server.new_database()
    relay = Relay(server.port)
    address = direct.replace(f":{server.port}/", f":{relay.port}/")
    stations = [_start(folder / name, name, address) for name in STATIONS]
    time.sleep(WORKING_S)
    server.stop()
    time.sleep(STOPPED_S)
    server.start()
    time.sleep(WORKING_S)
    for line in (Line.REFUSED, Line.SILENT):
        relay.become(line)
        time.sleep(away_s)
        relay.become(Line.OPEN)
        time.sleep(WORKING_S)
    reported = [json.loads(station.communicate()[0]) for station in stations]
    start = time.perf_counter()
    n_entries, n_wrong = _delivered([folder / name for name in STATIONS], address)
    took = time.perf_counter() - start
    relay.close()
    n_accepted = sum(each["n"] for each in reported)
    slowest = max(each["slowest_s"] for each in reported)
    closed = max(each["closed_s"] for each in reported)
    with closing(open_server(direct)) as database:
        findings = check_archive(database).findings
    for finding in findings:
        print(finding, file=sys.stderr)
    return [
        Row(
            f"{what} ({away_s:.0f} s each): entries of {n_accepted} tips accepted "
            "that the server lacks, has twice or out of order; changes found",
            f"{n_wrong}; {len(findings)}",
            "0; 0",
            met=n_wrong == 0 and not findings and n_entries >= n_accepted,
        ),
        Row(
            "- the slowest append; the end of the program; all delivered after",
            f"{slowest:.2f} s; {closed:.1f} s; {took:.1f} s",
            f"{MAX_APPEND_S:g} s",
            met=slowest <= MAX_APPEND_S,
        ),
    ]


def _start(data: Path, station: str, address: str) -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [sys.executable, str(WRITER), str(data), station],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, SERVER: address},
    )


def _delivered(folders: list[Path], address: str) -> tuple[int, int]:
    """Wait for what stations still have to deliver; return how many, and how wrong."""
    logbooks = [Logbook(folder, address) for folder in folders]
    deadline = time.monotonic() + LONGEST_DELIVERY_S
    try:
        while not all(_has_delivered(logbook) for logbook in logbooks):
            if time.monotonic() > deadline:
                break
            time.sleep(0.1)
    finally:
        for logbook in logbooks:
            logbook.close()
    n_entries = n_wrong = 0
    with closing(open_server(address)) as server:
        n_wrong += abs(len(heads(server)) - len(folders))
        for folder in folders:
            with closing(look_into(folder / ARCHIVE)) as database:
                chain = chain_at_home(database) or ""
                here = [each.text for each in entries_of(database, chain)]
            there = [each.text for each in entries_of(server, chain)]
            n_entries += len(here)
            n_wrong += abs(len(here) - len(there))
            n_wrong += sum(a != b for a, b in zip(here, there, strict=False))
    return n_entries, n_wrong


def _has_delivered(logbook: Logbook) -> bool:
    try:
        delivery = logbook.delivery()
    except ArchiveError:
        return False
    return delivery is not None and delivery.n_waiting == 0


def main() -> int:
    """Measure, print the table, and return the exit status."""
    rows = plant_rows()
    print(f"{description()}\n\n{table(rows)}")
    return 0 if all(row.met for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
