"""A simulated operator who touches what a verification asks for."""

from dataclasses import dataclass, field
from math import pi

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.simulator.hand import Operator
from lightpen.verification.session import SessionSetup, SessionState, TaskKind

LEANT, LEANT_FAR = 0.2, 0.4  # rad
RING_STEPS = 12


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
        self._last: tuple[int, int] | None = None

    def follow(self, setup: SessionSetup, state: SessionState) -> None:
        """Do what a state of the verification asks for."""
        step = len(state.touches)
        if self._last == (state.n_done, step):
            return
        self._last = (state.n_done, step)
        task, artefacts = state.task(setup), self._artefacts
        if task is TaskKind.FIXED_POINT:
            if step == 0:
                self._operator.seat()
            tilt = (LEANT, LEANT_FAR)[step % 2]
            self._operator.lean_towards(tilt, 2 * pi * step / setup.n_touches, 0.0)
        elif task is TaskKind.CIRCLE:
            self._operator.touch(artefacts.on_ring(step))
        elif task is TaskKind.LENGTH:
            ends = artefacts.bar_start, artefacts.bar_end
            self._operator.touch(ends[step % 2])
        else:
            self._operator.leave()
