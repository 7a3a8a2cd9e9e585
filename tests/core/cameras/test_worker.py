import logging
import threading
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.faulty_camera import FaultyCamera
from typing_extensions import override

from lightpen.cameras.pairing import Clock, MachineClock
from lightpen.cameras.protocol import (
    CameraCapabilities,
    CameraSettings,
    ConfigError,
    Connection,
    ConnectionChanged,
    DeviceBusy,
    DeviceLost,
    DeviceNotFound,
    EndOfImages,
    Failed,
    FaultRaised,
    Frame,
    FrameIncomplete,
    FrameReady,
    FramesSkipped,
    FrameTimeout,
    ImageCamera,
    ProcessingKeepsUp,
    SettingsApplied,
    Stats,
    WorkerEvent,
    WorkerStopped,
    sealed,
)
from lightpen.cameras.replay import ReplayCamera
from lightpen.cameras.worker import CameraWorker, is_too_slow
from lightpen.formats.decoding import encode_png
from lightpen.model.camera import Camera
from lightpen_extensions.simulator.camera import SkippingClock
from lightpen_extensions.simulator.hand import SimulatedOperator
from lightpen_extensions.simulator.scenes import Scene

SCENE = Scene(camera=Camera(width=102, height=86, fx=193, fy=193, cx=51, cy=43))
TIMEOUT = 60.0  # s until a test gives up
N_IMAGES = 40
MANY = 10**6  # images, which nobody waits for
CALLS = {
    *("open", "close", "configure", "set_exposure", "set_gain"),
    *("start", "stop", "read", "probe", "stats"),
}


class Events:
    """Takes the events of a worker and lets a test wait for one."""

    def __init__(self) -> None:
        self.all: list[WorkerEvent] = []
        self._changed = threading.Condition()

    def __call__(self, event: WorkerEvent) -> None:
        with self._changed:
            self.all.append(event)
            self._changed.notify_all()

    def wait_for(self, is_wanted: Callable[[WorkerEvent], bool], after: int = 0) -> int:
        """Return the index of the first such event from ``after`` on."""

        def index() -> int | None:
            events = list(enumerate(self.all))[after:]
            return next((i for i, event in events if is_wanted(event)), None)

        with self._changed:
            assert self._changed.wait_for(lambda: index() is not None, TIMEOUT), (
                f"Only {self.all[after:]} came."
            )
            found = index()
            assert found is not None
            return found

    def connections(self) -> list[Connection]:
        with self._changed:
            changes = [e for e in self.all if isinstance(e, ConnectionChanged)]
        return [change.connection for change in changes]

    def faults(self, kind: type[Exception]) -> list[str]:
        with self._changed:
            faults = [e for e in self.all if isinstance(e, FaultRaised | Failed)]
        return [str(e.error) for e in faults if isinstance(e.error, kind)]


class SpiedCamera(FaultyCamera):
    """Notes who calls it, and when it is opened."""

    def __init__(self, clock: Clock) -> None:
        super().__init__(SCENE, clock, SimulatedOperator(clock, seated=True))
        self.clock = clock
        self.threads: set[int] = set()
        self.opened_at: list[float] = []
        self.n_opened = threading.Semaphore(0)

    @override
    def __getattribute__(self, name: str) -> Any:
        if name in CALLS:
            self.threads.add(threading.get_ident())
        return super().__getattribute__(name)

    @override
    def open(self) -> None:
        self.opened_at.append(self.clock.now_ns() * 1e-9)
        self.n_opened.release()
        super().open()


class HungCamera(FaultyCamera):
    """Does not come back from a read until it is let go."""

    def __init__(self) -> None:
        super().__init__(SCENE)
        self.reads = threading.Event()
        self.let_go = threading.Event()

    @override
    def read(self, timeout_s: float) -> Frame:
        self.reads.set()
        self.let_go.wait(TIMEOUT)
        return super().read(timeout_s)


