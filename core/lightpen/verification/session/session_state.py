"""State of a verification: setup, probed points and results."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.messages import Message, message
from lightpen.verification.probing.drift_reference import LampDrift
from lightpen.verification.probing.probing import ProbingPhase, ProbingState, at_rest
from lightpen.verification.session.choices import VerificationChoices
from lightpen.verification.tasks.assessment import VerificationAssessment, worst
from lightpen.verification.tasks.drift import DRIFT, MIN_VISITS, Drift
from lightpen.verification.tasks.probed_point import NO_DRIFT
from lightpen.verification.tasks.registry import ALL_TASKS, AnyTask
from lightpen.verification.tasks.task import (
    Conditions,
    Found,
    FoundT,
    OptionsT,
    Points,
    Runs,
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

    @property
    def is_drift_checked(self) -> bool:
        """Whether a drift reference is visited before, between and after the tasks."""
        return DRIFT.kind in self.choices.kinds


def with_drift(
    setup: SessionSetup, reference: LampDrift | Drift | None
) -> SessionSetup:
    """Return the conditions with the camera drift measured by lamps or a cone."""
    if reference is None:
        return setup
    return replace(setup, drift=np.maximum(setup.drift, reference.share))


@dataclass(frozen=True, eq=False)
class RunsOfTask:
    """Points of a task that is done, to be measured again."""

    task: AnyTask
    runs: Runs
    setup: SessionSetup | None = None  # None where it is the session's
    lamps: LampDrift | None = None  # in recorded images
    drift: Drift | None = None  # between the visits around it


@dataclass(frozen=True, eq=False)
class SessionState:
    """A verification at one moment."""

    touching: ProbingState = field(default_factory=ProbingState)
    touches: Points = ()
    runs: tuple[Points, ...] = ()  # completed runs of the current task
    # Of the last point, or of all points once they suffice.
    fault: Message | None = None
    found: Mapping[str, Found] = field(default_factory=dict)  # of completed tasks
    # Runs of completed tasks.
    measured: Mapping[str, RunsOfTask] = field(default_factory=dict)
    visits: tuple[Points, ...] = ()  # visits of the reference cone so far
    pending: tuple[RunsOfTask, ...] = ()  # results that lack the next drift

    def found_by(self, task: VerificationTask[OptionsT, FoundT]) -> FoundT | None:
        """Return the result of a task; None until it is complete."""
        found: FoundT | None = self.found.get(task.kind)  # type: ignore[assignment]
        return found

    def task(self, setup: SessionSetup) -> AnyTask | None:
        """Return the task to probe; None when all are complete.

        The drift reference is visited before the first task and after each.
        """
        others = [task for task in setup.choices.tasks if task is not DRIFT]
        left = [task for task in others if task.kind not in self.found]
        is_due = len(self.visits) <= len(others) - len(left)
        if self.awaits_drift(setup) and (is_due or not left):
            return DRIFT
        return next(iter(left), None)

    def awaits_drift(self, setup: SessionSetup) -> bool:
        """Return whether a cone is visited in between, and not for the last time."""
        return setup.is_drift_checked and DRIFT.kind not in self.found

    def runs_of(self, task: AnyTask) -> tuple[Points, ...]:
        """Return the completed runs of the current task."""
        return self.visits if task is DRIFT else self.runs

    def progress(self, setup: SessionSetup, task: AnyTask) -> TaskProgress:
        """Return the progress of a task."""
        is_at_hand = self.task(setup) is task
        runs = self.runs_of(task) if is_at_hand or task is DRIFT else ()
        n_runs = task.n_runs(setup.choices.options_of(task))
        if task is DRIFT:
            n_runs = max(n_visits(setup.choices), len(runs) + is_at_hand)
        return TaskProgress(
            points=self.touches if is_at_hand else (), runs=runs, n_runs=n_runs
        )

    @property
    def is_begun(self) -> bool:
        """Whether anything was probed or found."""
        return bool(self.found or self.touches or self.runs or self.visits)

    @property
    def assessment(self) -> VerificationAssessment | None:
        """The worst finding so far; a drift first, as it explains the others."""
        drift = self.found_by(DRIFT)
        found = [self.found[task.kind] for task in ALL_TASKS if task.kind in self.found]
        if drift is not None and not drift.assessment.is_accepted:
            found.insert(0, drift)
        return worst([each.assessment for each in found]) if found else None


def n_done(state: SessionState) -> int:
    """Return the completed runs of the current task and visits of the cone."""
    return len(state.runs) + len(state.visits)


def n_visits(choices: VerificationChoices) -> int:
    """Return the number of visits to the cone: before, between and after the tasks."""
    n_others = len({*choices.kinds} - {DRIFT.kind})
    return max(n_others + 1, MIN_VISITS)


def without_touches(state: SessionState) -> SessionState:
    """Return the state at the start of the next run; a pen at rest must move first."""
    touching = replace(state.touching, taken=(), places=())
    return replace(state, touching=touching, touches=(), runs=(), fault=None)


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


def fraction_done(setup: SessionSetup, state: SessionState) -> float:
    """Return the completed fraction of the current task, 0 to 1."""
    task = state.task(setup)
    if task is None:
        return 1.0
    progress, options = state.progress(setup, task), setup.choices.options_of(task)
    return (len(progress.runs) + task.done(options, progress)) / progress.n_runs
