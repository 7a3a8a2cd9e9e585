"""Damaged limits, keys, results, archives and imports: rejected, never valid.

Usage: python benchmarks/hostile_guard.py [N_MUTATIONS [SEED]]

A data folder with a supervisor password is damaged, one file at a time, as a hand with
write access but without password and key would. Whatever happens, what is read (limits,
key, result, library, verification, entries) is what was kept, or reading raises a
`LightpenError`, or the check of the archive tells of it. Processes that set limits,
introduce station keys or import are killed at random: afterwards all files are complete
and can be used further.
"""

import os
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.hostile_records import NAMES, small_result
from benchmarks.json_mutations import mutated
from benchmarks.mutations import mutated as mutated_bytes
from benchmarks.rows import Row

from lightpen.archive.chains.chains import entries_of, heads
from lightpen.archive.checks.check import check_archive
from lightpen.archive.events.station_events import event_of_station
from lightpen.archive.logbook.logbook import ARCHIVE, Logbook
from lightpen.archive.replication.exchange import export_entries, import_entries
from lightpen.archive.store.database import look_into, open_file
from lightpen.errors import LightpenError
from lightpen.model.limits import StationLimits, SwingLimits
from lightpen.record.folder.verifications import CONCLUSION
from lightpen.record.library.guard_files import LIMITS_FOLDER
from lightpen.record.library.library_changes import Author, add_item
from lightpen.record.library.signing.keys import KEYS, chain_of, key_folder
from lightpen.record.library.signing.station import memory_file
from lightpen.record.library.supervision import (
    Signature,
    read_supervision,
    require_supervisor,
)
from lightpen.record.library.supervision_changes import (
    renew_station_key,
    set_limits,
    set_password,
)
from lightpen.record.library.tip_library import LIBRARY, ListedTip, read_library
from lightpen.record.results.result_folder import RECORDS, RESULTS, FolderArchive
from lightpen.verification.storage.verification_files import keep_verification

N_MUTATIONS, N_KILLS, SEED = 10_000, 40, 7
NOON = datetime(2026, 1, 2, 12, tzinfo=UTC)
EVE = Signature("Eve", "correct horse")
STRICT = StationLimits(SwingLimits(0.0005))
LONGEST = 0.4  # s that a process lives
# A tip that a supervisor accepts though its verification did not pass.
ACCEPTED = {
    "program": {"name": "lightpen", "version": "1"},
    "created": NOON.isoformat(),
    "verification": CONCLUSION,
    "outcome": "accepted",
    "operator": "Ann",
    "supervisor": EVE.name,
    "reason": "for a trial",
}


@dataclass(frozen=True)
class Guarded:
    """A data folder with one file of each kind, its exported archive, and keys."""

    data: Path
    export: Path
    verification: Path
    result: Path
    archive: Path  # a copy that is only read

    @property
    def key(self) -> Path:
        """File of the present station key."""
        public = read_supervision(self.data).station_keys[-1]
        return key_folder() / f"{chain_of(public)}.key"

    @property
    def files(self) -> tuple[Path, ...]:
        """The files that are damaged."""
        limits = sorted((self.data / LIMITS_FOLDER).iterdir())
        library = sorted((self.data / LIBRARY).iterdir())
        others = memory_file(self.data), self.key, self.verification, self.result
        return (*limits, *library, *others, self.export, self.archive)


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
            key = require_supervisor(read_supervision(data), EVE)
            file = keep_verification(data, ACCEPTED, key, is_simulated=False)
            add_item(data, ListedTip(id=NAMES.tip), Author(signature=EVE), NOON)
            FolderArchive(data).store(small_result(1.0, data / RECORDS / "swing"))
            (result,) = sorted((data / RESULTS).iterdir())
            logbook.enter_owed()
            export_entries(logbook.database, export)
        copy = Path(folder, "copy", ARCHIVE)
        copy.parent.mkdir()
        shutil.copy(data / ARCHIVE, copy)
        try:
            yield Guarded(data, export, file, result, copy)
        finally:
            os.environ.pop(KEYS)
            if before is not None:
                os.environ[KEYS] = before


