"""Files after the program is killed while writing.

Usage: python benchmarks/hostile_kills.py

For each kind of write a process does it over and over, tells what was acknowledged, and
is killed at a random moment. What was acknowledged must be there, whole and not mixed
with what came before, and the next start must leave nothing behind of the write that
was cut off.
"""

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.hostile_records import NAMES, make_data
from benchmarks.machine import description
from benchmarks.rows import Row, table

from lightpen.archive.checks import check_file
from lightpen.archive.logbook import Logbook
from lightpen.formats.files import write_whole
from lightpen.record.folder import OLDEST, sweep_leftovers
from lightpen.record.library.entered_files import ARCHIVE
from lightpen.record.results.result_folder import RECORDS, FolderArchive
from lightpen.record.swings.interrupted import find_unfinished
from lightpen.record.swings.reading import Record, open_record
from lightpen.record.swings.solving import source
from lightpen_app.work.settings_store import load

SEED = 5
N_KILLS = 60  # of each kind
LONGEST = 0.3  # s that a process lives
LONGEST_OF = {"accept": 1.5}  # opens the archive first
VICTIM = Path(__file__).with_name("write_until_killed.py")

Victim: TypeAlias = "subprocess.Popen[str]"

# Whether all is whole in a data folder after a kill, by what was reported before it.
Check = Callable[[Path, list[str]], bool]


@dataclass(frozen=True)
class KillCount:
    """What became of the writes of a kind.

    Attributes
    ----------
    n_reported : int
        Writes that were acknowledged.
    n_sound : int
        Kills that lost none of them, and mixed nothing.
    n_left : int
        Files and folders that were left behind after the next start.
    """

    n_reported: int
    n_sound: int
    n_left: int


def hostile_kill_rows() -> list[Row]:
    """Return what was left after kills of each kind of write."""
    if not hasattr(os, "fork"):
        return [Row("killed while it writes", "needs processes that fork")]
    with start_victim() as victim:
        outcomes = {kind: killed(victim, kind, N_KILLS) for kind in CHECKS}
    return [
        Row(
            f"killed {N_KILLS} times while it writes ({kind}), {outcome.n_reported} "
            "writes acknowledged: kills without lost or mixed data, files left behind",
            f"{outcome.n_sound}, {outcome.n_left}",
            f"{N_KILLS}, 0",
            met=outcome.n_sound == N_KILLS and outcome.n_left == 0,
        )
        for kind, outcome in outcomes.items()
    ]


