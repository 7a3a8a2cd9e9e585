"""A verification without a key.

`advance_session` takes the state and what the next image shows. The task ends
automatically when its points suffice; live images and recorded ones go through the
same steps. Points that can be none of the task are dropped with a message.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from lightpen.detection.pen_detection import PenDetection
from lightpen.errors import CalibrationError
from lightpen.messages import message
from lightpen_extensions.measure.verification.probing.current_tip import CurrentTip
from lightpen_extensions.measure.verification.probing.probing import (
    ProbingEvent,
    ProbingEventKind,
    ProbingRules,
    advance_touch,
    with_taken,
)
from lightpen_extensions.measure.verification.probing.sources import require_leds_fit
from lightpen_extensions.measure.verification.session.choices import VerificationChoices
from lightpen_extensions.measure.verification.session.session_state import (
    SessionSetup,
    SessionState,
    numbered_runs,
    without_touches,
)
from lightpen_extensions.measure.verification.tasks.probed_point import (
    StillFrames,
    measure_touches,
)
from lightpen_extensions.measure.verification.tasks.registry import AnyTask
from lightpen_extensions.measure.verification.tasks.task import (
    Points,
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
    return SessionTransition(state, events, state.done)


def end_task(setup: SessionSetup, state: SessionState) -> SessionTransition:
    """End the current task with its touches, or report why it cannot end."""
    task = state.task(setup)
    if task is None:
        return SessionTransition(state)
    runs = (*state.runs, state.touches) if state.touches else state.runs
    try:
        ended = _done(setup, state, task, runs)
    except CalibrationError as error:
        return SessionTransition(replace(state, fault=error.message))
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
    """Return the session with the touches of its current run.

    A touch that would end the run is omitted, as the run was not ended.
    """
    instrument, task = setup.instrument, state.task(setup)
    touching = with_taken(instrument, state.touching, held)
    touches = measure_touches(instrument, held)
    state = replace(state, touching=touching, touches=touches)
    while task is not None and state.touches and _suffices(setup, state, task):
        state = without_last_touch(state)
    return state


def without_last_touch(state: SessionState) -> SessionState:
    """Return the session without the last point of the current run."""
    touching = replace(
        state.touching,
        taken=state.touching.taken[:-1],
        places=state.touching.places[:-1],
    )
    return replace(state, touching=touching, touches=state.touches[:-1], fault=None)


def rules_of(setup: SessionSetup, state: SessionState, task: AnyTask) -> ProbingRules:
    """Return the probing rules of the next point of a task."""
    options = setup.choices.options_of(task)
    turn, distance = task.newness(options)
    n_frames = setup.choices.frames_of(task)
    return ProbingRules(n_frames, min_turn=turn, min_distance=distance)


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
    runs = (*state.runs, state.touches)
    options = setup.choices.options_of(task)
    if len(runs) >= task.n_runs(options):
        return _done(setup, state, task, runs)
    (task.check or task.measure)(numbered_runs(runs), setup.conditions, options)
    return replace(without_touches(state), runs=runs)


def _done(
    setup: SessionSetup, state: SessionState, task: AnyTask, runs: Sequence[Points]
) -> SessionState:
    """Measure a task."""
    options = setup.choices.options_of(task)
    found = task.measure(numbered_runs(runs), setup.conditions, options)
    return replace(without_touches(state), runs=(), done=task, found=found)
