"""The open record of a swing: which images of its source go there, and how."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from hashlib import sha256
from typing import Self, TypeAlias

import numpy as np

from lightpen.arrays import Image
from lightpen.cameras.protocol import Frame, Stats
from lightpen.detection.pen_detection import PenDetection
from lightpen.detection.reasons import Reason
from lightpen.formats.decoding import encode_png
from lightpen.messages import message
from lightpen.record.swings.reading import DISCARDED, Record
from lightpen.record.swings.writing import RecordWriter, SecondaryView
from lightpen.swing.capture.kept_images import keep
from lightpen.swing.capture.rules import advance_swing, finish
from lightpen.swing.capture.state import (
    Phase,
    Progress,
    SwingEvent,
    SwingEventKind,
    SwingSetup,
    SwingState,
    Transition,
)
from lightpen.swing_messages import Code

Rule: TypeAlias = Callable[[SwingSetup, SwingState, PenDetection, float], Transition]


def capture_image(
    setup: SwingSetup,
    state: SwingState,
    writer: RecordWriter,
    image: Image,
    detection: PenDetection,
    time: float,
    device_time_ns: int | None = None,
    stats: Stats | None = None,
    rule: Rule | None = None,
    others: Sequence[SecondaryView] = (),
) -> Transition:
    """Take one image, with its detection, into a swing whose record is written.

    ``rule`` is how it changes the swing, by default that for live images; ``stats`` are
    the counters of the camera since the swing began, ``others`` the simultaneous images
    of the other cameras of a rig. An image that is kept is on the disk when this
    returns. Raises `FileError` if it could not be recorded; ``state`` and the record go
    without it.
    """
    if state.next_number != writer.next_number:
        raise ValueError(
            f"The swing is at image {state.next_number}, the record at "
            f"{writer.next_number}."
        )
    transition = (rule or advance_swing)(setup, state, detection, time)
    # The image last: if the disk fails before, state and record both go without it.
    for event in transition.events:
        if event.what is SwingEventKind.SLIPPED and event.numbers:
            writer.exclude(event.numbers, Reason.SLIPPED)
    for event in transition.events:
        if event.what is SwingEventKind.KEPT:
            writer.append(
                image,
                detection.pixels,
                detection.rotation,
                detection.translation,
                time,
                device_time_ns,
                stats,
                others,
            )
    return transition


def take_recorded_image(
    setup: SwingSetup,
    state: SwingState,
    detection: PenDetection,
    time: float,
    n_images: int,
    *,
    is_known: bool = False,
) -> Transition:
    """Take the next recorded image, read at a time, s; the last one ends the capture.

    A known image was taken before the swing was interrupted.
    """
    state = replace(_further(state, n_images), time=time)
    events: tuple[SwingEvent, ...] = ()
    flaw = _flaw(detection)
    if flaw is not Reason.NONE:
        state = state.with_dropped(1, flaw)
    elif not is_known:
        number = state.next_number
        kept = keep(setup.rig, setup.pen, state.kept, detection, number, time)
        trace = state.trace.with_estimate(kept)
        state = replace(state, kept=kept, next_number=number + 1, trace=trace)
        events = (SwingEvent(SwingEventKind.KEPT, (number,)),)
    return _ended_by_last(Transition(state, events))


def pass_over(state: SwingState, n_images: int) -> Transition:
    """Leave out the next recorded image, which cannot be read or is of another size."""
    passed = _further(state, n_images).with_dropped(1, Reason.UNREADABLE)
    return _ended_by_last(Transition(passed))


def _further(state: SwingState, n_images: int) -> SwingState:
    n_read = state.progress.n_read + 1
    return replace(
        state,
        phase=Phase.CAPTURING,
        progress=Progress(n_read, n_images),
        message=message(Code.IMAGES_READ, n_read=n_read, n_images=n_images),
    )


def _ended_by_last(transition: Transition) -> Transition:
    """End the capture where no image is left."""
    progress = transition.state.progress
    if progress.n_read < progress.n_images:
        return transition
    return finish(transition.state).after(transition.events)


def _flaw(detection: PenDetection) -> Reason:
    """Return why an image cannot take part."""
    if detection.has_pose and not np.isfinite(detection.sigma):
        return Reason.MISFIT
    return detection.reason


@dataclass(frozen=True)
class FrameCounters:
    """Counts over a swing, also over several sessions and cameras."""

    total: Stats = field(default_factory=Stats)  # since the swing began
    last: Stats | None = None  # of the camera at the last image

    def after(self, stats: Stats) -> Self:
        """Return the counters after an image, given the camera's counters."""
        last = self.last
        if last is None:
            return type(self)(self.total, stats)
        if stats.delivered < last.delivered:  # another camera, counting from 0
            last = Stats()
        return type(self)(self.total.and_then(stats.since(last)), stats)


class SwingRecorder:
    """A record that takes in the images of its swing, until it is closed."""

    def __init__(self, record: Record) -> None:
        self._writer = RecordWriter.resume(record)
        self._counters = FrameCounters(record.stats)
        self._known = frozenset(image.sha256 for image in record.images)
        self._n_others = 0  # images of a recording since the last that was read

    def capture(
        self,
        setup: SwingSetup,
        before: SwingState,
        frame: Frame,
        detection: PenDetection,
        n_images: int | None,
        stats: Stats | None,
    ) -> Transition | None:
        """Return the transition by an image, once it is stored if accepted.

        ``n_images`` is the number of images of the recording, if it is one. Return None
        for an image of another swing.
        """
        if stats is not None:
            self._counters = self._counters.after(stats)
        rule: Rule | None = None
        if setup.is_recording:
            if n_images is None or before.phase is Phase.PAUSED:
                return None
            if frame.seq % n_images != before.progress.n_read:
                return self._wait(before, n_images)
            self._n_others = 0
            is_known = self._is_known(frame)
            rule = partial(take_recorded_image, n_images=n_images, is_known=is_known)
        time = frame.host_ts_ns * 1e-9
        return capture_image(
            setup,
            before,
            self._writer,
            frame.image,
            detection,
            time,
            frame.device_ts_ns,
            self._counters.total,
            rule,
            _others(frame, detection),
        )

    def _wait(self, before: SwingState, n_images: int) -> Transition | None:
        """Skip an image of a recording that is not due.

        The recording is shown over and over; each image is read once, in its order.
        One that does not come in a whole pass cannot be read, and is passed over.
        """
        self._n_others += 1
        if self._n_others <= n_images:
            return None
        self._n_others = 0
        return pass_over(before, n_images)

    def _is_known(self, frame: Frame) -> bool:
        """Return whether a recorded image was taken before an interruption."""
        if not self._known:
            return False
        return sha256(encode_png(frame.image)).hexdigest() in self._known

    def discard(self) -> None:
        """Record that the swing was discarded."""
        self._writer.conclude(DISCARDED)

    def close(self) -> None:
        """Close the files of the record."""
        self._writer.close()


def _others(frame: Frame, detection: PenDetection) -> tuple[SecondaryView, ...]:
    return tuple(
        SecondaryView(other.image, seen.pixels, other.device_ts_ns)
        for other, seen in zip(frame.others, detection.others, strict=True)
    )