def start_victim() -> Victim:
    """Return a process that writes what it is given, by one that can be killed."""
    return subprocess.Popen(
        [sys.executable, str(VICTIM)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        encoding="utf-8",
    )


def killed(victim: Victim, kind: str, n_kills: int) -> KillCount:
    """Kill a process again and again while it writes; return what was left."""
    rng = np.random.default_rng(SEED)
    n_sound = n_reported = n_left = 0
    with tempfile.TemporaryDirectory(prefix="lightpen-kills-") as folder:
        data = Path(folder)
        make_data(data)
        for _ in range(n_kills):
            seconds = float(rng.uniform(0, LONGEST_OF.get(kind, LONGEST)))
            reported = _reported_until_killed(victim, f"{kind}\t{folder}\n", seconds)
            n_reported += len(reported)
            n_sound += CHECKS[kind](data, reported)
            n_left += _n_left_after_start(data)
    return KillCount(n_reported, n_sound, n_left)


def _reported_until_killed(victim: Victim, wanted: str, seconds: float) -> list[str]:
    assert victim.stdin is not None
    assert victim.stdout is not None
    victim.stdin.write(wanted)
    victim.stdin.flush()
    child = int(victim.stdout.readline())
    time.sleep(seconds)
    os.kill(child, signal.SIGKILL)
    reported = []
    while (line := victim.stdout.readline().strip()) != "dead":
        reported.append(line)
    return reported


def _n_left_after_start(data: Path) -> int:
    """Do what a start does with leftovers, and return how many there are then."""
    if any(not (f / "header.json").exists() for f in (data / RECORDS).iterdir()):
        time.sleep(OLDEST)
    for part in data.rglob(".*.part"):  # as old as by the start of the next day
        os.utime(part, (0, 0))
    sweep_leftovers(data)
    load(data / "lightpen.json")
    if (data / "tip.json").exists():
        write_whole(data / "tip.json", (data / "tip.json").read_bytes())
    unmade = [f for f in (data / RECORDS).iterdir() if not (f / "header.json").exists()]
    return len(list(data.rglob(".*.part"))) + len(unmade)


def _swings_are_whole(data: Path, reported: list[str]) -> bool:
    """Check that every image that was acknowledged is there as it was."""
    if find_unfinished(data / RECORDS).damaged:
        return False
    kept = defaultdict[str, set[int]](set)
    for name, number in map(str.split, reported):
        kept[name].add(int(number))
    return all(
        numbers <= _sound_images(data / RECORDS / name)
        for name, numbers in kept.items()
    )


def _sound_images(folder: Path) -> set[int]:
    record = open_record(folder)
    for load_image in source(record).images[0].open():
        load_image()
    return set(record.all_numbers.tolist())


def _taken_out_is_one_edit(data: Path, reported: list[str]) -> bool:
    record: Record = open_record(data / RECORDS / "swing")
    out = tuple(sorted(record.excluded))
    return out in {(1, 3), (2, 4, 5)} or (not reported and out == (2,))


def _result_is_one(data: Path, reported: list[str]) -> bool:
    """Check that the last that was acknowledged is in force, or the one after."""
    found = FolderArchive(data).in_force(NAMES.pen, NAMES.tip)
    if found is None:
        return False
    x, y, _ = found.tip_pen.tolist()
    return not reported or (x == y and x >= float(reported[-1]))


def _accepted_is_not_accused(data: Path, reported: list[str]) -> bool:
    """Check that the next start enters what is owed, and nothing is found changed."""
    with closing(Logbook(data)) as logbook:
        faults = logbook.enter_owed()
    findings = check_file(data / ARCHIVE, data, lambda fraction: None).findings
    return not (faults or findings) and _result_is_one(data, reported)


def _taken_back_is_one_step(data: Path, reported: list[str]) -> bool:
    """Check that the tip that stays is in forceor the reported one beside it."""
    found = FolderArchive(data).in_force(NAMES.pen, NAMES.tip)
    if found is None:
        return False
    x, y, _ = found.tip_pen.tolist()
    last = int(reported[-1]) if reported else 0
    stays = bool(x > 0)  # others are negative
    if last < 0:  # put in force; taking it back may have been under way
        return stays or bool(x == y == last)
    return stays or bool(x == y < 0)  # the next may be in force by now


def _settings_are_one(data: Path, reported: list[str]) -> bool:
    loaded = load(data / "lightpen.json")
    if loaded.fault is not None:
        return False
    numbers = {loaded.content["last"].get(name, 0) for name in ("a", "b")}
    return len(numbers) == 1 and (not reported or max(numbers) >= int(reported[-1]))


def _json_is_one(data: Path, reported: list[str]) -> bool:
    path = data / "tip.json"
    if not path.exists():
        return not reported
    record = json.loads(path.read_bytes())
    return len(set(record["frames"])) == 1 and (
        not reported or record["frames"][0] >= int(reported[-1])
    )


CHECKS: dict[str, Check] = {
    "swing": _swings_are_whole,
    "resume": _swings_are_whole,
    "take out": _taken_out_is_one_edit,
    "accept": _accepted_is_not_accused,
    "take back": _taken_back_is_one_step,
    "settings": _settings_are_one,
    "json": _json_is_one,
}


def main() -> int:
    """Measure, print the table, and return the exit status."""
    rows = hostile_kill_rows()
    print(f"{description()}\n\n{table(rows)}")
    return 0 if all(row.met for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
