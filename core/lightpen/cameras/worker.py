"""The thread that owns a camera: reads, monitors and reconnects.

Every call of the camera is made in this thread. Frames leave it two ways: through a box
for the newest one, for showing, and through a queue that loses nothing, for measuring.
"""

import logging
from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from queue import Empty, SimpleQueue
from threading import Event, Thread

from lightpen.cameras.link_watch import LinkWatch
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
)
from lightpen.cameras.source import FrameBox, FrameQueue
from lightpen.errors import LightpenError

N_QUEUED = 4  # frames of 5 MB
QUIET_PERIODS = 3
LEAST_QUIET = 1.0  # s without an image after which the camera is probed
LONGEST_SILENCE = 6.0  # s without an image after which it counts as lost
LONGEST_READ = 2.0  # s, longest delay of a request
BUSY_PAUSE = 0.5  # s
PROBING = 2.0  # s between probes of a paused camera
# A GigE Vision camera frees itself from a program that crashed after a 3 s heartbeat;
# that it is not free yet may take 5 s to find out.
LONGEST_BUSY = 8.0  # s
BACK_OFF = (0.5, 1.0, 2.0)  # s between attempts to reconnect; the last repeats
LONGEST_STOP = 10.0  # s; a dead camera may take 8 to close
# Of the images since measuring began, skipped by a computer that is too slow; fewer
# are skipped when something else holds it up once.
LEAST_SKIPPED = 20
SKIPPED_SHARE = 0.05
KEEPING_UP = 3.0  # s without a skipped image that clear the fault

_logger = logging.getLogger(__name__)


