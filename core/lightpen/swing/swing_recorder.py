"""The open record of a swing: which images of its source go there, and how."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Self, TypeAlias

import numpy as np

from lightpen import __version__
from lightpen.arrays import Image
from lightpen.cameras.protocol import Frame, Stats
from lightpen.cameras.sources import source_named
from lightpen.detection.pen_detection import PenDetection
from lightpen.detection.reasons import Reason
from lightpen.formats.camera_files import CAMERA_FILE
from lightpen.formats.decoding import encode_png
from lightpen.formats.own_json import plain
from lightpen.formats.pen_files import PEN_FILE
from lightpen.formats.rig_files import RIG_FILE, RigFile, read_rig
from lightpen.local_time import local_now
from lightpen.messages import Code, message
from lightpen.model.names import Origin
from lightpen.model.pen import Pen
from lightpen.model.rigid import Rig
from lightpen.record.swings.header import FileCopy, Header, RecordedCamera, damaged_file
from lightpen.record.swings.reading import DISCARDED, JOURNAL, Record, open_record
from lightpen.record.swings.solving import is_simulated_recording, source
from lightpen.record.swings.writing import RecordWriter, SecondaryView
from lightpen.swing.capture.guidance import limits_for_more
from lightpen.swing.capture.kept_images import keep, kept_before
from lightpen.swing.capture.rules import advance_swing, finish, start_again
from lightpen.swing.capture.state import (
    Phase,
    Progress,
    SwingEvent,
    SwingEventKind,
    SwingSetup,
    SwingState,
    Transition,
)
from lightpen.swing.preparation import Preparation, SourceChoice

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


def record_header(preparation: Preparation, *, is_press_test: bool = False) -> Header:
    """Return the header of a record that begins now; files are read again."""
    rig_file = preparation.rig_file
    if rig_file is not None:
        camera_paths = rig_file.camera_files
    elif preparation.camera_file is not None:
        camera_paths = (preparation.camera_file.path,)
    else:
        raise ValueError("`camera_file` or a rig must be chosen.")
    if preparation.pen_file is None:
        raise ValueError("`pen_file` must be chosen.")
    origin = preparation.origin
    if origin is Origin.RECORDED and is_simulated_recording(preparation.source.place):
        origin = Origin.SIMULATED
    return Header(
        created=local_now(),
        program=f"lightpen {__version__}",
        names=preparation.names,
        cameras=tuple(
            RecordedCamera(
                FileCopy.of(path, CAMERA_FILE),
                plain(preparation.mask_of(c)),
                chosen.kind,
                chosen.place,
                preparation.in_use(c),
            )
            for c, (path, chosen) in enumerate(
                zip(camera_paths, preparation.sources, strict=True)
            )
        ),
        rig_file=None if rig_file is None else FileCopy.of(rig_file.path, RIG_FILE),
        pen_file=FileCopy.of(preparation.pen_file.path, PEN_FILE),
        units=preparation.pen_file.units,
        nominal_tip_mm=plain(preparation.nominal_tip),
        origin=origin,
        limits=preparation.limits,
        assumptions=preparation.assumptions_today,
        method=preparation.method,
        is_press_test=is_press_test,
    )


ROUNDING = 1e-6  # of a rotation


@dataclass(frozen=True, eq=False)
class Resumable:
    """An interrupted swing, ready to be resumed."""

    record: Record
    setup: SwingSetup  # of the record's own files
    state: SwingState  # with all images in the journal
    rig_file: RigFile | None = None  # the record's own copy; None of a single camera

    @property
    def source_choices(self) -> tuple[SourceChoice, ...]:
        """The source of each camera; none where this version does not know one."""
        cameras = self.record.header.cameras
        choices = tuple(SourceChoice(each.source, each.place) for each in cameras)
        return choices if all(source_named(each.kind) for each in choices) else ()

    def is_of(self, sources: Sequence[SourceChoice]) -> bool:
        """Return whether images of these sources can continue it."""
        if len(sources) != self.setup.rig.n_cameras:
            return False
        source, own = sources[0], self.record.header.cameras[0]
        return source.kind == own.source and (
            not self.setup.is_recording or source.place == own.place
        )

    def fits(self, image_size: tuple[int, int]) -> bool:
        """Return whether images of this width and height, px, can continue it."""
        return image_size == self.setup.camera.image_size


def read_resumable(folder: Path) -> Resumable:
    """Read an interrupted swing and fit its images again."""
    record = open_record(folder)
    setup = recorded_setup(record)
    if not _shows(record, setup.pen, setup.rig):
        raise damaged_file(folder / JOURNAL)
    if record.more is not None:
        min_images, max_images = record.more
        limits = replace(setup.limits, min_images=min_images, max_images=max_images)
        setup = replace(setup, limits=limits)
    found = source(record)
    rig_file = None
    if found.rig_file is not None:
        rig_file = read_rig(found.rig_file, found.camera_files)
    return Resumable(record, setup, resume_swing(setup, record), rig_file)


def read_for_more(folder: Path) -> Resumable:
    """Read a complete swing, to capture more images.

    The record notes it, so that the swing continues likewise when it is interrupted.
    """
    swing = read_resumable(folder)
    limits = limits_for_more(swing.setup.limits, swing.state.n_kept)
    with RecordWriter.resume(swing.record) as writer:
        writer.ask_for_more(limits.min_images, limits.max_images)
    setup = replace(swing.setup, limits=limits)
    return replace(swing, record=open_record(folder), setup=setup)


def _shows(record: Record, pen: Pen, rig: Rig) -> bool:
    """Return whether the journal can be of this pen before these cameras."""
    for image in record.images:
        R, t = np.array(image.rotation), np.array(image.translation)
        if image.rig_pixels.shape[:2] != (rig.n_cameras, pen.n_leds):
            return False
        if not np.allclose(R.T @ R, np.eye(3), rtol=0, atol=ROUNDING):
            return False
        leds_rig = pen.leds @ R.T + t
        depths = leds_rig @ rig.rotations[:, 2].T + rig.translations[:, 2]
        if depths.min(axis=0).max() <= 0:  # behind all of them
            return False
    return True


def resume_swing(setup: SwingSetup, record: Record, time: float = 0.0) -> SwingState:
    """Return an interrupted swing with all images that its record acknowledged.

    The setup has the record's own camera and pen.
    """
    images = record.used_images
    kept = kept_before(
        setup.rig,
        setup.pen,
        record.numbers,
        np.array([image.rig_pixels for image in images]),
        np.array([image.rotation for image in images]),
        np.array([image.translation for image in images]),
        setup.assumptions,
    )
    return start_again(setup, kept, record.next_number, time)


def recorded_setup(record: Record) -> SwingSetup:
    """Return the setup of a record, from its own copies of the files."""
    found = source(record)
    return SwingSetup(
        found.camera,
        found.pen,
        record.header.limits,
        found.masks[0],
        assumptions=found.assumptions,
        is_recording=record.header.is_of_recording,
        beside=found.rig,
        other_masks=found.masks[1:],
        is_press_test=record.header.is_press_test,
    )
