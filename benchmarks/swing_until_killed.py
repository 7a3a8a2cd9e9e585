"""Begin or resume a swing of the simulated pen, and say which images are kept.

Usage: python benchmarks/swing_until_killed.py FOLDER

The wizard's swing without its window, with 2448 x 2048 images 20 times a second. It
prints ``resumed RECORD N`` with the number of images that it goes on with, and ``kept
RECORD NUMBER`` for each image that it has acknowledged. It does not end by itself.
"""

import os
import sys
from dataclasses import replace
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

from PySide6.QtCore import QCoreApplication

from lightpen.session.interrupted import find_unfinished, read_resumable
from lightpen.session.preparation import Names
from lightpen.session.swing_state import Event, Happening, SwingLimits
from lightpen_app.bench import Bench
from lightpen_app.settings import Settings

NAMES = Names("Bench", "Bench", "SIM-1", "T-1", "C-1", 10.0)
ENDLESS = SwingLimits(max_uncertainty=1e-9, max_images=100_000)


def main() -> int:
    """Swing until this process is killed."""
    folder = Path(sys.argv[1])
    application = QCoreApplication(sys.argv[:1])
    bench = Bench(Settings(folder / "lightpen.ini"), folder)
    run = bench.run

    def tell(event: Event) -> None:
        if event.what is Happening.KEPT and run.record_folder is not None:
            _say("kept", run.record_folder.name, *event.numbers)

    run.happened.connect(tell)
    bench.set_preparation(replace(bench.preparation, names=NAMES, limits=ENDLESS))
    bench.use_sample_files()
    bench.open_camera()
    operator = bench.live.operator
    if operator is not None:
        operator.seat()
    bench.live.set_following(True)
    offered = find_unfinished(run.records_folder).interrupted
    if offered:
        record = offered[0]
        run.go_on(read_resumable(record.folder))
        _say("resumed", record.folder.name, len(record.images))
    else:
        run.begin(bench.preparation)
    return application.exec()


def _say(*words: object) -> None:
    """Print a line at one stroke, so that none is left half by a kill."""
    os.write(1, (" ".join(map(str, words)) + "\n").encode())


if __name__ == "__main__":
    sys.exit(main())
