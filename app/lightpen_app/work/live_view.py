"""The live images of a camera as signals of Qt."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from threading import Lock, Thread
from time import monotonic

from PySide6.QtCore import QObject, QSize, Qt, Signal

from lightpen.arrays import Image
from lightpen.cameras.pairing import Clock
from lightpen.cameras.protocol import (
    CameraCapabilities,
    CameraSettings,
    Connection,
    ConnectionChanged,
    DeviceLost,
    Failed,
    FaultRaised,
    FramesSkipped,
    ImageCamera,
    ProcessingKeepsUp,
    SettingsApplied,
    Stats,
    WorkerEvent,
    WorkerStopped,
)
from lightpen.detection.pixel_box import RegionOfInterest
from lightpen.errors import LightpenError
from lightpen.live.pipeline import ImageCapture, ImageListener, Live, LiveImage, Sink
from lightpen.live.sources import OperatedCamera, Operator
from lightpen_app.look.figures import pooled
from lightpen_app.look.languages import worded
from lightpen_app.work.job import Notifications
from lightpen_app.work.swing_run import SwingRun


@dataclass(frozen=True, eq=False)
class DisplayedImage:
    """A live image, ready to be shown."""

    # (H // 2, W // 2), the image at half its size, see
    # `lightpen_app.look.figures.pooled`
    half: Image
    size: QSize  # of the whole image, px
    seen: LiveImage


class Mailbox(QObject):
    """One slot between a producing thread and the GUI.

    A queued signal with every image would fill the memory whenever the GUI is busy;
    here only the newest waits, with one pending `ready`.
    """

    ready = Signal()  # a value waits; emitted once until it is taken

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._lock = Lock()
        self._value: object | None = None

    def put(self, value: object) -> None:
        """Put a value, from any thread, in place of the one waiting."""
        with self._lock:
            waited = self._value is not None
            self._value = value
        if not waited:
            self.ready.emit()

    def take(self) -> object | None:
        """Return the newest value, or None if it was taken already."""
        with self._lock:
            value, self._value = self._value, None
        return value


class QueuedListener(QObject):
    """Forwards events from camera threads to the GUI thread.

    Its public signals are emitted on the thread of the GUI, so that blocking them
    there is enough to receive none.
    """

    image_shown = Signal(object)
    event_received = Signal(object, int)
    _event_posted = Signal(object, int)

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self.camera = 0  # whose images are shown
        self._images = Mailbox(self)

        # Connections
        queued = Qt.ConnectionType.QueuedConnection
        self._images.ready.connect(self._on_image_ready, queued)
        self._event_posted.connect(self.event_received, queued)

    def discard(self) -> None:
        """Free the image that waits."""
        self._images.take()

    # On the threads of the camera

    def on_image(self, image: LiveImage) -> None:
        """Put an image into the mailbox of the GUI."""
        if image.camera != self.camera:
            return
        pixels = image.frame.image
        height, width = pixels.shape
        half = pooled(pixels, image.frame.bits)
        self._images.put(DisplayedImage(half, QSize(width, height), image))

    def on_camera(self, event: WorkerEvent, camera: int) -> None:
        """Forward an event of a camera."""
        if not isinstance(event, WorkerStopped):  # the connection closes besides
            with suppress(RuntimeError):  # the program has ended meanwhile
                self._event_posted.emit(event, camera)

    # On the thread of the GUI

    def _on_image_ready(self) -> None:
        shown = self._images.take()
        if isinstance(shown, DisplayedImage) and shown.seen.camera == self.camera:
            self.image_shown.emit(shown)


WITHOUT_IMAGES = "without-images"  # cause of a notification
CLOSING_TIME = 10.0  # s for everything in progress; a dead camera may take 8


class LiveView(QObject):
    """Opens one or two cameras and signals their images.

    Of two, one is `chosen`: queries, signals and settings refer to it, except `failed`
    and `configured`, which refer to both. Images go to the capture with an operator,
    else to the swing; listeners get those of the first camera.
    """

    # Shown: the newest image; the GUI skips those that it has no time for
    image_shown = Signal(object)
    connection_changed = Signal(object)  # Connection
    # Connection: the camera that is not chosen is in this state now
    other_changed = Signal(object)
    settings_applied = Signal(object)  # CameraSettings now in use
    # int, CameraSettings: index of a camera, and its settings now
    configured = Signal(int, object)
    failed = Signal()  # no more images come until another `open`; `why_no_images` shows
    _closing_failed = Signal(str)

    def __init__(
        self, run: SwingRun, notifications: Notifications, parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._run = run
        self._captures: list[ImageCapture] = []
        self._listeners: list[ImageListener] = []
        self._live: Live | None = None
        self._chosen = 0
        self._states = [_CameraState()]
        self._region = RegionOfInterest()
        self._sink: Sink | None = None
        self._is_watched = True
        self._simulated: list[OperatedCamera] = []
        self._operated: OperatedCamera | None = None  # the first, if it is simulated
        self._listener: QueuedListener | None = None
        self._closing: list[Thread] = []
        self._notifications = notifications

        # Connections
        self._closing_failed.connect(self._on_closing_failed)

    def add_capture(self, capture: ImageCapture) -> None:
        """Offer the images of later cameras to a capture, too."""
        self._captures.append(capture)

    def add_listener(self, listener: ImageListener) -> None:
        """Give the detections of later cameras to a listener, too."""
        self._listeners.append(listener)

    def open(
        self,
        cameras: Sequence[ImageCamera],
        settings: CameraSettings,
        clock: Clock | None = None,
        known: Mapping[str, CameraSettings] | None = None,
    ) -> None:
        """Open one or two cameras; earlier ones are closed.

        A camera whose serial number is among the ``known`` gets the settings there.
        """
        self.close()
        first = cameras[0]
        self._operated = first if isinstance(first, OperatedCamera) else None
        self._chosen = min(self._chosen, len(cameras) - 1)
        self._states = [_CameraState() for _ in cameras]
        self._listener = listener = QueuedListener(self)
        listener.camera = self._chosen
        listener.image_shown.connect(self.image_shown)
        listener.event_received.connect(self._on_event_received)
        self._live = live = Live(
            cameras,
            settings,
            listener,
            self._run.runner,
            clock,
            known,
            captures=self._captures,
            listeners=self._listeners,
        )
        live.set_region(self._region)
        live.set_sink(self._sink)
        self._simulated = [c for c in cameras if isinstance(c, OperatedCamera)]
        self.set_watched(self._is_watched)
        live.start()

    def close(self) -> None:
        """Close the camera; pending signals are dropped.

        A dead camera may take seconds, so this does not wait: see `await_closed`. A
        swing that is captured waits for the next camera.
        """
        live, self._live = self._live, None
        listener, self._listener = self._listener, None
        if live is None or listener is None:
            return
        listener.blockSignals(True)
        for c in range(self.n_cameras):
            self._withdraw(c)
        self.set_following(False)
        self._operated, self._simulated = None, []
        self._closing = [thread for thread in self._closing if thread.is_alive()]
        thread = Thread(
            target=self._stop, args=(live, listener), name="closing", daemon=True
        )
        self._closing.append(thread)
        thread.start()
        for c in range(self.n_cameras):
            self._set_connection(c, Connection.CLOSED)

    def await_closed(self, timeout_s: float = CLOSING_TIME) -> bool:
        """Wait until all closed cameras have released their devices.

        Returns whether all have; the others continue closing.
        """
        deadline = monotonic() + timeout_s
        for thread in self._closing:
            thread.join(max(0.0, deadline - monotonic()))
        self._closing = [thread for thread in self._closing if thread.is_alive()]
        return not self._closing

    @property
    def is_open(self) -> bool:
        """Whether a camera is open, or being opened."""
        return self._live is not None

    @property
    def n_cameras(self) -> int:
        """Number of cameras that are open, or were last."""
        return len(self._states)

    @property
    def chosen(self) -> int:
        """Number of the selected camera, from 0."""
        return self._chosen

    def choose(self, camera: int) -> None:
        """Select another camera by its number from 0, if it exists."""
        if camera == self._chosen or camera >= self.n_cameras:
            return
        self._chosen = camera
        if self._listener is not None:
            self._listener.camera = camera
        state = self._states[camera]
        self.connection_changed.emit(state.connection)
        if state.settings is not None:
            self.settings_applied.emit(state.settings)

    @property
    def connection(self) -> Connection:
        """State of the connection."""
        return self._states[self._chosen].connection

    @property
    def worst_connection(self) -> Connection:
        """The worst connection state of the cameras of a swing."""
        connections = [state.connection for state in self._states]
        return min(connections, key=_WORST_FIRST.index)

    @property
    def settings(self) -> CameraSettings:
        """Applied settings of the camera."""
        return self._states[self._chosen].settings or CameraSettings()

    @property
    def why_no_images(self) -> str:
        """Why the camera was lost, or could not be opened; empty while images come."""
        return self._why_without(self._chosen)

    def has_failed(self, camera: int) -> bool:
        """Return whether a camera, by its number from 0, could not be opened."""
        is_closed = (
            camera < self.n_cameras
            and self._states[camera].connection is Connection.CLOSED
        )
        return is_closed and bool(self._why_without(camera))

    @property
    def serial(self) -> str:
        """Serial number of the camera; empty where none is open."""
        return self.serial_of(self._chosen)

    def serial_of(self, camera: int) -> str:
        """Return the serial number of a camera, by its number from 0."""
        return "" if self._live is None else self._live.worker(camera).serial

    @property
    def caps(self) -> CameraCapabilities | None:
        """Capabilities of the camera; None before it is opened."""
        return self.capabilities_of(self._chosen)

    def capabilities_of(self, camera: int) -> CameraCapabilities | None:
        """Return the capabilities of a camera by its number from 0."""
        return None if self._live is None else self._live.worker(camera).caps

    @property
    def stats(self) -> Stats:
        """Frame counters of this camera and of the pairs."""
        if self._live is None:
            return Stats()
        own = self._live.worker(self._chosen).stats
        return replace(own, unpaired=self._live.stats.unpaired)

    @property
    def lag_ms(self) -> float | None:
        """Time lag of the second camera; None if unknown."""
        return None if self._live is None else self._live.lag_ms

    @property
    def operator(self) -> Operator | None:
        """The simulated operator, where the pen is simulated."""
        return None if self._operated is None else self._operated.operator

    def set_region(self, region: RegionOfInterest) -> None:
        """Set the region of interest in the images of this camera and later ones."""
        self._region = region
        if self._live is not None:
            self._live.set_region(region)

    def set_sink(self, sink: Sink | None) -> None:
        """Give every image to a function on the pipeline's thread, or to none."""
        self._sink = sink
        if self._live is not None:
            self._live.set_sink(sink)

    def set_watched(self, watched: bool) -> None:
        """Set whether images are displayed, for present and later cameras."""
        self._is_watched = watched
        for camera in self._simulated:
            camera.is_seen = watched
        if self._live is not None:
            self._live.set_watched(watched)

    def hurry(self) -> None:
        """Request every image for a while, even if nothing moves."""
        if self._live is not None:
            self._live.hurry()

    def set_exposure(self, exposure_us: float) -> None:
        """Ask the camera for another exposure."""
        if self._live is not None:
            self._live.worker(self._chosen).set_exposure(exposure_us)

    def set_gain(self, gain_db: float) -> None:
        """Ask the camera for another gain."""
        if self._live is not None:
            self._live.worker(self._chosen).set_gain(gain_db)

    def show_pen(self) -> None:
        """Have the simulated operator bring the pen into view.

        Only while nothing else is asked of him.
        """
        if self.operator is not None and self.operator.is_free:
            self.operator.seat()

    def configure(self, settings: CameraSettings) -> None:
        """Request other settings; the camera stops briefly to apply them."""
        if self._live is not None:
            self._live.worker(self._chosen).configure(settings)

    def set_following(self, follows: bool) -> None:
        """Set whether the simulated operator follows the swing."""
        led = self._operated if follows else None
        self._run.follower = None if led is None else led.follower()

    def _stop(self, live: Live, listener: QueuedListener) -> None:
        try:
            live.stop()
        except DeviceLost as error:
            with suppress(RuntimeError):  # the program has ended meanwhile
                self._closing_failed.emit(worded(error.message))
        else:
            listener.discard()
            with suppress(RuntimeError):  # deleted with this
                listener.deleteLater()

    def _set_connection(self, camera: int, connection: Connection) -> None:
        state = self._states[camera]
        if connection is state.connection:
            return
        state.connection = connection
        if connection is Connection.STREAMING:
            self._withdraw(camera)
        if camera == self._chosen:
            self.connection_changed.emit(connection)
        else:
            self.other_changed.emit(connection)

    def _on_closing_failed(self, sentence: str) -> None:
        self._notifications.notify((self, "closing"), sentence)

    def _show_fault(self, camera: int, error: LightpenError) -> None:
        words = self._words_of(camera, error)
        self._notifications.notify((self, camera, WITHOUT_IMAGES), words)

    def _words_of(self, camera: int, error: LightpenError) -> str:
        """Return the sentence of a fault, with the camera's number if there are two."""
        words = worded(error.message)
        if self.n_cameras > 1:
            words = self.tr("Camera {0}: {1}").format(camera + 1, words)
        return words

    def _why_without(self, camera: int) -> str:
        return self._notifications.text((self, camera, WITHOUT_IMAGES))

    def _withdraw(self, camera: int) -> None:
        self._notifications.withdraw((self, camera, WITHOUT_IMAGES))

    def _on_event_received(self, what: WorkerEvent, camera: int) -> None:
        state = self._states[camera]
        match what:
            case ConnectionChanged(connection):
                self._set_connection(camera, connection)
            case SettingsApplied(settings):
                state.settings = settings
                self.configured.emit(camera, settings)
                if camera == self._chosen:
                    self.settings_applied.emit(settings)
            case Failed(error):
                self._show_fault(camera, error)
                self.failed.emit()
            case FaultRaised(FramesSkipped() as fault):
                self._notifications.show_status(self._words_of(camera, fault))
            case FaultRaised(fault):
                self._show_fault(camera, fault)
            case ProcessingKeepsUp():
                self._notifications.show_status("")


@dataclass
class _CameraState:
    connection: Connection = Connection.CLOSED
    settings: CameraSettings | None = None


_WORST_FIRST = (
    Connection.LOST,
    Connection.CLOSED,
    Connection.OPENING,
    Connection.SILENT,
    Connection.STREAMING,
)
