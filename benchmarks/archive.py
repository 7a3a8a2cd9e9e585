"""The archive with 100,000 entries.

Usage: python benchmarks/archive.py
"""

import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing, contextmanager
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.machine import description
from benchmarks.rows import Row, table

from lightpen.archive.chains import (
    ChainHead,
    Event,
    Kind,
    append,
    chained,
    entry_signature,
    own_chain,
    text_sha256,
)
from lightpen.archive.checks import check_archive
from lightpen.archive.history import EntryFilter, last_accepted, newest
from lightpen.archive.store import Database, open_file
from lightpen.record.library.entered_files import ARCHIVE
from lightpen.record.swings.header import Names
from lightpen_extensions.plant.copies import copy_entries

N_ENTRIES, N_TIPS = 100_000, 40
RECORD = "{" + " " * 280_000 + "}"  # as long as that of 300 images
SHORT_RECORD = '{"frames": []}'
BATCH = 5000
N_TIMED = 50
START = datetime(2026, 1, 2, 8, tzinfo=UTC)
MAX_APPEND_MS, MAX_LAST_MS, MAX_OPEN_MS, MAX_CHECK_S = 20.0, 5.0, 500.0, 60.0
MAX_BLOCKED_MS = 50.0


def _event(n: int, record: str) -> Event:
    return Event(
        kind=Kind.ACCEPTED,
        at=START + timedelta(minutes=n),
        names=Names("Hall 2", "Ann", f"LP-{n % 10:02}", f"T-{n % N_TIPS}", "C-1", 10.0),
        program="lightpen 1",
        grade="pass",
        tip_pen_mm=(float(n), 0.0, 0.0),
        expanded_uncertainty_mm=(0.001, 0.002, 0.001),
        record_sha256=text_sha256(record),
    )


def archive_rows() -> list[Row]:
    """Return how fast the archive is."""
    with _folder() as folder, closing(open_file(folder / ARCHIVE)) as database:
        chain = own_chain(database)
        _fill(database, chain)
        records = [RECORD.replace(" ", f'"n": {n}, ', 1) for n in range(N_TIMED)]
        events = [_event(N_ENTRIES + n, each) for n, each in enumerate(records)]
        pairs = zip(events, records, strict=True)
        appended = _milliseconds(
            partial(append, database, chain, event, record) for event, record in pairs
        )
        last = _milliseconds(
            partial(last_accepted, database, f"LP-{n % 10:02}", f"T-{n}")
            for n in range(N_TIPS)
        )
        shown = _milliseconds([partial(newest, database, EntryFilter(), 100)] * N_TIPS)
        history = _history_row(folder)
        start = time.perf_counter()
        checked = check_archive(database, folder)
        check_s = time.perf_counter() - start
    what = f"archive of {N_ENTRIES:,} entries: "
    return [
        _at_most(f"{what}append one with its record", appended, MAX_APPEND_MS),
        _at_most("- last result of a pen and a tip", last, MAX_LAST_MS),
        _at_most("- the newest 100", shown, MAX_OPEN_MS),
        history,
        Row(
            "- whole check",
            f"{check_s:.0f} s, {len(checked.findings)} changes found",
            f"{MAX_CHECK_S:.0f} s",
            met=check_s <= MAX_CHECK_S and not checked.findings,
        ),
    ]


def _history_row(folder: Path) -> Row:
    """Return how soon the step History opens, and how it scrolls from end to end."""
    script = Path(__file__).with_name("history_step.py")
    words = [sys.executable, str(script), str(folder)]
    outcome = subprocess.run(words, capture_output=True, text=True, check=True)
    reported = json.loads(outcome.stdout.splitlines()[-1])
    opened, blocked = reported["opened_ms"], reported["blocked_ms"]
    return Row(
        "- the step History: opened; 95 % of scrolls answer again after",
        f"{opened:.0f} ms; {blocked:.0f} ms",
        f"{MAX_OPEN_MS:g} ms; {MAX_BLOCKED_MS:g} ms",
        met=opened <= MAX_OPEN_MS and blocked <= MAX_BLOCKED_MS,
    )


def _fill(database: Database, chain: str) -> None:
    head = ChainHead(chain)
    records = {text_sha256(SHORT_RECORD): SHORT_RECORD}
    for first in range(0, N_ENTRIES, BATCH):
        entries = []
        for n in range(first, first + BATCH):
            event = _event(n, SHORT_RECORD)
            entry = chained(head, event)
            signature = entry_signature(head, event, entry.sha256)
            entries.append(replace(entry, signature=signature))
            head = ChainHead(chain, n + 1, entry.sha256, entry.entry.since)
        copy_entries(database, chain, entries, records)


def _milliseconds(acts: Iterable[Callable[[], object]]) -> list[float]:
    times = []
    for act in acts:
        start = time.perf_counter()
        act()
        times.append(1000 * (time.perf_counter() - start))
    return times


def _at_most(what: str, times: list[float], limit: float) -> Row:
    median = statistics.median(times)
    return Row(
        what,
        f"{median:.1f} ms, at most {max(times):.1f}",
        f"{limit:g} ms",
        met=median <= limit,
    )


@contextmanager
def _folder() -> Iterator[Path]:
    with tempfile.TemporaryDirectory(prefix="lightpen-archive-") as folder:
        yield Path(folder)


def main() -> int:
    """Measure, print the table, and return the exit status."""
    rows = archive_rows()
    print(f"{description()}\n\n{table(rows)}")
    return 0 if all(row.met for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
