"""The images of live touches on the disk, from which a verification can be repeated.

Each run is a separate record, see `lightpen.record.swings.reading`: an image is
written, with the number of its touch, before it counts; one that no longer counts is
excluded. So a run can be read like any recorded images, and a crash leaves complete
data.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from msgspec.structs import replace

from lightpen.arrays import FloatArray
from lightpen.cameras.protocol import Frame
from lightpen.detection.pen_detection import PenDetection
from lightpen.detection.region_of_interest import RegionOfInterest
from lightpen.detection.rig_pose import see_together
from lightpen.errors import FileError
from lightpen.formats.hashes import InputFile, hashed
from lightpen.record.folder.verifications import TOUCHES
from lightpen.record.swings.header import Header
from lightpen.record.swings.journal import JOURNAL
from lightpen.record.swings.names import Names
from lightpen.record.swings.reading import DISCARDED, Record, image_name, open_record
from lightpen.record.swings.writing import (
    RecordWriter,
    SecondaryView,
    make_record_folder,
)
from lightpen_extensions.measure.verification.probing.drift_reference import (
    LampDrift,
    LampObservations,
)
from lightpen_extensions.measure.verification.probing.probing import (
    ProbingEventKind,
    ProbingPhase,
    ProbingRules,
    approach_of,
)
from lightpen_extensions.measure.verification.session.session import (
    SessionTransition,
    advance_session,
    rules_of,
)
from lightpen_extensions.measure.verification.session.session_state import (
    SessionSetup,
    SessionState,
    with_drift,
)
from lightpen_extensions.measure.verification.storage.checkpoint import CountingRun

CONCLUDED = "concluded"
NOT_COUNTED = "not counted"


@dataclass(frozen=True)
class PointRecord:
    """Images of a run; the journal has the checksum of each."""

    folder: Path
    journal: InputFile


@dataclass(frozen=True, eq=False)
class NewRecord:
    """A folder that was made for a record, and its header."""

    folder: Path
    header: Header


class PointImages:
    """Keeps the images of one run after another, each in a new record."""

    def __init__(self, begin: Callable[[], NewRecord]) -> None:
        self._begin = begin
        self._writer: RecordWriter | None = None
        self._open: CountingRun | None = None
        self._folder: Path | None = None
        self._numbers: dict[str, int] = {}  # of images that count, by name
        self._touch = 1  # of the next image
        self._runs: tuple[CountingRun, ...] = ()
        self._records: dict[str, PointRecord] = {}

    @property
    def runs(self) -> tuple[CountingRun, ...]:
        """The accepted runs in order of time, the current one included."""
        return self._runs if self._open is None else (*self._runs, self._open)

    @property
    def records(self) -> tuple[PointRecord, ...]:
        """The runs that are done."""
        return tuple(self._records[run.folder] for run in self._runs)

    def keep(
        self, frame: Frame, seen: PenDetection, approach: FloatArray | None = None
    ) -> str:
        """Put an image on the disk, and return its name in the record."""
        if self._writer is None:
            new = self._begin()
            self._writer = RecordWriter.create(new.folder, new.header, is_swing=False)
            self._folder, self._open = (new.folder, CountingRun(new.folder.name))
        others = frame.others[: len(seen.others)]
        number = self._writer.append(
            frame.image,
            seen.pixels,
            seen.rotation,
            seen.translation,
            frame.host_ts_ns * 1e-9,
            frame.device_ts_ns,
            others=[
                SecondaryView(other.image, view.pixels, other.device_ts_ns)
                for other, view in zip(others, seen.others, strict=True)
            ],
            touch=self._touch,
            approach=approach,
        )
        name = touch_image_name(number)
        self._numbers[name] = number
        return name

    def follow(self, before: SessionState, transition: SessionTransition) -> None:
        """Remove images that no longer count, and end a completed run."""
        state = transition.state
        is_last = transition.finished is not None
        has_ended = is_last or len(state.runs) > len(before.runs)
        counting = before if has_ended else state
        touching = counting.touching
        names = {frame.name for still in touching.taken for frame in still.frames}
        for event in transition.events if has_ended else ():
            if event.what is ProbingEventKind.RECORDED:
                names.update(event.names)
        if not has_ended:
            deviating = () if touching.deviating is None else (touching.deviating,)
            held = touching.held if touching.phase is ProbingPhase.HOLDING else ()
            names.update(seen.frame.name for seen in (*held, *deviating))
        if any(event.what is ProbingEventKind.RECORDED for event in transition.events):
            self._touch += 1
        self._take_out([name for name in self._numbers if name not in names])
        if has_ended:
            self._end(is_last=is_last)

    def begin(self) -> None:
        """Discard the current run, and begin with the first of another session."""
        with suppress(FileError):  # it stays interrupted
            self._close(DISCARDED)
        self._open = None
        self._runs = ()

    def take_over(self, runs: Sequence[CountingRun], folder: Path) -> None:
        """Continue after interrupted runs in the folder of all records."""
        self.begin()
        done = []
        for run in runs:
            record = open_record(folder / run.folder)
            if record.verdict == CONCLUDED:
                done.append(run)
                self._records[run.folder] = _touch_record(folder / run.folder)
            else:
                self._resume(run, record)
        self._runs = tuple(done)

    def _resume(self, run: CountingRun, record: Record) -> None:
        self._writer = RecordWriter.resume(record)
        self._open, self._folder = run, record.folder
        self._numbers = {touch_image_name(i.number): i.number for i in record.images}
        for number in record.excluded:
            self._numbers.pop(touch_image_name(number), None)
        self._touch = 1 + max((image.touch for image in record.images), default=0)

    def _take_out(self, names: list[str]) -> None:
        if names and self._writer is not None:
            self._writer.exclude([self._numbers[name] for name in names], NOT_COUNTED)
            for name in names:
                del self._numbers[name]

    def _end(self, *, is_last: bool) -> None:
        """Close the current run as complete."""
        run, folder = self._open, self._folder
        self._close(CONCLUDED)
        self._open = None
        if run is not None and folder is not None:
            self._records[run.folder] = _touch_record(folder)
            self._runs = (*self._runs, replace(run, is_last=is_last))
        elif is_last and self._runs:  # ended between two runs
            *others, last = self._runs
            self._runs = (*others, replace(last, is_last=True))

    def _close(self, verdict: str) -> None:
        writer = self._writer
        self._writer, self._numbers, self._touch = None, {}, 1
        if writer is not None:
            with writer:
                writer.conclude(verdict)


def touch_image_name(number: int) -> str:
    """Return the name of an image in the record of touches, from 1."""
    return Path(image_name(number)).name


def _touch_record(folder: Path) -> PointRecord:
    return PointRecord(folder, hashed(folder / JOURNAL))


def is_held_on(rules: ProbingRules, state: SessionState) -> bool:
    """Return whether the next image is one of a touch, if the pen stays still."""
    touching = state.touching
    n_held = len(touching.held)
    is_holding = touching.phase is ProbingPhase.HOLDING or not rules.n_settling
    return is_holding and n_held >= rules.n_settling


def new_record(root: Path, names: Names, header: Header) -> NewRecord:
    """Make a folder for the images of a run in the verifications folder."""
    return NewRecord(make_record_folder(root / TOUCHES, names, header.created), header)


class LivePoints:
    """Takes the images of one verification after another."""

    def __init__(self, images: PointImages) -> None:
        self._images = images
        self._lamps = LampObservations()

    def begin(self, lamps: LampObservations) -> None:
        """Begin another verification, with the lamps observed so far."""
        self._lamps = lamps

    def lamp_drift(self, setup: SessionSetup) -> LampDrift | None:
        """Return the drift of fixed lamps."""
        cameras = setup.instrument.rig.cameras
        return self._lamps.lamp_drift(cameras, setup.choices.limits)

    def take(
        self,
        setup: SessionSetup,
        state: SessionState,
        frame: Frame,
        detection: PenDetection,
        region: RegionOfInterest,
    ) -> SessionTransition:
        """Process an image and return the transition of the verification."""
        if state.touching.phase is ProbingPhase.HOLDING:
            self._lamps = self._lamps.with_frame(frame, detection, region)
        together = see_together(setup.instrument.rig, setup.instrument.pen, detection)
        name = self._name(frame, together, setup, state)
        transition = advance_session(self._drifted(setup, state), state, name, together)
        self._images.follow(state, transition)
        return transition

    def _drifted(self, setup: SessionSetup, state: SessionState) -> SessionSetup:
        """Return the conditions with the motion of the camera, if required."""
        task = state.task(setup)
        if task is None:
            return setup
        rules = rules_of(setup, state, task)
        if len(state.touching.held) + 1 < rules.n_settling + rules.n_frames:
            return setup
        return with_drift(setup, self.lamp_drift(setup))

    def _name(
        self, frame: Frame, seen: PenDetection, setup: SessionSetup, state: SessionState
    ) -> str:
        """Return the name of an image of a touch."""
        task = state.task(setup)
        if task is None or not seen.has_pose or seen.is_blurred:
            return str(frame.seq)
        rules = rules_of(setup, state, task)
        if not is_held_on(rules, state):
            return str(frame.seq)
        tip_cam = seen.rotation @ setup.instrument.tip_pen + seen.translation
        approach = approach_of(state.touching, tip_cam)
        return self._images.keep(frame, seen, approach)
