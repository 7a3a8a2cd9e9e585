"""A whole verification in one go, without a key: the tasks one after the other.

`advance_session` takes the state and what the next image shows. Each task ends
automatically when its points suffice, and the next begins when the pen moves on; live
images and recorded ones go through the same steps. Points that can be none of the task
are dropped with a message.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from lightpen.detection.pen_detection import PenDetection
from lightpen.errors import CalibrationError
from lightpen.messages import message
from lightpen.verification.probing.current_tip import CurrentTip
from lightpen.verification.probing.drift_reference import judged_with
from lightpen.verification.probing.probing import (
    ProbingEvent,
    ProbingEventKind,
    ProbingRules,
    advance_touch,
    taken_again,
)
from lightpen.verification.probing.sources import require_leds_fit
from lightpen.verification.session.choices import VerificationChoices
from lightpen.verification.session.session_state import (
    RunsOfTask,
    SessionSetup,
    SessionState,
    n_visits,
    with_drift,
    without_touches,
)
from lightpen.verification.tasks.drift import DRIFT, MIN_VISITS, Drift, measure_drift
from lightpen.verification.tasks.part import PART
from lightpen.verification.tasks.part_course import with_move
from lightpen.verification.tasks.probed_point import StillFrames, measure_touches
from lightpen.verification.tasks.registry import AnyTask
from lightpen.verification.tasks.task import (
    Found,
    Points,
    Runs,
    Screening,
    without_last,
)

BROKEN_OFF = message("session.broken-off")


@dataclass(frozen=True, eq=False)
class SessionTransition:
    """A verification after one more image, with the task that this image ended."""

    state: SessionState
    events: tuple[ProbingEvent, ...] = ()
    finished: AnyTask | None = None


def setup_of(tip: CurrentTip, choices: VerificationChoices) -> SessionSetup:
    """Return the setup of a session with a current tip."""
    return SessionSetup(
        tip.instrument, choices, tip.names.ball_diameter, tip.nominal_tip, tip.cone_cam
    )


def advance_session(
    setup: SessionSetup, state: SessionState, name: str, detection: PenDetection
) -> SessionTransition:
    """Process one more image, and end the current task when its touches suffice."""
    task = state.task(setup)
    if task is None:
        return SessionTransition(state)
    rules = rules_of(setup, state, task)
    touched = advance_touch(setup.instrument, rules, state.touching, name, detection)
    events = touched.events
    happened = {event.what for event in events}
    state = replace(state, touching=touched.state)
    if ProbingEventKind.BROKEN_OFF in happened:
        state = replace(state, fault=BROKEN_OFF)
    if ProbingEventKind.RECORDED not in happened:
        return SessionTransition(state, events)
    try:
        state = with_touch(setup, state, task)
        if not _suffices(setup, state, task):
            return SessionTransition(state, events)
        state = _with_run(setup, state, task)
    except CalibrationError as error:
        state = replace(state, fault=error.message)
    is_finished = task.kind in state.found
    return SessionTransition(state, events, task if is_finished else None)


def end_task(setup: SessionSetup, state: SessionState) -> SessionTransition:
    """End the current task with its touches, or report why it cannot end."""
    task = state.task(setup)
    if task is None:
        return SessionTransition(state)
    before = state.runs_of(task)
    runs = _numbered((*before, state.touches) if state.touches else before)
    try:
        ended = _done(setup, state, task, runs)
    except CalibrationError as error:
        return SessionTransition(replace(state, fault=error.message))
    if task is DRIFT and state.touches:
        ended = replace(ended, visits=(*state.visits, state.touches))
    return SessionTransition(ended, finished=task)


def run_again(
    setup: SessionSetup, state: SessionState, touches: Points, *, is_last: bool
) -> SessionState:
    """Return the state with an earlier run, with its options of that time.

    ``is_last``: the task at hand ended with it. Raises `CalibrationError` if it does
    not belong to the current task.
    """
    state, task = replace(state, touches=touches), state.task(setup)
    if task is None:
        return state
    if not is_last:
        return _with_run(setup, state, task)
    ended = end_task(setup, state).state
    if ended.fault is not None:
        raise CalibrationError(ended.fault)
    return ended


def touch_again(
    setup: SessionSetup, state: SessionState, held: Sequence[StillFrames]
) -> SessionState:
    """Return the session with earlier touches of the current run.

    A touch that would end the run is omitted, as the run was not ended.
    """
    task = state.task(setup)
    if task is None:
        return state
    for still in held:
        rules = rules_of(setup, state, task)
        touching = taken_again(setup.instrument, rules, state.touching, still)
        if touching is state.touching:
            continue
        touched = with_touch(setup, replace(state, touching=touching), task)
        if not _suffices(setup, touched, task):
            state = touched
    return state


def measure(setup: SessionSetup, task: AnyTask, runs: Runs) -> Found:
    """Return the result of a task from its points."""
    found: Found = task.measure(runs, setup.conditions, setup.choices.options_of(task))
    return found


def measure_with_drift(setup: SessionSetup, done: RunsOfTask) -> Found:
    """Return the result of a task, with the motion of the camera."""
    by = with_drift(setup if done.setup is None else done.setup, done.drift)
    found = measure(by, done.task, done.runs)
    return replace(found, assessment=judged_with(found.assessment, done.lamps))


def with_found(state: SessionState, done: RunsOfTask, found: Found) -> SessionState:
    """Return the session with a task's result; the next begins when the pen moves."""
    kind = done.task.kind
    return replace(
        without_touches(state),
        found={**state.found, kind: found},
        measured={**state.measured, kind: done},
        pending=() if done.task is DRIFT else state.pending,
    )


