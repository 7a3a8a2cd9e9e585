"""The live images of a camera as signals of Qt."""

from collections.abc import Mapping
from dataclasses import dataclass
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
from lightpen.cameras.worker import (
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
from lightpen.live.looking import Live, LiveImage
from lightpen.simulator.camera import SimulatedCamera
from lightpen.simulator.follower import Follower
from lightpen.simulator.hand import Operator
from lightpen_app.look.pooling import pooled
from lightpen_app.look.sentences import worded
from lightpen_app.work.mailbox import Mailbox
from lightpen_app.work.swing_run import SwingRun

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
    """Opens one camera at a time and tells what it shows.

    Parameters
    ----------
    run : SwingRun
        Takes every image.

    Signals
    -------
    image_shown(Shown)
        The newest image; those that the GUI had no time for are skipped.
    connection_changed(Connection)
    settings_applied(CameraSettings)
        The camera has these in force.
    troubled(str)
        A sentence to be read; the camera carries on.
    failed(str)
        A sentence to be read; no more images come until another `open`.
    relieved(str)
        The sentence of one of these whose cause is gone.
    """

    image_shown = Signal(object)
    connection_changed = Signal(object)
    settings_applied = Signal(object)
    troubled = Signal(str)
    failed = Signal(str)
    relieved = Signal(str)

    def __init__(self, run: SwingRun, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._run = run
        self._live: Live | None = None
        self._connection = Connection.CLOSED
        self._aim = Aim()
        self._is_watched = True
        self._operator: Operator | None = None
        self._teller: _Teller | None = None
        self._closing: list[Thread] = []
        self._without_images = self._skipping = ""  # as was told of them

    def open(
        self,
        camera: ImageCamera,
        settings: CameraSettings,
        clock: Clock | None = None,
        known: Mapping[str, CameraSettings] | None = None,
    ) -> None:
        """Show another camera; the one before is closed.

        A camera whose serial number is among the ``known`` gets the settings there.
        """
        self.close()
        self._operator = (
            camera.operator if isinstance(camera, SimulatedCamera) else None
        )
        self._teller = teller = _Teller(self)
        teller.image_shown.connect(self.image_shown)
        teller.told.connect(self._on_told)
        self._live = live = Live(
            *(camera, settings, teller, self._run.runner, clock, known)
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
        teller, self._teller = self._teller, None
        if live is None or teller is None:
            return
        teller.blockSignals(True)
        self._relieve()
        self.set_following(False)
        self._operator = None
        self._closing = [thread for thread in self._closing if thread.is_alive()]
        thread = Thread(
            target=self._stop, args=(live, teller), name="closing", daemon=True
        )
        self._closing.append(thread)
        thread.start()
        self._set_connection(Connection.CLOSED)

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
    def connection(self) -> Connection:
        """How the camera is."""
        return self._connection

    @property
    def serial(self) -> str:
        """Serial number of the camera; empty where none is open."""
        return "" if self._live is None else self._live.serial

    @property
    def caps(self) -> Caps | None:
        """What the camera can do; None until it was open."""
        return None if self._live is None else self._live.caps

    @property
    def stats(self) -> Stats:
        """What became of the images of this camera."""
        return Stats() if self._live is None else self._live.stats

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
            self._live.set_exposure(exposure_us)

    def set_gain(self, gain_db: float) -> None:
        """Ask the camera for another gain."""
        if self._live is not None:
            self._live.set_gain(gain_db)

    def show_pen(self) -> None:
        """Let the simulated operator bring the pen, so that there is something to see.

        Only while nothing else is asked of him.
        """
        if self._operator is not None and self._operator.is_free:
            self._operator.seat()

    def configure(self, settings: CameraSettings) -> None:
        """Ask the camera for other settings, for which it stops for a moment."""
        if self._live is not None:
            self._live.configure(settings)

    def set_following(self, follows: bool) -> None:
        """Let the simulated operator do what the swing asks for, or leave it."""
        operator = self._operator
        self._run.follower = Follower(operator) if follows and operator else None

    def _stop(self, live: Live, teller: "_Teller") -> None:
        try:
            live.stop()
        except DeviceLost as error:
            self.troubled.emit(worded(error.sentence))
        else:
            teller.deleteLater()

    def _set_connection(self, connection: Connection) -> None:
        if connection is not self._connection:
            self._connection = connection
            if connection is Connection.STREAMING:
                self._take_back(self._without_images)
                self._without_images = ""
            self.connection_changed.emit(connection)

    def _relieve(self) -> None:
        """Take back all that was told of a camera."""
        for told in (self._without_images, self._skipping):
            self._take_back(told)
        self._without_images = self._skipping = ""

    def _take_back(self, told: str) -> None:
        if told:
            self.relieved.emit(told)

    def _on_told(self, what: WorkerEvent) -> None:
        match what:
            case ConnectionChanged(connection):
                self._set_connection(connection)
            case SettingsApplied(settings):
                self.settings_applied.emit(settings)
            case Failed(error):
                self._without_images = worded(error.sentence)
                self.failed.emit(self._without_images)
            case Troubled(FramesSkipped() as trouble):
                self._skipping = worded(trouble.sentence)
                self.troubled.emit(self._skipping)
            case Troubled(trouble):
                self._without_images = worded(trouble.sentence)
                self.troubled.emit(self._without_images)
            case KeepsUp():
                self._take_back(self._skipping)
                self._skipping = ""


class _Teller(QObject):
    """Takes what happens on the threads of a camera to that of the GUI.

    Its public signals are emitted on the thread of the GUI, so that one who blocks them
    there hears nothing any more.
    """

    image_shown = Signal(object)
    told = Signal(object)
    _said = Signal(object)

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._images = Mailbox(self)

        # Connections
        queued = Qt.ConnectionType.QueuedConnection
        self._images.ready.connect(self._on_image_ready, queued)
        self._said.connect(self.told, queued)

    # On the threads of the camera

    def on_image(self, image: LiveImage) -> None:
        """Leave an image for the GUI."""
        pixels = image.frame.image
        height, width = pixels.shape
        half = pooled(pixels, image.frame.bits)
        self._images.put(Shown(half, QSize(width, height), image))

    def on_camera(self, event: WorkerEvent) -> None:
        """Hand on what happens to the camera."""
        if not isinstance(event, Ended):  # the connection closes besides
            self._said.emit(event)

    # On the thread of the GUI

    def _on_image_ready(self) -> None:
        shown = self._images.take()
        if shown is not None:
            self.image_shown.emit(shown)
