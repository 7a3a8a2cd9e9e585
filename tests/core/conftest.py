"""A swing without a window: a runner, the simulated pen, and who hears of it."""

import shutil
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import pytest
from tests.faulty_camera import FaultyCamera

from lightpen.cameras.protocol import CameraSettings
from lightpen.detection.pen_detection import PenDetection, detect_pen
from lightpen.formats.opened_files import CameraFile, PenFile
from lightpen.formats.rig_files import read_rig
from lightpen.messages import Message
from lightpen.model.limits import SwingLimits
from lightpen.record.results.result_folder import RESULTS, SIMULATED, FolderArchive
from lightpen.record.results.results import Result
from lightpen.record.swings.header import Names
from lightpen.record.swings.interrupted import find_unfinished
from lightpen.record.swings.reading import open_record
from lightpen.record.swings.solving import Solution
from lightpen.record.swings.writing import RecordWriter
from lightpen.swing.capture.state import Phase, SwingEvent, SwingEventKind, SwingState
from lightpen.swing.preparation import Preparation, SecondCamera
from lightpen.swing.runner import SwingRunner
from lightpen.swing.status import SwingStatus
from lightpen.swing.swing_recorder import read_resumable
from lightpen_extensions.simulator.camera import GuidedOperator, SkippingClock
from lightpen_extensions.simulator.hand import SimulatedOperator
from lightpen_extensions.simulator.scene_files import write_sample_files
from lightpen_extensions.simulator.scenes import Scene
from lightpen_extensions.simulator.swings import paper_camera

TIMEOUT = 60.0  # s until a test gives up, on a machine that does other things besides
MANY = 600  # images, in which all that is to be seen is seen
FRAME_RATE = 6.0  # 1/s: a third of the usual one, as looking at an image takes long
SHORT = SwingLimits(max_uncertainty=0.05, min_images=12, min_per_field=0)


class Witness:
    """Hears what a runner tells, and lets a test wait for it."""

    def __init__(self) -> None:
        self.reported: list[tuple[SwingStatus, tuple[SwingEvent, ...]]] = []
        self.faults: list[str] = []
        self.reliefs: list[str] = []
        self.fractions: list[float] = []
        self.threads: set[threading.Thread] = set()  # that reported the swing
        self.follower: GuidedOperator | None = None
        self._changed = threading.Condition()

    def on_swing(self, status: SwingStatus, events: tuple[SwingEvent, ...]) -> None:
        if self.follower is not None and status.state is not None:
            self.follower.follow(status.state)
        self.threads.add(threading.current_thread())
        self._note(lambda: self.reported.append((status, events)))

    def on_progress(self, fraction: float) -> None:
        self._note(lambda: self.fractions.append(fraction))

    def on_fault(self, message: Message) -> None:
        self._note(lambda: self.faults.append(str(message)))

    def on_fault_cleared(self, message: Message) -> None:
        self._note(lambda: self.reliefs.append(str(message)))

    @property
    def statuses(self) -> list[SwingStatus]:
        return [status for status, _ in self.reported]

    @property
    def events(self) -> list[SwingEvent]:
        return [event for _, events in self.reported for event in events]

    @property
    def event_kinds(self) -> list[SwingEventKind]:
        return [event.what for event in self.events]

    def wait_until(self, is_so: Callable[[], bool]) -> None:
        with self._changed:
            assert self._changed.wait_for(is_so, TIMEOUT)

    def _note(self, note: Callable[[], None]) -> None:
        with self._changed:
            note()
            self._changed.notify_all()


