"""End of a verification: accepted, refused or abandoned, in a permanent file.

A verification is concluded when all selected tasks are complete: accepted if the limits
are kept, else refused. Who accepts the tip all the same concludes it once more, with a
reason, and so does who does one of its tasks again: the last conclusion of a session
counts. One that is given up before all is done is abandoned. Each names all records of
its session by their hashes, so that it stands for the whole.
"""

from dataclasses import dataclass
from datetime import datetime
from typing import Any

from lightpen.comparisons.assessment import VerificationAssessment
from lightpen.errors import AcceptanceError
from lightpen.estimation.reports.verdict import Grade
from lightpen.formats.hashes import InputFile
from lightpen.formats.json_records import file_entry, plain, record_heading
from lightpen.model.origin import Origin
from lightpen.record.folder.outcome import TrialOutcome
from lightpen.record.folder.verifications import CONCLUSION
from lightpen.record.library.signing.keys import SigningKey
from lightpen.record.library.supervision import (
    Signature,
    Supervision,
    require_supervisor,
)
from lightpen.record.swings.names import Names


@dataclass(frozen=True)
class Conclusion:
    """The end of a verification."""

    outcome: TrialOutcome
    session: datetime  # when it began
    at: datetime
    found: VerificationAssessment | None = None  # the worst, if any
    reason: str = ""  # why the tip is used despite findings
    supervisor: str = ""  # who approved that, if needed
    supervisor_key: SigningKey | None = None  # signs the record


def conclusion_record(
    names: Names,
    origin: Origin,
    tip_file: InputFile,
    conclusion: Conclusion,
    files: tuple[InputFile, ...],
) -> dict[str, Any]:
    """Return the record of a conclusion on the result in ``tip_file``.

    ``files`` are all records of the session.
    """
    found = conclusion.found
    return {
        **record_heading(conclusion.at),
        "verification": CONCLUSION,
        "outcome": conclusion.outcome,
        "session": conclusion.session.isoformat(timespec="seconds"),
        "station": names.station,
        "operator": names.operator,
        "pen": names.pen,
        "tip": names.tip,
        "origin": origin,
        "verdict": None
        if found is None
        else {"grade": found.grade.value, **plain(found.reason)},
        "supervisor": conclusion.supervisor,
        "reason": conclusion.reason,
        "inputs": {"tip": file_entry(tip_file)},
        "records": [file_entry(file) for file in files],
    }


def accepting_supervisor(
    supervision: Supervision, found: VerificationAssessment, signature: Signature | None
) -> tuple[str, SigningKey | None]:
    """Return name and key of the supervisor who accepts the tip.

    An empty name and no key if none is needed; `AcceptanceError` if one is, and none
    signs or the password is wrong.
    """
    if not supervision.is_guarded and found.grade is not Grade.REPEAT:
        return "", None
    if signature is None:
        raise AcceptanceError("verification.no-supervisor", why=found.reason)
    key = require_supervisor(supervision, signature)
    return signature.name.strip(), key
