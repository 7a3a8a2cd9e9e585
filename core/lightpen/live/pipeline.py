"""The live pipeline: detects spots and pen in camera images and passes them on.

One thread processes the images. While nothing is captured it takes the newest and skips
those in between; during a swing or another capture it takes all of them in order,
simultaneous ones of two cameras together. If nothing moves it takes two a second,
within a capture only after a while; without a viewer, none. A recording
that has been replayed to its end counts as at rest.
"""

import logging
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from functools import partial, reduce
from threading import Event, Thread
from typing import Protocol, TypeAlias

from lightpen.cameras.pairing import Clock, FramePairs, held_up
from lightpen.cameras.protocol import (
    CameraSettings,
    DeviceLost,
    EndOfImages,
    Failed,
    FaultRaised,
    Frame,
    FrameReady,
    FramesDelayed,
    FrameTimeout,
    ImageCamera,
    Stats,
    WorkerEvent,
)
from lightpen.cameras.worker import LONGEST_STOP, CameraWorker
from lightpen.detection.pen_detection import PenDetection, detect_pen
from lightpen.detection.pixel_box import RegionOfInterest
from lightpen.detection.reasons import UNFORESEEN
from lightpen.detection.spots import Spots, detect_spots, have_moved
from lightpen.errors import LightpenError
from lightpen.swing.capture.state import Phase, SwingSetup
from lightpen.swing.runner import SwingRunner

LONGEST_WAIT = 0.1  # s until the start of a swing is noticed
UNHURRIED = 0.5  # s from image to image while nothing moves
LIVELY_NS = 2_000_000_000  # after the last motion, in which every image is taken
# The same during a capture, longer than the pen is held still for it.
PATIENT_NS = 10_000_000_000
FULL_SCAN = 20  # images of a swing for each that is searched in full
MAY_REST = (Phase.CAPTURING, Phase.PAUSED)  # a pen at rest changes nothing

_logger = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class LiveImage:
    """An image with its detections."""

    frame: Frame
    spots: Spots  # all bright spots that are not masked
    # None without intrinsics or pen, or if the image is not of the camera's size.
    detection: PenDetection | None
    camera: int = 0  # index of the camera


Sink: TypeAlias = Callable[[LiveImage], None]


class LiveListener(Protocol):
    """Listener, called on the thread of the pipeline or of a camera."""

    def on_image(self, image: LiveImage) -> None:
        """Handle a processed image."""

    def on_camera(self, event: WorkerEvent, camera: int) -> None:
        """Handle an event, other than an image, of the camera with this index."""


class ImageListener(Protocol):
    """Listener to what is seen in the images of the first camera."""

    @property
    def is_heard(self) -> bool:
        """Whether it needs every image."""

    def process_image(self, frame: Frame, detection: PenDetection | None) -> None:
        """Handle a processed image; returns at once."""


class ImageCapture(Protocol):
    """What an operator may capture in place of a swing, such as a verification."""

    @property
    def is_here(self) -> bool:
        """Whether its operator is present."""

    @property
    def region(self) -> RegionOfInterest | None:
        """Target of its detection; None while it takes no images."""

    @property
    def stage(self) -> object:
        """Where it stands; another stage counts as a motion."""

    def process_image(
        self, frame: Frame, detection: PenDetection | None, region: RegionOfInterest
    ) -> None:
        """Take an image that was searched for this region."""


@dataclass(frozen=True, eq=False)
class _Capture:
    """Consumer of the images: a swing, another capture, or none."""

    swing: SwingSetup | None = None
    other: RegionOfInterest | None = None

    @property
    def wanted(self) -> SwingSetup | RegionOfInterest | None:
        """Target of its detection."""
        return self.swing or self.other


