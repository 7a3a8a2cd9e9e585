"""Every image of a camera looked at as it comes, and handed to the swing.

One thread looks at the images. While no swing is captured it takes the newest and
passes over those that came meanwhile; during a swing it takes them all, in order. Where
nothing moves it looks twice a second, and where nobody looks on, not at all.
"""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from threading import Event, Thread
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
from lightpen.detection.reasons import MISHAPS
from lightpen.detection.sighting import Sighting, look
from lightpen.detection.spots import Spots, detect_spots, have_moved
from lightpen.errors import LightpenError
from lightpen.sentences import sentence
from lightpen.swing.runner import SwingRunner
from lightpen.swing.state import Phase, SwingSetup

LONGEST_WAIT = 0.1  # s, after which a swing that began is noticed at the latest
UNHURRIED = 0.5  # s from image to image while nothing moves
LIVELY_NS = 2_000_000_000  # after the last move, for which every image is looked at


@dataclass(frozen=True, eq=False)
class LiveImage:
    """An image and what it shows.

    Attributes
    ----------
    spots : Spots
        All that is bright in it and not masked.
    sighting : Sighting or None
        The pen; None until the intrinsics and the pen are known and the image has the
        size that the intrinsics are for.
    """

    frame: Frame
    spots: Spots
    sighting: Sighting | None


class LiveListener(Protocol):
    """Who is told, on the thread that looks or on that of the camera."""

    def on_image(self, image: LiveImage) -> None:
        """Take an image that was looked at."""

    def on_camera(self, event: WorkerEvent) -> None:
        """Take what happens to the camera, but for images."""


class Live:
    """Looks at the images of a camera until it is stopped.

    Parameters
    ----------
    camera : ImageCamera
        Not open yet. Nobody else may call it any more.
    settings : CameraSettings
        To be applied when it is opened.
    runner : SwingRunner
        Takes every image.
    clock : Clock, optional
        The one that the camera goes by.
    known : mapping of str to CameraSettings
        By serial numbers; a camera that is among them gets these instead.
    """

    def __init__(
        self,
        camera: ImageCamera,
        settings: CameraSettings,
        listener: LiveListener,
        runner: SwingRunner,
        clock: Clock | None = None,
        known: Mapping[str, CameraSettings] | None = None,
    ) -> None:
        self._worker = CameraWorker(
            camera, settings, self._on_event, clock=clock, known=known
        )
        self._listener = listener
        self._runner = runner
        self._aim = Aim()
        self._wanted: Aim | SwingSetup = self._aim
        self._last: Sighting | None = None  # of what is wanted
        self._is_watched = True
        self._scene = Spots.none()
        self._moved_ns: int | None = None
        self._seen_ns = 0
        self._measures = False
        self._ready = Event()
        self._stopping = Event()
        self._thread = Thread(target=self._run, name="looking", daemon=True)

    @property
    def serial(self) -> str:
        """Serial number of the camera, or what it is looked for by until it is open."""
        return self._worker.serial

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
        """Close the camera and end both threads.

        Raises
        ------
        DeviceLost
            The camera did not come back from a call.
        """
        self._stopping.set()
        self._ready.set()
        if self._thread.ident is not None:
            self._thread.join(LONGEST_STOP)
        self._worker.stop()

    def set_aim(self, aim: Aim) -> None:
        """Look for something else from the next image on; a swing keeps its own."""
        self._aim = aim

    def set_watched(self, watched: bool) -> None:
        """Say whether anybody looks on; a swing that is captured goes on anyway."""
        self._is_watched = watched

    def hurry(self) -> None:
        """Look at every image for a while, as if something had moved."""
        if self._moved_ns is not None:
            self._moved_ns = self._seen_ns

    def set_exposure(self, exposure_us: float) -> None:
        """Ask the camera for another exposure."""
        self._worker.set_exposure(exposure_us)

    def set_gain(self, gain_db: float) -> None:
        """Ask the camera for another gain."""
        self._worker.set_gain(gain_db)

    def configure(self, settings: CameraSettings) -> None:
        """Ask the camera for other settings, for which it stops for a moment."""
        self._worker.configure(settings)

    def _run(self) -> None:
        try:
            while not self._stopping.is_set():
                setup = self._captured()
                self._worker.set_rest(self._rest())
                frame = self._next_frame()
                if frame is not None:
                    self._take(frame, setup)
        finally:
            if not self._stopping.is_set():
                self._give_up()

    def _give_up(self) -> None:
        """Tell of a bug and let go of the camera; the swing stays as it is."""
        self._listener.on_camera(
            Failed(
                LightpenError(
                    sentence(
                        "live.bug",
                        "The program made a mistake of its own and looks at no more "
                        "images. Open the camera again.",
                    )
                )
            )
        )
        with suppress(DeviceLost):  # `stop` tells it
            self._worker.stop()

    def _captured(self) -> SwingSetup | None:
        """Return what is captured now, and take all images while something is."""
        status = self._runner.status
        setup = status.setup if status.is_capturing else None
        if self._measures is not (setup is not None):
            self._measures = setup is not None
            self._worker.measure(self._measures)
        return setup

    def _rest(self) -> float | None:
        """Return how long the camera may rest after each image, s; None for good."""
        status = self._runner.status
        waits = status.state is None or status.state.phase is Phase.WAIT
        if status.is_capturing and not (waits or status.is_paused_by_user):
            return 0.0
        if self._moved_ns is None:  # the first image tells of what size they are
            return 0.0
        if not self._is_watched:
            return None
        is_lively = self._seen_ns - self._moved_ns < LIVELY_NS
        return 0.0 if is_lively else UNHURRIED

    def _notice(self, image: LiveImage) -> None:
        """Remember when anything was seen to move last."""
        self._seen_ns = image.frame.host_ts_ns
        if self._moved_ns is None or have_moved(self._scene, image.spots):
            self._moved_ns = self._seen_ns
        self._scene = image.spots

    def _next_frame(self) -> Frame | None:
        if self._measures:
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

    def _take(self, frame: Frame, setup: SwingSetup | None) -> None:
        wanted = setup or self._aim
        if wanted is not self._wanted:
            self._wanted, self._last = wanted, None
        image = self._look(frame, wanted)
        self._notice(image)
        caps = self._worker.caps
        n_images = None if caps is None else caps.n_images
        stats = self._worker.stats
        self._runner.take(frame, image.sighting, setup, n_images, stats)
        self._listener.on_image(image)

    def _look(self, frame: Frame, wanted: Aim | SwingSetup) -> LiveImage:
        camera, pen, mask = wanted.camera, wanted.pen, wanted.mask
        if camera is None or pen is None or not camera.fits(frame.image):
            try:
                spots = detect_spots(frame.image, mask, full_scale=frame.full_scale)
                return LiveImage(frame, spots, None)
            except MISHAPS:
                return LiveImage(frame, Spots.none(), None)
        sighting = look(*(frame.image, camera, pen, mask, self._last, frame.full_scale))
        self._last = sighting
        spots = Spots.none() if sighting.spots is None else sighting.spots
        return LiveImage(frame, spots, sighting)

    def _on_event(self, event: WorkerEvent) -> None:
        if isinstance(event, FrameReady):
            self._ready.set()
        else:
            self._listener.on_camera(event)
