"""A verification at one moment: what is verified, and what was touched and found."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.instrument import Instrument
from lightpen.sentences import Sentence
from lightpen.verification.articulation import Articulation
from lightpen.verification.assessment import Conformity, worst
from lightpen.verification.choices import TaskKind, VerificationChoices
from lightpen.verification.circle import Circle
from lightpen.verification.drift import MIN_VISITS, Drift
from lightpen.verification.fixed_point import FixedPoint
from lightpen.verification.length import Length
from lightpen.verification.touch import NO_DRIFT, Touch
from lightpen.verification.touching import TouchState
from lightpen.verification.witness import LampWitness

Found: TypeAlias = FixedPoint | Circle | Length | Articulation | Drift
Runs: TypeAlias = Sequence[tuple[str, Sequence[Touch]]]


@dataclass(frozen=True, eq=False)
class SessionSetup:
    """What is verified, and by what.

    Attributes
    ----------
    ball_diameter : float or None
        Of the tip, mm; needed where a ring is touched in a bore or round a boss.
    nominal_tip, cone_cam : (3,) array or None
        See `lightpen.verification.fixed_point.measure_fixed_point`.
    drift : (3,) array
        Standard uncertainty of a point by a camera that moved meanwhile, mm.
    """

    instrument: Instrument
    choices: VerificationChoices = field(default_factory=VerificationChoices)
    ball_diameter: float | None = None
    nominal_tip: FloatArray | None = None
    cone_cam: FloatArray | None = None
    drift: FloatArray = field(default_factory=NO_DRIFT.copy)


def with_drift(
    setup: SessionSetup, witness: LampWitness | Drift | None
) -> SessionSetup:
    """Return it with how far the camera moved by what lamps or a cone tell."""
    if witness is None:
        return setup
    return replace(setup, drift=np.maximum(setup.drift, witness.share))


@dataclass(frozen=True, eq=False)
class Unwitnessed:
    """Touches of a task that is done, until the witness is visited again.

    Attributes
    ----------
    setup : SessionSetup or None
        By which recorded images were measured; None where it is the session's.
    lamps : LampWitness or None
        What fixed lamps in recorded images tell.
    """

    task: TaskKind
    runs: Runs
    setup: SessionSetup | None = None
    lamps: LampWitness | None = None


@dataclass(frozen=True, eq=False)
class SessionState:
    """A verification at one moment.

    Attributes
    ----------
    touching : TouchState
        Of the run at hand.
    touches : tuple of Touch
        Measured for it.
    runs : tuple of tuple of Touch
        Runs of the task at hand that are done.
    trouble : Sentence or None
        What was wrong with the last touch, or why the touches do not suffice yet
        though they are as many as needed.
    visits : tuple of tuple of Touch
        Of the cone that is the witness, so far.
    unwitnessed : tuple of Unwitnessed
        What was found since the last visit, which does not count the drift yet.
    """

    touching: TouchState = field(default_factory=TouchState)
    touches: tuple[Touch, ...] = ()
    runs: tuple[tuple[Touch, ...], ...] = ()
    trouble: Sentence | None = None
    fixed_point: FixedPoint | None = None
    circle: Circle | None = None
    length: Length | None = None
    articulation: Articulation | None = None
    drift: Drift | None = None
    visits: tuple[tuple[Touch, ...], ...] = ()
    unwitnessed: tuple[Unwitnessed, ...] = ()

    def found(self, kind: TaskKind) -> Found | None:
        """Return what a task has found; None until it is done."""
        found: dict[TaskKind, Found | None] = {
            TaskKind.FIXED_POINT: self.fixed_point,
            TaskKind.CIRCLE: self.circle,
            TaskKind.LENGTH: self.length,
            TaskKind.ARTICULATION: self.articulation,
            TaskKind.DRIFT: self.drift,
        }
        return found[kind]

    def task(self, setup: SessionSetup) -> TaskKind | None:
        """Return what is to be touched now; None when all is done.

        A witness is visited before the first task and after each.
        """
        others = [each for each in setup.choices.kinds if each is not TaskKind.DRIFT]
        left = [each for each in others if self.found(each) is None]
        is_due = len(self.visits) <= len(others) - len(left)
        if self.is_witnessed(setup) and (is_due or not left):
            return TaskKind.DRIFT
        return next(iter(left), None)

    def is_witnessed(self, setup: SessionSetup) -> bool:
        """Return whether a cone is visited in between, and not for the last time."""
        return TaskKind.DRIFT in setup.choices.kinds and self.drift is None

    @property
    def is_begun(self) -> bool:
        """Whether anything was touched or found."""
        has_found = any(self.found(kind) is not None for kind in TaskKind)
        return has_found or bool(self.touches or self.runs or self.visits)

    @property
    def assessment(self) -> Conformity | None:
        """The worst that was found so far; a drift first, as it explains the rest."""
        found = [each for each in map(self.found, TaskKind) if each is not None]
        if self.drift is not None and not self.drift.assessment.is_accepted:
            found.insert(0, self.drift)
        return worst([each.assessment for each in found]) if found else None


def n_done(state: SessionState) -> int:
    """Return how many runs are done of the task at hand, and visits of the witness."""
    return len(state.runs) + len(state.visits)


def n_visits(choices: VerificationChoices) -> int:
    """Return how often the witness is visited: before, between and after the tasks."""
    n_others = len(set(choices.kinds) - {TaskKind.DRIFT})
    return max(n_others + 1, MIN_VISITS)


def without_touches(state: SessionState) -> SessionState:
    """Return it with the next run to begin; a pen at rest has to move on first."""
    touching = replace(state.touching, taken=(), places=())
    return replace(state, touching=touching, touches=(), runs=(), trouble=None)
