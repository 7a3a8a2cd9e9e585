"""Let the wizard capture a swing from a GigE Vision camera; print the result.

Usage: python benchmarks/linked_wizard.py SECONDS

One line of JSON: images looked at for the swing, and what became of the others; then
how long it took to tell that the camera was cut off, and to show its images again. The
camera is cut off once more and the program closed, which whoever started it may time
from the line on. The camera is `linked_camera.py`, in a process of its own.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

from PySide6.QtCore import QEventLoop, QTimer

from lightpen.cameras.protocol import CameraSettings, Connection, Region
from lightpen.model.limits import SwingLimits
from lightpen.record.swings.header import Names
from lightpen.swing.capture.state import Phase
from lightpen.swing.preparation import SourceChoice
from lightpen_app.application import Wizard, ended, make_application
from lightpen_app.work.settings import FilePaths, Settings, Station, StoredCamera
from lightpen_extensions.simulator.scene_files import write_sample_files
from lightpen_extensions.simulator.scenes import Scene
from lightpen_program.extensions import faces

CAMERA = Path(__file__).with_name("linked_camera.py")
ADDRESS, SERIAL = "127.0.0.1", "LP01"
FRAME_RATE, PACKET_SIZE, EXPOSURE_US = 25.0, 16_000, 1000.0
N_IMAGES = 10_000  # that no swing takes, so that it goes on
LONGEST_S = 60.0  # until something comes that is waited for


def main() -> int:
    """Measure, print, and return the exit status."""
    seconds = float(sys.argv[1])
    application = make_application(sys.argv[:1])
    scene = Scene()
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        camera = _plugged_in(stack)
        wizard = Wizard(
            application, faces(), _settings(Path(folder), scene), Path(folder)
        )
        wizard.show()
        _until(lambda: not wizard.workbench.selection.preparation.missing_inputs())
        while wizard.window.page().key != "swing":
            wizard.window.press_main()
            _run(0.1)
        run, live = wizard.workbench.run, wizard.workbench.live
        _until(
            lambda: (
                run.status.state is not None
                and run.status.state.phase is Phase.CAPTURING
            )
        )
        before, start = live.stats, time.perf_counter()
        _run(seconds)
        elapsed = time.perf_counter() - start
        stats = live.stats.since(before)
        connections: list[Connection] = []
        live.connection_changed.connect(connections.append)
        start = time.perf_counter()
        camera.kill()
        _until(lambda: Connection.LOST in connections)
        reported = time.perf_counter() - start
        camera = _plugged_in(stack)
        n_before, start = live.stats.delivered, time.perf_counter()
        _until(lambda: live.stats.delivered > n_before)
        back = time.perf_counter() - start
        camera.kill()
        found = {
            "seconds": elapsed,
            "reported": reported,
            "back": back,
            **asdict(stats),
        }
        print(json.dumps(found), flush=True)
        wizard.window.close_unasked()
        return ended(wizard, 0)


def _plugged_in(stack: ExitStack) -> "subprocess.Popen[str]":
    """Return a camera that is there until it is killed."""
    camera = stack.enter_context(
        subprocess.Popen(
            [sys.executable, str(CAMERA)], stdout=subprocess.PIPE, text=True
        )
    )
    stack.callback(camera.kill)
    assert camera.stdout is not None
    camera.stdout.readline()
    return camera


def _settings(folder: Path, scene: Scene) -> Settings:
    """Return those of a station with this camera and its files."""
    files = write_sample_files(scene, folder / "files")
    measured = folder / "measured"  # as for a real pen, without the simulator's mark
    measured.mkdir()
    settings = Settings(folder / "lightpen.json")
    region = Region(0, 0, *scene.camera.image_size)
    settings.set_camera(
        SERIAL,
        CameraSettings(
            *(EXPOSURE_US, None, FRAME_RATE, "Mono8", region, None, PACKET_SIZE)
        ),
    )
    station = Station(
        Names("", "Ann", "LP-04", "T-1", "C-1", 10.0),
        camera=StoredCamera(SourceChoice("aravis", ADDRESS)),
        files=FilePaths(
            str(shutil.copy(files.camera, measured)),
            str(shutil.copy(files.pen, measured)),
        ),
        limits=SwingLimits(min_images=N_IMAGES, max_images=N_IMAGES),
    )
    settings.set_station("Bench", station)
    settings.set_last(station="Bench")
    return settings


def _run(seconds: float) -> None:
    loop = QEventLoop()  # the application itself would close its windows at the end
    QTimer.singleShot(round(1000 * seconds), loop.quit)
    loop.exec()


def _until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + LONGEST_S
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError("What is waited for did not come.")
        _run(0.05)


if __name__ == "__main__":
    sys.exit(main())
