"""A whole verification in one go, without a key: fixed point, ring, length, postures.

`advance` takes the state and what the next image shows. Each task ends by itself when
its touches suffice, and the next begins when the pen moves on; live images and recorded
ones go through the same steps. Touches that can be none of the task are dropped with a
word on it, as nobody is at the screen to take them out.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.detection.sighting import Sighting
from lightpen.errors import CalibrationError
from lightpen.estimation.instrument import Instrument
from lightpen.model.posture import angles_between
from lightpen.sentences import Sentence, sentence
from lightpen.verification.articulation import (
    N_POSTURES,
    N_TOUCHES,
    Articulation,
    by_posture,
    measure_articulation,
)
from lightpen.verification.assessment import Conformity, worst
from lightpen.verification.choices import TaskKind, VerificationChoices, ball_offset
from lightpen.verification.circle import (
    ANOTHER,
    MIN_ANGLE,
    Circle,
    CircleFit,
    measure_circle,
    ring_so_far,
)
from lightpen.verification.fixed_point import LIFTED, FixedPoint, measure_fixed_point
from lightpen.verification.length import Length, measure_length
from lightpen.verification.sources import require_leds_fit
from lightpen.verification.touch import NO_DRIFT, Touch, measure_touches
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
ELSEWHERE = 5.0  # mm from the others: the tip was not in the cone at all
SAME_POSTURE = np.radians(12.0)  # within which a pen is held alike
WORTH_TELLING = 0.5  # of its images, that were held before a touch was broken off

Found: TypeAlias = FixedPoint | Circle | Length | Articulation
Runs: TypeAlias = Sequence[tuple[str, Sequence[Touch]]]

BROKEN_OFF = sentence(
    "session.broken-off",
    "The pen was lifted or moved before the touch was taken, so it does not count. "
    "Hold it still until it is.",
)
STILL_IN_CONE = sentence(
    "session.still-in-cone",
    "The fixed point is done: this touch of the cone does not count. Touch the ring.",
)
ALIKE = sentence(
    "session.alike",
    "The pen was held like this before. Lean it another way, and touch the cone five "
    "times so.",
)
OTHER_POSTURE = sentence(
    "session.other-posture",
    "The pen leans otherwise than at the touches before, so this one does not count. "
    "Hold it as before until the posture is done.",
)


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
    """

    touching: TouchState = field(default_factory=TouchState)
    touches: tuple[Touch, ...] = ()
    runs: tuple[tuple[Touch, ...], ...] = ()
    trouble: Sentence | None = None
    fixed_point: FixedPoint | None = None
    circle: Circle | None = None
    length: Length | None = None
    articulation: Articulation | None = None

    def found(self, kind: TaskKind) -> Found | None:
        """Return what a task has found; None until it is done."""
        found: dict[TaskKind, Found | None] = {
            TaskKind.FIXED_POINT: self.fixed_point,
            TaskKind.CIRCLE: self.circle,
            TaskKind.LENGTH: self.length,
            TaskKind.ARTICULATION: self.articulation,
        }
        return found[kind]

    def task(self, setup: SessionSetup) -> TaskKind | None:
        """Return what is to be touched now; None when all is done."""
        to_do = (each for each in setup.choices.kinds if self.found(each) is None)
        return next(to_do, None)

    @property
    def is_begun(self) -> bool:
        """Whether anything was touched or found."""
        has_found = any(self.found(kind) is not None for kind in TaskKind)
        return has_found or bool(self.touches or self.runs)

    @property
    def assessment(self) -> Conformity | None:
        """The worst that was found so far."""
        found = [each for each in map(self.found, TaskKind) if each is not None]
        return worst([each.assessment for each in found]) if found else None


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
    rules = rules_of(setup, task)
    touched = advance_touch(setup.instrument, rules, state.touching, name, sighting)
    events = tuple(each for each in touched.events if _is_worth_telling(rules, each))
    happened = {event.what for event in events}
    state = replace(state, touching=touched.state)
    if TouchHappening.BROKEN_OFF in happened:
        state = replace(state, trouble=BROKEN_OFF)
    if TouchHappening.TAKEN not in happened:
        return SessionTransition(state, events)
    try:
        state = _with_touch(setup, replace(state, trouble=None), task)
        if not _suffices(setup, state, task):
            return SessionTransition(state, events)
        state = _with_run(setup, state, task)
    except CalibrationError as error:
        state = replace(state, trouble=error.sentence)
    is_finished = state.found(task) is not None
    return SessionTransition(state, events, task if is_finished else None)