class Live:
    """Processes the images of one or two cameras until stopped.

    Parameters
    ----------
    cameras : sequence of ImageCamera
        Not open yet, and from now on called from here only.
    settings : CameraSettings
        Applied when they are opened.
    runner : SwingRunner
        Takes every image, except during another capture.
    known : mapping of str to CameraSettings
        Settings by serial number, in place of ``settings``.
    captures : sequence of ImageCapture
        Of these the one where an operator is present takes every image.
    listeners : sequence of ImageListener
        Are given the detections of the first camera.
    """

    def __init__(
        self,
        cameras: Sequence[ImageCamera],
        settings: CameraSettings,
        listener: LiveListener,
        runner: SwingRunner,
        clock: Clock | None = None,
        known: Mapping[str, CameraSettings] | None = None,
        captures: Sequence[ImageCapture] = (),
        listeners: Sequence[ImageListener] = (),
    ) -> None:
        self._workers = tuple(
            CameraWorker(
                camera, settings, partial(self._on_event, c), clock=clock, known=known
            )
            for c, camera in enumerate(cameras)
        )
        self._pairs = FramePairs()
        self._has_refused = False
        self._listener = listener
        self._runner = runner
        self._captures = tuple(captures)
        self._listeners = tuple(listeners)
        self._region = RegionOfInterest()
        self._sink: Sink | None = None
        self._wanted: RegionOfInterest | SwingSetup = self._region
        self._last: dict[int, PenDetection] = {}  # by camera
        self._is_watched = True
        self._scene = Spots.none()
        self._moved_ns: int | None = None
        self._seen_ns = 0
        self._seen_seq = 0
        self._pass_seq = 0  # where the replay of a recording began
        self._stage: object = None
        self._measures = False
        self._ready = Event()
        self._stopping = Event()
        self._thread = Thread(target=self._run, name="looking", daemon=True)

    def worker(self, camera: int = 0) -> CameraWorker:
        """Return the worker of a camera."""
        return self._workers[camera]

    @property
    def stats(self) -> Stats:
        """Counters of the images of all cameras."""
        stats = reduce(Stats.and_then, (worker.stats for worker in self._workers))
        return replace(stats, unpaired=self._pairs.n_unpaired)

    @property
    def lag_ms(self) -> float | None:
        """Lag of the second camera, ms; None until it is known."""
        return self._pairs.lag_ms

    def start(self) -> None:
        """Open the cameras and start processing; once only."""
        for worker in self._workers:
            worker.start()
        self._thread.start()

    def stop(self) -> None:
        """Close the cameras and end all threads.

        Raises `DeviceLost` if a call of the camera did not return.
        """
        self._stopping.set()
        self._ready.set()
        if self._thread.ident is not None:
            self._thread.join(LONGEST_STOP)
        self._pairs = FramePairs()  # frees its images now
        with ExitStack() as stack:  # an error in one does not prevent the others
            for worker in self._workers:
                stack.callback(worker.stop)

    def set_region(self, region: RegionOfInterest) -> None:
        """Set what is detected from the next image on, except during a swing."""
        self._region = region
        self._pass_seq = self._seen_seq

    def set_sink(self, sink: Sink | None) -> None:
        """Give every image of the first camera, in order, to a function, or to none.

        It is called on the pipeline's thread, for a recording without a swing.
        """
        self._sink = sink

    def set_watched(self, watched: bool) -> None:
        """Set whether images are displayed; a capture continues regardless."""
        self._is_watched = watched

    def hurry(self) -> None:
        """Process every image for a while, as after a motion."""
        if self._moved_ns is not None:
            self._moved_ns = self._seen_ns

    def _run(self) -> None:
        try:
            while not self._stopping.is_set():
                captured = self._captured()
                self._notice_stage()
                rest = self._rest()
                is_paired = self._measures and len(self._workers) > 1
                for worker in self._workers:  # resting cameras are rarely simultaneous
                    worker.set_rest(0.0 if is_paired and rest is not None else rest)
                if self._measures:
                    self._take_next(captured, rest if is_paired else None)
                else:
                    self._take_newest()
        finally:
            if not self._stopping.is_set():
                self._give_up()

    def _give_up(self) -> None:
        """Report an internal error and close the cameras; the swing is kept."""
        self._listener.on_camera(Failed(LightpenError("live.bug")), 0)
        for worker in self._workers:
            with suppress(DeviceLost):  # `stop` shows it
                worker.stop()

    def _captured(self) -> _Capture:
        """Return the capture in progress, for which the workers deliver all images."""
        status, other = self._runner.status, self._other_region()
        is_swing = other is None and status.is_capturing
        captured = _Capture(status.setup if is_swing else None, other)
        measures = captured.wanted is not None or self._sink is not None
        if self._measures is not measures:
            self._measures = measures
            for worker in self._workers:
                worker.measure(self._measures)
            self._pairs.forget()
        return captured

    @property
    def _other(self) -> ImageCapture | None:
        """The capture where an operator is present."""
        return next((each for each in self._captures if each.is_here), None)

    def _other_region(self) -> RegionOfInterest | None:
        """Return the detection target of another capture than a swing."""
        other = self._other
        return None if other is None else other.region

    def _rest(self) -> float | None:
        """Return the pause after each image, s; None to stop."""
        if self._sink is not None or any(each.is_heard for each in self._listeners):
            return 0.0
        if self._moved_ns is None:  # the first image gives the size
            return 0.0
        still_ns = self._seen_ns - self._moved_ns
        status = self._runner.status
        waits = status.state is None or status.state.phase is Phase.WAIT
        is_swung = status.is_capturing and not (waits or status.is_paused_by_user)
        is_other = self._other_region() is not None
        if not is_other and is_swung:
            assert status.setup is not None
            assert status.state is not None
            is_begun = status.state.phase in MAY_REST
            if status.setup.is_recording or not is_begun:
                return 0.0
        if is_other or is_swung:
            return 0.0 if still_ns < PATIENT_NS else UNHURRIED
        if not self._is_watched:
            return None
        return 0.0 if still_ns < LIVELY_NS else UNHURRIED

    def _notice_stage(self) -> None:
        """Treat a new phase or task as a motion."""
        status, other = self._runner.status, self._other
        stage = (
            None if status.state is None else status.state.phase,
            None if other is None else other.stage,
        )
        if stage != self._stage:
            self._stage = stage
            self.hurry()

    def _notice(self, image: LiveImage) -> None:
        """Note the time of the last motion, however slow."""
        self._seen_ns = image.frame.host_ts_ns
        self._seen_seq = image.frame.seq
        is_first = self._moved_ns is None
        has_moved = not self._is_passed() and have_moved(self._scene, image.spots)
        if is_first or has_moved:
            self._moved_ns = self._seen_ns
            self._scene = image.spots

    def _is_passed(self) -> bool:
        """Return whether a recording was replayed to its end without a capture."""
        caps = self._workers[0].caps
        if self._measures or caps is None or caps.n_images is None:
            return False
        return self._seen_seq - self._pass_seq >= caps.n_images

    def _notify_others(self, image: LiveImage) -> None:
        """Give the detection to the listeners."""
        for each in self._listeners:
            each.process_image(image.frame, image.detection)

    def _take_newest(self) -> None:
        """Process the newest image of each camera."""
        self._ready.wait(LONGEST_WAIT)
        self._ready.clear()
        for c, worker in enumerate(self._workers):
            frame = worker.latest()
            if frame is None:
                continue
            self._pairs.note(c, frame)
            image = self._look(frame, self._region, c)
            if c == 0:
                self._notice(image)
                self._notify_others(image)
                self._hand_over(frame, image.detection, None)
            self._listener.on_image(image)

    def _take_next(self, captured: _Capture, rest: float | None) -> None:
        """Process the next image, or the next simultaneous pair, after a rest, s."""
        wanted = captured.wanted or self._region
        frame = self._next_frame()
        if frame is None:
            return
        if rest is not None and frame.host_ts_ns - self._seen_ns < rest * 1e9:
            return
        frames = (frame, *frame.others)[: len(wanted.regions)]
        # A full search now and then finds new spots.
        is_followed = captured.swing is not None and frame.seq % FULL_SCAN != 0
        images = [
            self._look(each, wanted, c, is_followed=is_followed)
            for c, each in enumerate(frames)
        ]
        self._notice(images[0])
        self._notify_others(images[0])
        detections = [i.detection for i in images if i.detection is not None]
        detection = None
        if len(detections) == len(images):
            detection = replace(detections[0], others=tuple(detections[1:]))
        other = self._other
        if other is not None and captured.other is not None:
            other.process_image(frame, detection, captured.other)
        else:
            self._hand_over(frame, detection, captured.swing)
        sink = self._sink
        if sink is not None:
            sink(images[0])
        for image in images:
            self._listener.on_image(image)

    def _next_frame(self) -> Frame | None:
        """Return the next image, of two cameras the next simultaneous pair."""
        try:
            if len(self._workers) == 1:
                return self._workers[0].next_frame(LONGEST_WAIT)
            return self._next_pair()
        except FrameTimeout:
            return None
        except EndOfImages:
            self._stopping.wait(LONGEST_WAIT)
            return None

    def _next_pair(self) -> Frame | None:
        counts = {w.caps.n_images if w.caps else None for w in self._workers}
        if len(counts) > 1 and None not in counts:
            self._refuse_recordings()
            return None
        n_images = counts.pop() if len(counts) == 1 else None
        moment = self._pairs.next_frame(n_images)
        if moment is None:
            self._add_next()
            moment = self._pairs.next_frame(n_images)
        moved_ms = self._pairs.moved_ms()
        if moved_ms is not None:
            self._listener.on_camera(FaultRaised(FramesDelayed(held_up(moved_ms))), 1)
        return moment

    def _add_next(self) -> None:
        """Take the next frame of the camera whose turn it is."""
        wanted = self._pairs.wanted
        try:
            frame = self._workers[wanted].next_frame(LONGEST_WAIT)
        except FrameTimeout:  # frames of the other camera stay unpaired
            wanted = 1 - wanted
            frame = self._workers[wanted].next_frame(0.0)
        self._pairs.add(wanted, frame)

    def _refuse_recordings(self) -> None:
        """Report once that two recordings are not of the same moments."""
        if not self._has_refused:
            self._has_refused = True
            self._listener.on_camera(Failed(LightpenError("live.other-recording")), 1)
        self._stopping.wait(LONGEST_WAIT)

    def _hand_over(
        self, frame: Frame, detection: PenDetection | None, setup: SwingSetup | None
    ) -> None:
        caps = self._workers[0].caps
        n_images = None if caps is None else caps.n_images
        self._runner.process_image(frame, detection, setup, n_images, self.stats)

    def _look(
        self,
        frame: Frame,
        wanted: RegionOfInterest | SwingSetup,
        c: int,
        *,
        is_followed: bool = False,
    ) -> LiveImage:
        """Detect spots and, if possible, the pen."""
        if wanted is not self._wanted:
            self._wanted = wanted
            self._last.clear()
        regions = wanted.regions
        # Cameras may just come or go.
        region = regions[c] if c < len(regions) else RegionOfInterest()
        camera, pen, mask = region.camera, region.pen, region.mask
        if camera is None or pen is None or not camera.fits(frame.image):
            try:
                spots = detect_spots(frame.image, mask, full_scale=frame.full_scale)
            except UNFORESEEN:
                spots = Spots.none()
            return LiveImage(frame, spots, None, c)
        detection = detect_pen(
            frame.image,
            camera,
            pen,
            mask,
            self._last.get(c),
            frame.full_scale,
            is_followed=is_followed,
        )
        self._last[c] = detection
        spots = Spots.none() if detection.spots is None else detection.spots
        return LiveImage(frame, spots, detection, c)

    def _on_event(self, c: int, event: WorkerEvent) -> None:
        if isinstance(event, FrameReady):
            self._ready.set()
        else:
            if isinstance(event, FaultRaised | Failed):
                what = event.error.message
                _logger.warning("fault of camera %d: %s: %s", c + 1, what.code, what)
            self._listener.on_camera(event, c)
