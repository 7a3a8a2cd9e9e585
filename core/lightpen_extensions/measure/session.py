"""A verification session: its state, its rules and guidance."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from enum import StrEnum
from functools import lru_cache
from pathlib import Path
from typing import Protocol

from lightpen.detection.pen_detection import PenDetection
from lightpen.detection.pixel_box import RegionOfInterest
from lightpen.errors import CalibrationError
from lightpen.estimation.reports.verdict import Grade
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.messages import Message, message
from lightpen_extensions.comparisons.assessment import VerificationAssessment
from lightpen_extensions.measure.probing.current_tip import CurrentTip
from lightpen_extensions.measure.probing.probing import (
    ProbingPhase,
    ProbingRules,
    ProbingState,
    advance_touch,
    at_rest,
    with_taken,
)
from lightpen_extensions.measure.probing.sources import require_leds_fit
from lightpen_extensions.measure.tasks.probed_point import StillFrames, measure_touches
from lightpen_extensions.measure.tasks.registry import AnyTask, task_of
from lightpen_extensions.measure.tasks.task import (
    Band,
    Conditions,
    Found,
    FoundT,
    Points,
    Runs,
    Screening,
    TaskProgress,
    VerificationChoices,
    VerificationTask,
)

# A verification without a key.
#
# `advance_session` takes the state and what the next image shows. The task ends
# automatically when its points suffice; live images and recorded ones go through the
# same steps. Points that can be none of the task are dropped with a message.


BROKEN_OFF = message("session.broken-off")


@dataclass(frozen=True, eq=False)
class SessionSetup:
    """A task, and under which conditions its points are measured and judged."""

    conditions: Conditions
    choices: VerificationChoices = field(default_factory=VerificationChoices)

    @property
    def instrument(self) -> Instrument:
        """The instrument."""
        return self.conditions.instrument

    @property
    def task(self) -> AnyTask:
        """The task that is chosen."""
        return task_of(self.choices.kind)

    @property
    def rules(self) -> ProbingRules:
        """The probing rules of a point of it."""
        turn, distance = self.task.newness
        n_frames = self.task.n_frames(self.choices)
        return ProbingRules(n_frames, min_turn=turn, min_distance=distance)


@dataclass(frozen=True, eq=False)
class SessionState:
    """A verification at one moment."""

    touching: ProbingState = field(default_factory=ProbingState)
    touches: Points = ()
    runs: tuple[Points, ...] = ()  # that are complete
    # Of the last point, or of all points once they suffice.
    fault: Message | None = None
    done: AnyTask | None = None  # the task once it is complete
    found: Found | None = None  # by it

    def found_by(self, task: VerificationTask[FoundT]) -> FoundT | None:
        """Return the result of a task; None until it is complete."""
        # What the task itself found has its type.
        return self.found if self.done is task else None  # type: ignore[return-value]

    def task(self, setup: SessionSetup) -> AnyTask | None:
        """Return the task to probe; None when it is complete."""
        return setup.task if self.done is None else None

    def progress(self, setup: SessionSetup, task: AnyTask) -> TaskProgress:
        """Return the progress of a task."""
        n_runs = task.n_runs(setup.choices)
        if self.task(setup) is not task:
            return TaskProgress(n_runs=n_runs)
        return TaskProgress(self.touches, self.runs, n_runs)

    @property
    def is_begun(self) -> bool:
        """Whether anything was probed or found."""
        return bool(self.found or self.touches or self.runs)


def without_touches(state: SessionState) -> SessionState:
    """Return the state at the start of the next run; a pen at rest must move first."""
    touching = replace(state.touching, taken=(), places=())
    return replace(state, touching=touching, touches=(), fault=None)


def with_pen_at_rest(state: SessionState) -> SessionState:
    """Return the state for a pen at an unknown place, which must move first."""
    return replace(state, touching=at_rest(state.touching))


def is_at_rest(state: SessionState) -> bool:
    """Return whether the pen is seen where it rests since probing began."""
    touching = state.touching
    return touching.phase is ProbingPhase.AT_REST and bool(touching.held)


def instruction(setup: SessionSetup, state: SessionState) -> Message:
    """Return the instruction for the operator."""
    task = state.task(setup)
    if task is None:
        return message("session.done")
    if is_at_rest(state):
        return message("session.at-rest")
    if state.touching.phase is ProbingPhase.KNOWN:
        return task.known
    if state.fault is not None:
        return state.fault
    return task.instruction(setup.choices, state.progress(setup, task))


def bands_so_far(setup: SessionSetup, state: SessionState) -> tuple[Band, ...]:
    """Return the values of the session, or of its points so far, with their limits."""
    task = setup.task
    if state.found is not None:
        return tuple(task.bands(state.found, setup.conditions))
    runs = state.runs
    if task.is_of_tip and state.touches:
        runs = (*runs, state.touches)
    return _bands_of(setup.choices, setup.conditions, runs) if runs else ()


@lru_cache(maxsize=8)
def _bands_of(
    choices: VerificationChoices, conditions: Conditions, runs: tuple[Points, ...]
) -> tuple[Band, ...]:
    """Return the values of some runs; none as long as they do not determine any."""
    task = task_of(choices.kind)
    try:
        found = task.measure(numbered_runs(runs), conditions, choices)
    except CalibrationError:
        return ()
    return tuple(task.bands(found, conditions))


def numbered_runs(runs: Sequence[Points]) -> Runs:
    """Return runs with their names."""
    return [(f"#{i}", points) for i, points in enumerate(runs, start=1)]


def fraction_done(setup: SessionSetup, state: SessionState) -> float:
    """Return the completed fraction of the current task, 0 to 1."""
    task = state.task(setup)
    if task is None:
        return 1.0
    progress = state.progress(setup, task)
    return (len(progress.runs) + task.done(setup.choices, progress)) / progress.n_runs


@dataclass(frozen=True, eq=False)
class SessionTransition:
    """A verification after one more image, with the task that this image ended."""

    state: SessionState
    recorded: tuple[str, ...] = ()  # images of the point that is complete now
    is_broken_off: bool = False  # whether a point was, before it was complete
    finished: AnyTask | None = None


def setup_of(tip: CurrentTip, choices: VerificationChoices) -> SessionSetup:
    """Return the setup of a session with a current tip."""
    conditions = Conditions(
        tip.instrument,
        choices.limits,
        tip.names.ball_diameter,
        nominal_tip=tip.nominal_tip,
    )
    return SessionSetup(conditions, choices)


def advance_session(
    setup: SessionSetup, state: SessionState, name: str, detection: PenDetection
) -> SessionTransition:
    """Process one more image, and end the current task when its touches suffice."""
    task = state.task(setup)
    if task is None:
        return SessionTransition(state)
    touched = advance_touch(
        setup.instrument, setup.rules, state.touching, name, detection
    )
    recorded, is_broken_off = touched.recorded, touched.is_broken_off
    state = replace(state, touching=touched.state)
    if is_broken_off:
        state = replace(state, fault=BROKEN_OFF)
    if not recorded:
        return SessionTransition(state, is_broken_off=is_broken_off)
    try:
        ended = end_run(setup, with_touch(setup, state))
    except CalibrationError as error:
        ended = SessionTransition(replace(state, fault=error.message))
    return replace(ended, recorded=recorded, is_broken_off=is_broken_off)


def end_run(setup: SessionSetup, state: SessionState) -> SessionTransition:
    """End the current run if its points suffice, and with the last one the task."""
    try:
        if _suffices(setup, state):
            state = _with_run(setup, state)
    except CalibrationError as error:
        state = replace(state, fault=error.message)
    return SessionTransition(state, finished=state.done)


def end_task(setup: SessionSetup, state: SessionState) -> SessionTransition:
    """End the current task with its touches, or report why it cannot end."""
    task = state.task(setup)
    if task is None:
        return SessionTransition(state)
    runs = (*state.runs, state.touches) if state.touches else state.runs
    try:
        ended = _done(setup, state, runs)
    except CalibrationError as error:
        return SessionTransition(replace(state, fault=error.message))
    return SessionTransition(ended, finished=task)


def run_again(
    setup: SessionSetup, state: SessionState, held: Sequence[StillFrames]
) -> SessionState:
    """Return the session with the touches of an earlier run.

    Raises `CalibrationError` if they are none of the current task.
    """
    touches = measure_touches(setup.instrument, held)
    return _with_run(setup, replace(state, touches=touches))


def touch_again(
    setup: SessionSetup, state: SessionState, held: Sequence[StillFrames]
) -> SessionState:
    """Return the session with the touches of its current run; see `end_run`."""
    touching = with_taken(setup.instrument, state.touching, held)
    touches = measure_touches(setup.instrument, held)
    return replace(state, touching=touching, touches=touches)


def without_last_touch(state: SessionState) -> SessionState:
    """Return the session without the last point of the current run."""
    touching = replace(
        state.touching,
        taken=state.touching.taken[:-1],
        places=state.touching.places[:-1],
    )
    return replace(state, touching=touching, touches=state.touches[:-1], fault=None)


def with_touch(setup: SessionSetup, state: SessionState) -> SessionState:
    """Measure again with the last point; drop it if it cannot be one of the task."""
    points = measure_touches(setup.instrument, state.touching.taken)
    state = replace(state, touches=points)
    screening = _screened(setup, state)
    kept = screening.kept
    touching = replace(
        state.touching,
        taken=tuple(state.touching.taken[i] for i in kept),
        places=tuple(state.touching.places[i] for i in kept),
    )
    return replace(
        state,
        touching=touching,
        touches=tuple(points[i] for i in kept),
        fault=screening.fault,
    )


def _screened(setup: SessionSetup, state: SessionState) -> Screening:
    last = state.touches[-1]
    try:
        require_leds_fit(last.label, (last,))
    except CalibrationError as error:
        return Screening(range(len(state.touches) - 1), error.message)
    return setup.task.screen(state.progress(setup, setup.task))


def _suffices(setup: SessionSetup, state: SessionState) -> bool:
    """Return whether the points are enough for a run."""
    return setup.task.done(setup.choices, state.progress(setup, setup.task)) >= 1.0


def _with_run(setup: SessionSetup, state: SessionState) -> SessionState:
    """End a run, and with the last of them the task."""
    runs, task = (*state.runs, state.touches), setup.task
    if len(runs) >= task.n_runs(setup.choices):
        return _done(setup, state, runs)
    (task.check or task.measure)(numbered_runs(runs), setup.conditions, setup.choices)
    return replace(without_touches(state), runs=runs)


def _done(
    setup: SessionSetup, state: SessionState, runs: Sequence[Points]
) -> SessionState:
    """Measure a task."""
    found = setup.task.measure(numbered_runs(runs), setup.conditions, setup.choices)
    return replace(without_touches(state), runs=(), done=setup.task, found=found)


def _is_known(state: SessionState) -> bool:
    return state.touching.phase is ProbingPhase.KNOWN


class ReadingState(StrEnum):
    """What is being read."""

    NOTHING = ""
    TIP = "tip"
    IMAGES = "images"


class SessionEventKind(StrEnum):
    """Kinds of events, each with its sound and sign."""

    RECORDED = "recorded"
    BROKEN_OFF = "broken off"
    KNOWN = "known"
    DONE = "done"
    FAILED = "failed"  # done, with something found against the tip


@dataclass(frozen=True, eq=False)
class VerificationStatus:
    """Immutable snapshot of a verification, from the current tip to its verdict."""

    tip: CurrentTip | None = None
    setup: SessionSetup | None = None  # None until the tip is read
    state: SessionState | None = None  # likewise
    region: RegionOfInterest | None = None
    began: datetime | None = None  # when its first image came
    files: tuple[Path, ...] = ()  # results
    reading: ReadingState = ReadingState.NOTHING
    is_here: bool = False  # an operator is present
    is_paused: bool = False
    refusal: Message | None = None  # why nothing can be verified

    @property
    def task(self) -> AnyTask | None:
        """Task to probe; None when it is complete or none is possible."""
        if self.setup is None or self.state is None:
            return None
        return self.state.task(self.setup)

    @property
    def is_touching(self) -> bool:
        """Whether images are taken."""
        is_wanted = self.is_here and not self.is_paused and self.refusal is None
        return is_wanted and not self.reading and self.task is not None

    @property
    def is_done(self) -> bool:
        """Whether the task is complete."""
        return self.state is not None and self.state.done is not None

    @property
    def assessment(self) -> VerificationAssessment | None:
        """What was found."""
        found = None if self.state is None else self.state.found
        return None if found is None else found.assessment


class VerificationListener(Protocol):
    """Listener, called on the threads of a runner; must return soon."""

    def on_verification(
        self, status: VerificationStatus, events: tuple[SessionEventKind, ...]
    ) -> None:
        """Take the status after a change, and what happened."""

    def on_progress(self, fraction: float) -> None:
        """Receive the fraction of images read, 0 to 1."""

    def on_fault(self, message: Message) -> None:
        """Take a sentence to be read: something could not be done."""

    def on_fault_cleared(self, message: Message) -> None:
        """Receive the end of a fault."""


def event_kinds(
    before: SessionState | None, transition: SessionTransition
) -> list[SessionEventKind]:
    """Return the events of the touches by one more image."""
    is_known = _is_known(transition.state)
    happened = {
        SessionEventKind.BROKEN_OFF: transition.is_broken_off,
        SessionEventKind.RECORDED: transition.recorded,
        SessionEventKind.KNOWN: is_known and before and not _is_known(before),
    }
    return [kind for kind, has_happened in happened.items() if has_happened]


def ending(status: VerificationStatus) -> SessionEventKind:
    """Return the event of a completed task."""
    found = status.assessment
    is_refused = found is not None and found.grade is Grade.REPEAT
    return SessionEventKind.FAILED if is_refused else SessionEventKind.DONE
