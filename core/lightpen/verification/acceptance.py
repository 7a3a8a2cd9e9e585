"""Whose word it takes to use a tip that did not pass its verification."""

from lightpen.errors import AcceptanceError
from lightpen.estimation.verdict import Grade
from lightpen.record.supervision import Signature, Supervision, require_supervisor
from lightpen.sentences import sentence
from lightpen.verification.assessment import Conformity


def accepting_supervisor(
    supervision: Supervision, found: Conformity, signature: Signature | None
) -> str:
    """Return the supervisor who accepts the tip; empty where it takes none.

    Raises
    ------
    AcceptanceError
        It takes one, and nobody signs or the password is another one.
    """
    if not supervision.is_guarded and found.grade is not Grade.REPEAT:
        return ""
    if signature is None:
        raise AcceptanceError(
            sentence(
                "verification.no-supervisor",
                "The tip did not keep the limits. {why} Only a supervisor can "
                "accept it, with a reason.",
                why=found.reason,
            )
        )
    require_supervisor(supervision, signature)
    return signature.name.strip()
