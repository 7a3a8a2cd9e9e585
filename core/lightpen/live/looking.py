"""Every image of a camera looked at as it comes, and a swing captured from them.

One thread looks at the images. While no swing is on it takes the newest and passes over
those that came meanwhile; during a swing it takes them all, in order. The state of the
swing belongs to that thread: what a user wants is handed over and done between two
images.
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from queue import Empty, SimpleQueue
from threading import Event, Lock, Thread
from typing import Protocol

from lightpen.cameras.clock import Clock
from lightpen.cameras.protocol import (
    CameraSettings,
    Caps,
    DeviceLost,
    EndOfImages,
    Frame,
    FrameTimeout,
    ImageCamera,
    Stats,
)
from lightpen.cameras.worker import (
    LONGEST_STOP,
    CameraWorker,
    Failed,
    FrameReady,
    WorkerEvent,
)
from lightpen.detection.aim import Aim
from lightpen.detection.sighting import Sighting, look
from lightpen.detection.spots import Spots, detect_spots
from lightpen.errors import LightpenError
from lightpen.record.writing import RecordWriter
from lightpen.swing.capture import capture_image
from lightpen.swing.rules import Transition, finish, pause, resume
from lightpen.swing.state import (
    Happening,
    Phase,
    SwingEvent,
    SwingSetup,
    SwingState,
)

LONGEST_WAIT = 0.1  # s, after which wishes are served at the latest
CAPTURE_ENDS = (Phase.SOLVING, Phase.VERDICT)
CRASH_SENTENCE = (
    "The program made a mistake of its own and looks at no more images. Open the "
    "camera again."
)


@dataclass(frozen=True, eq=False)
class LiveImage:
    """An image and what it shows.

    Attributes
    ----------
    frame : Frame
    spots : Spots
        All that is bright in it and not masked.
    sighting : Sighting or None
        The pen; None until the intrinsics and the pen are known and the image has the
        size that the intrinsics are for.
    """

    frame: Frame
    spots: Spots
    sighting: Sighting | None


@dataclass(frozen=True, eq=False)
class Swinging:
    """A swing that is being captured.

    Attributes
    ----------
    setup : SwingSetup
    writer : RecordWriter
        Of its record; closed when the capture ends.
    state : SwingState
        From which it goes on.
    """

    setup: SwingSetup
    writer: RecordWriter
    state: SwingState


class Listener(Protocol):
    """Who is told, on the thread that looks or on that of the camera."""

    def on_image(self, image: LiveImage) -> None:
        """Take an image that was looked at."""

    def on_swing(self, state: SwingState, events: tuple[SwingEvent, ...]) -> None:
        """Take the state of the swing after an image or a wish."""

    def on_camera(self, event: WorkerEvent) -> None:
        """Take what happens to the camera, but for images."""

    def on_trouble(self, error: LightpenError) -> None:
        """Take why the swing was paused."""


class Live:
    """Looks at the images of a camera until it is stopped.

    Parameters
    ----------
    camera : ImageCamera
        Not open yet. Nobody else may call it any more.
    settings : CameraSettings
        To be applied when it is opened.
    listener : Listener
    clock : Clock, optional
        The one that the camera goes by.
    """

    def __init__(
        self,
        camera: ImageCamera,
        settings: CameraSettings,
        listener: Listener,
        clock: Clock | None = None,
    ) -> None:
        self._worker = CameraWorker(camera, settings, self._on_event, clock=clock)
        self._listener = listener
        self._aim = Aim()
        self._swinging: Swinging | None = None
        self._last: Sighting | None = None
        self._left: Swinging | None = None
        self._n_since_kept = 0
        self._ready = Event()
        self._stopping = Event()
        self._wishes: SimpleQueue[Callable[[], None]] = SimpleQueue()
        self._has_crashed = Event()
        self._crash_lock = Lock()  # for the state, which belongs to no thread then
        self._thread = Thread(target=self._run, name="looking", daemon=True)

    @property
    def caps(self) -> Caps | None:
        """What the camera can do; None until it was open."""
        return self._worker.caps

    @property
    def stats(self) -> Stats:
        """What became of the images."""
        return self._worker.stats

    def start(self) -> None:
        """Open the camera and look at its images; once only."""
        self._worker.start()
        self._thread.start()

    def stop(self) -> None:
        """Close the camera and a swing's record, and end both threads.

        Raises
        ------
        DeviceLost
            The camera did not come back from a call.
        """
        self.stop_looking()
        self._worker.stop()

    def stop_looking(self) -> Swinging | None:
        """End the thread that looks, and leave the camera to `stop`.

        Returns
        -------
        Swinging or None
            The swing that was being captured; its record is closed.
        """
        self._stopping.set()
        self._ready.set()
        if self._thread.ident is None:
            self._leave()
        else:
            self._thread.join(LONGEST_STOP)
        if self._has_crashed.is_set():
            with self._crash_lock:
                self._leave()
        return self._left

    def set_aim(self, aim: Aim) -> None:
        """Look for something else from the next image on; a swing keeps its own."""
        self._ask(lambda: self._take_aim(aim))

    def set_exposure(self, exposure_us: float) -> None:
        """Ask the camera for another exposure."""
        self._worker.set_exposure(exposure_us)

    def set_gain(self, gain_db: float) -> None:
        """Ask the camera for another gain."""
        self._worker.set_gain(gain_db)

    def swing(self, swinging: Swinging) -> None:
        """Capture a swing from the next image on."""
        self._ask(lambda: self._begin(swinging))

    def pause(self) -> None:
        """Pause the swing for its user."""
        self._ask(lambda: self._change(lambda state: Transition(pause(state))))

    def resume(self) -> None:
        """Go on with a swing that its user paused."""
        self._ask(lambda: self._change(lambda state: Transition(resume(state))))

    def finish(self) -> None:
        """End the capture with what there is."""
        self._ask(lambda: self._change(finish))

    def abandon(self, then: Callable[[], None] | None = None) -> None:
        """Stop capturing; the record stays as it is, to be resumed.

        Parameters
        ----------
        then : callable, optional
            Called when the record is closed; a `LightpenError` that it raises is told
            as trouble.
        """
        self._ask(lambda: self._abandon(then))

    def _run(self) -> None:
        try:
            while not self._stopping.is_set():
                self._serve()
                frame = self._next_frame()
                if frame is not None:
                    self._take(frame)
        finally:
            if self._stopping.is_set():
                self._leave()
            else:
                self._give_up()

    def _give_up(self) -> None:
        """Tell of a bug and let go of the camera; the swing stays as it is."""
        self._has_crashed.set()
        self._listener.on_camera(Failed(LightpenError(CRASH_SENTENCE)))
        self._serve_late()
        with suppress(DeviceLost):  # `stop` tells it
            self._worker.stop()

    def _ask(self, wish: Callable[[], None]) -> None:
        """Have something done between two images, or at once where none come."""
        self._wishes.put(wish)
        if self._has_crashed.is_set():
            self._serve_late()

    def _serve_late(self) -> None:
        with self._crash_lock:
            self._serve()

    def _leave(self) -> None:
        """Do what is still wished for, and note the swing that ends unfinished."""
        try:
            self._serve()
        finally:
            self._left = self._swinging or self._left
            self._end()

    def _serve(self) -> None:
        while True:
            try:
                wish = self._wishes.get_nowait()
            except Empty:
                return
            wish()

    def _next_frame(self) -> Frame | None:
        if self._swinging is not None:
            try:
                return self._worker.next_frame(LONGEST_WAIT)
            except FrameTimeout:
                return None
            except EndOfImages:
                self._stopping.wait(LONGEST_WAIT)
                return None
        self._ready.wait(LONGEST_WAIT)
        self._ready.clear()
        return self._worker.latest()

    def _take(self, frame: Frame) -> None:
        image = self._look(frame)
        if self._swinging is not None and image.sighting is not None:
            self._capture(self._swinging, frame, image.sighting)
        self._listener.on_image(image)

    def _look(self, frame: Frame) -> LiveImage:
        aim = self._aim if self._swinging is None else _aim_of(self._swinging.setup)
        camera, pen, mask = aim.camera, aim.pen, aim.mask
        if camera is None or pen is None or not camera.fits(frame.image):
            return LiveImage(frame, detect_spots(frame.image, mask), None)
        sighting = look(frame.image, camera, pen, mask, self._last)
        self._last = sighting
        spots = sighting.spots
        assert spots is not None
        return LiveImage(frame, spots, sighting)

    def _capture(self, swinging: Swinging, frame: Frame, sighting: Sighting) -> None:
        setup, writer = swinging.setup, swinging.writer
        time = frame.host_ts_ns * 1e-9
        before = swinging.state
        try:
            transition = capture_image(
                *(setup, before, writer, frame.image, sighting, time),
                frame.device_ts_ns,
            )
        except LightpenError as error:
            self._become(swinging, Transition(pause(before)))
            self._listener.on_trouble(error)
            return
        if transition.state.phase is Phase.CAPTURING:
            is_kept = any(event.what is Happening.KEPT for event in transition.events)
            self._n_since_kept = 0 if is_kept else self._n_since_kept + 1
            if self._is_played_out:
                ended = finish(transition.state)
                transition = Transition(
                    ended.state, (*transition.events, *ended.events)
                )
        self._become(swinging, transition)

    @property
    def _is_played_out(self) -> bool:
        """Whether a recording was played from end to end in vain."""
        n_images = self._worker.caps.n_images if self._worker.caps else None
        return n_images is not None and self._n_since_kept >= n_images

    def _take_aim(self, aim: Aim) -> None:
        self._aim = aim
        if self._swinging is None:
            self._last = None

    def _begin(self, swinging: Swinging) -> None:
        self._end()
        self._last = None
        self._n_since_kept = 0
        self._swinging = swinging
        self._worker.measure(True)
        self._listener.on_swing(swinging.state, ())

    def _change(self, act: Callable[[SwingState], Transition]) -> None:
        if self._swinging is not None:
            self._become(self._swinging, act(self._swinging.state))

    def _abandon(self, then: Callable[[], None] | None) -> None:
        self._end()
        if then is None:
            return
        try:
            then()
        except LightpenError as error:
            self._listener.on_trouble(error)

    def _become(self, swinging: Swinging, transition: Transition) -> None:
        self._swinging = replace(swinging, state=transition.state)
        if transition.state.phase in CAPTURE_ENDS:
            self._end()
        self._listener.on_swing(transition.state, transition.events)

    def _end(self) -> None:
        """Let go of the swing and its record."""
        self._worker.measure(False)
        swinging, self._swinging = self._swinging, None
        if swinging is not None:
            self._last = None
            swinging.writer.close()

    def _on_event(self, event: WorkerEvent) -> None:
        if isinstance(event, FrameReady):
            self._ready.set()
        else:
            self._listener.on_camera(event)


def _aim_of(setup: SwingSetup) -> Aim:
    return Aim(setup.camera, setup.pen, setup.mask)