class PacedCamera(FaultyCamera):
    """Sends as many images as it may."""

    def __init__(self) -> None:
        super().__init__(SCENE)
        self.may_send = threading.Semaphore(0)

    @override
    def read(self, timeout_s: float) -> Frame:
        assert self.may_send.acquire(timeout=TIMEOUT)
        return super().read(timeout_s)


class LinkedCamera(SpiedCamera):
    """Sends its images over a link."""

    @property
    @override
    def caps(self) -> CameraCapabilities:
        return replace(super().caps, has_link=True)


class Workbench:
    """A worker that runs a camera, with what it tells."""

    def __init__(
        self,
        camera: ImageCamera,
        clock: Clock,
        settings: CameraSettings,
        n_queued: int,
        known: Mapping[str, CameraSettings] | None = None,
    ) -> None:
        self.camera = camera
        self.events = Events()
        self.worker = CameraWorker(
            *(camera, settings, self.events),
            clock=clock,
            n_queued=n_queued,
            known=known,
        )

    def wait_until(self, connection: Connection, after: int = 0) -> int:
        return self.events.wait_for(
            lambda event: event == ConnectionChanged(connection), after
        )

    def wait_for(self, kind: type[WorkerEvent], after: int = 0) -> int:
        return self.events.wait_for(lambda event: isinstance(event, kind), after)

    def wait_for_fault(self, kind: type[Exception]) -> int:
        return self.events.wait_for(
            lambda e: isinstance(e, FaultRaised | Failed) and isinstance(e.error, kind)
        )

    def wait_for_frames(self, n_frames: int) -> None:
        goal = self.worker.stats.delivered + n_frames
        enough = threading.Event()
        for _ in range(round(TIMEOUT / 0.005)):
            if self.worker.stats.delivered >= goal:
                return
            enough.wait(0.005)
        pytest.fail(f"Only {self.worker.stats} came.")


class Benches:
    """Makes benches and stops their workers."""

    def __init__(self) -> None:
        self._made: list[Workbench] = []

    def make(
        self,
        camera: ImageCamera,
        clock: Clock | None = None,
        settings: CameraSettings | None = None,
        n_queued: int = 16,
        known: Mapping[str, CameraSettings] | None = None,
    ) -> Workbench:
        settings = settings or CameraSettings()
        workbench = Workbench(
            camera, clock or MachineClock(), settings, n_queued, known
        )
        self._made.append(workbench)
        return workbench

    def spied(
        self, settings: CameraSettings | None = None
    ) -> tuple[Workbench, SpiedCamera]:
        """Return a workbench with a camera whose waits take no time."""
        clock = SkippingClock()
        camera = SpiedCamera(clock)
        return self.make(camera, clock, settings), camera

    def live(self, frame_rate: float = 100, n_queued: int = 16) -> Workbench:
        settings = CameraSettings(frame_rate=frame_rate)
        return self.make(FaultyCamera(SCENE), settings=settings, n_queued=n_queued)

    def stop(self) -> None:
        for workbench in self._made:
            workbench.worker.stop(TIMEOUT)


@pytest.fixture
def benches() -> Iterator[Benches]:
    benches = Benches()
    yield benches
    benches.stop()


def frame(seq: int) -> Frame:
    return Frame(sealed(np.zeros((2, 2), np.uint8)), seq, host_ts_ns=0)


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    for i in range(N_IMAGES):
        (tmp_path / f"{i}.png").write_bytes(encode_png(np.full((4, 4), i, np.uint8)))
    return tmp_path


def drain(worker: CameraWorker, seconds_per_frame: float) -> list[Frame]:
    frames = []
    busy = threading.Event()
    while True:
        try:
            frames.append(worker.next_frame(TIMEOUT))
        except EndOfImages:
            return frames
        busy.wait(seconds_per_frame)


def test_a_camera_that_comes_and_goes_is_logged(
    benches: Benches, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO, "lightpen.cameras.worker")
    workbench, camera = benches.spied()
    workbench.worker.start()
    workbench.wait_for_frames(1)
    camera.unplug()
    workbench.wait_until(Connection.LOST)
    workbench.worker.stop()

    said = [(each.levelname, each.message) for each in caplog.records]
    name = f"camera {workbench.worker.serial}"
    assert said[:2] == [("INFO", f"{name}: opening"), ("INFO", f"{name}: streaming")]
    assert ("WARNING", f"{name}: lost") in said
    assert said[-1] == ("INFO", f"{name}: closed")


