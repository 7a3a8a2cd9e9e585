"""Which touches count: one that can be none of its task is dropped, and told."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lightpen.errors import CalibrationError
from lightpen.model.posture import angles_between
from lightpen.sentences import Sentence, sentence
from lightpen.verification.choices import TaskKind, ball_offset
from lightpen.verification.circle import ANOTHER
from lightpen.verification.fixed_point import LIFTED
from lightpen.verification.session_state import SessionSetup, SessionState
from lightpen.verification.sources import require_leds_fit
from lightpen.verification.touch import Touch, measure_touches

NEW_POSTURE = np.radians(8.0)
ELSEWHERE = 5.0  # mm from the others: the tip was not in the cone at all
SAME_POSTURE = np.radians(12.0)  # within which a pen is held alike

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
OTHER_THAN_FIRST = sentence(
    "session.other-than-first",
    "The pen leans otherwise than at the first visit, so this touch does not count. "
    "Hold it as then: what is not known of the pen then moves all visits alike.",
)


def with_touch(
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
    if task is TaskKind.DRIFT:
        return _at_witness(state, touches)
    if task is TaskKind.CIRCLE and _is_in_cone(state, touches[-1]):
        kept = range(len(touches) - 1)
        return replace(_with_touches(state, touches, kept), trouble=STILL_IN_CONE)
    if task is TaskKind.LENGTH and len(touches) == 2:
        return _with_true_ends(setup, state, touches)
    return replace(state, touches=touches)


def _is_in_cone(state: SessionState, touch: Touch) -> bool:
    """Return whether a touch is of the fixed point or the witness, which are done."""
    cones = [visit[0].point_cam for visit in state.visits[:1]]
    if state.fixed_point is not None:
        cones.append(state.fixed_point.calibrated.mean)
    ways = [touch.point_cam - cone for cone in cones]
    return any(float(np.linalg.norm(way)) <= ELSEWHERE for way in ways)


def _at_witness(state: SessionState, touches: tuple[Touch, ...]) -> SessionState:
    """Drop a touch in another posture than the first, or away from its cone."""
    first, last = (*state.visits, touches)[0][0], touches[-1]
    is_second = not state.visits and len(touches) == 2  # nobody knows which is right
    kept = (1,) if is_second else tuple(range(len(touches) - 1))
    turned = angles_between(last.rotation[None], first.rotation[None])[0, 0]
    if turned > SAME_POSTURE:
        alone = _with_touches(state, touches, kept)
        return replace(alone, trouble=OTHER_THAN_FIRST)
    distance = float(np.linalg.norm(last.point_cam - first.point_cam))
    if distance > ELSEWHERE:
        return replace(
            _with_touches(state, touches, kept), trouble=_elsewhere(distance)
        )
    return _without_others(state, touches, LIFTED)


def _without_others(
    state: SessionState, touches: tuple[Touch, ...], limit: float = ELSEWHERE
) -> SessionState:
    """Drop touches that are not of the cone, as of a pen that was laid down."""
    points = np.array([touch.point_cam for touch in touches])
    distances = np.linalg.norm(points - np.median(points, axis=0), axis=1)
    kept = np.flatnonzero(distances <= limit).tolist()
    if len(touches) < 3 or len(kept) == len(touches):  # of two, nobody knows which
        return replace(state, touches=touches)
    trouble = _elsewhere(float(distances.max()))
    return replace(_with_touches(state, touches, kept), trouble=trouble)


def _elsewhere(distance: float) -> Sentence:
    return sentence(
        "session.elsewhere",
        "A touch {distance:.1f} mm from the others does not count: the tip was not in "
        "the cone. Put it into the cone and hold it still.",
        distance=distance,
    )


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
    choices = setup.choices
    beyond = 2 * ball_offset(choices.length_surface, setup.ball_diameter)
    distance = float(np.linalg.norm(one - other)) + beyond
    certified = choices.length
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
