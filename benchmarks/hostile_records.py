"""Damage to results, records and settings: detected and undetected.

Usage: python benchmarks/hostile_records.py [N_MUTATIONS [SEED]]

Bits are flipped in an accepted result and in every file of its swing, one at a time;
each must be named, and none may put another tip, U, grade or date in force. Then the
readers get thousands of files that were damaged in worse ways, many with a right
checksum; they may end in the program's own errors alone.
"""

import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.json_mutations import flipped, mutated
from benchmarks.machine import description
from benchmarks.rows import Row, table
from benchmarks.small_records import small_record
from tests.simulated_centers import simulate_centers

from lightpen.errors import LightpenError
from lightpen.estimation.reports.verdict import Grade
from lightpen.model.names import Origin
from lightpen.record.library.signing import KEYS
from lightpen.record.results.result_folder import RECORDS, FolderArchive
from lightpen.record.results.results import Result
from lightpen.record.swings.header import HEADER, Names
from lightpen.record.swings.interrupted import find_unfinished
from lightpen.record.swings.reading import JOURNAL, OPENER, open_record, record_files
from lightpen.record.swings.solving import source
from lightpen.record.swings.writing import RecordWriter
from lightpen.swing.preparation import Preparation
from lightpen.swing.swing_recorder import read_resumable, record_header
from lightpen_app.work.settings import Settings, Station
from lightpen_extensions.simulator.scenes import Scene
from lightpen_extensions.simulator.simulator import SceneSimulator
from lightpen_extensions.simulator.swings import paper_camera, paper_pen, swing_poses

SEED = 11
N_FLIPS, N_MUTATIONS = 2000, 5000
N_IMAGES = 6

# The keys of what a benchmark writes are not the user's.
_ACCOUNT = tempfile.TemporaryDirectory(prefix="lightpen-keys-")
os.environ.setdefault(KEYS, _ACCOUNT.name)
NAMES = Names("Bench", "Bench", "LP-04", "T-10", "C-1", 10.0)
NOON = datetime(2026, 1, 2, 12, tzinfo=UTC)
IMAGE = np.random.default_rng(1).integers(0, 9, (512, 612), dtype=np.uint8)


@dataclass(frozen=True)
class Data:
    """A data folder with a result in force, an unfinished swing, and settings."""

    folder: Path
    swing: Path
    result: Path
    settings: Path

    @property
    def archive(self) -> FolderArchive:
        """Of the results."""
        return FolderArchive(self.folder)


def make_data(folder: Path) -> Data:
    """Make a data folder to be damaged."""
    simulator = SceneSimulator(Scene(camera=paper_camera(binning=4)))
    files = simulator.write_files(folder / "samples")
    preparation = Preparation(
        names=NAMES, camera_file=files.camera_file, pen_file=files.pen_file
    )
    swing = folder / RECORDS / "swing"
    camera, pen, rng = simulator.scene.camera, paper_pen(), np.random.default_rng(SEED)
    poses = swing_poses(N_IMAGES, rng, pen=pen, camera=camera)
    R, t = poses.rotations, poses.translations
    pixels = simulate_centers(camera, pen, R, t, 0.03, rng)
    with RecordWriter.create(swing, record_header(preparation)) as writer:
        for i in range(N_IMAGES):
            writer.append(IMAGE, pixels[i], R[i], t[i], i / 20)
        writer.set_excluded({2: "excluded"})
    archive = FolderArchive(folder)
    for x in (1.0, 2.0):
        archive.store(small_result(x, swing))
    _, newest = sorted(archive.folder.iterdir())
    settings = Settings(folder / "lightpen.json")
    settings.set_station("Hall 3", Station(Names(operator="Ann", pen="LP-04")))
    settings.set_last(station="Hall 3")
    settings.await_saved(60.0)
    return Data(folder, swing, newest, settings.file)


def unnamed_flips(data: Data, n_flips: int) -> tuple[int, int]:
    """Flip bits in the result in force, then in the files of its swing.

    Returns
    -------
    n_result, n_record : int
        Flips that no error named.
    """
    rng = np.random.default_rng(SEED)
    n_result = sum(
        not _is_named(lambda: data.archive.in_force(NAMES.pen, NAMES.tip), data.result)
        for _ in _flips([data.result], n_flips, rng)
    )
    record = record_files(open_record(data.swing))
    files = [file for file in record if file.name != OPENER]  # nothing reads that one
    n_record = sum(
        not _is_named(lambda: _read_all(data.swing), file)
        for file in _flips(files, n_flips, rng)
    )
    return n_result, n_record