@dataclass
class Station:
    """A runner, and a camera that sees the pen in its cone.

    The images are taken one after the other by the test itself: see `see`.
    """

    folder: Path
    preparation: Preparation
    runner: SwingRunner
    witness: Witness
    clock: SkippingClock
    operator: SimulatedOperator
    camera: FaultyCamera
    _last: PenDetection | None = None
    _first: SwingStatus = field(init=False)

    def __post_init__(self) -> None:
        self._first = self.runner.status

    @property
    def status(self) -> SwingStatus:
        return self.runner.status

    @property
    def state(self) -> SwingState:
        assert self.status.state is not None
        return self.status.state

    @property
    def solution(self) -> Solution:
        assert self.status.solution is not None
        return self.status.solution

    @property
    def record_folder(self) -> Path:
        assert self.status.record_folder is not None
        return self.status.record_folder

    @property
    def records(self) -> Path:
        return self.folder / "records"

    @property
    def results(self) -> Path:
        return self.folder / SIMULATED / RESULTS

    @property
    def archive(self) -> FolderArchive:
        return FolderArchive(self.folder)

    @property
    def n_recorded(self) -> int:
        return len(open_record(self.record_folder).images)

    @property
    def tip(self) -> list[float]:
        tip: list[float] = self.solution.calibration.joint.tip_pen.tolist()
        return tip

    def interrupted(self) -> list[Path]:
        """Return the folders of the swings that can be gone on with."""
        return [each.folder for each in find_unfinished(self.records).interrupted]

    def is_free(self, folder: Path) -> bool:
        """Return that a record can be written to; `FileError` while it cannot."""
        with RecordWriter.resume(open_record(folder)):
            return True

    def in_force(self) -> Result | None:
        names = self.preparation.names
        return self.archive.in_force(names.pen, names.tip, is_simulated=True)

    def new_camera(self) -> FaultyCamera:
        """Return another camera before the same pen, not open yet."""
        return FaultyCamera(self.camera.scene, self.clock, self.operator)

    def begin(self, limits: SwingLimits = SHORT) -> None:
        """Begin a swing, and wait until it has begun."""
        before = self.status.record_folder
        chosen = replace(self.preparation, limits=limits)
        self.runner.ask(lambda workflow: workflow.begin(chosen))
        self.wait_until(lambda: self.status.record_folder not in (None, before))

    def go_on(self, folder: Path) -> None:
        """Go on with an interrupted swing, and wait until it does."""
        resumable = read_resumable(folder)
        self.runner.ask(lambda workflow: workflow.continue_swing(resumable))
        self.wait_until(lambda: self.status.record_folder == folder)

    def solve(self) -> None:
        """End the capture, and wait for the verdict."""
        self.runner.ask(lambda workflow: workflow.finish())
        self.wait_for_phase(Phase.VERDICT)

    def see(self, n_images: int = 1) -> None:
        """Have so many images taken, after all that was commanded so far."""
        for _ in range(n_images):
            frame = self.camera.read(1.0)
            setup = self.status.setup if self.status.is_capturing else None
            wanted = setup or self.preparation.region
            assert wanted.camera is not None
            assert wanted.pen is not None
            self._last = detect_pen(
                *(frame.image, wanted.camera, wanted.pen, wanted.mask, self._last)
            )
            self.runner.process_image(frame, self._last, setup)

    def see_until(self, is_so: Callable[[], bool]) -> None:
        """Have images taken until something is so."""
        for _ in range(MANY):
            if is_so():
                return
            self.see()
        pytest.fail("It never came to that.")

    def keep(self, n_images: int) -> None:
        """Have images taken until so many more are kept."""
        wanted = self.state.n_kept + n_images
        self.see_until(lambda: self.state.n_kept >= wanted)

    def accept(self, reason: str = "It is seen to.") -> None:
        """Put the tip in force, and wait until it is."""
        self.runner.ask(lambda workflow: workflow.solving.accept(reason))
        self.wait_until(lambda: self.status.result is not None)

    def wait_until(self, is_so: Callable[[], bool]) -> None:
        """Wait until something is so, and the witness has heard of it."""
        self.witness.wait_until(lambda: is_so() and self._is_reported())

    def wait_for_phase(self, phase: Phase) -> None:
        self.wait_until(
            lambda: self.status.state is not None and self.state.phase is phase
        )

    def wait_until_solved(self) -> None:
        """Do what was commanded, and wait until nothing is computed any more."""
        self.see()
        self.wait_until(lambda: not self.status.is_solving)

    def _is_reported(self) -> bool:
        reported = self.witness.reported
        return self.status is (reported[-1][0] if reported else self._first)


@pytest.fixture(scope="session")
def prepared(tmp_path_factory: pytest.TempPathFactory) -> Preparation:
    """All that a swing needs; the camera has a quarter of the paper's pixels."""
    scene = Scene(camera=paper_camera(binning=2))
    files = write_sample_files(scene, tmp_path_factory.mktemp("files"))
    return Preparation(
        names=Names("Hall 2", "Ann", "LP-04", "T-10", "C-1", 10.0),
        camera_file=CameraFile.read(files.camera),
        pen_file=PenFile.read(files.pen),
        image_size=(scene.camera.width, scene.camera.height),
        limits=SHORT,
    )


@pytest.fixture(scope="session")
def prepared_by_two(
    tmp_path_factory: pytest.TempPathFactory, prepared: Preparation
) -> Preparation:
    """All that a swing before two cameras needs."""
    assert prepared.camera is not None
    scene = Scene(camera=prepared.camera)
    files = write_sample_files(scene, tmp_path_factory.mktemp("files_of_two"))
    rig_file = read_rig(files.rig)
    second = SecondCamera(rig_file=rig_file, image_size=prepared.image_size)
    return replace(prepared, pen_file=PenFile.read(files.pen), second=second)


@pytest.fixture
def station(tmp_path: Path, prepared: Preparation) -> Iterator[Station]:
    witness, clock = Witness(), SkippingClock()
    operator = SimulatedOperator(clock, seated=True)
    witness.follower = GuidedOperator(operator)
    assert prepared.camera is not None
    camera = FaultyCamera(Scene(camera=prepared.camera), clock, operator)
    camera.open()
    camera.configure(CameraSettings(frame_rate=FRAME_RATE))
    camera.start()
    runner = SwingRunner(tmp_path / "records", FolderArchive(tmp_path), witness)
    yield Station(tmp_path, prepared, runner, witness, clock, operator, camera)
    runner.shut_down()
    assert runner.await_end(TIMEOUT)
    camera.close()


@pytest.fixture
def interrupted(station: Station, swung: Callable[..., Path]) -> Path:
    """An interrupted swing of 20 images among the records."""
    folder = station.records / "interrupted"
    shutil.copytree(swung(), folder)
    return folder
