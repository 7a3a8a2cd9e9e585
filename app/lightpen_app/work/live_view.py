"""The live images of a camera as signals of Qt."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from threading import Thread
from time import monotonic

from PySide6.QtCore import QObject, QSize, Qt, Signal

from lightpen.arrays import Image
from lightpen.cameras.clock import Clock
from lightpen.cameras.protocol import (
    CameraSettings,
    Caps,
    DeviceLost,
    FramesSkipped,
    ImageCamera,
    Stats,
)
from lightpen.cameras.worker_events import (
    Connection,
    ConnectionChanged,
    Ended,
    Failed,
    KeepsUp,
    SettingsApplied,
    Troubled,
    WorkerEvent,
)
from lightpen.detection.aim import Aim
from lightpen.errors import LightpenError
from lightpen.live.looking import Live, LiveImage
from lightpen.simulator.camera import SimulatedCamera
from lightpen.simulator.follower import Follower
from lightpen.simulator.hand import Operator
from lightpen.simulator.toucher import Toucher
from lightpen.streaming.server import PoseStream
from lightpen_app.look.pooling import pooled
from lightpen_app.look.sentences import worded
from lightpen_app.work.mailbox import Mailbox
from lightpen_app.work.swing_run import SwingRun
from lightpen_app.work.verification_run import VerificationRun

CLOSING_TIME = 10.0  # s for all that is under way; a dead camera may take 8


@dataclass(frozen=True, eq=False)
class Shown:
    """A live image, ready to be shown.

    Attributes
    ----------
    half : (H // 2, W // 2) array of uint8
        The image at half its size, see `lightpen_app.look.pooling.pooled`.
    size : QSize
        Of the whole image, px.
    """

    half: Image
    size: QSize
    seen: LiveImage


class LiveView(QObject):
    """Opens a camera, or two beside each other, and tells what they show.

    Of two, one is `chosen`: what is asked, told and set is of it, but for what goes
    wrong and `configured`, which are of both.

    Parameters
    ----------
    run : SwingRun
        Takes every image, but for those of a verification.
    verification : VerificationRun
        Takes every image while somebody is at it.
    stream : PoseStream
        Tells other programs what the first camera shows.

    Signals
    -------
    image_shown(Shown)
        The newest image; those that the GUI had no time for are skipped.
    connection_changed(Connection)
    other_changed(Connection)
        The camera that is not chosen is in this state now.
    settings_applied(CameraSettings)
        The camera has these in force.
    configured(int, CameraSettings)
        A camera, by its number from 0, has these in force.
    troubled(str)
        A sentence to be read; the camera carries on.
    failed(str)
        A sentence to be read; no more images come until another `open`.
    relieved(str)
        The sentence of one of these whose cause is gone.
    """

    image_shown = Signal(object)
    connection_changed = Signal(object)
    other_changed = Signal(object)
    settings_applied = Signal(object)
    configured = Signal(int, object)
    troubled = Signal(str)
    failed = Signal(str)
    relieved = Signal(str)

    def __init__(
        self,
        run: SwingRun,
        verification: VerificationRun,
        stream: PoseStream,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._run = run
        self._verification = verification
        self._stream = stream
        self._live: Live | None = None
        self._chosen = 0
        self._states = [_CameraState()]
        self._aim = Aim()
        self._is_watched = True
        self._operator: Operator | None = None
        self._listener: _QueuedListener | None = None
        self._closing: list[Thread] = []

    def open(
        self,
        cameras: Sequence[ImageCamera],
        settings: CameraSettings,
        clock: Clock | None = None,
        known: Mapping[str, CameraSettings] | None = None,
    ) -> None:
        """Show another camera, or two; those before are closed.

        A camera whose serial number is among the ``known`` gets the settings there.
        """
        self.close()
        first = cameras[0]
        self._operator = first.operator if isinstance(first, SimulatedCamera) else None
        self._chosen = min(self._chosen, len(cameras) - 1)
        self._states = [_CameraState() for _ in cameras]
        self._listener = listener = _QueuedListener(self)
        listener.camera = self._chosen
        listener.image_shown.connect(self.image_shown)
        listener.told.connect(self._on_told)
        self._live = live = Live(
            *(cameras, settings, listener, self._run.runner, clock, known),
            verifier=self._verification.runner,
            stream=self._stream,
        )
        live.set_aim(self._aim)
        live.set_watched(self._is_watched)
        live.start()

    def close(self) -> None:
        """Close the camera; what it still had to tell is not told.

        A dead camera may take seconds, so this does not wait: see `await_closed`. A
        swing that is captured waits for the next camera.
        """
        live, self._live = self._live, None
        listener, self._listener = self._listener, None
        if live is None or listener is None:
            return
        listener.blockSignals(True)
        self._relieve()
        self.set_following(False)
        self.set_touching(False)
        self._operator = None
        self._closing = [thread for thread in self._closing if thread.is_alive()]
        thread = Thread(
            target=self._stop, args=(live, listener), name="closing", daemon=True
        )
        self._closing.append(thread)
        thread.start()
        for c in range(self.n_cameras):
            self._set_connection(c, Connection.CLOSED)

    def await_closed(self, timeout_s: float = CLOSING_TIME) -> bool:
        """Wait until every camera that was closed has let go of its device.

        Returns
        -------
        bool
            Whether all have; the others go on closing.
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
        """Number of the camera that is asked and told of, from 0."""
        return self._chosen

    def choose(self, camera: int) -> None:
        """Ask and tell of another camera, by its number from 0, if it is there."""
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
        """How the camera is."""
        return self._states[self._chosen].connection

    @property
    def worst_connection(self) -> Connection:
        """How that camera is which keeps a swing from its images."""
        connections = [state.connection for state in self._states]
        return min(connections, key=_WORST_FIRST.index)

    @property
    def serial(self) -> str:
        """Serial number of the camera; empty where none is open."""
        return self.serial_of(self._chosen)

    def serial_of(self, camera: int) -> str:
        """Return the serial number of a camera, by its number from 0."""
        return "" if self._live is None else self._live.worker(camera).serial

    @property
    def caps(self) -> Caps | None:
        """What the camera can do; None until it was open."""
        return self.caps_of(self._chosen)

    def caps_of(self, camera: int) -> Caps | None:
        """Return what a camera can do, by its number from 0."""
        return None if self._live is None else self._live.worker(camera).caps

    @property
    def stats(self) -> Stats:
        """What became of the images of this camera, and of pairs with the other."""
        if self._live is None:
            return Stats()
        own = self._live.worker(self._chosen).stats
        return replace(own, unpaired=self._live.stats.unpaired)

    @property
    def lag_ms(self) -> float | None:
        """By how much the second camera is later; None while that is not known."""
        return None if self._live is None else self._live.lag_ms

    @property
    def operator(self) -> Operator | None:
        """The simulated operator, where the pen is simulated."""
        return self._operator

    def set_aim(self, aim: Aim) -> None:
        """Look for something else in the images, of this camera and later ones."""
        self._aim = aim
        if self._live is not None:
            self._live.set_aim(aim)

    def set_watched(self, watched: bool) -> None:
        """Say whether anybody looks at the images, of this camera and later ones."""
        self._is_watched = watched
        if self._live is not None:
            self._live.set_watched(watched)

    def hurry(self) -> None:
        """Ask for every image for a while, though nothing moves."""
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
        """Let the simulated operator bring the pen, so that there is something to see.

        Only while nothing else is asked of him.
        """
        if self._operator is not None and self._operator.is_free:
            self._operator.seat()

    def configure(self, settings: CameraSettings) -> None:
        """Ask the camera for other settings, for which it stops for a moment."""
        if self._live is not None:
            self._live.worker(self._chosen).configure(settings)

    def set_following(self, follows: bool) -> None:
        """Let the simulated operator do what the swing asks for, or leave it."""
        operator = self._operator
        self._run.follower = Follower(operator) if follows and operator else None

    def set_touching(self, touches: bool) -> None:
        """Let the simulated operator touch what is verified, or leave it."""
        operator = self._operator
        self._verification.toucher = Toucher(operator) if touches and operator else None

    def _stop(self, live: Live, listener: "_QueuedListener") -> None:
        try:
            live.stop()
        except DeviceLost as error:
            self.troubled.emit(worded(error.sentence))
        else:
            listener.deleteLater()

    def _set_connection(self, camera: int, connection: Connection) -> None:
        state = self._states[camera]
        if connection is state.connection:
            return
        state.connection = connection
        if connection is Connection.STREAMING:
            self._take_back(state.without_images)
            state.without_images = ""
        if camera == self._chosen:
            self.connection_changed.emit(connection)
        else:
            self.other_changed.emit(connection)

    def _relieve(self) -> None:
        """Take back all that was told of the cameras."""
        for state in self._states:
            for told in (state.without_images, state.skipping):
                self._take_back(told)
            state.without_images = state.skipping = ""

    def _take_back(self, told: str) -> None:
        if told:
            self.relieved.emit(told)

    def _on_told(self, what: WorkerEvent, camera: int) -> None:
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
                state.without_images = self._worded(error, camera)
                self.failed.emit(state.without_images)
            case Troubled(FramesSkipped() as trouble):
                state.skipping = self._worded(trouble, camera)
                self.troubled.emit(state.skipping)
            case Troubled(trouble):
                state.without_images = self._worded(trouble, camera)
                self.troubled.emit(state.without_images)
            case KeepsUp():
                self._take_back(state.skipping)
                state.skipping = ""

    def _worded(self, error: LightpenError, camera: int) -> str:
        """Return what is wrong with a camera, of two with its number."""
        words = worded(error.sentence)
        if self.n_cameras == 1:
            return words
        return self.tr("Camera {0}: {1}").format(camera + 1, words)


@dataclass
class _CameraState:
    """How a camera is, and what was told of it."""

    connection: Connection = Connection.CLOSED
    settings: CameraSettings | None = None
    without_images: str = ""
    skipping: str = ""


_WORST_FIRST = (
    Connection.LOST,
    Connection.CLOSED,
    Connection.OPENING,
    Connection.SILENT,
    Connection.STREAMING,
)


class _QueuedListener(QObject):
    """Takes what happens on the threads of a camera to that of the GUI.

    Its public signals are emitted on the thread of the GUI, so that one who blocks them
    there hears nothing any more.
    """

    image_shown = Signal(object)
    told = Signal(object, int)
    _said = Signal(object, int)

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self.camera = 0  # whose images are shown
        self._images = Mailbox(self)

        # Connections
        queued = Qt.ConnectionType.QueuedConnection
        self._images.ready.connect(self._on_image_ready, queued)
        self._said.connect(self.told, queued)

    # On the threads of the camera

    def on_image(self, image: LiveImage) -> None:
        """Leave an image for the GUI."""
        if image.camera != self.camera:
            return
        pixels = image.frame.image
        height, width = pixels.shape
        half = pooled(pixels, image.frame.bits)
        self._images.put(Shown(half, QSize(width, height), image))

    def on_camera(self, event: WorkerEvent, camera: int) -> None:
        """Hand on what happens to a camera."""
        if not isinstance(event, Ended):  # the connection closes besides
            self._said.emit(event, camera)

    # On the thread of the GUI

    def _on_image_ready(self) -> None:
        shown = self._images.take()
        if isinstance(shown, Shown) and shown.seen.camera == self.camera:
            self.image_shown.emit(shown)
