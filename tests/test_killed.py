"""Killed at any moment, a swing keeps every image that it acknowledged and goes on."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from time import sleep

import numpy as np
import pytest

from lightpen.record.swings.interrupted import find_unfinished
from lightpen.record.swings.reading import Record, image_name, is_record, open_record
from lightpen.record.swings.solving import solve_record
from lightpen_extensions.simulator.swings import PAPER_TIP

N_KILLS = 6  # `benchmarks` has more
STARTING = 0.6  # s in which a swing is begun or resumed
KEEPING = 0.05  # s in which an image is kept
FEWEST = 8  # images in all, or the test has not tested much

# Starts the wizard's swing without its window, in a new process for each line that it
# reads, and tells what was acknowledged. It forks, as importing takes a second.
PROGRAM = """
import os, sys, time
from dataclasses import replace
from pathlib import Path
from PySide6.QtCore import QCoreApplication
import lightpen_extensions.simulator.camera
from lightpen_extensions.simulator.hand import SimulatedOperator
from lightpen.cameras.protocol import CameraSettings
from lightpen_extensions.simulator.camera import SimulatedCamera
from lightpen.record.swings.interrupted import (find_unfinished,)
from lightpen.swing.swing_recorder import read_resumable
from lightpen.record.swings.header import Names
from lightpen.live.sources import SourceEnvironment
from lightpen.swing.capture.state import (SwingEventKind,)
from lightpen.model.limits import SwingLimits
from lightpen_extensions.simulator.scenes import Scene
from lightpen_extensions.simulator.swings import paper_camera
from lightpen_app.work.workbench import Workbench
from lightpen_app.work.settings import Settings
from lightpen_extensions.simulator.simulator import SceneSimulator

SPEED = 8
lightpen_extensions.simulator.camera.USUAL_FRAME_RATE = 7.0  # looking takes long
NAMES = Names("Hall 2", "Ann", "LP-04", "T-10", "C-1")
ENDLESS = SwingLimits(min_images=100_000, max_images=100_000)

class HastyClock:
    is_real = True

    def now_ns(self):
        return SPEED * time.monotonic_ns()

    def wait(self, seconds, wake=None):
        if wake is not None:
            return wake.wait(seconds / SPEED)
        time.sleep(max(seconds, 0.0) / SPEED)
        return False

def tell(*words):
    # At one stroke: a process that is killed must not leave half a line.
    os.write(1, (" ".join(map(str, words)) + "\\n").encode())

def swing(folder):
    application = QCoreApplication([])
    simulator = SceneSimulator(Scene(camera=paper_camera(binning=4)))
    around = SourceEnvironment(simulator, HastyClock())
    workbench = Workbench(Settings(folder / "lightpen.json"), folder, around)
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
    run = workbench.run

    def say(event):
        if event.what is SwingEventKind.KEPT:
            tell("kept", run.status.record_folder.name, *event.numbers)

    run.happened.connect(say)
    clock = around.clock
    operator = SimulatedOperator(clock, seated=True)
    camera = SimulatedCamera(simulator.scene, clock, operator)
    workbench.live.open([camera], CameraSettings(), clock)
    workbench.live.set_following(True)
    offered = find_unfinished(run.records_folder).interrupted
    if offered:
        resumed = read_resumable(offered[0].folder)
        tell("resumed", resumed.record.folder.name, resumed.state.n_kept)
        run.runner.ask(lambda workflow: workflow.continue_swing(resumed))
    else:
        chosen = workbench.selection.preparation
        run.runner.ask(lambda workflow: workflow.begin(chosen))
    application.exec()

for line in sys.stdin:
    child = os.fork()
    if child == 0:
        tell("started", os.getpid())
        swing(Path(sys.argv[1]))
    os.waitpid(child, 0)
    tell("dead")
"""


@dataclass(frozen=True)
class Life:
    """What one process reported until it was killed.

    Attributes
    ----------
    kept : tuple
        Folder and number of each image that it acknowledged.
    resumed : tuple or None
        Folder of the swing that it went on with, and the images that it had.
    """

    kept: tuple[tuple[str, int], ...]
    resumed: tuple[str, int] | None


class Program:
    """Lives and is killed again and again."""

    def __init__(self, process: "subprocess.Popen[str]") -> None:
        self._process = process

    def live(self, n_kept: int, seconds: float) -> Life:
        """Swing, be killed so long after so many images; return what was reported."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write("swing\n")
        self._process.stdin.flush()
        kept: list[tuple[str, int]] = []
        resumed, child = None, 0
        for line in self._process.stdout:
            match line.split():
                case ["dead"]:
                    break
                case ["started", number]:
                    child = int(number)
                case ["kept", folder, number]:
                    kept.append((folder, int(number)))
                case ["resumed", folder, number]:
                    resumed = folder, int(number)
            if child and len(kept) >= n_kept:
                sleep(seconds)
                os.kill(child, signal.SIGKILL)
                child, n_kept = 0, sys.maxsize
        return Life(tuple(kept), resumed)


@contextmanager
def program(folder: Path) -> Iterator[Program]:
    """Start the program that is to be killed."""
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM, str(folder)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        encoding="utf-8",
        env=os.environ | {"QT_QPA_PLATFORM": "offscreen"},
    ) as process:
        yield Program(process)


def assert_whole(record: Record) -> None:
    """Check that every image of a record is on the disk as it was recorded."""
    numbers = [image.number for image in record.images]
    assert numbers == list(range(1, len(numbers) + 1))
    for image in record.images:
        assert (
            sha256((record.folder / image_name(image.number)).read_bytes()).hexdigest()
            == image.sha256
        )


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs processes that fork")
def test_killed_at_any_moment_the_swing_keeps_what_it_acknowledged_and_goes_on(
    tmp_path: Path,
) -> None:
    rng = np.random.default_rng(20)
    records = tmp_path / "records"
    acknowledged = set[tuple[str, int]]()
    n_resumed = 0
    with program(tmp_path) as victim:
        for i in range(N_KILLS):
            offered = find_unfinished(records).interrupted
            if i % 3 == 2:
                life = victim.live(0, rng.uniform(0, STARTING))
            else:
                life = victim.live(int(rng.integers(1, 6)), rng.uniform(0, KEEPING))
            if life.resumed is not None:
                assert life.resumed == (offered[0].folder.name, len(offered[0].numbers))
                n_resumed += 1
            acknowledged |= set(life.kept)
            found = [open_record(f) for f in records.iterdir() if is_record(f)]
            for record in found:
                assert_whole(record)
            on_disk = {
                (r.folder.name, image.number) for r in found for image in r.images
            }
            assert acknowledged <= on_disk

    (record,) = find_unfinished(records).interrupted
    assert len(acknowledged) >= FEWEST
    assert n_resumed >= N_KILLS / 2
    calibration = solve_record(record).calibration
    assert np.abs(calibration.joint.tip_pen - PAPER_TIP).max() < 0.05