def foreign_errors(data: Data, n_mutations: int, seed: int = SEED) -> list[str]:
    """Return the errors that are not the program's own, of all readers."""
    rng = np.random.default_rng(seed)
    readers: dict[Path, Callable[[], object]] = {
        data.result: lambda: _read_results(data),
        data.swing / HEADER: lambda: _read_record(data),
        data.swing / JOURNAL: lambda: _read_record(data),
        data.settings: lambda: _read_settings(data.settings),
    }
    found = []
    for number in range(n_mutations):
        file, read = list(readers.items())[number % len(readers)]
        content = file.read_bytes()
        with damaged(file, _mutated_file(file, content, rng)):
            try:
                read()
            except LightpenError:
                pass
            except Exception as error:  # that none comes is the trial
                found.append(f"{file.name} {number}: {error!r}")
    return found


def hostile_record_rows(n_mutations: int = N_MUTATIONS, seed: int = SEED) -> list[Row]:
    """Return what damage to results, records and settings leads to."""
    with tempfile.TemporaryDirectory(prefix="lightpen-hostile-") as folder:
        data = make_data(Path(folder))
        n_result, n_record = unnamed_flips(data, N_FLIPS)
        errors = foreign_errors(data, n_mutations, seed)
    for error in errors[:10]:
        print(error, file=sys.stderr)
    return [
        Row(
            f"{N_FLIPS} bits flipped in an accepted result, one at a time: detected",
            f"{N_FLIPS - n_result}",
            "all",
            met=n_result == 0,
        ),
        Row(
            "- in header, journal, images and files of its swing: detected",
            f"{N_FLIPS - n_record}",
            "all",
            met=n_record == 0,
        ),
        Row(
            f"{n_mutations} damaged results, records and settings: errors without "
            "a message of the program",
            f"{len(errors)}",
            "0",
            met=not errors,
        ),
    ]


def small_result(x: float, swing: Path) -> Result:
    """Return the result of a swing with the tip at (x / 3, ...) mm."""
    return Result(
        names=NAMES,
        accepted=NOON,
        grade=Grade.PASS,
        record=swing,
        images=tuple(range(1, N_IMAGES + 1)),
        origin=Origin.LIVE,
        calibration=small_record(
            {
                "tip_pen_mm": [x / 3, -90.0 / 7, -25.0 / 3],
                "expanded_uncertainty_mm": [0.001, 0.004 / 3, 0.005 / 3],
                "cone_cam_mm": [x, 200.0, 1000.0],
                "covariance": (np.eye(6) / 3e6).tolist(),
                "warnings": [],
            }
        ),
    )


@contextmanager
def damaged(file: Path, content: bytes) -> Iterator[None]:
    """Have a file hold this for a while."""
    before = file.read_bytes()
    file.write_bytes(content)
    try:
        yield
    finally:
        file.write_bytes(before)


def _flips(
    files: list[Path] | tuple[Path, ...], n_flips: int, rng: np.random.Generator
) -> Iterator[Path]:
    """Flip one bit after the other, and yield the file that it is in by turns."""
    for number in range(n_flips):
        file = files[number % len(files)]
        content = file.read_bytes()
        with damaged(file, flipped(content, int(rng.integers(8 * len(content))))):
            yield file


def _is_named(read: Callable[[], object], file: Path) -> bool:
    try:
        read()
    except LightpenError as error:
        return file.name in str(error)
    return False


def _read_all(swing: Path) -> None:
    """Read a record with all of its images."""
    for load in source(open_record(swing)).images[0].open():
        load()


def _read_results(data: Data) -> None:
    data.archive.of_record(data.swing)
    found = data.archive.in_force(NAMES.pen, NAMES.tip)
    if found is not None:
        found.accepted.astimezone()


def _read_record(data: Data) -> None:
    found = find_unfinished(data.folder / RECORDS)
    if len(found.interrupted) + len(found.damaged) > 1:
        raise AssertionError("One swing was found twice.")
    read_resumable(data.swing)


def _read_settings(file: Path) -> None:
    settings = Settings(file)
    settings.preferences()
    for name in settings.stations():
        settings.station(name)
    settings.last()


def _mutated_file(file: Path, content: bytes, rng: np.random.Generator) -> bytes:
    """Damage a file, or one line of it."""
    if file.name != JOURNAL or rng.random() < 0.2:
        return mutated(content, rng)
    lines = content.split(b"\n")
    index = int(rng.integers(len(lines) - 1))
    lines[index] = mutated(lines[index], rng)
    return b"\n".join(lines)


def main() -> int:
    """Measure, print the table, and return the exit status."""
    rows = hostile_record_rows(*map(int, sys.argv[1:]))
    print(f"{description()}\n\n{table(rows)}")
    return 0 if all(row.met for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
