"""The archive, interrupted at random moments of writing.

Usage: python benchmarks/archive_cuts.py [KIND ...]

A process accepts tips, changes the tip library, makes notes, takes up entries of
another station, closes and seals the archive and opens it again, and tells what was
acknowledged. At a random moment it is killed, or stopped while another program enters
something; its disk becomes full, or read-only; or the power of the disk is cut, so that
all is lost that the system had not written to it yet. Then the archive must open and
pass its check, every acknowledged entry and file must be there, and the next start must
have entered each file once.

The kinds ``full``, ``read-only`` and ``power`` need a disk of their own, in a mount
namespace: the first any user may make where the system lets users have namespaces, the
others, ext4 in a file, the superuser alone.
"""

import argparse
import json
import os
import random
import select
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from threading import Thread

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.hostile_records import make_data
from benchmarks.machine import description
from benchmarks.rows import Row, table

from lightpen.archive.chains.chains import entries_of, heads
from lightpen.archive.chains.entries import StoredEntry
from lightpen.archive.checks.check import check_archive
from lightpen.archive.logbook.logbook import ARCHIVE, Logbook
from lightpen.archive.store.database import Database, look_into
from lightpen.errors import LightpenError, NoArchiveError
from lightpen.record.library.tip_library import library_files
from lightpen.record.results.result_folder import FolderArchive

SEED = 3
N_CUTS = 50  # of each kind
LONGEST_LIFE_S = 0.6  # from the first write to the cut
STOPPED_S = 0.1  # while another program enters something
WITHOUT_DISK_S = 0.1  # that a program goes on writing in vain
FULL_DISK, DISK = "48m", 64 * 2**20  # bytes
LARGEST_GAP = 300_000  # bytes that a full disk has left
GROWN = 20 * 10**6  # bytes of an archive, after which a new one is begun
VICTIM = Path(__file__).with_name("enter_until_cut.py")
# Of linux/ext4.h: end all writing at once, and leave its journal as it is.
EXT4_IOC_SHUTDOWN, NO_LOG_FLUSH = 0x8004587D, 2


@dataclass
class FrameCounters:
    """What became of what was written.

    Attributes
    ----------
    n_reported : int
        Entries and files that were acknowledged.
    n_lost : int
        Of these, what was not there after the cut.
    n_whole : int
        Cuts after which the archive opened and passed its check, and after which the
        next start entered each file once.
    n_faults : int
        Writes that failed, and were reported.
    faults : list of str
        What was wrong.
    """

    n_cuts: int = 0
    n_reported: int = 0
    n_lost: int = 0
    n_whole: int = 0
    n_faults: int = 0
    faults: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Place:
    """Where a kind of cut is tried.

    Attributes
    ----------
    folder : Path
        Where a disk is mounted, if the kind needs one.
    """

    folder: Path

    @property
    def data(self) -> Path:
        """Data folder."""
        return self.folder / "data"

    @property
    def archive(self) -> Path:
        """File of the archive."""
        return self.data / ARCHIVE


