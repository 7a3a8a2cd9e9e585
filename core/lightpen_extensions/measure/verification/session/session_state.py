"""State of a verification: setup, probed points and results."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.messages import Message, message
from lightpen.model.limits import VerificationLimits
from lightpen_extensions.measure.verification.probing.drift_reference import LampDrift
from lightpen_extensions.measure.verification.probing.probing import (
    ProbingPhase,
    ProbingState,
    at_rest,
)
from lightpen_extensions.measure.verification.session.choices import VerificationChoices
from lightpen_extensions.measure.verification.tasks.probed_point import NO_DRIFT
from lightpen_extensions.measure.verification.tasks.registry import AnyTask
from lightpen_extensions.measure.verification.tasks.task import (
    Band,
    Conditions,
    Found,
    FoundT,
    OptionsT,
    Points,
    Runs,
    TaskOptions,
    TaskProgress,
    VerificationTask,
)


@dataclass(frozen=True, eq=False)
class SessionSetup:
    """Instrument, tasks and artefacts; see `Conditions`."""

    instrument: Instrument
    choices: VerificationChoices = field(default_factory=VerificationChoices)
    ball_diameter: float | None = None
    nominal_tip: FloatArray | None = None
    cone_cam: FloatArray | None = None
    drift: FloatArray = field(default_factory=NO_DRIFT.copy)

    @property
    def conditions(self) -> Conditions:
        """Under which points are measured and judged."""
        return Conditions(
            self.instrument,
            self.choices.limits,
            self.ball_diameter,
            self.nominal_tip,
            self.cone_cam,
            self.drift,
        )


def with_drift(setup: SessionSetup, reference: LampDrift | None) -> SessionSetup:
    """Return the conditions with the camera drift measured by lamps."""
    if reference is None:
        return setup
    return replace(setup, drift=np.maximum(setup.drift, reference.share))


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

    def found_by(self, task: VerificationTask[OptionsT, FoundT]) -> FoundT | None:
        """Return the result of a task; None until it is complete."""
        # What the task itself found has its type.
        return self.found if self.done is task else None  # type: ignore[return-value]

    def task(self, setup: SessionSetup) -> AnyTask | None:
        """Return the task to probe; None when it is complete."""
        return setup.choices.task if self.done is None else None

    def progress(self, setup: SessionSetup, task: AnyTask) -> TaskProgress:
        """Return the progress of a task."""
        n_runs = task.n_runs(setup.choices.options_of(task))
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
    options = setup.choices.options_of(task)
    return task.instruction(options, state.progress(setup, task))


def bands_so_far(setup: SessionSetup, state: SessionState) -> tuple[Band, ...]:
    """Return the values of the session, or of its points so far, with their limits."""
    task = setup.choices.task
    if state.found is not None:
        return tuple(task.bands(state.found, setup.conditions))
    runs = state.runs
    if task.judges_points and state.touches:
        runs = (*runs, state.touches)
    options = setup.choices.options_of(task)
    given = setup.instrument, setup.choices.limits, setup.ball_diameter
    return _bands_of(task, options, *given, runs) if runs else ()


@lru_cache(maxsize=8)
def _bands_of(
    task: AnyTask,
    options: TaskOptions,
    instrument: Instrument,
    limits: VerificationLimits,
    ball_diameter: float | None,
    runs: tuple[Points, ...],
) -> tuple[Band, ...]:
    """Return the values of some runs; none as long as they do not determine any."""
    conditions = Conditions(instrument, limits, ball_diameter)
    try:
        found = task.measure(numbered_runs(runs), conditions, options)
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
    progress, options = state.progress(setup, task), setup.choices.options_of(task)
    return (len(progress.runs) + task.done(options, progress)) / progress.n_runs
