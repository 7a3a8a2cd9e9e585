"""What an operator is told to do next in a verification, and how far it is."""

from lightpen.sentences import Sentence, sentence
from lightpen.verification.articulation import N_POSTURES, N_TOUCHES
from lightpen.verification.choices import TaskKind
from lightpen.verification.circle import MIN_ANGLE
from lightpen.verification.counting import ALIKE
from lightpen.verification.session import RING_TOUCHES, VISIT_TOUCHES, covered
from lightpen.verification.session_state import SessionSetup, SessionState, n_visits
from lightpen.verification.touching import TouchPhase

_KNOWN = {
    TaskKind.FIXED_POINT: sentence(
        "session.same-posture",
        "This posture was taken before. Leave the tip in the cone and lean the pen "
        "another way.",
    ),
    TaskKind.CIRCLE: sentence(
        "session.same-place",
        "This place of the ring was touched before. Touch it where it was not.",
    ),
    TaskKind.LENGTH: sentence(
        "session.same-end",
        "This end was touched before. Touch the other one.",
    ),
    TaskKind.ARTICULATION: ALIKE,
    TaskKind.DRIFT: ALIKE,
}


def instruction(setup: SessionSetup, state: SessionState) -> Sentence:
    """Return what the operator should do now."""
    task, n_touches, choices = state.task(setup), len(state.touches), setup.choices
    if task is None:
        return sentence("session.done", "The verification is done. Put the pen down.")
    if state.touching.phase is TouchPhase.KNOWN:
        return _KNOWN[task]
    if state.trouble is not None:
        return state.trouble
    if task is TaskKind.FIXED_POINT:
        return sentence(
            "session.touch-cone",
            "Put the tip into the cone and hold it still, each time leant another way: "
            "{n_touches} of {needed}.",
            n_touches=n_touches,
            needed=choices.n_touches,
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
    if task is TaskKind.ARTICULATION:
        return sentence(
            "session.touch-postures",
            "Touch the cone {needed} times in one posture and lift the tip in between: "
            "{n_touches} of {needed}. Posture {posture} of {n_postures}: upright, and "
            "leant to four sides.",
            n_touches=n_touches,
            needed=N_TOUCHES,
            posture=len(state.runs) + 1,
            n_postures=N_POSTURES,
        )
    if task is TaskKind.DRIFT:
        return sentence(
            "session.touch-witness",
            "Has the camera moved? Touch the cone {needed} times with the pen upright, "
            "and lift the tip in between: {n_touches} of {needed}. Visit {visit} of "
            "{n_visits}.",
            needed=VISIT_TOUCHES,
            n_touches=n_touches,
            visit=len(state.visits) + 1,
            n_visits=max(n_visits(choices), len(state.visits) + 1),
        )
    return sentence(
        "session.touch-ends",
        "Touch one end of the length, then the other, and hold still on each: "
        "{n_touches} of 2.",
        n_touches=n_touches,
    )


def fraction_done(setup: SessionSetup, state: SessionState) -> float:
    """Return how much of the task at hand is done, 0 to 1."""
    choices, n_touches = setup.choices, len(state.touches)
    match state.task(setup):
        case TaskKind.FIXED_POINT:
            return min(n_touches / choices.n_touches, 1.0)
        case TaskKind.CIRCLE:
            part = min(covered(state.touches) / MIN_ANGLE, n_touches / RING_TOUCHES)
            return (len(state.runs) + min(part, 1.0)) / choices.n_runs
        case TaskKind.LENGTH:
            return (len(state.runs) + n_touches / 2) / choices.n_places
        case TaskKind.ARTICULATION:
            return (len(state.runs) + n_touches / N_TOUCHES) / N_POSTURES
        case TaskKind.DRIFT:
            return min(n_touches / VISIT_TOUCHES, 1.0)
    return 1.0
