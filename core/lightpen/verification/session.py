"""A whole verification in one go, without a key: fixed point, ring, length, postures.

`advance_session` takes the state and what the next image shows. Each task ends by
itself when its touches suffice, and the next begins when the pen moves on; live images
and recorded ones go through the same steps. Touches that can be none of the task are
dropped with a word on it, as nobody is at the screen to take them out.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightpen.detection.sighting import Sighting
from lightpen.errors import CalibrationError
from lightpen.sentences import sentence
from lightpen.verification.articulation import (
    N_POSTURES,
    N_TOUCHES,
    Articulation,
    by_posture,
    measure_articulation,
)
from lightpen.verification.choices import TaskKind, VerificationChoices, ball_offset
from lightpen.verification.circle import (
    MIN_ANGLE,
    Circle,
    CircleFit,
    measure_circle,
    ring_so_far,
)
from lightpen.verification.counting import NEW_POSTURE, with_touch
from lightpen.verification.drift import MIN_VISITS, Drift, measure_drift
from lightpen.verification.fixed_point import FixedPoint, measure_fixed_point
from lightpen.verification.length import Length, measure_length
from lightpen.verification.session_state import (
    Found,
    Runs,
    SessionSetup,
    SessionState,
    Unwitnessed,
    n_visits,
    with_drift,
    without_touches,
)
from lightpen.verification.tip_in_force import TipInForce
from lightpen.verification.touch import StillFrames, Touch
from lightpen.verification.touching import (
    TouchEvent,
    TouchHappening,
    TouchRules,
    advance_touch,
    taken_again,
)
from lightpen.verification.witness import judged_with

NEW_PLACE = 3.0  # mm, on a ring
OTHER_END = 10.0  # mm
EVERYWHERE = 1e6  # mm or rad: no other place, no other posture makes a touch new
RING_TOUCHES = 10
VISIT_TOUCHES = 3  # of the witness
WORTH_TELLING = 0.5  # of its images, that were held before a touch was broken off

BROKEN_OFF = sentence(
    "session.broken-off",
    "The pen was lifted or moved before the touch was taken, so it does not count. "
    "Hold it still until it is.",
)


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


def setup_of(tip: TipInForce, choices: VerificationChoices) -> SessionSetup:
    """Return what is verified by a tip in force."""
    return SessionSetup(
        tip.instrument,
        choices,
        tip.names.ball_diameter,
        tip.nominal_tip,
        tip.cone_cam,
    )


def advance_session(
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
        state = with_touch(setup, replace(state, trouble=None), task)
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
    before = state.visits if task is TaskKind.DRIFT else state.runs
    runs = _numbered((*before, state.touches) if state.touches else before)
    try:
        ended = _done(setup, state, task, runs)
    except CalibrationError as error:
        return SessionTransition(replace(state, trouble=error.sentence))
    if task is TaskKind.DRIFT and state.touches:
        ended = replace(ended, visits=(*state.visits, state.touches))
    return SessionTransition(ended, finished=task)


def run_again(
    setup: SessionSetup,
    state: SessionState,
    touches: tuple[Touch, ...],
    *,
    is_last: bool,
) -> SessionState:
    """Return it with a run that was done before, as it was then.

    Parameters
    ----------
    is_last : bool
        Whether the task at hand ended with it.

    Raises
    ------
    CalibrationError
        It is none of the task at hand.
    """
    state, task = replace(state, touches=touches), state.task(setup)
    if task is None:
        return state
    if not is_last:
        return _with_run(setup, state, task)
    ended = end_task(setup, state).state
    if ended.trouble is not None:
        raise CalibrationError(ended.trouble)
    return ended


def touch_again(
    setup: SessionSetup, state: SessionState, held: Sequence[StillFrames]
) -> SessionState:
    """Return it with touches of the run at hand that were taken before.

    One that would end the run has to be taken again: so it was not ended by it.
    """
    task = state.task(setup)
    if task is None:
        return state
    rules = rules_of(setup, task)
    for still in held:
        touching = taken_again(setup.instrument, rules, state.touching, still)
        if touching is state.touching:
            continue
        touched = with_touch(setup, replace(state, touching=touching), task)
        if not _suffices(setup, touched, task):
            state = touched
    return state


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
                ball_offset=ball_offset(choices.length_surface, setup.ball_diameter),
                drift=setup.drift,
            )
        case TaskKind.DRIFT:
            return measure_drift(runs, instrument, choices.limits)


def measure_with_drift(
    setup: SessionSetup, done: Unwitnessed, drift: Drift | None = None
) -> Found:
    """Return what the touches of a task find, by a camera that may have moved.

    Raises
    ------
    CalibrationError
        They do not suffice.
    """
    by = with_drift(setup if done.setup is None else done.setup, drift)
    found = measure(by, done.task, done.runs)
    return replace(found, assessment=judged_with(found.assessment, done.lamps))


def with_read(
    setup: SessionSetup, state: SessionState, read: Unwitnessed, found: Found
) -> SessionState:
    """Return it with what recorded images have found.

    A witness that they are of counts in what was found before it, and one that is yet
    to come will count in what they have found.
    """
    if isinstance(found, Drift):
        return with_found(_counting(setup, state, found), found)
    if state.is_witnessed(setup):
        others = (each for each in state.unwitnessed if each.task is not read.task)
        state = replace(state, unwitnessed=(*others, read))
    return with_found(state, found)


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
        case Drift():
            return replace(state, drift=found, unwitnessed=())


def touched_anew(state: SessionState, task: TaskKind) -> SessionState:
    """Return it with one task to be done again, and no touches of the one at hand.

    The witness is visited once more after it.
    """
    others = tuple(each for each in state.unwitnessed if each.task is not task)
    state = replace(without_touches(state), drift=None, unwitnessed=others)
    match task:
        case TaskKind.FIXED_POINT:
            return replace(state, fixed_point=None)
        case TaskKind.CIRCLE:
            return replace(state, circle=None)
        case TaskKind.LENGTH:
            return replace(state, length=None)
        case TaskKind.ARTICULATION:
            return replace(state, articulation=None)
        case TaskKind.DRIFT:
            return replace(state, visits=())


def rules_of(setup: SessionSetup, task: TaskKind) -> TouchRules:
    """Return which touches count as new in a task."""
    turn, distance = {
        TaskKind.FIXED_POINT: (float(NEW_POSTURE), EVERYWHERE),
        TaskKind.CIRCLE: (EVERYWHERE, NEW_PLACE),
        TaskKind.LENGTH: (EVERYWHERE, min(OTHER_END, setup.choices.length / 2)),
        TaskKind.ARTICULATION: (0.0, 0.0),  # the same again
        TaskKind.DRIFT: (0.0, 0.0),
    }[task]
    return TouchRules(setup.choices.n_frames, min_turn=turn, min_distance=distance)


def ring_fit(touches: Sequence[Touch]) -> CircleFit | None:
    """Return the circle that touches lie on so far; None before they tell it."""
    return ring_so_far(np.array([touch.point_cam for touch in touches]).reshape(-1, 3))


def drift_so_far(setup: SessionSetup, state: SessionState) -> Drift | None:
    """Return how far the witness moved by its visits; None before there are two."""
    if state.drift is not None or len(state.visits) < MIN_VISITS:
        return state.drift
    visits = _numbered(state.visits)
    return measure_drift(visits, setup.instrument, setup.choices.limits)


def covered(touches: Sequence[Touch]) -> float:
    """Return how much of a ring touches cover, degrees; 0 before they tell it."""
    fit = ring_fit(touches)
    return 0.0 if fit is None else fit.covered


def _is_worth_telling(rules: TouchRules, event: TouchEvent) -> bool:
    """Return whether an event is news: a hand that comes to rest stops and goes."""
    needed = rules.n_settling + WORTH_TELLING * rules.n_frames
    return event.what is TouchHappening.TAKEN or len(event.names) >= needed


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
        case TaskKind.DRIFT:
            return n_touches >= VISIT_TOUCHES


def _with_run(setup: SessionSetup, state: SessionState, task: TaskKind) -> SessionState:
    """End a run, and with the last of them the task."""
    if task is TaskKind.DRIFT:
        return _with_visit(setup, state)
    runs = (*state.runs, state.touches)
    has_more = len(runs) < _n_runs(setup.choices, task)
    if not has_more:
        return _done(setup, state, task, _numbered(runs))
    if task is not TaskKind.ARTICULATION:  # of which a single posture tells nothing
        measure(setup, task, _numbered(runs))
    return replace(without_touches(state), runs=runs)


def _done(
    setup: SessionSetup, state: SessionState, task: TaskKind, runs: Runs
) -> SessionState:
    """Measure a task; the next visit of a witness will tell how far it can be off."""
    if task is TaskKind.DRIFT:
        state = _witnessed(setup, state, runs)
    found = measure(setup, task, runs)
    if task is not TaskKind.DRIFT and state.is_witnessed(setup):
        state = replace(
            state, unwitnessed=(*state.unwitnessed, Unwitnessed(task, runs))
        )
    return with_found(state, found)


def _with_visit(setup: SessionSetup, state: SessionState) -> SessionState:
    """End a visit of the witness, and with the last of them the task."""
    visits = (*state.visits, state.touches)
    runs = _numbered(visits)
    if len(visits) >= n_visits(setup.choices):
        return replace(_done(setup, state, TaskKind.DRIFT, runs), visits=visits)
    return replace(without_touches(_witnessed(setup, state, runs)), visits=visits)


def _witnessed(setup: SessionSetup, state: SessionState, visits: Runs) -> SessionState:
    """Count in what was found since the visit before by how far the witness moved."""
    if len(visits) < MIN_VISITS:
        return state
    around = measure_drift(visits[-MIN_VISITS:], setup.instrument, setup.choices.limits)
    return _counting(setup, state, around)


def _counting(setup: SessionSetup, state: SessionState, drift: Drift) -> SessionState:
    """Count a drift in what was found since the visit before."""
    for each in state.unwitnessed:
        state = with_found(state, measure_with_drift(setup, each, drift))
    return replace(state, unwitnessed=())


def _n_runs(choices: VerificationChoices, task: TaskKind) -> int:
    return {
        TaskKind.FIXED_POINT: 1,
        TaskKind.CIRCLE: choices.n_runs,
        TaskKind.LENGTH: choices.n_places,
        TaskKind.ARTICULATION: N_POSTURES,
        TaskKind.DRIFT: n_visits(choices),
    }[task]


def _numbered(runs: Sequence[tuple[Touch, ...]]) -> Runs:
    return [(f"#{i}", touches) for i, touches in enumerate(runs, start=1)]
