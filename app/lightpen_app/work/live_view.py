"""The live images of a camera, and a swing captured from them, as signals of Qt."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from threading import Lock, Thread
from time import monotonic

from PySide6.QtCore import QObject, QSize, Qt, Signal

from lightpen.arrays import Image
from lightpen.cameras.clock import Clock
from lightpen.cameras.protocol import (
    CameraSettings,
    Caps,
    DeviceLost,
    ImageCamera,
    Stats,
)
from lightpen.cameras.worker import (
    Connection,
    ConnectionChanged,
    Ended,
    Failed,
    SettingsApplied,
    Troubled,
    WorkerEvent,
)
from lightpen.detection.aim import Aim
from lightpen.errors import LightpenError
from lightpen.live.looking import (
    Live,
    LiveImage,
    Swinging,
)
from lightpen.simulator.camera import SimulatedCamera
from lightpen.simulator.follower import Follower
from lightpen.simulator.hand import Operator
from lightpen.swing.rules import Transition, finish, pause, resume
from lightpen.swing.state import Happening, Phase, SwingEvent, SwingState
from lightpen_app.look.pooling import pooled
from lightpen_app.look.sentences import worded
from lightpen_app.work.mailbox import Mailbox

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
    seen : LiveImage
    """

    half: Image
    size: QSize
    seen: LiveImage


class LiveView(QObject):
    """Opens one camera at a time and tells what it shows.

    Signals
    -------
    image_shown(Shown)
        The newest image; those that the GUI had no time for are skipped.
    swing_changed(SwingState)
        The newest state of the swing that is captured.
    happened(SwingEvent)
        Each event of the swing, in order; `swing_changed` follows.
    swing_left(Swinging)
        A swing that is not finished, of a camera that was closed; its record, too.
    connection_changed(Connection)
    settings_applied(CameraSettings)
        The camera has these in force.
    troubled(str)
        A sentence to be read; the camera or the swing carries on.
    relieved(str)
        The sentence of `troubled` whose cause is gone: images are recorded again.
    failed(str)
        A sentence to be read; no more images come until another `open`.
    """

    image_shown = Signal(object)
    swing_changed = Signal(object)
    happened = Signal(object)
    swing_left = Signal(object)
    connection_changed = Signal(object)
    settings_applied = Signal(object)
    troubled = Signal(str)
    relieved = Signal(str)
    failed = Signal(str)
    _stopped_looking = Signal(object, object)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._live: Live | None = None
        self._waiting: Swinging | None = None
        self._connection = Connection.CLOSED
        self._aim = Aim()
        self._operator: Operator | None = None
        self._teller: _Teller | None = None
        self._closing: list[Thread] = []
        self._leaving: Live | None = None  # whose swing is on its way from it
        self._missed: list[Callable[[], None]] = []  # wishes meanwhile
        self._trouble = ""  # of a record

        # Connections
        self.happened.connect(self._on_happened)
        self._stopped_looking.connect(self._on_stopped_looking)

    def open(
        self, camera: ImageCamera, settings: CameraSettings, clock: Clock | None = None
    ) -> None:
        """Show another camera; the one before is closed."""
        self.close()
        self._operator = (
            camera.operator if isinstance(camera, SimulatedCamera) else None
        )
        self._teller = teller = _Teller(self)
        teller.image_shown.connect(self.image_shown)
        teller.happened.connect(self.happened)
        teller.swing_changed.connect(self.swing_changed)
        teller.told.connect(self._on_told)
        self._live = live = Live(camera, settings, teller, clock)
        live.set_aim(self._aim)
        waiting, self._waiting = self._waiting, None
        if waiting is not None:
            self.swing(waiting)
        live.start()

    def close(self) -> None:
        """Close the camera; what it still had to tell is not told.

        A dead camera may take seconds, so this does not wait: see `await_closed`. A
        swing that is captured stays on the disk as it is; see `swing_left`.
        """
        live, self._live = self._live, None
        teller, self._teller = self._teller, None
        if live is None or teller is None:
            return
        teller.blockSignals(True)
        self._operator = None
        if self._leaving is None:
            self._leaving = live
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
        self._tell(lambda live: live.set_aim(aim))

    def set_exposure(self, exposure_us: float) -> None:
        """Ask the camera for another exposure."""
        self._tell(lambda live: live.set_exposure(exposure_us))

    def set_gain(self, gain_db: float) -> None:
        """Ask the camera for another gain."""
        self._tell(lambda live: live.set_gain(gain_db))

    def swing(self, swinging: Swinging) -> None:
        """Capture a swing from the next image on, be it of the next camera.

        Nothing more is told of the swing before.
        """
        self._forget_leaving()
        if self._live is None or self._teller is None:
            self._forget_waiting()
            self._waiting = swinging
            return
        self._teller.await_swing(swinging.state)
        self._live.swing(swinging)

    def pause(self) -> None:
        """Pause the swing for its user."""
        self._wish(Live.pause, lambda state: Transition(pause(state)))

    def resume(self) -> None:
        """Go on with a swing that its user paused."""
        self._wish(Live.resume, lambda state: Transition(resume(state)))

    def finish(self) -> None:
        """End the capture with what there is."""
        self._wish(Live.finish, finish)

    def abandon(self, then: Callable[[], None] | None = None) -> None:
        """Stop capturing and telling; the record stays as it is, to be resumed.

        Parameters
        ----------
        then : callable, optional
            Called when the record is closed, on any thread; a `LightpenError` that it
            raises is `troubled`.
        """
        self._forget_leaving()
        self._forget_waiting()
        if self._live is not None and self._teller is not None:
            self._teller.await_swing(None)
            self._live.abandon(then)
        elif then is not None:
            try:
                then()
            except LightpenError as error:
                self.troubled.emit(worded(error.sentence))

    def set_following(self, follows: bool) -> None:
        """Let the simulated operator do what the swing asks for, or leave it."""
        if self._teller is not None and self._operator is not None:
            self._teller.follower = Follower(self._operator) if follows else None

    def _stop(self, live: Live, teller: "_Teller") -> None:
        self._stopped_looking.emit(live, live.stop_looking())
        try:
            live.stop()
        except DeviceLost as error:
            self.troubled.emit(worded(error.sentence))
        else:
            teller.deleteLater()

    def _wish(
        self, wish: Callable[[Live], None], act: Callable[[SwingState], Transition]
    ) -> None:
        """Change the swing, be it with a camera, waiting for one, or in between."""
        if self._leaving is not None:
            self._missed.append(partial(self._wish, wish, act))
            return
        self._tell(wish)
        self._change_waiting(act)

    def _tell(self, wish: Callable[[Live], None]) -> None:
        if self._live is not None:
            wish(self._live)

    def _change_waiting(self, act: Callable[[SwingState], Transition]) -> None:
        """Do with a swing that waits for a camera what its user wishes."""
        if self._waiting is None:
            return
        transition = act(self._waiting.state)
        self._waiting = replace(self._waiting, state=transition.state)
        if transition.state.phase is Phase.SOLVING:
            self._forget_waiting()
        for event in transition.events:
            self.happened.emit(event)
        self.swing_changed.emit(transition.state)

    def _forget_leaving(self) -> None:
        self._leaving, self._missed = None, []

    def _forget_waiting(self) -> None:
        waiting, self._waiting = self._waiting, None
        if waiting is not None:
            waiting.writer.close()

    def _set_connection(self, connection: Connection) -> None:
        if connection is not self._connection:
            self._connection = connection
            self.connection_changed.emit(connection)

    def _on_stopped_looking(self, live: Live, left: Swinging | None) -> None:
        missed: list[Callable[[], None]] = []
        if live is self._leaving:
            missed = self._missed
            self._forget_leaving()
        if left is not None:
            self.swing_left.emit(left)  # whoever goes on with it does so in this call
            for wish in missed:
                wish()

    def _on_told(self, what: WorkerEvent | LightpenError) -> None:
        match what:
            case ConnectionChanged(connection):
                self._set_connection(connection)
            case SettingsApplied(settings):
                self.settings_applied.emit(settings)
            case Failed(error):
                self.failed.emit(worded(error.sentence))
            case Troubled(trouble):
                self.troubled.emit(worded(trouble.sentence))
            case LightpenError():
                self._trouble = worded(what.sentence)
                self.troubled.emit(self._trouble)

    def _on_happened(self, event: SwingEvent) -> None:
        if self._trouble and event.what is Happening.KEPT:
            trouble, self._trouble = self._trouble, ""
            self.relieved.emit(trouble)


