"""Write all parts of the archive repeatedly, in a process to be killed.

Usage: python benchmarks/enter_until_cut.py FOLDER

For each line of its input it forks; the child tells its number, and then what it has
acknowledged: ``file PLACE`` for a result or a change of the library, ``entry HASH`` for
an entry, ``fault TEXT`` for a write that failed with a message.
"""

import os
import random
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.hostile_records import NAMES, NOON
from benchmarks.write_until_killed import tell
from msgspec import structs

from lightpen.archive.chains.chains import heads
from lightpen.archive.chains.entries import ChainHead, Event, Kind, chained, text_sha256
from lightpen.archive.chains.growth import copy_entries
from lightpen.archive.history.queries import EntryFilter, newest
from lightpen.archive.logbook.logbook import Logbook
from lightpen.errors import LightpenError
from lightpen.formats.stored_messages import StoredMessage
from lightpen.record.library.library_changes import Author, add_item, change_item
from lightpen.record.library.tip_library import (
    ItemKind,
    ListedCone,
    library_files,
    read_library,
)
from lightpen.record.results.result_folder import FolderArchive
from lightpen.record.results.results import Result

CONE = ListedCone(id="C-1")
BY = Author("Bench", "Ann")
FOREIGN = "f" * 32  # a chain that is at home elsewhere
LONGEST_RECORD = 280_000  # characters, of 300 images
LONGEST_PAUSE_S = 0.01  # of an operator


def accept(data: Path, logbook: Logbook, rng: random.Random) -> None:
    """Put a tip in force, and enter it."""
    results = FolderArchive(data)
    before = results.in_force(NAMES.pen, NAMES.tip)
    assert isinstance(before, Result)
    filler = StoredMessage("filler", "x" * rng.randrange(LONGEST_RECORD), {})
    at = before.accepted + timedelta(seconds=1)
    calibration = structs.replace(before.calibration, warnings=(filler,))
    results.store(replace(before, accepted=at, calibration=calibration))
    tell("file", results.place_of(results.all_files()[-1]))
    logbook.enter_owed()


def change_library(data: Path, logbook: Logbook, rng: random.Random) -> None:
    """Change a cone, and enter it."""
    note = f"seat {rng.random()}"
    known = read_library(data).item(ItemKind.CONE, CONE.id)
    add = add_item if known is None else change_item
    add(data, ListedCone(id=CONE.id, note=note), BY, NOON)
    tell("file", library_files(data)[-1].relative_to(data).as_posix())
    logbook.enter_owed()


def note(data: Path, logbook: Logbook, rng: random.Random) -> None:
    """Have something to say of an entry."""
    found = newest(logbook.database, EntryFilter(kinds=(Kind.ACCEPTED,)), 1)
    for each in found:
        logbook.enter_note(each, "word " * rng.randrange(1000), "Ann")


def take_up(data: Path, logbook: Logbook, rng: random.Random) -> None:
    """Copy what was entered at another station."""
    known = {head.chain: head for head in heads(logbook.database)}
    head = known.get(FOREIGN, ChainHead(FOREIGN))
    record = f'{{"filler": "{"y" * rng.randrange(LONGEST_RECORD)}"}}'
    event = Event(
        kind=Kind.ACCEPTED,
        at=NOON,
        names=NAMES,
        program="bench",
        record_sha256=text_sha256(record),
    )
    entry = chained(head, event)
    copy_entries(logbook.database, FOREIGN, [entry], {text_sha256(record): record})


WRITES: tuple[Callable[[Path, Logbook, random.Random], None], ...] = (
    *(accept, note, change_library, take_up),
)


def write_until_cut(data: Path) -> None:
    """Open the archive, write in it, close and seal it, again and again."""
    rng = random.Random(os.getpid())
    tell("begun")
    while True:
        with telling_faults():
            logbook = Logbook(data)
            try:
                logbook.enter_owed()
                for write in rng.sample(WRITES, len(WRITES)):
                    with telling_faults():
                        write(data, logbook, rng)
                        for head in heads(logbook.database):
                            tell("entry", head.sha256)
                    time.sleep(rng.uniform(0, LONGEST_PAUSE_S))
            finally:
                logbook.close()


@contextmanager
def telling_faults() -> Iterator[None]:
    """Go on after what the program says of a write that failed."""
    try:
        yield
    except LightpenError as error:
        tell("fault", error)
        time.sleep(LONGEST_PAUSE_S)


def main() -> int:
    """Write until cut off, once for each line of the input."""
    for _ in sys.stdin:
        child = os.fork()
        if child == 0:
            tell(os.getpid())
            write_until_cut(Path(sys.argv[1]))
        os.waitpid(child, 0)
        tell("dead")
    return 0


if __name__ == "__main__":
    sys.exit(main())
