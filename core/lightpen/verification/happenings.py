"""What happens in a verification, to be heard and seen."""

from lightpen.estimation.verdict import Grade
from lightpen.verification.session import SessionTransition
from lightpen.verification.session_state import SessionState
from lightpen.verification.status import SessionHappening, VerificationStatus
from lightpen.verification.touching import TouchHappening, TouchPhase

_HAPPENED = {
    TouchHappening.TAKEN: SessionHappening.TAKEN,
    TouchHappening.BROKEN_OFF: SessionHappening.BROKEN_OFF,
}


def happenings(
    before: SessionState | None, transition: SessionTransition
) -> list[SessionHappening]:
    """Return what has happened to the touches by one more image."""
    happened = [_HAPPENED[event.what] for event in transition.events]
    if before is not None and _is_known(transition.state) and not _is_known(before):
        happened.append(SessionHappening.KNOWN)
    return happened


def ending(status: VerificationStatus) -> SessionHappening:
    """Return what it is that a task is done."""
    if status.task is not None or status.assessment is None:
        return SessionHappening.FINISHED
    is_refused = status.assessment.grade is Grade.REPEAT
    return SessionHappening.FAILED if is_refused else SessionHappening.DONE


def _is_known(state: SessionState) -> bool:
    return state.touching.phase is TouchPhase.KNOWN