def end_task(setup: SessionSetup, state: SessionState) -> SessionTransition:
    """End the task at hand with the touches that there are, or say why it cannot."""
    task = state.task(setup)
    if task is None:
        return SessionTransition(state)
    runs = (*state.runs, state.touches) if state.touches else state.runs
    try:
        ended = with_found(state, measure(setup, task, _numbered(runs)))
    except CalibrationError as error:
        return SessionTransition(replace(state, trouble=error.sentence))
    return SessionTransition(ended, finished=task)


def measure(setup: SessionSetup, task: TaskKind, runs: Runs) -> Found:
    """Return what a task finds by its touches.

    Raises
    ------
    CalibrationError
        They do not suffice.
    """
    choices, instrument = setup.choices, setup.instrument
    match task:
        case TaskKind.FIXED_POINT:
            return measure_fixed_point(
                [touch for _, touches in runs for touch in touches],
                *(instrument, choices.limits, setup.nominal_tip, setup.cone_cam),
                drift=setup.drift,
            )
        case TaskKind.CIRCLE:
            return measure_circle(
                *(runs, instrument, choices.radius, choices.limits),
                certified_uncertainty=choices.radius_uncertainty,
                ball_offset=ball_offset(choices.surface, setup.ball_diameter),
                drift=setup.drift,
            )
        case TaskKind.ARTICULATION:
            return measure_articulation(by_posture(runs), instrument, choices.limits)
        case TaskKind.LENGTH:
            return measure_length(
                *(runs, instrument, choices.length, choices.limits),
                certified_uncertainty=choices.length_uncertainty,
                drift=setup.drift,
            )


def with_found(state: SessionState, found: Found) -> SessionState:
    """Return it with what a task has found; the next begins when the pen moves on."""
    state = without_touches(state)
    match found:
        case FixedPoint():
            return replace(state, fixed_point=found)
        case Circle():
            return replace(state, circle=found)
        case Length():
            return replace(state, length=found)
        case Articulation():
            return replace(state, articulation=found)


def touched_anew(state: SessionState, task: TaskKind) -> SessionState:
    """Return it with one task to be done again, and no touches of the one at hand."""
    state = without_touches(state)
    match task:
        case TaskKind.FIXED_POINT:
            return replace(state, fixed_point=None)
        case TaskKind.CIRCLE:
            return replace(state, circle=None)
        case TaskKind.LENGTH:
            return replace(state, length=None)
        case TaskKind.ARTICULATION:
            return replace(state, articulation=None)


def without_touches(state: SessionState) -> SessionState:
    """Return it with the next run to begin; a pen at rest has to move on first."""
    touching = replace(state.touching, taken=(), places=())
    return replace(state, touching=touching, touches=(), runs=(), trouble=None)


def rules_of(setup: SessionSetup, task: TaskKind) -> TouchRules:
    """Return which touches count as new in a task."""
    turn, distance = {
        TaskKind.FIXED_POINT: (float(NEW_POSTURE), EVERYWHERE),
        TaskKind.CIRCLE: (EVERYWHERE, NEW_PLACE),
        TaskKind.LENGTH: (EVERYWHERE, min(OTHER_END, setup.choices.length / 2)),
        TaskKind.ARTICULATION: (0.0, 0.0),  # the same again
    }[task]
    return TouchRules(setup.choices.n_frames, min_turn=turn, min_distance=distance)


def ring_fit(touches: Sequence[Touch]) -> CircleFit | None:
    """Return the circle that touches lie on so far; None before they tell it."""
    return ring_so_far(np.array([touch.point_cam for touch in touches]).reshape(-1, 3))


def covered(touches: Sequence[Touch]) -> float:
    """Return how much of a ring touches cover, degrees; 0 before they tell it."""
    fit = ring_fit(touches)
    return 0.0 if fit is None else fit.covered


def _is_worth_telling(rules: TouchRules, event: TouchEvent) -> bool:
    """Return whether an event is news: a hand that comes to rest stops and goes."""
    needed = rules.n_settling + WORTH_TELLING * rules.n_frames
    return event.what is TouchHappening.TAKEN or len(event.names) >= needed


def _with_touch(
    setup: SessionSetup, state: SessionState, task: TaskKind
) -> SessionState:
    """Measure anew with the last touch; drop it if it can be none of the task."""
    touches = measure_touches(setup.instrument, state.touching.taken)
    try:
        require_leds_fit(touches[-1].label, touches[-1:])
    except CalibrationError as error:
        kept = range(len(touches) - 1)
        return replace(_with_touches(state, touches, kept), trouble=error.sentence)
    if task is TaskKind.FIXED_POINT:
        return _without_others(state, touches)
    if task is TaskKind.ARTICULATION:
        return _in_posture(state, touches)
    if task is TaskKind.CIRCLE and _is_in_cone(state, touches[-1]):
        kept = range(len(touches) - 1)
        return replace(_with_touches(state, touches, kept), trouble=STILL_IN_CONE)
    if task is TaskKind.LENGTH and len(touches) == 2:
        return _with_true_ends(setup, state, touches)
    return replace(state, touches=touches)


