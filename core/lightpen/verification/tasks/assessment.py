"""What a verification found: a grade, the reason that counts most, and what to do."""

from collections.abc import Iterable
from dataclasses import dataclass

from lightpen.estimation.reports.verdict import Grade
from lightpen.messages import Message, message

USE_TIP = message("verification.use-tip")
CALIBRATE_AGAIN = message("verification.calibrate-again")
VERIFY_AGAIN = message("verification.verify-again")
CHECK_FILES = message("verification.check-files")


WORST = (Grade.PASS, Grade.CHECK, Grade.REPEAT)  # last


@dataclass(frozen=True)
class VerificationAssessment:
    """What a verification found.

    Accepted is what lies within its limit (simple acceptance); U is stated beside it
    and may itself not be larger than the limit.
    """

    grade: Grade
    reason: Message
    next_step: Message

    @property
    def is_accepted(self) -> bool:
        """Whether nothing was found against the tip."""
        return self.grade is Grade.PASS


def worst(found: Iterable[VerificationAssessment]) -> VerificationAssessment:
    """Return the worst of several; of equals the first."""
    return max(found, key=lambda each: WORST.index(each.grade))


def accepted(reason: Message, next_step: Message = USE_TIP) -> VerificationAssessment:
    """Return that all is well."""
    return VerificationAssessment(Grade.PASS, reason, next_step)


def check(reason: Message, next_step: Message) -> VerificationAssessment:
    """Return an assessment CHECK."""
    return VerificationAssessment(Grade.CHECK, reason, next_step)


def refused(reason: Message, next_step: Message) -> VerificationAssessment:
    """Return an assessment for an exceeded limit."""
    return VerificationAssessment(Grade.REPEAT, reason, next_step)