def test_all_calls_of_the_camera_come_from_one_thread(benches: Benches) -> None:
    workbench, camera = benches.spied()
    workbench.worker.start()
    workbench.worker.set_exposure(500)
    workbench.worker.set_gain(6)
    workbench.wait_for_frames(1)
    camera.unplug()
    workbench.wait_until(Connection.LOST)
    camera.plug_in()
    workbench.wait_until(
        Connection.STREAMING, after=workbench.wait_until(Connection.LOST)
    )
    workbench.worker.stop()

    assert len(camera.threads) == 1
    assert threading.get_ident() not in camera.threads


def test_the_newest_frame_waits_and_is_announced_once(benches: Benches) -> None:
    workbench = benches.live()
    workbench.worker.start()
    workbench.wait_for_frames(10)
    announced = sum(isinstance(event, FrameReady) for event in workbench.events.all)
    newest = workbench.worker.latest()

    assert announced == 1
    assert newest is not None
    assert newest.seq >= 9
    workbench.wait_for(FrameReady, after=workbench.wait_for(FrameReady) + 1)


def test_no_frame_is_shown_twice(benches: Benches, recording: Path) -> None:
    workbench = benches.make(ReplayCamera(str(recording), frame_rate=1000))
    workbench.worker.start()
    workbench.wait_for(WorkerStopped)

    assert workbench.worker.latest() is not None
    assert workbench.worker.latest() is None


def test_a_recording_waits_for_a_slow_reader_and_then_ends(
    benches: Benches, recording: Path
) -> None:
    workbench = benches.make(ReplayCamera(str(recording), frame_rate=1000), n_queued=2)
    workbench.worker.measure(True)
    workbench.worker.start()
    frames = drain(workbench.worker, seconds_per_frame=0.003)

    assert [int(frame.image[0, 0]) for frame in frames] == list(range(N_IMAGES))
    workbench.wait_until(Connection.CLOSED)
    assert WorkerStopped() in workbench.events.all
    assert workbench.worker.stats == Stats(delivered=N_IMAGES)


def test_frames_of_a_live_camera_that_nobody_takes_in_time_are_reported(
    benches: Benches,
) -> None:
    workbench = benches.live(n_queued=3)
    workbench.worker.measure(True)
    workbench.worker.start()
    workbench.wait_for_fault(FramesSkipped)
    n_skipped = workbench.worker.stats.skipped
    workbench.wait_for_frames(5)
    n_reported = len(workbench.events.faults(FramesSkipped))
    kept = [workbench.worker.next_frame(TIMEOUT).seq for _ in range(3)]

    assert n_reported == 1  # not once an image
    assert "20 of 23 images skipped" in workbench.events.faults(FramesSkipped)[0]
    assert kept == sorted(set(kept))
    # The first ones, but for those that the camera could not hand over.
    assert kept[-1] <= 2 + workbench.worker.stats.missed
    assert workbench.worker.stats.skipped >= n_skipped + 5


def test_a_reader_that_was_held_up_once_is_not_called_slow(benches: Benches) -> None:
    camera = PacedCamera()
    settings = CameraSettings(frame_rate=100)
    workbench = benches.make(camera, settings=settings, n_queued=3)
    workbench.worker.measure(True)
    workbench.worker.start()
    camera.may_send.release(5)
    workbench.wait_for_frames(5)
    assert workbench.worker.stats.skipped == 2
    for _ in range(30):
        camera.may_send.release()
        workbench.worker.next_frame(TIMEOUT)

    assert workbench.events.faults(FramesSkipped) == []
    camera.may_send.release(MANY)  # so that it can be stopped


