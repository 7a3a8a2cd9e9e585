"""Every image of a camera looked at as it comes, and handed to whom it is for.

One thread looks at the images. While nothing is captured it takes the newest and passes
over those that came meanwhile; during a swing or a verification it takes them all, in
order, of two cameras those of one moment together. Where nothing moves it looks twice a
second, in the midst of a swing or a verification after a while only; where nobody looks
on, not at all. Recorded images, none of which is new after a pass, count as what rests.
"""

from collections.abc import Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from functools import partial, reduce
from threading import Event, Thread
from typing import Protocol

from lightpen.cameras.clock import Clock
from lightpen.cameras.pairing import FramePairs, held_up
from lightpen.cameras.protocol import (
    CameraSettings,
    DeviceLost,
    EndOfImages,
    Frame,
    FramesHeldUp,
    FrameTimeout,
    ImageCamera,
    Stats,
)
from lightpen.cameras.worker import LONGEST_STOP, CameraWorker
from lightpen.cameras.worker_events import Failed, FrameReady, Troubled, WorkerEvent
from lightpen.detection.aim import Aim
from lightpen.detection.reasons import MISHAPS
from lightpen.detection.sighting import Sighting, look
from lightpen.detection.spots import Spots, detect_spots, have_moved
from lightpen.errors import LightpenError
from lightpen.sentences import sentence
from lightpen.streaming.server import PoseStream
from lightpen.swing.runner import SwingRunner
from lightpen.swing.state import Phase, SwingSetup
from lightpen.verification.runner import VerificationRunner

