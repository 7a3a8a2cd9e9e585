"""Enter tips at a station that delivers to a server, until it is ended.

Usage: python benchmarks/enter_for_plant.py FOLDER STATION, with the server's address in
LIGHTPEN_ARCHIVE

Prints JSON when its input ends: how many tips were put in force and entered, and how
long the slowest of them and the end of the program took.
"""

import json
import os
import sys
import time
from dataclasses import replace
from datetime import timedelta
from itertools import count
from pathlib import Path
from threading import Event, Thread

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.hostile_records import NAMES, make_data

from lightpen.archive.logbook.lazy_logbook import SERVER
from lightpen.archive.logbook.logbook import Logbook
from lightpen.record.results.result_folder import FolderArchive

PAUSE_S = 0.1  # between two tips


def main() -> int:
    """Enter, print, and return the exit status."""
    data, station = Path(sys.argv[1]), sys.argv[2]
    make_data(data)
    results = FolderArchive(data)
    first = results.in_force(NAMES.pen, NAMES.tip)
    assert first is not None
    names = replace(NAMES, station=station)
    logbook = Logbook(data, os.environ[SERVER])
    logbook.enter_owed()
    is_over = Event()
    Thread(target=_await_end, args=(is_over,), daemon=True).start()
    times = []
    for n in count(1):
        if is_over.wait(PAUSE_S):
            break
        at = first.accepted + timedelta(seconds=n)
        results.store(replace(first, names=names, accepted=at))
        start = time.perf_counter()
        logbook.enter_owed()
        times.append(time.perf_counter() - start)
    start = time.perf_counter()
    logbook.close()
    closed = time.perf_counter() - start
    reported = {"n": len(times), "slowest_s": max(times), "closed_s": closed}
    print(json.dumps(reported))
    return 0


def _await_end(is_over: Event) -> None:
    sys.stdin.read()
    is_over.set()


if __name__ == "__main__":
    sys.exit(main())