def damage(guarded: Guarded, n_mutations: int, seed: int = SEED) -> Counter[str]:
    """Damage a folder many times; return what came of it, ``wrong`` if bad."""
    rng, outcomes = np.random.default_rng(seed), Counter[str]()
    files, key_file = guarded.files, guarded.key
    contents = {file: file.read_bytes() for file in files}
    key = read_supervision(guarded.data).signers().station.public
    results = FolderArchive(guarded.data)
    n_exported = contents[guarded.export].count(b"\n") - 2
    archive = guarded.export.with_name("other") / ARCHIVE
    entered = _entered(guarded.archive)
    with closing(open_file(archive)) as other:
        for _ in range(n_mutations):
            file = files[int(rng.integers(len(files)))]
            spoil = mutated_bytes if file == guarded.archive else mutated
            file.write_bytes(spoil(contents[file], rng))
            try:
                if file == guarded.export:
                    import_entries(other, file)
                    is_right = sum(head.number for head in heads(other)) <= n_exported
                elif file == guarded.archive:
                    is_right = _is_found(file, entered)
                elif file == guarded.result:
                    current = results.in_force(NAMES.pen, NAMES.tip)
                    is_right = current is not None and current.tip_pen[0] == 1 / 3
                elif file.parent.name == LIBRARY:
                    is_right = list(read_library(guarded.data).tips) == [NAMES.tip]
                elif file == key_file:
                    found = read_supervision(guarded.data)
                    is_right = found.signers().station.public == key
                elif file == guarded.verification:
                    event = event_of_station(results, file).event
                    is_right = event.reason == ACCEPTED["reason"]
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


def _entered(archive: Path) -> list[str]:
    """Return the hashes of the entries in an archive."""
    with closing(look_into(archive)) as database:
        return [
            entry.sha256
            for head in heads(database)
            for entry in entries_of(database, head.chain)
        ]


def _is_found(archive: Path, entered: list[str]) -> bool:
    """Return whether the check finds damage, or there is none in the entries."""
    with closing(look_into(archive)) as database:
        has_findings = bool(check_archive(database).findings)
    return has_findings or _entered(archive) == entered


def killed_changes(guarded: Guarded, kind: str, n_kills: int, seed: int = SEED) -> int:
    """Kill processes that change something; return after how many all was whole.

    Parameters
    ----------
    kind : str
        One of `CHANGES`.
    """
    change, is_whole = CHANGES[kind]
    rng, n_right = np.random.default_rng(seed), 0
    for _ in range(n_kills):
        child = os.fork()
        if child == 0:
            try:
                for n in range(1, 1000):
                    change(guarded, n)
            finally:
                os._exit(0)
        time.sleep(float(rng.uniform(0, LONGEST)))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        try:
            n_right += is_whole(guarded)
        except LightpenError as error:
            print(error, flush=True)
    return n_right


def _set_limits(guarded: Guarded, n: int) -> None:
    limits = replace(STRICT, swing=SwingLimits(n / 1000))
    set_limits(guarded.data, "Hall 3", limits, EVE, NOON)


def _limits_are_whole(guarded: Guarded) -> bool:
    return read_supervision(guarded.data).limits["Hall 2"] == STRICT


def _introduce_key(guarded: Guarded, n: int) -> None:
    chain = read_supervision(guarded.data).chain
    renew_station_key(guarded.data, chain, None, NOON)


def _key_is_there(guarded: Guarded) -> bool:
    """Check that the present key signs, and that the archive takes its entries."""
    found = read_supervision(guarded.data)
    with closing(Logbook(guarded.data)) as logbook:
        owed = logbook.enter_owed()
    return found.signers().station.public == found.station_keys[-1] and owed == ()


def _import(guarded: Guarded, n: int) -> None:
    target = guarded.export.with_name("imported")
    shutil.rmtree(target, ignore_errors=True)
    with closing(open_file(target / ARCHIVE)) as other:
        import_entries(other, guarded.export)


def _import_goes_on(guarded: Guarded) -> bool:
    """Check that the next import completes what was cut off."""
    n_exported = guarded.export.read_bytes().count(b"\n") - 2
    archive = guarded.export.with_name("imported") / ARCHIVE
    with closing(open_file(archive)) as other:
        n_before = sum(head.number for head in heads(other))
        import_entries(other, guarded.export)
        n_after = sum(head.number for head in heads(other))
    return n_before <= n_exported == n_after


CHANGES: dict[str, tuple[Callable[[Guarded, int], None], Callable[[Guarded], bool]]] = {
    "limits are set": (_set_limits, _limits_are_whole),
    "station keys are introduced": (_introduce_key, _key_is_there),
    "entries are imported": (_import, _import_goes_on),
}


def hostile_guard_rows(
    n_mutations: int = N_MUTATIONS, n_kills: int = N_KILLS, seed: int = SEED
) -> list[Row]:
    """Return what becomes of damaged limits, keys and imports, and of kills."""
    kinds = CHANGES if hasattr(os, "fork") else ()
    with guarded_folder() as guarded:
        outcomes = damage(guarded, n_mutations, seed)
        right = {k: killed_changes(guarded, k, n_kills, seed) for k in kinds}
    return [
        Row(
            f"{n_mutations} damaged files of limits, keys, results, library, "
            "verifications, archives and imports: wrong ones that count, forged "
            "entries or tracebacks",
            str(outcomes["wrong"]),
            "0",
            met=not outcomes["wrong"],
        ),
        *(
            Row(
                f"killed {n_kills} times while {kind}: all files complete and usable",
                str(n_right),
                str(n_kills),
                met=n_right == n_kills,
            )
            for kind, n_right in right.items()
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
