"""A simulated operator who touches what a verification asks for."""

from dataclasses import dataclass, field
from math import pi

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.simulator.hand import Doing, Operator
from lightpen.verification.choices import TaskKind
from lightpen.verification.session_state import SessionSetup, SessionState
from lightpen.verification.touching import TouchPhase

LEANT, LEANT_FAR = 0.2, 0.4  # rad
RING_STEPS = 12
BAR_STEP = 15.0  # mm, from one place of the bar to the next
DOWNWARDS = np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True)
class _TouchGoal:
    """A touch that the operator was led to."""

    task: TaskKind | None
    run: int
    step: int


@dataclass(frozen=True, eq=False)
class Artefacts:
    """Where a ring and a bar stand, from the bottom of the cone, camera frame, mm.

    Attributes
    ----------
    ring_center : (3,) array
    ring_axes : (2, 3) array
        Unit vectors in the plane of the ring.
    bar_start, bar_end : (3,) array
    """

    ring_center: FloatArray = field(default_factory=lambda: np.array([0.0, -40.0, 0.0]))
    ring_radius: float = 31.751
    ring_axes: FloatArray = field(
        default_factory=lambda: np.array([[1.0, 0.0, 0.0], [0.0, 0.9, -(0.19**0.5)]])
    )
    bar_start: FloatArray = field(default_factory=lambda: np.array([-75.0, -20.0, 0.0]))
    bar_end: FloatArray = field(default_factory=lambda: np.array([75.0, -20.0, 0.0]))

    @property
    def length(self) -> float:
        """Of the bar, mm."""
        return float(np.linalg.norm(self.bar_end - self.bar_start))

    def on_ring(self, step: int) -> FloatArray:
        """Return a point of the ring."""
        angle = 2 * pi * step / RING_STEPS
        spoke = np.array([np.cos(angle), np.sin(angle)]) @ self.ring_axes
        return np.asarray(self.ring_center + self.ring_radius * spoke)


class Toucher:
    """Leads the hand of a simulated operator by the states of a verification."""

    def __init__(self, operator: Operator, artefacts: Artefacts | None = None) -> None:
        self._operator = operator
        self._artefacts = artefacts or Artefacts()
        self._wanted: _TouchGoal | None = None

    def follow(self, setup: SessionSetup, state: SessionState) -> None:
        """Do what a state of the verification asks for; a lifted tip is put back."""
        n_runs = len(state.runs) + len(state.visits)
        wanted = _TouchGoal(state.task(setup), n_runs, len(state.touches))
        is_lifted = self._operator.doing in (Doing.LIFTED, Doing.ABSENT)
        if wanted == self._wanted and not (is_lifted and wanted.task is not None):
            return
        is_taken = state.touching.phase is TouchPhase.TAKEN
        again = wanted.task in (TaskKind.ARTICULATION, TaskKind.DRIFT)
        if is_lifted and is_taken and again:
            return  # it has to move on first
        before, self._wanted = self._wanted, wanted
        step, artefacts = wanted.step, self._artefacts
        if wanted.task is TaskKind.FIXED_POINT:
            if is_lifted or before is None or before.task is not wanted.task:
                self._operator.seat()
            tilt = (LEANT, LEANT_FAR)[step % 2]
            direction = 2 * pi * step / setup.choices.n_touches
            self._operator.lean_towards(tilt, direction, 0.0)
        elif again:
            if is_taken:
                self._operator.lift()
            else:
                self._operator.seat()
                n_postures = len(state.runs)
                tilt = LEANT_FAR if n_postures else 0.0
                self._operator.lean_towards(tilt, pi / 2 * n_postures, 0.0)
        elif wanted.task is TaskKind.CIRCLE:
            self._operator.touch(artefacts.on_ring(step))
        elif wanted.task is TaskKind.LENGTH:
            ends = artefacts.bar_start, artefacts.bar_end
            lower = BAR_STEP * len(state.runs) * DOWNWARDS
            self._operator.touch(ends[step % 2] + lower)
        else:
            self._operator.leave()