@pytest.mark.parametrize(
    ("n_missed", "n_offered", "is_slow"),
    [(19, 20, False), (20, 36, True), (20, 400, True), (20, 401, False)],
)
def test_a_computer_is_slow_when_many_images_and_a_good_share_are_missed(
    n_missed: int, n_offered: int, is_slow: bool
) -> None:
    assert is_too_slow(n_missed, n_offered) is is_slow


def test_it_is_reported_when_no_image_is_skipped_any_more(benches: Benches) -> None:
    workbench = benches.live(n_queued=1)
    workbench.worker.measure(True)
    workbench.worker.start()
    workbench.wait_for_fault(FramesSkipped)
    assert ProcessingKeepsUp() not in workbench.events.all

    workbench.worker.measure(False)
    workbench.wait_for_frames(3)

    assert workbench.events.all.count(ProcessingKeepsUp()) == 1


def test_it_is_over_when_no_image_was_skipped_for_a_while(
    benches: Benches, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lightpen.cameras.worker.KEEPING_UP", 0.1)
    workbench = benches.live(n_queued=16)
    workbench.worker.measure(True)
    workbench.worker.start()
    workbench.wait_for_fault(FramesSkipped)

    for _ in range(100):  # far fewer than make the skipped ones a small share
        workbench.worker.next_frame(TIMEOUT)
        if ProcessingKeepsUp() in workbench.events.all:
            break
    assert workbench.events.all.count(ProcessingKeepsUp()) == 1


def test_a_camera_rests_while_nobody_wants_images_but_is_looked_after(
    benches: Benches, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lightpen.cameras.worker.PROBING", 0.02)
    workbench = benches.live()
    assert isinstance(workbench.camera, FaultyCamera)
    workbench.worker.start()
    workbench.wait_for_frames(3)

    workbench.worker.set_rest(None)
    n_delivered = workbench.worker.stats.delivered
    threading.Event().wait(0.3)
    assert workbench.worker.stats.delivered <= n_delivered + 1  # that was under way

    workbench.camera.unplug()
    lost = workbench.wait_until(Connection.LOST)
    workbench.camera.plug_in()
    workbench.wait_until(Connection.STREAMING, after=lost)
    workbench.worker.set_rest(0.0)
    workbench.wait_for_frames(3)


def test_images_missed_while_the_camera_rests_do_not_count(benches: Benches) -> None:
    workbench = benches.live()
    workbench.worker.set_rest(0.2)
    workbench.worker.start()
    workbench.wait_for_frames(4)

    assert workbench.worker.stats.missed == 0
    assert workbench.camera.stats().missed > 10


def test_a_recording_that_waits_for_its_reader_goes_on_when_nobody_measures(
    benches: Benches, recording: Path
) -> None:
    camera = ReplayCamera(str(recording), frame_rate=1000, loops=True)
    workbench = benches.make(camera, n_queued=2)
    workbench.worker.measure(True)
    workbench.worker.start()
    workbench.wait_for(FrameReady)
    workbench.worker.measure(False)
    workbench.wait_for_frames(N_IMAGES)

    assert len(waiting(workbench.worker)) <= 1  # one may have been on its way


def waiting(worker: CameraWorker) -> list[Frame]:
    frames = []
    while True:
        try:
            frames.append(worker.next_frame(0.05))
        except FrameTimeout:
            return frames


def test_frames_are_queued_only_while_measuring(benches: Benches) -> None:
    workbench = benches.live(n_queued=3)
    workbench.worker.start()
    workbench.wait_for_frames(5)
    with pytest.raises(FrameTimeout):
        workbench.worker.next_frame(0.05)
    assert workbench.worker.stats.skipped == 0
    before = workbench.worker.stats.delivered
    workbench.worker.measure(True)

    assert workbench.worker.next_frame(TIMEOUT).seq >= before


def test_measuring_anew_forgets_what_was_left(benches: Benches) -> None:
    workbench = benches.live(n_queued=3)
    workbench.worker.measure(True)
    workbench.worker.start()
    workbench.wait_for_frames(5)
    workbench.worker.measure(False)
    workbench.wait_for_frames(2)
    before = workbench.worker.stats.delivered
    workbench.worker.measure(True)

    assert workbench.worker.next_frame(TIMEOUT).seq >= before


def test_settings_are_applied_and_reported(benches: Benches) -> None:
    workbench, _ = benches.spied(CameraSettings(exposure_us=1e9, gain_db=3))
    workbench.worker.start()
    first = workbench.events.all[workbench.wait_for(SettingsApplied)]
    workbench.worker.set_gain(1e9)
    workbench.events.wait_for(
        lambda e: isinstance(e, SettingsApplied) and e.settings.gain_db == 24
    )

    assert isinstance(first, SettingsApplied)
    assert first.settings.exposure_us == 50_000
    assert first.settings.gain_db == 3


def test_a_lost_camera_comes_back_with_its_settings(benches: Benches) -> None:
    workbench, camera = benches.spied(CameraSettings(gain_db=3, pixel_format="Mono12"))
    workbench.worker.start()
    workbench.worker.set_exposure(444)
    workbench.wait_for_frames(2)
    camera.unplug()
    lost = workbench.wait_until(Connection.LOST)
    before = workbench.worker.stats.delivered
    camera.plug_in()
    workbench.wait_until(Connection.STREAMING, after=lost)
    applied = workbench.events.all[workbench.wait_for(SettingsApplied, after=lost)]
    workbench.wait_for_frames(2)

    assert isinstance(applied, SettingsApplied)
    assert applied.settings == CameraSettings(444, 3, 20, "Mono12")
    assert "cable" in workbench.events.faults(DeviceLost)[0]
    assert workbench.worker.stats.delivered > before


def test_attempts_to_reconnect_back_off(benches: Benches) -> None:
    workbench, camera = benches.spied()
    workbench.worker.start()
    workbench.wait_for_frames(1)
    camera.unplug()
    for _ in range(7):
        assert camera.n_opened.acquire(timeout=TIMEOUT)
    attempts = camera.opened_at[1:7]

    np.testing.assert_allclose(np.diff(attempts), [1, 2, 2, 2, 2], atol=1e-6)


def test_a_silent_camera_that_answers_is_given_up_after_six_seconds(
    benches: Benches,
) -> None:
    workbench, camera = benches.spied()
    workbench.worker.start()
    workbench.wait_for_frames(1)
    camera.stall(1e6)
    silent = workbench.wait_until(Connection.SILENT)
    lost = workbench.wait_until(Connection.LOST)

    assert silent < lost
    assert "SIM-1 for 6 s" in workbench.events.faults(DeviceLost)[0]


def test_a_short_silence_is_waited_for(benches: Benches) -> None:
    workbench, camera = benches.spied()
    workbench.worker.start()
    workbench.wait_for_frames(1)
    camera.stall(4.0)
    silent = workbench.wait_until(Connection.SILENT)
    workbench.wait_until(Connection.STREAMING, after=silent)

    assert Connection.LOST not in workbench.events.connections()
    assert workbench.worker.stats.timeouts >= 3


def test_a_slow_camera_is_not_taken_for_silent(benches: Benches) -> None:
    workbench, _ = benches.spied(CameraSettings(frame_rate=0.1))
    workbench.worker.start()
    workbench.wait_for_frames(3)

    changes = workbench.events.connections()
    assert changes == [Connection.OPENING, Connection.STREAMING]


def test_a_busy_camera_is_waited_for(benches: Benches) -> None:
    workbench, camera = benches.spied()
    camera.occupy(3.0)
    workbench.worker.start()
    workbench.wait_until(Connection.STREAMING)

    assert camera.opened_at[-1] == pytest.approx(3.0)
    reported = workbench.events.faults(DeviceBusy)
    assert len(reported) == 1
    assert "Another program" in reported[0]


def test_a_camera_that_stays_busy_is_given_up(benches: Benches) -> None:
    workbench, camera = benches.spied()
    camera.occupy(3600)
    workbench.worker.start()
    workbench.wait_until(Connection.CLOSED)

    assert "Another program" in workbench.events.faults(DeviceBusy)[0]
    assert camera.opened_at[-1] == pytest.approx(8.0)


def test_a_missing_camera_ends_the_worker(benches: Benches) -> None:
    workbench, camera = benches.spied()
    camera.unplug()
    workbench.worker.start()
    failed = workbench.wait_for(Failed)
    closed = workbench.wait_until(Connection.CLOSED)

    assert failed < closed
    assert "There is no camera" in workbench.events.faults(DeviceNotFound)[0]
    with pytest.raises(EndOfImages):
        workbench.worker.next_frame(TIMEOUT)


def test_impossible_settings_at_first_end_the_worker(benches: Benches) -> None:
    workbench, _ = benches.spied(CameraSettings(pixel_format="BayerRG8"))
    workbench.worker.start()
    workbench.wait_until(Connection.CLOSED)

    assert "BayerRG8" in workbench.events.faults(ConfigError)[0]


def test_kept_settings_that_are_impossible_now_are_reported_when_images_come(
    benches: Benches,
) -> None:
    camera = FaultyCamera(SCENE)
    kept = {camera.serial: CameraSettings(pixel_format="BayerRG8")}
    workbench = benches.make(camera, known=kept)
    workbench.worker.start()
    reported = workbench.wait_for_fault(ConfigError)

    assert workbench.wait_until(Connection.STREAMING) < reported
    assert "BayerRG8" in workbench.events.faults(ConfigError)[0]
    workbench.wait_for_frames(2)


def test_one_image_that_a_link_damaged_is_counted_but_disturbs_nobody(
    benches: Benches,
) -> None:
    clock = SkippingClock()
    camera = LinkedCamera(clock)
    workbench = benches.make(camera, clock)
    camera.spoil_frames(1)
    workbench.worker.start()
    workbench.wait_for_frames(2)

    assert workbench.worker.stats.incomplete == 1
    assert workbench.events.faults(FrameIncomplete) == []


def test_a_damaged_image_is_reported_and_the_next_one_comes(benches: Benches) -> None:
    workbench, camera = benches.spied()
    camera.spoil_frames(1)
    workbench.worker.start()
    workbench.wait_for_fault(FrameIncomplete)
    workbench.wait_for_frames(2)

    assert workbench.worker.stats.incomplete == 1
    assert Connection.LOST not in workbench.events.connections()


def test_stopping_ends_a_worker_whose_reader_is_gone(
    benches: Benches, recording: Path
) -> None:
    workbench = benches.make(ReplayCamera(str(recording), frame_rate=1000), n_queued=1)
    workbench.worker.measure(True)
    workbench.worker.start()
    workbench.wait_for(FrameReady)
    workbench.worker.stop(TIMEOUT)

    assert workbench.events.connections()[-1] is Connection.CLOSED
    assert workbench.worker.latest() is None  # no image stays in memory
    with pytest.raises(EndOfImages):
        workbench.worker.next_frame(0)


def test_stopping_ends_a_worker_that_seeks_its_camera(benches: Benches) -> None:
    camera = FaultyCamera(SCENE)
    workbench = benches.make(camera, settings=CameraSettings(frame_rate=100))
    workbench.worker.start()
    workbench.wait_for_frames(1)
    camera.unplug()
    workbench.wait_until(Connection.LOST)
    workbench.worker.stop()

    assert workbench.events.connections()[-1] is Connection.CLOSED


def test_stopping_twice_or_before_the_start_does_no_harm(benches: Benches) -> None:
    workbench = benches.live()
    workbench.worker.stop()
    assert workbench.events.all == []

    workbench = benches.live()
    workbench.worker.start()
    workbench.worker.stop()
    workbench.worker.stop()


def test_a_camera_that_hangs_does_not_hang_the_program(benches: Benches) -> None:
    camera = HungCamera()
    workbench = benches.make(camera)
    workbench.worker.start()
    assert camera.reads.wait(TIMEOUT)
    try:
        with pytest.raises(DeviceLost, match="did not stop"):
            workbench.worker.stop(timeout_s=0.1)
    finally:
        camera.let_go.set()
