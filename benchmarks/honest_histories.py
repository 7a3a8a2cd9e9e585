"""Honest histories with power cuts: whether the check accuses any of them.

Usage: python benchmarks/honest_histories.py [N [SEED]]

Each history is a data folder in which tips are accepted, the library is changed and
notes are made, while all is delivered to a PostgreSQL server under the role of a
station. Its program is killed at random moments, once to three times; then it is
started and ended properly. Neither the check of the folder nor that of the server may
have a finding.
"""

import os
import random
import shutil
import signal
import sys
import tempfile
import time
from contextlib import closing
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.hostile_records import NAMES, NOON, make_data
from benchmarks.machine import description
from benchmarks.postgres_server import Postgres, postgres_programs
from benchmarks.rows import Row, table
from msgspec import structs

from lightpen.archive.chains.entries import Kind
from lightpen.archive.checks.check import check_file
from lightpen.archive.history.queries import EntryFilter, newest
from lightpen.archive.logbook.logbook import Logbook
from lightpen.archive.replication.comparison import check_server, require_same
from lightpen.archive.replication.exchange import deliver
from lightpen.archive.replication.server import open_server
from lightpen.archive.store.database import look_into
from lightpen.formats.stored_messages import StoredMessage
from lightpen.record.library.entered_files import ARCHIVE
from lightpen.record.library.library_changes import Author, add_item, change_item
from lightpen.record.library.signing.keys import KEYS
from lightpen.record.library.tip_library import ItemKind, ListedCone, read_library
from lightpen.record.results.result_folder import FolderArchive
from lightpen.record.results.results import Result

SEED = 25
N_HISTORIES = 1000
MOST_CUTS = 3
LONGEST_LIFE_S = 1.5  # of a program until it is killed
CONE = ListedCone(id="C-1")
BY = Author("Bench", "Ann")
LONGEST_RECORD = 280_000  # characters, of 300 images


def accept(data: Path, logbook: Logbook, rng: random.Random) -> None:
    """Put a tip in force, and enter it."""
    results = FolderArchive(data)
    before = results.in_force(NAMES.pen, NAMES.tip)
    assert isinstance(before, Result)
    filler = StoredMessage("filler", "x" * rng.randrange(LONGEST_RECORD), {})
    at = before.accepted + timedelta(seconds=1)
    calibration = structs.replace(before.calibration, warnings=(filler,))
    results.store(replace(before, accepted=at, calibration=calibration))
    logbook.enter_owed()


def change_library(data: Path, logbook: Logbook, rng: random.Random) -> None:
    """Change a cone, and enter it."""
    note = f"seat {rng.random()}"
    known = read_library(data).item(ItemKind.CONE, CONE.id)
    add = add_item if known is None else change_item
    add(data, ListedCone(id=CONE.id, note=note), BY, NOON)
    logbook.enter_owed()


def note(data: Path, logbook: Logbook, rng: random.Random) -> None:
    """Have something to say of an entry."""
    found = newest(logbook.database, EntryFilter(kinds=(Kind.ACCEPTED,)), 1)
    for each in found:
        logbook.enter_note(each, "word " * rng.randrange(1000), "Ann")


WRITES = (accept, change_library, note)


def honest_row(n_histories: int = N_HISTORIES, seed: int = SEED) -> Row:
    """Return how many honest histories have a finding."""
    what = f"archive, {n_histories} honest histories with power cuts: with a finding"
    programs = postgres_programs()
    if programs is None or not hasattr(os, "fork"):
        return Row(what, "needs PostgreSQL")
    rng, n_cuts, n_accused, n_entries = random.Random(seed), 0, 0, 0
    with tempfile.TemporaryDirectory(prefix="lightpen-honest-") as name:
        folder = Path(name)
        folder.chmod(0o755)  # for the user of the server
        os.environ[KEYS] = str(folder / "keys")
        (folder / "server").mkdir()
        server = Postgres(folder / "server", programs)
        try:
            admin = server.new_database()
            for _ in range(n_histories):
                data = folder / "data"
                make_data(data)
                address = server.new_role(admin, "lightpen_station")
                for _ in range(rng.randint(1, MOST_CUTS)):
                    _live_until_cut(data, address, rng)
                    n_cuts += 1
                findings, n = _findings(data, address)
                for finding in findings:
                    print(finding, file=sys.stderr)
                n_accused += bool(findings)
                n_entries += n
                shutil.rmtree(data)
        finally:
            server.stop()
    return Row(
        f"{what}, after {n_cuts} cuts and {n_entries} entries",
        f"{n_accused}",
        "0",
        met=n_accused == 0 and n_entries > 3 * n_histories,
    )


def _live_until_cut(data: Path, address: str, rng: random.Random) -> None:
    """Let a program write and deliver, and kill it at a random moment."""
    seed, life_s = rng.random(), rng.uniform(0.02, LONGEST_LIFE_S)
    child = os.fork()
    if child == 0:
        try:
            _write_and_deliver(data, address, random.Random(seed))
        finally:
            os._exit(0)
    time.sleep(life_s)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)


def _write_and_deliver(data: Path, address: str, rng: random.Random) -> None:
    while True:
        logbook = Logbook(data)
        try:
            logbook.enter_owed()
            for _ in range(rng.randint(1, 4)):
                rng.choice(WRITES)(data, logbook, rng)
                with closing(open_server(address)) as server:
                    deliver(logbook.database, logbook.chain, server)
        finally:
            logbook.close()


def _findings(data: Path, address: str) -> tuple[list[str], int]:
    """Start and end the program; return all findings, and the number of entries."""
    with closing(Logbook(data)) as logbook, closing(open_server(address)) as server:
        faults = list(map(str, logbook.enter_owed()))
        require_same(logbook.database, logbook.chain, server)
        deliver(logbook.database, logbook.chain, server)
    checked = check_file(data / ARCHIVE, data, lambda fraction: None)
    with (
        closing(look_into(data / ARCHIVE)) as database,
        closing(open_server(address)) as server,
    ):
        there = check_server(database, server)
    faults += map(str, checked.findings + there.findings)
    return faults, checked.n_entries


def main() -> int:
    """Measure, print the table, and return the exit status."""
    row = honest_row(*map(int, sys.argv[1:3]))
    print(f"{description()}\n\n{table([row])}")
    return 0 if row.met else 1


if __name__ == "__main__":
    sys.exit(main())