class Victim:
    """The process that is cut off, and what it reported."""

    def __init__(self, data: Path) -> None:
        self._process = subprocess.Popen(
            [sys.executable, str(VICTIM), str(data)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            bufsize=0,
        )
        self._child = 0
        self._unread = b""

    def begin(self) -> None:
        """Let it write, and return when it has begun."""
        assert self._process.stdin is not None
        self._process.stdin.write(b"go\n")
        self._child = int(self._line())
        assert self._line() == "begun"

    def signal(self, number: int) -> None:
        """Send it a signal."""
        os.kill(self._child, number)

    def reported(self) -> list[str]:
        """Return what it has reported by now and was not returned yet."""
        while select.select([self._output()], [], [], 0)[0]:
            self._unread += os.read(self._output(), 65536)
        *lines, self._unread = self._unread.split(b"\n")
        return [line.decode() for line in lines]

    def killed(self) -> list[str]:
        """Kill it, and return what it had reported."""
        self.signal(signal.SIGKILL)
        reported = []
        while (line := self._line()) != "dead":
            reported.append(line)
        return reported

    def close(self) -> None:
        """End it."""
        self._process.communicate()

    def _output(self) -> int:
        assert self._process.stdout is not None
        return self._process.stdout.fileno()

    def _line(self) -> str:
        while b"\n" not in self._unread:
            self._unread += os.read(self._output(), 65536)
        line, _, self._unread = self._unread.partition(b"\n")
        return line.decode()


def cut_rows() -> list[Row]:
    """Return what is left after cuts of each kind."""
    if not sys.platform.startswith("linux"):
        return [Row("archive, cut off while it writes", "needs Linux")]
    return [_row(kind, _apart(kind, N_CUTS)) for kind in KINDS]


def _row(kind: str, counters: FrameCounters | None) -> Row:
    what = f"archive, {WORDS[kind]} at {N_CUTS} random moments: "
    if counters is None:
        return Row(f"{what}lost, whole", "needs the superuser")
    for fault in counters.faults[:10]:
        print(f"{kind}: {fault}", file=sys.stderr)
    return Row(
        f"{what}lost of {counters.n_reported} acknowledged entries and files; times "
        "that the archive was intact",
        f"{counters.n_lost}; {counters.n_whole}",
        f"0; {N_CUTS}",
        met=(counters.n_lost, counters.n_whole) == (0, N_CUTS)
        and counters.n_reported > N_CUTS,
    )


def _apart(kind: str, n_cuts: int) -> FrameCounters | None:
    """Try a kind of cut in a mount namespace, if it needs one and may have it."""
    words = [sys.executable, __file__, "--counters", "--cuts", str(n_cuts), kind]
    if kind in ("full", "read-only", "power"):
        namespace = ["unshare", "--mount"]
        if os.geteuid() != 0:
            if kind != "full":
                return None
            namespace.append("--map-root-user")
        if subprocess.run([*namespace, "true"], check=False).returncode != 0:
            return None
        words = [*namespace, *words]
    reported = subprocess.run(words, stdout=subprocess.PIPE, text=True, check=True)
    return FrameCounters(**json.loads(reported.stdout))


def cut_off(kind: str, n_cuts: int) -> FrameCounters:
    """Cut the archive off again and again, and return what became of it."""
    rng, counters = random.Random(SEED), FrameCounters()
    with (
        tempfile.TemporaryDirectory(prefix="lightpen-cuts-") as folder,
        closing(KINDS[kind](Path(folder), rng)) as trial,
        closing(Victim(trial.place.data)) as victim,
    ):
        make_data(trial.place.data)
        for _ in range(n_cuts):
            victim.begin()
            time.sleep(rng.uniform(0, LONGEST_LIFE_S))
            _note(counters, trial.cut(victim), trial.place)
            if trial.place.archive.stat().st_size > GROWN:
                shutil.rmtree(trial.place.data)
                make_data(trial.place.data)
    return counters


class _Trial:
    """A kind of cut, and where it is tried; here, that it is killed."""

    def __init__(self, folder: Path, rng: random.Random) -> None:
        self.place, self._rng = Place(folder), rng

    def cut(self, victim: Victim) -> list[str]:
        """Cut a victim off, put right what was cut, and return what was reported."""
        return victim.killed()

    def close(self) -> None:
        """Give back what was taken for it."""


class _Stopped(_Trial):
    """It is stopped, and sometimes killed so; another program works meanwhile."""

    def cut(self, victim: Victim) -> list[str]:
        victim.signal(signal.SIGSTOP)
        reported: list[str] = []
        others = [
            Thread(target=do, args=(reported,)) for do in (self._enter, self._look)
        ]
        for other in others:
            other.start()
        time.sleep(STOPPED_S)
        if self._rng.random() < 0.5:
            victim.signal(signal.SIGCONT)
            time.sleep(self._rng.uniform(0, LONGEST_LIFE_S))
        reported += victim.killed()
        for other in others:
            other.join()
        return reported

    def _look(self, reported: list[str]) -> None:
        """Check the archive meanwhile."""
        with suppress(NoArchiveError), closing(look_into(self.place.archive)) as found:
            reported += [f"fault {each}" for each in check_archive(found).findings]

    def _enter(self, reported: list[str]) -> None:
        """Enter a note, as another program on the same data folder."""
        try:
            with closing(Logbook(self.place.data)) as logbook:
                logbook.enter_owed()
                (last, *_) = heads(logbook.database)
                reported.append(f"entry {last.sha256}")
        except LightpenError as error:
            reported.append(f"fault {error}")


class _Full(_Trial):
    """Its disk is full for a while."""

    def __init__(self, folder: Path, rng: random.Random) -> None:
        super().__init__(folder, rng)
        _run("mount", "-t", "tmpfs", "-o", f"size={FULL_DISK}", "none", str(folder))

    def cut(self, victim: Victim) -> list[str]:
        filler = self.place.folder / "filler"
        with filler.open("wb") as stream:
            left = os.fstatvfs(stream.fileno())
            n_free = left.f_bavail * left.f_frsize
            gap = self._rng.randrange(LARGEST_GAP)
            with suppress(OSError):  # it writes, too
                os.posix_fallocate(stream.fileno(), 0, max(1, n_free - gap))
        time.sleep(WITHOUT_DISK_S)
        filler.unlink()
        time.sleep(self._rng.uniform(0, LONGEST_LIFE_S))
        return victim.killed()

    def close(self) -> None:
        _run("umount", str(self.place.folder))


class _OnDisk(_Trial):
    """It writes on a disk that can be stopped."""

    def __init__(self, folder: Path, rng: random.Random) -> None:
        super().__init__(folder, rng)
        self._image = folder.with_suffix(".disk")
        with self._image.open("wb") as stream:
            stream.truncate(DISK)
        _run("mkfs.ext4", "-q", str(self._image))
        self._mount()

    def cut(self, victim: Victim) -> list[str]:
        # What it tells when the disk is gone, no cut of the power lets anybody hear.
        victim.signal(signal.SIGSTOP)
        reported = victim.reported()
        self.stop()
        victim.signal(signal.SIGCONT)
        time.sleep(WITHOUT_DISK_S)
        reported += [line for line in victim.killed() if line.startswith("fault")]
        _run("umount", str(self.place.folder))
        self._mount()
        return reported

    def stop(self) -> None:
        """Stop the disk."""
        raise NotImplementedError

    def close(self) -> None:
        _run("umount", str(self.place.folder))
        self._image.unlink()

    def _mount(self) -> None:
        options = "loop,errors=remount-ro"
        _run("mount", "-o", options, str(self._image), str(self.place.folder))


class _ReadOnly(_OnDisk):
    """The system makes its disk read-only, as it does after an error."""

    def stop(self) -> None:
        _run("sync", "-f", str(self.place.folder))
        device = self.place.folder.stat().st_dev
        name = Path(f"/sys/dev/block/{os.major(device)}:{os.minor(device)}").resolve()
        Path(f"/sys/fs/ext4/{name.name}/trigger_fs_error").write_text("1")


class _PowerCut(_OnDisk):
    """The disk has what was written to it, and nothing of what the system still had."""

    def stop(self) -> None:
        import fcntl  # which Windows does not have

        folder = os.open(self.place.folder, os.O_RDONLY)
        try:
            fcntl.ioctl(folder, EXT4_IOC_SHUTDOWN, struct.pack("I", NO_LOG_FLUSH))
        finally:
            os.close(folder)


KINDS: dict[str, Callable[[Path, random.Random], _Trial]] = {
    "kill": _Trial,
    "stop": _Stopped,
    "full": _Full,
    "read-only": _ReadOnly,
    "power": _PowerCut,
}
WORDS = {
    "kill": "killed",
    "stop": "stopped while another program entered something",
    "full": "its disk full",
    "read-only": "its disk read-only",
    "power": "its disk without power",
}


def _note(counters: FrameCounters, reported: list[str], place: Place) -> None:
    """Note what is there of what was reported."""
    of = Counter(line.partition(" ")[0] for line in reported)
    counters.n_cuts += 1
    counters.n_faults += of["fault"]
    entries = {
        line.removeprefix("entry ") for line in reported if line.startswith("entry")
    }
    files = {line.removeprefix("file ") for line in reported if line.startswith("file")}
    faults = [
        line.removeprefix("fault ") for line in reported if line.startswith("fault")
    ]
    counters.n_reported += len(entries) + len(files)
    lost = {file for file in files if not (place.data / file).is_file()}
    there = set[str]()
    try:
        with suppress(NoArchiveError), closing(look_into(place.archive)) as database:
            there |= {each.sha256 for each in _all_entries(database)}
            faults += map(str, check_archive(database, place.data).findings)
        faults += _faults_of_next_start(place.data)
    except LightpenError as error:
        faults.append(str(error))
    lost |= entries - there
    counters.n_lost += len(lost)
    counters.n_whole += not faults
    counters.faults += [*faults, *(f"{each} is lost." for each in sorted(lost))]


def _faults_of_next_start(data: Path) -> list[str]:
    """Return what the next start says, and which file has not one entry."""
    with closing(Logbook(data)) as logbook:
        faults = list(map(str, logbook.enter_owed()))
        entries = [each.entry for each in _all_entries(logbook.database)]
        faults += map(str, check_archive(logbook.database, data).findings)
    results = FolderArchive(data)
    files = [*results.all_files(), *library_files(data)]
    places = Counter(e.event.result.place for e in entries if e.event.result)
    wanted = dict.fromkeys(map(results.place_of, files), 1)
    if places != wanted:
        faults.append(f"Entered: {places}, and there are {list(wanted)}.")
    return faults


def _all_entries(database: Database) -> Iterator[StoredEntry]:
    for head in heads(database):
        yield from entries_of(database, head.chain)


def _run(*words: str) -> None:
    subprocess.run(words, check=True)


def main() -> int:
    """Measure, print the table, and return the exit status."""
    parser = argparse.ArgumentParser(description="Cut the archive off.")
    parser.add_argument("kinds", nargs="*", metavar="KIND", help=", ".join(KINDS))
    parser.add_argument("--cuts", type=int, default=N_CUTS)
    parser.add_argument(
        "--counters", action="store_true", help="print one kind's counters"
    )
    options = parser.parse_args()
    kinds = options.kinds or list(KINDS)
    if options.counters:
        print(json.dumps(asdict(cut_off(kinds[0], options.cuts))))
        return 0
    rows = [_row(kind, _apart(kind, N_CUTS)) for kind in kinds]
    print(f"{description()}\n\n{table(rows)}")
    return 0 if all(row.met for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