class CameraWorker:
    """Runs a camera in its own thread.

    Parameters
    ----------
    camera : ImageCamera
        Not open; used by the worker only from now on.
    settings : CameraSettings
        Settings to apply, again after each reconnection.
    known : mapping of str to CameraSettings
        Settings by serial number, used instead for these cameras.
    on_event : callable
        Called in the thread of the worker with what happens; must return at once and
        not call `stop`.
    clock : Clock, optional
        The clock of the camera.
    n_queued : int
        Frames of a live camera that wait to be measured at most.
    """

    def __init__(
        self,
        camera: ImageCamera,
        settings: CameraSettings,
        on_event: Callable[[WorkerEvent], None],
        *,
        clock: Clock | None = None,
        n_queued: int = N_QUEUED,
        known: Mapping[str, CameraSettings] | None = None,
    ) -> None:
        self._camera = camera
        self._settings = settings
        self._known = dict(known or {})
        self._applied = settings
        self._capabilities: CameraCapabilities | None = None
        self._on_event = on_event
        self._clock = clock or MachineClock()
        self._mailbox = FrameBox()
        self._queue = FrameQueue(n_queued)
        self._requests: SimpleQueue[Callable[[], None]] = SimpleQueue()
        self._stopping = Event()
        self._wake = Event()
        self._rest: float | None = 0.0
        self._is_rested = self._is_stopped = False
        self._delivered_ns = 0
        self._n_missed_read = self._n_missed_resting = 0
        self._measures = Event()
        self._thread = Thread(target=self._run, name="camera", daemon=True)
        self._connection: Connection | None = None
        self._stats = Stats()
        self._n_skipped = 0
        self._n_offered = self._n_missed = 0  # since measuring began
        self._skipping_reported = False
        self._skipped_ns = 0
        self._heard_ns = 0
        self._link = LinkWatch()

    @property
    def serial(self) -> str:
        """Serial number of the camera."""
        return self._camera.serial

    @property
    def caps(self) -> CameraCapabilities | None:
        """Capabilities of the camera; None until it was open."""
        return self._capabilities

    @property
    def stats(self) -> Stats:
        """Frame counters up to the last image."""
        return self._stats

    def start(self) -> None:
        """Open the camera and start streaming; once only."""
        self._thread.start()

    def stop(self, timeout_s: float = LONGEST_STOP) -> None:
        """Close the camera and end the thread.

        Raises `DeviceLost` if the camera does not come back from a call in time.
        """
        self._stopping.set()
        self._wake.set()
        self._queue.end()
        if self._thread.ident is None:
            return
        self._thread.join(timeout_s)
        if self._thread.is_alive():
            raise DeviceLost(
                "camera.did-not-stop", serial=self.serial, waited=timeout_s
            )
        self._queue.clear()  # images are large, and a stopped worker may live long
        self._mailbox.take()

    def latest(self) -> Frame | None:
        """Return the newest frame for display, if it is new."""
        return self._mailbox.take()

    def measure(self, measures: bool) -> None:
        """Start or stop queueing every frame for `next_frame`."""
        if measures and not self._measures.is_set():
            self._queue.clear()
            self._n_offered = self._n_missed = 0
            self._measures.set()
        elif not measures:
            self._n_offered = self._n_missed = 0
            self._measures.clear()
            self._queue.clear()  # a recording may wait for room in it

    def next_frame(self, timeout_s: float) -> Frame:
        """Return the oldest queued frame for processing.

        Raises `FrameTimeout` if there is none in time, `EndOfImages` after the last.
        """
        return self._queue.take(timeout_s)

    def set_rest(self, rest: float | None) -> None:
        """Set the pause between two images, s; None: until another pause is set.

        Images that are missed meanwhile count as neither missed nor skipped, and the
        next may be as old as the rest. A camera on a link sends on during a finite
        rest, and is read.
        """
        if rest != self._rest:
            self._rest = rest
            self._wake.set()

    def set_exposure(self, exposure_us: float) -> None:
        """Request another exposure while streaming."""
        self._request(lambda: self._set_exposure(exposure_us))

    def set_gain(self, gain_db: float) -> None:
        """Request another gain while streaming."""
        self._request(lambda: self._set_gain(gain_db))

    def configure(self, settings: CameraSettings) -> None:
        """Request other settings; streaming stops briefly."""
        self._request(lambda: self._configure(settings))

    def _request(self, act: Callable[[], None]) -> None:
        self._requests.put(act)
        self._wake.set()

    def _run(self) -> None:
        try:
            self._open_first()
            while not self._stopping.is_set():
                self._serve()
        except EndOfImages:
            self._on_event(WorkerStopped())
        except LightpenError as error:
            self._on_event(Failed(error))
        finally:
            self._camera.close()
            self._queue.end()
            self._change(Connection.CLOSED)

    def _serve(self) -> None:
        """Run the camera for one image, or reconnect."""
        try:
            self._serve_requests()
            self._report_keeping_up()
            if self._is_wanted():
                self._read()
        except DeviceLost as error:
            self._on_event(FaultRaised(error))
            self._reconnect()

    def _is_wanted(self) -> bool:
        """Return whether to fetch an image now; wait here for the rest between two."""
        rest = self._rest
        if rest is not None and self._is_stopped:
            self._is_stopped = False
            self._camera.start()
            self._hear()
        # What waits in the buffers of a link would be ever older.
        if rest == 0.0 or (rest is not None and self._camera.caps.has_link):
            return True
        self._wake.clear()
        if rest != self._rest or self._stopping.is_set():  # just before
            return False
        self._is_rested = True
        if rest is not None:
            self._clock.wait(rest, self._wake)
        else:
            if not self._camera.caps.waits:  # a recording would restart
                self._camera.stop()
                self._is_stopped = True
            self._wake.wait(PROBING)
            self._camera.probe()
        self._hear()
        return rest is not None

    def _read(self) -> None:
        try:
            frame = self._camera.read(min(self._quiet_time(), LONGEST_READ))
        except FrameTimeout:
            self._watch()
            return
        except FrameIncomplete as error:
            self._hear()
            self._count()
            if not self._camera.caps.has_link:  # else many are reported: see `_count`
                self._on_event(FaultRaised(error))
        else:
            self._hear()
            self._change(Connection.STREAMING)
            if self._is_due():
                self._deliver(frame)
            self._count()

    def _is_due(self) -> bool:
        """Return whether the pause is over."""
        now_ns = self._clock.now_ns()
        rest = self._rest if self._camera.caps.has_link else None
        if rest is not None and now_ns - self._delivered_ns < rest * 1e9:
            return False
        self._delivered_ns = now_ns
        return True

    def _deliver(self, frame: Frame) -> None:
        if self._mailbox.put(frame):
            self._on_event(FrameReady())
        if self._measures.is_set():
            self._enqueue(frame)

    def _enqueue(self, frame: Frame) -> None:
        if self._camera.caps.waits:
            self._queue.hand_over(frame, self._measures.is_set)
            return
        self._n_offered += 1
        if self._queue.offer(frame) or self._stopping.is_set():
            return
        self._n_skipped += 1
        self._n_missed += 1
        self._skipped_ns = self._clock.now_ns()
        n_missed, n_offered = self._n_missed, self._n_offered
        is_slow = is_too_slow(n_missed, n_offered)
        if is_slow and not self._skipping_reported:  # once is enough until it is over
            self._skipping_reported = True
            fault = FramesSkipped(
                "camera.too-slow", n_missed=n_missed, n_offered=n_offered
            )
            self._on_event(FaultRaised(fault))

    def _report_keeping_up(self) -> None:
        """Report that images are no longer skipped."""
        if not self._skipping_reported:
            return
        is_slow = is_too_slow(self._n_missed, self._n_offered)
        since_ns = self._clock.now_ns() - self._skipped_ns
        if not is_slow or since_ns >= KEEPING_UP * 1e9:
            self._skipping_reported = False
            self._n_offered = self._n_missed = 0
            self._on_event(ProcessingKeepsUp())

    def _quiet_time(self) -> float:
        """Return the time without images after which the camera is probed, s."""
        rate, exposure_us = self._applied.frame_rate, self._applied.exposure_us
        period = 1 / rate if rate else 0.0
        exposure = (exposure_us or 0.0) * 1e-6
        return max(QUIET_PERIODS * period + exposure, LEAST_QUIET)

    def _watch(self) -> None:
        """Probe a camera that has been silent."""
        self._count()
        silence = round((self._clock.now_ns() - self._heard_ns) * 1e-9, 3)
        if silence >= self._quiet_time():
            self._change(Connection.SILENT)
        if silence >= max(LONGEST_SILENCE, 2 * self._quiet_time()):
            raise DeviceLost("camera.silent", serial=self.serial, silence=silence)
        self._camera.probe()

    def _hear(self) -> None:
        self._heard_ns = self._clock.now_ns()

    def _count(self) -> None:
        """Update the frame counters, without frames of a pause."""
        stats = self._camera.stats()
        if self._is_rested:
            self._is_rested = False
            self._n_missed_resting = stats.missed - self._n_missed_read
            self._link = replace(self._link, since=None)
        self._n_missed_read = stats.missed - self._n_missed_resting
        self._stats = replace(
            stats, skipped=self._n_skipped, missed=self._n_missed_read
        )
        if self._camera.caps.has_link:
            self._link, fault = self._link.after(
                self._stats, self._heard_ns * 1e-9, self._applied
            )
            if fault is not None:
                self._on_event(FaultRaised(fault))

    def _open_first(self) -> None:
        """Open the camera; wait briefly while another program uses it."""
        self._change(Connection.OPENING)
        limit_ns = self._clock.now_ns() + round(LONGEST_BUSY * 1e9)
        is_reported = False
        while True:
            try:
                self._connect()
                return
            except DeviceBusy as error:
                if self._clock.now_ns() >= limit_ns:
                    raise
                if not is_reported:
                    is_reported = True
                    self._on_event(FaultRaised(error))
            if self._clock.wait(BUSY_PAUSE, self._stopping):
                return

    def _reconnect(self) -> None:
        """Reopen the camera until it succeeds or the worker is stopped."""
        self._change(Connection.LOST)
        n_attempts = 0
        while True:
            self._camera.close()
            pause = BACK_OFF[min(n_attempts, len(BACK_OFF) - 1)]
            if self._clock.wait(pause, self._stopping):
                return
            n_attempts += 1
            try:
                self._connect()
                return
            except (DeviceNotFound, DeviceBusy, DeviceLost):
                continue

    def _connect(self) -> None:
        self._camera.open()
        known = self._known.pop(self._camera.serial, None)
        if known is None:
            self._start(self._settings)
            return
        self._settings = known
        try:
            self._start(known)
        except ConfigError as error:  # the camera changed since they were stored
            self._settings = CameraSettings()
            self._start(self._settings)
            # After the start, as arriving images clear earlier faults.
            self._on_event(FaultRaised(error))

    def _start(self, settings: CameraSettings) -> None:
        """Configure the open camera and start streaming."""
        self._applied = self._camera.configure(settings)
        self._capabilities = self._camera.caps
        self._camera.start()
        self._is_stopped = False
        self._hear()
        self._link = LinkWatch()
        self._on_event(SettingsApplied(self._applied))
        self._change(Connection.STREAMING)

    def _serve_requests(self) -> None:
        while True:
            try:
                request = self._requests.get_nowait()
            except Empty:
                return
            try:
                request()
            except ConfigError as error:
                self._on_event(FaultRaised(error))

    def _configure(self, settings: CameraSettings) -> None:
        before = self._settings
        self._camera.stop()
        try:
            self._start(settings)
        except ConfigError:
            self._start(before)
            raise
        self._settings = merged_settings(before, self._applied)

    def _set_exposure(self, exposure_us: float) -> None:
        # Where the camera is lost over it, it is set when it comes back.
        self._settings = replace(self._settings, exposure_us=exposure_us)
        applied = self._camera.set_exposure(exposure_us)
        self._settings = replace(self._settings, exposure_us=applied)
        self._apply(replace(self._applied, exposure_us=applied))

    def _set_gain(self, gain_db: float) -> None:
        self._settings = replace(self._settings, gain_db=gain_db)
        applied = self._camera.set_gain(gain_db)
        self._settings = replace(self._settings, gain_db=applied)
        self._apply(replace(self._applied, gain_db=applied))

    def _apply(self, applied: CameraSettings) -> None:
        self._applied = applied
        self._on_event(SettingsApplied(applied))

    def _change(self, connection: Connection) -> None:
        if connection is not self._connection:
            self._connection = connection
            is_bad = connection in (Connection.LOST, Connection.SILENT)
            level = logging.WARNING if is_bad else logging.INFO
            _logger.log(level, "camera %s: %s", self.serial, connection.name.lower())
            self._on_event(ConnectionChanged(connection))


def merged_settings(before: CameraSettings, now: CameraSettings) -> CameraSettings:
    """Return settings, completed by earlier ones."""
    given = {f.name: getattr(now, f.name) for f in fields(now)}
    return replace(before, **{n: v for n, v in given.items() if v is not None})


def is_too_slow(n_missed: int, n_offered: int) -> bool:
    """Return whether images are skipped persistently."""
    return n_missed >= max(LEAST_SKIPPED, SKIPPED_SHARE * n_offered)
