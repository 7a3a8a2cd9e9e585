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

from lightpen.live.sources import SourceEnvironment
from lightpen.model.limits import SwingLimits
from lightpen.record.swings.header import Names
from lightpen.record.swings.interrupted import find_unfinished
from lightpen.swing.capture.state import SwingEvent, SwingEventKind
from lightpen.swing.swing_recorder import read_resumable
from lightpen_app.work.settings import Settings
from lightpen_app.work.workbench import Workbench
from lightpen_extensions.simulator.simulator import SceneSimulator

NAMES = Names("Bench", "Bench", "SIM-1", "T-1", "C-1", 10.0)
ENDLESS = SwingLimits(min_images=100_000, max_images=100_000)


def main() -> int:
    """Swing until this process is killed."""
    folder = Path(sys.argv[1])
    application = QCoreApplication(sys.argv[:1])
    simulator = SceneSimulator()
    around = SourceEnvironment(simulator)
    workbench = Workbench(Settings(folder / "lightpen.json"), folder, around)
    run = workbench.run

    def tell(event: SwingEvent) -> None:
        if event.what is SwingEventKind.KEPT and run.status.record_folder is not None:
            _say("kept", run.status.record_folder.name, *event.numbers)

    run.happened.connect(tell)
    files = simulator.write_files(folder / "samples")
    workbench.selection.set_preparation(
        replace(
            workbench.selection.preparation,
            names=NAMES,
            limits=ENDLESS,
            camera_file=files.camera_file,
            pen_file=files.pen_file,
        )
    )
    workbench.camera.open()
    operator = workbench.live.operator
    if operator is not None:
        operator.seat()
    workbench.live.set_following(True)
    offered = find_unfinished(run.records_folder).interrupted
    if offered:
        record = offered[0]
        resumable = read_resumable(record.folder)
        run.runner.ask(lambda workflow: workflow.continue_swing(resumable))
        _say("resumed", record.folder.name, len(record.images))
    else:
        chosen = workbench.selection.preparation
        run.runner.ask(lambda workflow: workflow.begin(chosen))
    return application.exec()


def _say(*words: object) -> None:
    """Print a line at one stroke, so that none is left half by a kill."""
    os.write(1, (" ".join(map(str, words)) + "\n").encode())


if __name__ == "__main__":
    sys.exit(main())