LONGEST_WAIT = 0.1  # s, after which a swing that began is noticed at the latest
UNHURRIED = 0.5  # s from image to image while nothing moves
LIVELY_NS = 2_000_000_000  # after the last move, for which every image is looked at
# The same while something is captured: who holds still for it has ended by then.
PATIENT_NS = 10_000_000_000
IN_THE_MIDST = (Phase.CAPTURING, Phase.PAUSED)  # a pen at rest leads to nothing more


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
    camera : int
        Which of the cameras took it, from 0.
    """

    frame: Frame
    spots: Spots
    sighting: Sighting | None
    camera: int = 0


class LiveListener(Protocol):
    """Who is told, on the thread that looks or on that of the camera."""

    def on_image(self, image: LiveImage) -> None:
        """Take an image that was looked at."""

    def on_camera(self, event: WorkerEvent, camera: int) -> None:
        """Take what happens to a camera, by its number from 0, but for images."""


class Live:
    """Looks at the images of one camera, or of two beside each other, until stopped.

    Parameters
    ----------
    cameras : sequence of ImageCamera
        Not open yet. Nobody else may call them any more.
    settings : CameraSettings
        To be applied when they are opened.
    runner : SwingRunner
        Takes every image, but for those of a verification.
    clock : Clock, optional
        The one that the cameras go by.
    known : mapping of str to CameraSettings
        By serial numbers; a camera that is among them gets these instead.
    verifier : VerificationRunner, optional
        Takes every image while somebody verifies a tip.
    stream : PoseStream, optional
        Tells others what the first camera shows; while they listen, nothing rests.
    """

    def __init__(
        self,
        cameras: Sequence[ImageCamera],
        settings: CameraSettings,
        listener: LiveListener,
        runner: SwingRunner,
        clock: Clock | None = None,
        known: Mapping[str, CameraSettings] | None = None,
        verifier: VerificationRunner | None = None,
        stream: PoseStream | None = None,
    ) -> None:
        self._workers = tuple(
            CameraWorker(
                *(camera, settings, partial(self._on_event, c)),
                clock=clock,
                known=known,
            )
            for c, camera in enumerate(cameras)
        )
        self._pairs = FramePairs()
        self._has_refused = False
        self._listener = listener
        self._runner = runner
        self._verifier = verifier
        self._stream = stream
        self._aim = Aim()
        self._wanted: Aim | SwingSetup = self._aim
        self._last: dict[int, Sighting] = {}  # of what is wanted, by camera
        self._is_watched = True
        self._scene = Spots.none()
        self._moved_ns: int | None = None
        self._seen_ns = 0
        self._seen_seq = 0
        self._pass_seq = 0  # where the pass through a recording began
        self._stage: object = None
        self._measures = False
        self._ready = Event()
        self._stopping = Event()
        self._thread = Thread(target=self._run, name="looking", daemon=True)

    def worker(self, camera: int = 0) -> CameraWorker:
        """Return who runs a camera."""
        return self._workers[camera]

    @property
    def stats(self) -> Stats:
        """What became of the images of all cameras."""
        stats = reduce(Stats.and_then, (worker.stats for worker in self._workers))
        return replace(stats, unpaired=self._pairs.n_unpaired)

    @property
    def lag_ms(self) -> float | None:
        """By how much the second camera is later; None while that is not known."""
        return self._pairs.lag_ms

    def start(self) -> None:
        """Open the cameras and look at their images; once only."""
        for worker in self._workers:
            worker.start()
        self._thread.start()

    def stop(self) -> None:
        """Close the cameras and end all threads.

        Raises
        ------
        DeviceLost
            The camera did not come back from a call.
        """
        self._stopping.set()
        self._ready.set()
        if self._thread.ident is not None:
            self._thread.join(LONGEST_STOP)
        with ExitStack() as stack:  # one that does not stop keeps none from it
            for worker in self._workers:
                stack.callback(worker.stop)

    def set_aim(self, aim: Aim) -> None:
        """Look for something else from the next image on; a swing keeps its own."""
        self._aim = aim
        self._pass_seq = self._seen_seq

    def set_watched(self, watched: bool) -> None:
        """Say whether anybody looks on; a swing that is captured goes on anyway."""
        self._is_watched = watched

    def hurry(self) -> None:
        """Look at every image for a while, as if something had moved."""
        if self._moved_ns is not None:
            self._moved_ns = self._seen_ns

    def _run(self) -> None:
        try:
            while not self._stopping.is_set():
                captured = self._captured()
                self._notice_stage()
                rest = self._rest()
                is_paired = self._measures and len(self._workers) > 1
                for worker in self._workers:  # two that rest rarely meet a moment
                    worker.set_rest(0.0 if is_paired and rest is not None else rest)
                if self._measures:
                    self._take_next(captured, rest if is_paired else None)
                else:
                    self._take_newest()
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
            ),
            0,
        )
        for worker in self._workers:
            with suppress(DeviceLost):  # `stop` tells it
                worker.stop()

    def _captured(self) -> SwingSetup | Aim | None:
        """Return what is captured now, and take all images while something is."""
        status = self._runner.status
        captured: SwingSetup | Aim | None = self._verified()
        if captured is None and status.is_capturing:
            captured = status.setup
        if self._measures is not (captured is not None):
            self._measures = captured is not None
            for worker in self._workers:
                worker.measure(self._measures)
            self._pairs.forget()
        return captured

    def _verified(self) -> Aim | None:
        """Return what a verification looks for; None while nobody is at one."""
        status = None if self._verifier is None else self._verifier.status
        return status.aim if status is not None and status.is_touching else None

    def _rest(self) -> float | None:
        """Return how long the camera may rest after each image, s; None for good."""
        if self._stream is not None and self._stream.is_heard:
            return 0.0
        if self._moved_ns is None:  # the first image tells of what size they are
            return 0.0
        still_ns = self._seen_ns - self._moved_ns
        status = self._runner.status
        waits = status.state is None or status.state.phase is Phase.WAIT
        is_swung = status.is_capturing and not (waits or status.is_paused_by_user)
        if self._verified() is None and is_swung:
            assert status.setup is not None
            assert status.state is not None
            is_begun = status.state.phase in IN_THE_MIDST
            if status.setup.is_recording or not is_begun:
                return 0.0
        if self._verified() is not None or is_swung:
            return 0.0 if still_ns < PATIENT_NS else UNHURRIED
        if not self._is_watched:
            return None
        return 0.0 if still_ns < LIVELY_NS else UNHURRIED

    def _notice_stage(self) -> None:
        """Count a new phase or task as a move: what rests may be of use in it."""
        status = self._runner.status
        verified = None if self._verifier is None else self._verifier.status
        stage = (
            None if status.state is None else status.state.phase,
            verified is not None and verified.is_touching and verified.task,
        )
        if stage != self._stage:
            self._stage = stage
            self.hurry()

    def _notice(self, image: LiveImage) -> None:
        """Remember when anything was seen to move last, however slowly."""
        self._seen_ns = image.frame.host_ts_ns
        self._seen_seq = image.frame.seq
        is_first = self._moved_ns is None
        has_moved = not self._is_passed() and have_moved(self._scene, image.spots)
        if is_first or has_moved:
            self._moved_ns = self._seen_ns
            self._scene = image.spots

    def _is_passed(self) -> bool:
        """Return whether a recording was seen to its end, and nothing is captured."""
        caps = self._workers[0].caps
        if self._measures or caps is None or caps.n_images is None:
            return False
        return self._seen_seq - self._pass_seq >= caps.n_images

    def _tell_others(self, image: LiveImage) -> None:
        """Stream what an image shows."""
        if self._stream is not None:
            self._stream.take(image.frame, image.sighting)

    def _take_newest(self) -> None:
        """Look at the newest image of each camera, as no swing takes them all."""
        self._ready.wait(LONGEST_WAIT)
        self._ready.clear()
        for c, worker in enumerate(self._workers):
            frame = worker.latest()
            if frame is None:
                continue
            self._pairs.note(c, frame)
            image = self._look(frame, self._aim, c)
            if c == 0:
                self._notice(image)
                self._tell_others(image)
                self._hand_over(frame, image.sighting, None)
            self._listener.on_image(image)

    def _take_next(self, captured: SwingSetup | Aim | None, rest: float | None) -> None:
        """Look at the next image, of two cameras at those of the next moment.

        Parameters
        ----------
        rest : float or None
            Moments within this time of the last one are passed over, s.
        """
        wanted = captured or self._aim
        frame = self._next_frame()
        if frame is None:
            return
        if rest is not None and frame.host_ts_ns - self._seen_ns < rest * 1e9:
            return
        frames = (frame, *frame.others)[: len(wanted.aims)]
        images = [self._look(each, wanted, c) for c, each in enumerate(frames)]
        self._notice(images[0])
        self._tell_others(images[0])
        sightings = [i.sighting for i in images if i.sighting is not None]
        sighting = None
        if len(sightings) == len(images):
            sighting = replace(sightings[0], others=tuple(sightings[1:]))
        if self._verifier is not None and isinstance(captured, Aim):
            self._verifier.take(frame, sighting, captured)
        elif not isinstance(captured, Aim):
            self._hand_over(frame, sighting, captured)
        for image in images:
            self._listener.on_image(image)

    def _next_frame(self) -> Frame | None:
        """Return the next image, with that of the other camera at its moment."""
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
        moment = self._pairs.take(n_images)
        if moment is None:
            self._add_next()
            moment = self._pairs.take(n_images)
        moved_ms = self._pairs.moved_ms()
        if moved_ms is not None:
            self._listener.on_camera(Troubled(FramesHeldUp(held_up(moved_ms))), 1)
        return moment

    def _add_next(self) -> None:
        """Take the next frame of the camera whose turn it is."""
        wanted = self._pairs.wanted
        try:
            frame = self._workers[wanted].next_frame(LONGEST_WAIT)
        except FrameTimeout:  # what the other has sent goes on, and finds no partner
            wanted = 1 - wanted
            frame = self._workers[wanted].next_frame(0.0)
        self._pairs.add(wanted, frame)

    def _refuse_recordings(self) -> None:
        """Tell once that two recordings are not of the same moments."""
        if not self._has_refused:
            self._has_refused = True
            self._listener.on_camera(
                Failed(
                    LightpenError(
                        sentence(
                            "live.other-recording",
                            "The recording of the second camera holds another number "
                            "of images than that of the first. Choose two recordings "
                            "of the same moments.",
                        )
                    )
                ),
                1,
            )
        self._stopping.wait(LONGEST_WAIT)

    def _hand_over(
        self, frame: Frame, sighting: Sighting | None, setup: SwingSetup | None
    ) -> None:
        caps = self._workers[0].caps
        n_images = None if caps is None else caps.n_images
        self._runner.take(frame, sighting, setup, n_images, self.stats)

    def _look(self, frame: Frame, wanted: Aim | SwingSetup, c: int) -> LiveImage:
        if wanted is not self._wanted:
            self._wanted = wanted
            self._last.clear()
        aims = wanted.aims
        aim = aims[c] if c < len(aims) else Aim()  # of cameras that come or go
        camera, pen, mask = aim.camera, aim.pen, aim.mask
        if camera is None or pen is None or not camera.fits(frame.image):
            try:
                spots = detect_spots(frame.image, mask, full_scale=frame.full_scale)
                return LiveImage(frame, spots, None, c)
            except MISHAPS:
                return LiveImage(frame, Spots.none(), None, c)
        sighting = look(
            *(frame.image, camera, pen, mask, self._last.get(c), frame.full_scale),
            is_followed=isinstance(wanted, SwingSetup),
        )
        self._last[c] = sighting
        spots = Spots.none() if sighting.spots is None else sighting.spots
        return LiveImage(frame, spots, sighting, c)

    def _on_event(self, c: int, event: WorkerEvent) -> None:
        if isinstance(event, FrameReady):
            self._ready.set()
        else:
            self._listener.on_camera(event, c)
