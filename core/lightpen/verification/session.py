"""A whole verification in one go, without a key: fixed point, ring, length.

`advance` takes the state and what the next image shows. Each task ends by itself when
its touches suffice, and the next begins when the pen moves on; live images and recorded
ones go through the same steps.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.detection.sighting import Sighting
from lightpen.errors import CalibrationError
from lightpen.estimation.instrument import Instrument
from lightpen.estimation.verdict import Grade
from lightpen.sentences import Sentence, sentence
from lightpen.verification.assessment import Conformity
from lightpen.verification.circle import (
    MIN_ANGLE,
    MIN_TOUCHES,
    Circle,
    fit_circle,
    measure_circle,
)
from lightpen.verification.fixed_point import (
    USUAL_TOUCHES,
    FixedPoint,
    measure_fixed_point,
)
from lightpen.verification.length import Length, measure_length
from lightpen.verification.limits import VerificationLimits
from lightpen.verification.touch import Touch, measure_touches
from lightpen.verification.touching import (
    TouchEvent,
    TouchHappening,
    TouchRules,
    TouchState,
)
from lightpen.verification.touching import advance as advance_touch

NEW_POSTURE = np.radians(8.0)
NEW_PLACE = 3.0  # mm, on a ring
OTHER_END = 10.0  # mm
EVERYWHERE = 1e6  # mm or rad: no other place, no other posture makes a touch new
RING_TOUCHES = 10
WORST = (Grade.PASS, Grade.CHECK, Grade.REPEAT)


class TaskKind(StrEnum):
    """What is touched."""

    FIXED_POINT = "fixed point"
    CIRCLE = "circle"
    LENGTH = "length"


@dataclass(frozen=True, eq=False)
class SessionSetup:
    """What is verified, and by what.

    Attributes
    ----------
    n_touches : int
        Of the fixed point.
    radius, length : float or None
        Certified, mm; None leaves that task away.
    nominal_tip, cone_cam : (3,) array or None
        See `lightpen.verification.fixed_point.measure_fixed_point`.
    n_frames : int
        Images of a touch.
    """

    instrument: Instrument
    limits: VerificationLimits = field(default_factory=VerificationLimits)
    n_touches: int = USUAL_TOUCHES
    radius: float | None = None
    length: float | None = None
    nominal_tip: FloatArray | None = None
    cone_cam: FloatArray | None = None
    n_frames: int = TouchRules().n_frames

    @property
    def tasks(self) -> tuple[TaskKind, ...]:
        """What is touched, in order."""
        tasks = [TaskKind.FIXED_POINT]
        if self.radius is not None:
            tasks.append(TaskKind.CIRCLE)
        if self.length is not None:
            tasks.append(TaskKind.LENGTH)
        return tuple(tasks)


@dataclass(frozen=True, eq=False)
class SessionState:
    """A verification at one moment.

    Attributes
    ----------
    n_done : int
        Tasks that are finished.
    touching : TouchState
        Of the task at hand.
    touches : tuple of Touch
        Measured for it.
    trouble : Sentence or None
        Why its touches do not suffice yet, though they are as many as needed.
    """

    n_done: int = 0
    touching: TouchState = field(default_factory=TouchState)
    touches: tuple[Touch, ...] = ()
    trouble: Sentence | None = None
    fixed_point: FixedPoint | None = None
    circle: Circle | None = None
    length: Length | None = None

    def task(self, setup: SessionSetup) -> TaskKind | None:
        """Return what is to be touched now; None when all is done."""
        tasks = setup.tasks
        return tasks[self.n_done] if self.n_done < len(tasks) else None

    @property
    def assessment(self) -> Conformity | None:
        """The worst that was found so far."""
        found = [
            each.assessment
            for each in (self.fixed_point, self.circle, self.length)
            if each is not None
        ]
        if not found:
            return None
        return max(found, key=lambda each: WORST.index(each.grade))


@dataclass(frozen=True, eq=False)
class SessionTransition:
    """A verification after one more image.

    Attributes
    ----------
    finished : TaskKind or None
        A task that this image ended.
    """

    state: SessionState
    events: tuple[TouchEvent, ...] = ()
    finished: TaskKind | None = None


def advance(
    setup: SessionSetup, state: SessionState, name: str, sighting: Sighting
) -> SessionTransition:
    """Take one more image, and end the task at hand when its touches suffice."""
    task = state.task(setup)
    if task is None:
        return SessionTransition(state)
    touched = advance_touch(
        *(setup.instrument, rules_of(setup, task), state.touching, name, sighting)
    )
    state = replace(state, touching=touched.state)
    if not any(event.what is TouchHappening.TAKEN for event in touched.events):
        return SessionTransition(state, touched.events)
    touches = measure_touches(setup.instrument, touched.state.taken)
    state = replace(state, touches=touches, trouble=None)
    try:
        ended = _ENDS[task](setup, state)
    except CalibrationError as error:
        return SessionTransition(replace(state, trouble=error.sentence), touched.events)
    if ended is None:
        return SessionTransition(state, touched.events)
    still = replace(touched.state, taken=(), places=())
    ended = replace(ended, n_done=state.n_done + 1, touching=still, touches=())
    return SessionTransition(ended, touched.events, task)


def rules_of(setup: SessionSetup, task: TaskKind) -> TouchRules:
    """Return which touches count as new in a task."""
    turn, distance = {
        TaskKind.FIXED_POINT: (float(NEW_POSTURE), EVERYWHERE),
        TaskKind.CIRCLE: (EVERYWHERE, NEW_PLACE),
        TaskKind.LENGTH: (EVERYWHERE, OTHER_END),
    }[task]
    return TouchRules(setup.n_frames, min_turn=turn, min_distance=distance)


def instruction(setup: SessionSetup, state: SessionState) -> Sentence:
    """Return what the operator should do now."""
    task, n_touches = state.task(setup), len(state.touches)
    if state.trouble is not None:
        return state.trouble
    if task is TaskKind.FIXED_POINT:
        return sentence(
            "session.touch-cone",
            "Put the tip into the cone and hold it still, each time leant another way: "
            "{n_touches} of {needed}.",
            n_touches=n_touches,
            needed=setup.n_touches,
        )
    if task is TaskKind.CIRCLE:
        return sentence(
            "session.touch-ring",
            "Touch the ring all round and hold still on each point: {covered:.0f} of "
            "{needed:.0f} degrees by {n_touches} touches.",
            covered=covered(state.touches),
            needed=MIN_ANGLE,
            n_touches=n_touches,
        )
    if task is TaskKind.LENGTH:
        return sentence(
            "session.touch-ends",
            "Touch one end of the length, then the other, and hold still on each: "
            "{n_touches} of 2.",
            n_touches=n_touches,
        )
    return sentence("session.done", "The verification is done. Put the pen down.")


def covered(touches: tuple[Touch, ...]) -> float:
    """Return how much of a ring touches cover, degrees; 0 before they tell it."""
    if len(touches) < MIN_TOUCHES:
        return 0.0
    try:
        return fit_circle(np.array([touch.point_cam for touch in touches])).covered
    except CalibrationError:
        return 0.0


def _end_fixed_point(setup: SessionSetup, state: SessionState) -> SessionState | None:
    if len(state.touches) < setup.n_touches:
        return None
    found = measure_fixed_point(
        state.touches,
        setup.instrument,
        setup.limits,
        setup.nominal_tip,
        setup.cone_cam,
    )
    return replace(state, fixed_point=found)


def _end_circle(setup: SessionSetup, state: SessionState) -> SessionState | None:
    if setup.radius is None or len(state.touches) < RING_TOUCHES:
        return None
    if covered(state.touches) < MIN_ANGLE:
        return None
    run = (str(TaskKind.CIRCLE), state.touches)
    found = measure_circle([run], setup.instrument, setup.radius, setup.limits)
    return replace(state, circle=found)


def _end_length(setup: SessionSetup, state: SessionState) -> SessionState | None:
    if setup.length is None or len(state.touches) < 2:
        return None
    run = (str(TaskKind.LENGTH), state.touches)
    found = measure_length([run], setup.instrument, setup.length, setup.limits)
    return replace(state, length=found)


_ENDS: dict[TaskKind, Callable[[SessionSetup, SessionState], SessionState | None]] = {
    TaskKind.FIXED_POINT: _end_fixed_point,
    TaskKind.CIRCLE: _end_circle,
    TaskKind.LENGTH: _end_length,
}
