"""Verification tasks: the definition for command line, session and window.

A module of this package makes one `VerificationTask`; `registry` lists them. The part
has a step of the window to itself. Nothing else switches on the kind of a task.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from math import inf
from typing import Annotated, Any, Generic, Literal, TypeAlias, TypeVar

import numpy as np
from msgspec import Meta

from lightpen.arrays import FloatArray
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.messages import Message, message
from lightpen.model.coverage import Decision
from lightpen.model.limits import BALL_UNCERTAINTY, VerificationLimits
from lightpen.record.folder import MEASURED_PART
from lightpen_extensions.comparisons.assessment import (
    VerificationAssessment,
    rule_in_words,
)
from lightpen_extensions.measure.measuring.plan import Plan, PlannedFeature
from lightpen_extensions.measure.measuring.report import ResultTable
from lightpen_extensions.measure.tasks.probed_point import NO_DRIFT, ProbedPoint

ANY = 1e6  # mm or rad: no other place, no other posture makes a point a new one
FAST = 5  # images of a point, usually
TaskKind: TypeAlias = Literal["fixed point", "drift", "part"]  # in records and settings


Points: TypeAlias = tuple[ProbedPoint, ...]
Runs: TypeAlias = Sequence[tuple[str, Sequence[ProbedPoint]]]


@dataclass(frozen=True)
class VerificationChoices:
    """What is chosen for a verification; the defaults are the usual values."""

    kind: TaskKind = "fixed point"
    plan: Plan | None = None  # of a part
    n_cone: Annotated[int, Meta(ge=3, le=50)] = 6  # points of a tip check, and
    n_cone_frames: Annotated[int, Meta(ge=1, le=100)] = 15  # images of each
    n_frames: int = FAST  # images of another point
    limits: VerificationLimits = field(default_factory=VerificationLimits)

    @property
    def features(self) -> tuple[PlannedFeature, ...]:
        """The features of the plan, a run each; none without a plan."""
        return () if self.plan is None else self.plan.features


@dataclass(frozen=True, eq=False)
class Conditions:
    """Conditions under which points are measured and judged."""

    instrument: Instrument
    limits: VerificationLimits = field(default_factory=VerificationLimits)
    ball_diameter: float | None = None  # mm; if a surface is touched
    ball_uncertainty: float = BALL_UNCERTAINTY  # U (k = 2) of the diameter, mm
    nominal_tip: FloatArray | None = None  # (3,), mm, to compare with
    # (3,), standard uncertainty of a point by a camera that moved, mm
    drift: FloatArray = field(default_factory=NO_DRIFT.copy)


@dataclass(frozen=True, eq=False)
class Found:
    """Base of the result of a task."""

    assessment: VerificationAssessment


@dataclass(frozen=True, eq=False)
class Band:
    """A value with its U (k = 2) between its limits, mm or degrees."""

    name: Message | str
    value: float
    uncertainty: float
    lower: float = -inf
    upper: float = inf
    nominal: float = 0.0
    decision: Decision | None = None  # None without limits
    of: tuple[str, ...] = ()  # features of a part that it needs
    is_angle: bool = False


@dataclass(frozen=True, eq=False)
class TaskProgress:
    """Points of the current run of a task, and completed runs."""

    points: Points = ()
    runs: tuple[Points, ...] = ()
    n_runs: int = 1

    @property
    def run(self) -> int:
        """Number of the current run, from 1."""
        return len(self.runs) + 1


@dataclass(frozen=True)
class Screening:
    """Accepted points of the current run, and the reason for a rejection."""

    kept: Sequence[int]
    fault: Message | None = None


@dataclass(frozen=True)
class HandGoal:
    """Goal of a simulated operator for the next point."""

    point: FloatArray | None = None  # (3,), from the cone's bottom, mm
    tilt: float = 0.0  # of the pen in the cone, rad
    direction: float = 0.0  # of the tilt, rad
    outwards: FloatArray = field(default_factory=lambda: np.zeros(3))  # its normal


FoundT = TypeVar("FoundT", bound=Found)


@dataclass(frozen=True, eq=False, kw_only=True)
class VerificationTask(Generic[FoundT]):
    """One task of a verification."""

    kind: TaskKind
    title: Message  # a noun
    purpose: Message  # instruction shown beside the check box of the task
    first: Message  # what to do, in few words
    another: Message  # likewise, for another point than the first
    known: Message  # message on a point that was probed before
    limits: tuple[str, ...]  # in `VerificationLimits`
    # Raises `CalibrationError` where the points do not suffice.
    measure: Callable[[Runs, Conditions, VerificationChoices], FoundT]
    entries: Callable[[FoundT, Instrument], dict[str, Any]]  # of the record
    tables: Callable[[FoundT, Conditions], tuple[ResultTable, ...]]
    bands: Callable[[FoundT, Conditions], tuple[Band, ...]]  # the leading one first
    # By run and point from 0
    hand: Callable[[VerificationChoices, int, int], HandGoal]
    instruction: Callable[[VerificationChoices, TaskProgress], Message]
    # Turn, rad, or distance, mm, that makes a point new; both 0 once lifted
    newness: tuple[float, float]
    n_points: Callable[[VerificationChoices, int], int]  # of a run, from 0
    n_frames: Callable[[VerificationChoices], int] = lambda choices: choices.n_frames
    other_run: Message | None = None  # what to do for the first point of another
    n_runs: Callable[[VerificationChoices], int] = lambda _: 1
    screen: Callable[[TaskProgress], Screening] = lambda progress: Screening(
        range(len(progress.points))
    )
    # What must be entered before, by choices and ball diameter
    missing: Callable[[VerificationChoices, float | None], Message | None] = (
        lambda choices, ball_diameter: None
    )
    # Refuses the last of some runs in less time than `measure`.
    check: Callable[[Runs, Conditions, VerificationChoices], object] | None = None
    is_of_tip: bool = True  # values are shown amid a run, and how the pen was held

    def done(self, choices: VerificationChoices, progress: TaskProgress) -> float:
        """Return the completed fraction of the current run, 0 to 1."""
        needed = self.n_points(choices, len(progress.runs))
        return min(len(progress.points) / needed, 1.0) if needed else 0.0

    def counted(self, choices: VerificationChoices, progress: TaskProgress) -> Message:
        """Return the progress of the current task: probed points and points in all."""
        n_points, run = len(progress.points), len(progress.runs)
        needed = self.n_points(choices, run)
        count = message("task.points", n_points=n_points, needed=needed)
        if progress.n_runs == 1:
            return count
        return message(
            "task.run", count=count, run=progress.run, n_runs=progress.n_runs
        )

    def headline(self, progress: TaskProgress, *, is_next: bool) -> Message:
        """Return the instruction in a few words, also just after a point."""
        if progress.points and (is_next or self.other_run):
            return self.another
        return self.other_run if progress.runs and self.other_run else self.first


def rule_of(choices: VerificationChoices, limits: VerificationLimits) -> Message:
    """Return the decision rule of the plan, else of the limits."""
    plan = choices.plan if choices.kind == MEASURED_PART else None
    stated = None if plan is None else plan.rule
    return rule_in_words(replace(limits, rule=stated or limits.rule))
