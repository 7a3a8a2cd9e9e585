"""The values that the step Verify shows."""

from dataclasses import dataclass, field

from lightpen_app.look.grades import GRADE_MARKS
from lightpen_app.look.sentences import worded
from lightpen_app.look.theme import Tone
from lightpen_app.widgets.operator_view import OperatorValue
from lightpen_app.widgets.page import MainAction
from lightpen_app.widgets.sign_label import StatusMessage
from lightpen_app_extensions.measure.check_list import CheckRow
from lightpen_extensions.measure.probing.probing import SETTLING, ProbingPhase
from lightpen_extensions.measure.session.session import SessionState
from lightpen_extensions.measure.session.status import VerificationStatus
from lightpen_extensions.measure.tasks.registry import AnyTask


@dataclass(frozen=True)
class Headline:
    """Status of the page for the window."""

    lead: str = ""  # below its title
    tone: Tone = Tone.QUIET
    action: MainAction = field(default_factory=lambda: MainAction(""))
    is_complete: bool = False
    is_doubtful: bool = False


@dataclass(frozen=True, eq=False)
class VerifyView:
    """Content of the page of a verification, except the results."""

    headline: Headline = field(default_factory=Headline)
    operator: OperatorValue = field(default_factory=OperatorValue)
    # The drift of fixed lamps, unless it is the verdict.
    lamps: StatusMessage = field(default_factory=StatusMessage)
    rows: tuple[CheckRow, ...] = ()  # checks, or features of a part
    current: int = 0  # row of what is probed now
    task: AnyTask | None = None  # the current one
    pause: str = ""
    can_be_accepted: bool = False
    can_start_over: bool = False
    can_undo: bool = False
    has_report: bool = False


def is_held(state: SessionState) -> bool:
    """Return whether the pen is held still on a point that is not recorded yet."""
    touching = state.touching
    is_holding = touching.phase is ProbingPhase.HOLDING
    return is_holding and len(touching.held) >= SETTLING


def lamps_message(status: VerificationStatus) -> StatusMessage:
    """Return the drift of fixed lamps, unless it is the verdict."""
    assessment = None if status.lamp_drift is None else status.lamp_drift.assessment
    if assessment is None or (status.is_done and assessment is status.assessment):
        return StatusMessage()
    return StatusMessage(worded(assessment.reason), *GRADE_MARKS[assessment.grade])
