"""How busy the live pipeline keeps a core, with images of a moving pen and without."""

import tempfile
import time
from itertools import cycle
from pathlib import Path

from benchmarks.labelling import CAMERA, PEN
from tests.simulated_plans import live_plan

from lightpen.arrays import Image
from lightpen.cameras.protocol import (
    CameraSettings,
    Frame,
    FrameTimeout,
    WorkerEvent,
    sealed,
)
from lightpen.detection.pixel_box import RegionOfInterest
from lightpen.live.pipeline import Live, LiveImage
from lightpen.messages import Message
from lightpen.record.results.result_folder import FolderArchive
from lightpen.swing.capture.state import SwingEvent
from lightpen.swing.runner import SwingRunner
from lightpen.swing.status import SwingStatus
from lightpen_extensions.simulator.camera import SimulatedCamera
from lightpen_extensions.simulator.image_plans import render_plan
from lightpen_extensions.simulator.scenes import Scene

N_IMAGES = 40  # of a swing, there and back
FRAME_RATE = 20.0  # images/s
SETTLING_S, SECONDS = 2.0, 10.0


class _Nobody:
    """Takes what is shown, and shows nothing."""

    def on_image(self, image: LiveImage) -> None: ...

    def on_camera(self, event: WorkerEvent, camera: int) -> None: ...

    def on_swing(self, status: SwingStatus, events: tuple[SwingEvent, ...]) -> None: ...

    def on_progress(self, fraction: float) -> None: ...

    def on_fault(self, message: Message) -> None: ...

    def on_fault_cleared(self, message: Message) -> None: ...


class _PreparedCamera(SimulatedCamera):
    """A camera whose images are there already; without any, none comes."""

    def __init__(self, images: list[Image]) -> None:
        super().__init__()
        self._images = cycle([*images, *images[::-1]])
        self._has_any = bool(images)
        self._n_read = 0
        self._due = time.monotonic()

    def read(self, timeout_s: float) -> Frame:
        if not self._has_any:
            time.sleep(timeout_s)
            raise FrameTimeout("camera.no-image-came", waited=timeout_s)
        self._due = max(self._due + 1 / FRAME_RATE, time.monotonic())
        time.sleep(max(self._due - time.monotonic(), 0.0))
        self._n_read += 1
        return Frame(next(self._images), self._n_read, time.monotonic_ns())


def live_loads() -> tuple[float, float]:
    """Return the shares of a core, with images of 5 MP at 20 a second and without."""
    plans = [live_plan(Scene(), i, i / FRAME_RATE) for i in range(N_IMAGES)]
    images = [sealed(render_plan(Scene(), plan)) for plan in plans]
    return _load(images), _load([])


def _load(images: list[Image]) -> float:
    with tempfile.TemporaryDirectory() as folder:
        nobody = _Nobody()
        runner = SwingRunner(Path(folder), FolderArchive(Path(folder)), nobody)
        live = Live([_PreparedCamera(images)], CameraSettings(), nobody, runner)
        live.set_region(RegionOfInterest(CAMERA, PEN))
        live.start()
        try:
            time.sleep(SETTLING_S)
            before = time.process_time()
            time.sleep(SECONDS)
            return (time.process_time() - before) / SECONDS
        finally:
            live.stop()
            runner.shut_down()
            runner.await_end(SECONDS)