def _is_in_cone(state: SessionState, touch: Touch) -> bool:
    """Return whether a touch is of the fixed point, which is done."""
    if state.fixed_point is None:
        return False
    way = touch.point_cam - state.fixed_point.calibrated.mean
    return float(np.linalg.norm(way)) <= ELSEWHERE


def _without_others(
    state: SessionState, touches: tuple[Touch, ...], limit: float = ELSEWHERE
) -> SessionState:
    """Drop touches that are not of the cone, as of a pen that was laid down."""
    points = np.array([touch.point_cam for touch in touches])
    distances = np.linalg.norm(points - np.median(points, axis=0), axis=1)
    kept = np.flatnonzero(distances <= limit).tolist()
    if len(touches) < 3 or len(kept) == len(touches):  # of two, nobody knows which
        return replace(state, touches=touches)
    trouble = sentence(
        "session.elsewhere",
        "A touch {distance:.1f} mm from the others does not count: the tip was not in "
        "the cone. Put it into the cone and hold it still.",
        distance=float(distances.max()),
    )
    return replace(_with_touches(state, touches, kept), trouble=trouble)


def _in_posture(state: SessionState, touches: tuple[Touch, ...]) -> SessionState:
    """Drop a touch in another posture than those of its run, or in an earlier one."""
    last, kept = touches[-1].rotation[None], range(len(touches) - 1)
    if len(touches) > 1:
        turned = angles_between(last, touches[0].rotation[None])[0, 0]
        if turned > SAME_POSTURE:
            alone = _with_touches(state, touches, kept)
            return replace(alone, trouble=OTHER_POSTURE)
        return _without_others(state, touches, LIFTED)
    before = [run[0].rotation for run in state.runs]
    if before and angles_between(last, np.array(before)).min() < NEW_POSTURE:
        return replace(_with_touches(state, touches, kept), trouble=ALIKE)
    return replace(state, touches=touches)


def _with_true_ends(
    setup: SessionSetup, state: SessionState, touches: tuple[Touch, ...]
) -> SessionState:
    """Take the last touch for a first end if the two are those of no such length."""
    one, other = (touch.point_cam for touch in touches)
    distance, certified = float(np.linalg.norm(one - other)), setup.choices.length
    if abs(distance - certified) <= ANOTHER * certified:
        return replace(state, touches=touches)
    trouble = sentence(
        "session.no-ends",
        "The two touches lie {distance:.2f} mm apart, {certified} mm is certified: "
        "they are not of its two ends. Touch the end opposite to the last touch.",
        distance=distance,
        certified=certified,
    )
    return replace(_with_touches(state, touches, (1,)), trouble=trouble)


def _with_touches(
    state: SessionState, touches: tuple[Touch, ...], kept: Sequence[int]
) -> SessionState:
    touching = replace(
        state.touching,
        taken=tuple(state.touching.taken[i] for i in kept),
        places=tuple(state.touching.places[i] for i in kept),
    )
    return replace(state, touching=touching, touches=tuple(touches[i] for i in kept))


def _suffices(setup: SessionSetup, state: SessionState, task: TaskKind) -> bool:
    """Return whether the touches are enough for a run."""
    n_touches = len(state.touches)
    match task:
        case TaskKind.FIXED_POINT:
            return n_touches >= setup.choices.n_touches
        case TaskKind.CIRCLE:
            return n_touches >= RING_TOUCHES and covered(state.touches) >= MIN_ANGLE
        case TaskKind.LENGTH:
            return n_touches >= 2
        case TaskKind.ARTICULATION:
            return n_touches >= N_TOUCHES


def _with_run(setup: SessionSetup, state: SessionState, task: TaskKind) -> SessionState:
    """End a run, and with the last of them the task."""
    runs = (*state.runs, state.touches)
    has_more = len(runs) < _n_runs(setup.choices, task)
    if has_more and task is TaskKind.ARTICULATION:  # of no use posture by posture
        return replace(without_touches(state), runs=runs)
    found = measure(setup, task, _numbered(runs))
    if has_more:
        return replace(without_touches(state), runs=runs)
    return with_found(state, found)


def _n_runs(choices: VerificationChoices, task: TaskKind) -> int:
    return {
        TaskKind.FIXED_POINT: 1,
        TaskKind.CIRCLE: choices.n_runs,
        TaskKind.LENGTH: choices.n_places,
        TaskKind.ARTICULATION: N_POSTURES,
    }[task]


def _numbered(runs: Sequence[tuple[Touch, ...]]) -> Runs:
    return [(f"#{i}", touches) for i, touches in enumerate(runs, start=1)]
