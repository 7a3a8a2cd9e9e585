"""Damaged limits, keys, results and imports: refused in words, never in force.

Usage: python benchmarks/hostile_guard.py [N_MUTATIONS [SEED]]

A data folder with a supervisor password is damaged, one file at a time, as a hand with
write access but without password and key would. Whatever happens, the limits that are
read are those that were set, or reading raises a `LightpenError`. Processes that set
limits are killed at random: what is read afterwards are limits that were set.
"""

import os
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.json_mutations import mutated
from benchmarks.rows import Row

from lightpen.archive.chains import heads
from lightpen.archive.database import open_file
from lightpen.archive.exchange import export_entries, import_entries
from lightpen.archive.logbook import ARCHIVE, Logbook
from lightpen.errors import LightpenError
from lightpen.model.limits import StationLimits, SwingLimits
from lightpen.record.library.guard_files import LIMITS_FOLDER
from lightpen.record.library.supervision import Signature, read_supervision
from lightpen.record.library.supervision_changes import (
    renew_station_key,
    set_limits,
    set_password,
)
from lightpen.record.signing.keys import KEYS
from lightpen.record.signing.station import memory_file

N_MUTATIONS, N_KILLS, SEED = 10_000, 40, 7
NOON = datetime(2026, 1, 2, 12, tzinfo=UTC)
EVE = Signature("Eve", "correct horse")
STRICT = StationLimits(SwingLimits(0.0005))
LONGEST = 0.4  # s that a process lives


@dataclass(frozen=True)
class Guarded:
    """A data folder with limits, its exported archive, and the keys."""

    data: Path
    export: Path

    @property
    def files(self) -> tuple[Path, ...]:
        """The files that are damaged."""
        limits = sorted((self.data / LIMITS_FOLDER).iterdir())
        return (*limits, memory_file(self.data), self.export)


@contextmanager
def guarded_folder() -> Iterator[Guarded]:
    """Make a data folder with limits, two station keys and an archive."""
    before = os.environ.get(KEYS)
    with tempfile.TemporaryDirectory(prefix="lightpen-guard-") as folder:
        os.environ[KEYS] = str(Path(folder, "keys"))
        data, export = Path(folder, "data"), Path(folder, "all.jsonl")
        set_password(data, EVE, EVE.password, NOON)
        set_limits(data, "Hall 2", STRICT, EVE, NOON)
        with closing(Logbook(data)) as logbook:
            renew_station_key(data, logbook.chain, None, NOON)
            logbook.enter_owed()
            export_entries(logbook.database, export)
        try:
            yield Guarded(data, export)
        finally:
            os.environ.pop(KEYS)
            if before is not None:
                os.environ[KEYS] = before


def damage(guarded: Guarded, n_mutations: int, seed: int = SEED) -> Counter[str]:
    """Damage a folder many times; return what came of it, ``wrong`` if bad."""
    rng, outcomes = np.random.default_rng(seed), Counter[str]()
    contents = {file: file.read_bytes() for file in guarded.files}
    n_exported = contents[guarded.export].count(b"\n") - 2
    archive = guarded.export.with_name("other") / ARCHIVE
    with closing(open_file(archive)) as other:
        for _ in range(n_mutations):
            file = guarded.files[int(rng.integers(len(contents)))]
            file.write_bytes(mutated(contents[file], rng))
            try:
                if file == guarded.export:
                    import_entries(other, file)
                    is_right = sum(head.number for head in heads(other)) <= n_exported
                else:
                    found = read_supervision(guarded.data)
                    is_right = found.limits_at("Hall 2", StationLimits()) == STRICT
                outcomes["as set" if is_right else "wrong"] += 1
            except LightpenError:
                outcomes["refused"] += 1
            except Exception as error:
                outcomes["wrong"] += 1
                print(file.name, repr(error), flush=True)
            file.write_bytes(contents[file])
    return outcomes


def killed_changes(guarded: Guarded, n_kills: int, seed: int = SEED) -> int:
    """Kill processes that set limits; return after how many all was as it was set."""
    rng, n_right = np.random.default_rng(seed), 0
    for _ in range(n_kills):
        child = os.fork()
        if child == 0:
            for n in range(1, 1000):
                limits = replace(STRICT, swing=SwingLimits(n / 1000))
                set_limits(guarded.data, "Hall 3", limits, EVE, NOON)
            os._exit(0)
        time.sleep(float(rng.uniform(0, LONGEST)))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        try:
            n_right += read_supervision(guarded.data).limits["Hall 2"] == STRICT
        except LightpenError as error:
            print(error, flush=True)
    return n_right


def hostile_guard_rows(
    n_mutations: int = N_MUTATIONS, n_kills: int = N_KILLS, seed: int = SEED
) -> list[Row]:
    """Return what becomes of damaged limits, keys and imports, and of kills."""
    with guarded_folder() as guarded:
        outcomes = damage(guarded, n_mutations, seed)
        n_right = killed_changes(guarded, n_kills, seed) if hasattr(os, "fork") else 0
    return [
        Row(
            f"{n_mutations} damaged files of limits, keys and imports: other limits in "
            f"force, forged entries or tracebacks",
            str(outcomes["wrong"]),
            "0",
            met=not outcomes["wrong"],
        ),
        Row(
            f"killed {n_kills} times while limits are set: all limits as they were set",
            str(n_right),
            str(n_kills),
            met=n_right == n_kills,
        ),
    ]


def main() -> int:
    """Damage and kill; print what became of it, and return the exit status."""
    numbers = [int(word) for word in sys.argv[1:]]
    n_mutations, seed, *_ = *numbers, *(N_MUTATIONS, SEED)[len(numbers) :]
    rows = hostile_guard_rows(n_mutations, seed=seed)
    for row in rows:
        print(f"{row.what}: {row.measured} ({row.limit})")
    return 0 if all(row.met for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
