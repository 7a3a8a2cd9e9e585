"""Images that a swing keeps when its program is killed at random moments.

Usage: python benchmarks/killed.py

A process swings the simulated pen at 2448 x 2048 and says which images it has
acknowledged; SIGKILL ends it at a random moment of the capture, and the next process
resumes the swing. After each kill every acknowledged image must be in the record with
its checksum, the record must open, and it must be offered for resuming with all of
them. At the end it is solved.
"""

import subprocess
import sys
import tempfile
import threading
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.machine import description
from benchmarks.rows import Row, table

from lightpen.record.swings.interrupted import find_unfinished
from lightpen.record.swings.reading import Record, image_name, open_record
from lightpen.record.swings.solving import solve_record
from lightpen_extensions.simulator.swings import PAPER_TIP

N_KILLS = 20
SEED = 7
MOST_IMAGES = 12  # that one process keeps before it is killed
SOON = 0.1  # s after the last of them, in which the next may be under way
LONGEST = 60.0  # s that one process lives, should it keep nothing
MICROMETRES = 1000.0  # in a millimetre
SWING = Path(__file__).with_name("swing_until_killed.py")

Acknowledged = set[tuple[str, int]]


@dataclass
class Losses:
    """What became of the acknowledged images.

    Attributes
    ----------
    acknowledged : set of (str, int)
        Record and number of each.
    n_opened : int
        Kills after which the record opened and was offered for resuming.
    n_resumed : int
        Processes that went on with all images that were on the disk.
    """

    acknowledged: Acknowledged = field(default_factory=set)
    n_opened: int = 0
    n_resumed: int = 0


def killed_rows() -> list[Row]:
    """Return how many acknowledged images survived 20 kills."""
    what = f"wizard, killed {N_KILLS} times at random moments of a swing: "
    if sys.platform == "win32":
        return [Row(f"{what}images that survived", "needs SIGKILL")]
    with tempfile.TemporaryDirectory(prefix="lightpen-killed-") as folder:
        counters = _killed_again_and_again(Path(folder))
        (record,) = find_unfinished(Path(folder) / "records").interrupted
        n_left = len(counters.acknowledged & _on_disk(record))
        calibration = solve_record(record).calibration
    n_kept = len(counters.acknowledged)
    n_resumptions = N_KILLS - 1
    error = np.linalg.norm(calibration.joint.tip_pen - PAPER_TIP) * MICROMETRES
    return [
        Row(
            f"{what}acknowledged images that are there",
            f"{n_left} of {n_kept}",
            "all",
            met=n_left == n_kept > N_KILLS,
        ),
        Row(
            "- kills after which the record opened and was offered",
            f"{counters.n_opened} of {N_KILLS}",
            "all",
            met=counters.n_opened == N_KILLS,
        ),
        Row(
            "- resumed with all images on the disk",
            f"{counters.n_resumed} of {n_resumptions}",
            "all",
            met=counters.n_resumed == n_resumptions,
        ),
        Row(
            "- tip of that swing, distance from the true one",
            f"{error:.1f} µm, {int(calibration.used.sum())} images used",
        ),
    ]


def _killed_again_and_again(folder: Path) -> Losses:
    rng = np.random.default_rng(SEED)
    counters = Losses()
    for n_images in rng.integers(1, MOST_IMAGES + 1, N_KILLS).tolist():
        before = find_unfinished(folder / "records").interrupted
        kept, resumed = _killed_once(folder, n_images, rng.uniform(0, SOON))
        counters.acknowledged |= kept
        found = find_unfinished(folder / "records").interrupted
        counters.n_opened += len(found) == 1 and kept <= _on_disk(found[0])
        counters.n_resumed += bool(before) and resumed == len(before[0].images)
    return counters


def _killed_once(
    folder: Path, n_images: int, seconds: float
) -> tuple[Acknowledged, int]:
    """Swing, be killed so long after so many images; return what was reported."""
    kept: Acknowledged = set()
    resumed = 0
    with subprocess.Popen(
        [sys.executable, str(SWING), str(folder)],
        stdout=subprocess.PIPE,
        encoding="utf-8",
    ) as process:
        death = threading.Timer(LONGEST, process.kill)
        death.start()
        assert process.stdout is not None
        for line in process.stdout:
            word, record, number = line.split()
            if word == "resumed":
                resumed = int(number)
                continue
            kept.add((record, int(number)))
            if len(kept) == n_images:
                death.cancel()
                death = threading.Timer(seconds, process.kill)
                death.start()
        death.join()
    return kept, resumed


def _on_disk(record: Record) -> Acknowledged:
    """Return the images of a record that are there as they were recorded."""
    return {
        (record.folder.name, image.number)
        for image in open_record(record.folder).images
        for file in [record.folder / image_name(image.number)]
        if file.is_file() and sha256(file.read_bytes()).hexdigest() == image.sha256
    }


def main() -> int:
    """Measure, print the table, and return the exit status."""
    rows = killed_rows()
    print(f"{description()}\n\n{table(rows)}")
    return 0 if all(row.met for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