def touched_anew(state: SessionState, task: AnyTask) -> SessionState:
    """Return the session with one task reset and no points of the current one.

    The drift reference is visited once more after it.
    """
    undone = {task.kind, DRIFT.kind}
    return replace(
        without_touches(state),
        found={kind: each for kind, each in state.found.items() if kind not in undone},
        visits=() if task is DRIFT else state.visits,
        pending=tuple(each for each in state.pending if each.task is not task),
    )


def without_last_touch(state: SessionState) -> SessionState:
    """Return the session without the last point of the current run."""
    touching = replace(
        state.touching,
        taken=state.touching.taken[:-1],
        places=state.touching.places[:-1],
        is_sliding=False,
    )
    return replace(state, touching=touching, touches=state.touches[:-1], fault=None)


def with_moved_part(setup: SessionSetup, state: SessionState) -> SessionSetup:
    """Return the setup of a session in which part or camera was moved just now.

    Raises `CalibrationError` if the runs so far have no datum points.
    """
    options = setup.choices.options_of(PART)
    moves = with_move(options, state.runs, setup.conditions).moves
    return replace(setup, choices=setup.choices.with_moves(moves))


def with_other_choices(
    setup: SessionSetup, state: SessionState, choices: VerificationChoices
) -> tuple[SessionSetup, SessionState]:
    """Return a verification that continues with other choices.

    Where another task is to be probed now, the points at hand are forgotten, and the
    state has another `touching`.
    """
    at_hand = state.task(setup)
    choices = choices.with_moves(setup.choices.options_of(PART).moves)
    setup = replace(setup, choices=choices)
    now = state.task(setup)
    if now is not at_hand:
        state = without_touches(state)
    if now is not None and DRIFT.kind in state.found:  # it was of others
        found = {k: each for k, each in state.found.items() if k != DRIFT.kind}
        state = replace(without_touches(state), found=found)
    if not state.awaits_drift(setup):
        state = replace(state, pending=())
    return setup, state


def rules_of(setup: SessionSetup, state: SessionState, task: AnyTask) -> ProbingRules:
    """Return the probing rules of the next point of a task."""
    options = setup.choices.options_of(task)
    turn, distance = task.newness(options)
    n_frames = setup.choices.frames_of(task)
    rules = ProbingRules(n_frames, min_turn=turn, min_distance=distance)
    is_sliding = bool(state.touches) and state.touching.is_sliding
    if is_sliding and task.scans(options, len(state.runs)):
        return replace(rules, n_frames=1, n_settling=0)
    return rules


def with_touch(setup: SessionSetup, state: SessionState, task: AnyTask) -> SessionState:
    """Measure again with the last point; drop it if it cannot be one of the task."""
    points = measure_touches(setup.instrument, state.touching.taken)
    state = replace(state, touches=points)
    screening = _screened(setup, state, task)
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


def _screened(setup: SessionSetup, state: SessionState, task: AnyTask) -> Screening:
    last = state.touches[-1]
    try:
        require_leds_fit(last.label, (last,))
    except CalibrationError as error:
        return without_last(len(state.touches), error.message)
    options = setup.choices.options_of(task)
    return task.screen(options, setup.conditions, state.progress(setup, task))


def _suffices(setup: SessionSetup, state: SessionState, task: AnyTask) -> bool:
    """Return whether the points are enough for a run."""
    options = setup.choices.options_of(task)
    return task.done(options, state.progress(setup, task)) >= 1.0


def _with_run(setup: SessionSetup, state: SessionState, task: AnyTask) -> SessionState:
    """End a run, and with the last of them the task."""
    if task is DRIFT:
        return _with_visit(setup, state)
    runs = (*state.runs, state.touches)
    if len(runs) >= task.n_runs(setup.choices.options_of(task)):
        return _done(setup, state, task, _numbered(runs))
    options = setup.choices.options_of(task)
    (task.check or task.measure)(_numbered(runs), setup.conditions, options)
    return replace(without_touches(state), runs=runs)


def _done(
    setup: SessionSetup, state: SessionState, task: AnyTask, runs: Runs
) -> SessionState:
    """Measure a task; the next visit of the cone adds the drift to its U."""
    if task is DRIFT:
        state = _after_visit(setup, state, runs)
    found = measure(setup, task, runs)
    if task is not DRIFT and state.awaits_drift(setup):
        done = RunsOfTask(task, runs)
        state = replace(state, pending=(*state.pending, done))
    return with_found(state, RunsOfTask(task, runs, setup), found)


def _with_visit(setup: SessionSetup, state: SessionState) -> SessionState:
    """End a visit of the cone, and with the last of them the task."""
    visits = (*state.visits, state.touches)
    runs = _numbered(visits)
    if len(visits) >= n_visits(setup.choices):
        return replace(_done(setup, state, DRIFT, runs), visits=visits)
    return replace(without_touches(_after_visit(setup, state, runs)), visits=visits)


def _after_visit(
    setup: SessionSetup, state: SessionState, visits: Runs
) -> SessionState:
    """Include the motion of the cone since the last visit in the results."""
    if len(visits) < MIN_VISITS:
        return state
    around = measure_drift(visits[-MIN_VISITS:], setup.conditions)
    return _counting(setup, state, around)


def _counting(setup: SessionSetup, state: SessionState, drift: Drift) -> SessionState:
    """Include a drift in the results since the last visit."""
    for each in state.pending:
        done = replace(each, setup=each.setup or setup, drift=drift)
        state = with_found(state, done, measure_with_drift(setup, done))
    return replace(state, pending=())


def _numbered(runs: Sequence[Points]) -> Runs:
    return [(f"#{i}", points) for i, points in enumerate(runs, start=1)]