class _Teller(QObject):
    """Takes what happens on the threads of a camera to that of the GUI.

    All signals but the private ones are emitted on the thread of the GUI, so that one
    who blocks them there hears nothing any more.
    """

    image_shown = Signal(object)
    happened = Signal(object)
    swing_changed = Signal(object)
    told = Signal(object)
    _said = Signal(object)
    _swung = Signal()

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self.follower: Follower | None = None
        self._images = Mailbox(self)
        self._lock = Lock()
        self._awaited: SwingState | None = None
        self._is_awaiting = True
        self._state: SwingState | None = None
        self._events: tuple[SwingEvent, ...] = ()

        # Connections
        queued = Qt.ConnectionType.QueuedConnection
        self._images.ready.connect(self._on_image_ready, queued)
        self._swung.connect(self._on_swung, queued)
        self._said.connect(self.told, queued)

    def await_swing(self, state: SwingState | None) -> None:
        """Tell nothing of a swing until its state is this one; None for ever."""
        with self._lock:
            self._is_awaiting, self._awaited = True, state
            self._state, self._events = None, ()

    # On the threads of the camera

    def on_image(self, image: LiveImage) -> None:
        """Leave an image for the GUI."""
        pixels = image.frame.image
        height, width = pixels.shape
        half = pooled(pixels, image.frame.bits)
        self._images.put(Shown(half, QSize(width, height), image))

    def on_swing(self, state: SwingState, events: tuple[SwingEvent, ...]) -> None:
        """Leave the state of the swing for the GUI, and every event."""
        follower = self.follower
        if follower is not None:
            follower.follow(state)
        with self._lock:
            if self._is_awaiting and state is not self._awaited:
                return
            self._is_awaiting, self._awaited = False, None
            is_first = self._state is None
            self._state, self._events = state, (*self._events, *events)
        if is_first:
            self._swung.emit()

    def on_camera(self, event: WorkerEvent) -> None:
        """Hand on what happens to the camera."""
        if not isinstance(event, Ended):  # the connection closes besides
            self._said.emit(event)

    def on_trouble(self, error: LightpenError) -> None:
        """Hand on why the swing was paused."""
        self._said.emit(error)

    # On the thread of the GUI

    def _on_image_ready(self) -> None:
        shown = self._images.take()
        if shown is not None:
            self.image_shown.emit(shown)

    def _on_swung(self) -> None:
        with self._lock:
            state, self._state = self._state, None
            events, self._events = self._events, ()
        if state is None:
            return
        for event in events:
            self.happened.emit(event)
        self.swing_changed.emit(state)
