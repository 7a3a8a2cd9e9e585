"""Assessment of a verification: grade, main reason and next step."""

from collections.abc import Iterable
from dataclasses import dataclass

from lightpen.estimation.reports.verdict import Grade
from lightpen.messages import Message, message
from lightpen.model.decision_rules import Decision
from lightpen.model.expanded_uncertainty import COVERAGE_FACTOR
from lightpen.model.limits import VerificationLimits
from lightpen.model.quantiles import normal_quantile

USE_TIP = message("verification.use-tip")
CALIBRATE_AGAIN = message("verification.calibrate-again")
VERIFY_AGAIN = message("verification.verify-again")
CHECK_FILES = message("verification.check-files")
BETTER_POSTURES = message("verification.better-postures")
MORE_POINTS = message("verification.more-points")


BY_CHANCE = 0.01  # probability that no error looks significant: beyond 1.3 U
RELEVANT = 0.25  # of a limit: a smaller difference does not matter, however certain

WORST = (Grade.STEADY, Grade.SCALE, Grade.PASS, Grade.CHECK, Grade.REPEAT)  # last


@dataclass(frozen=True)
class VerificationAssessment:
    """Assessment of a verification.

    A value is compared with its limit by the decision rule of the limits. A difference
    that is more than chance and relevant for the limit is never accepted in silence.
    """

    grade: Grade
    reason: Message
    next_step: Message

    @property
    def is_accepted(self) -> bool:
        """Whether nothing was found against the tip."""
        return self.grade not in {Grade.CHECK, Grade.REPEAT}


def worst(found: Iterable[VerificationAssessment]) -> VerificationAssessment:
    """Return the worst assessment; of passing ones, one that verifies the tip."""
    return max(found, key=lambda each: WORST.index(each.grade))


def accepted(
    reason: Message, next_step: Message = USE_TIP, grade: Grade = Grade.PASS
) -> VerificationAssessment:
    """Return an assessment that passes, by default of the tip."""
    return VerificationAssessment(grade, reason, next_step)


def check(reason: Message, next_step: Message) -> VerificationAssessment:
    """Return an assessment CHECK."""
    return VerificationAssessment(Grade.CHECK, reason, next_step)


def refused(reason: Message, next_step: Message) -> VerificationAssessment:
    """Return an assessment for an exceeded limit."""
    return VerificationAssessment(Grade.REPEAT, reason, next_step)


def graded(
    value: float,
    uncertainty: float,
    limit: float,
    limits: VerificationLimits,
    n_values: int = 1,
) -> Grade:
    """Return the grade of an error with its U (k = 2), mm, the worst of several.

    REPEAT if the decision rule rejects. CHECK if it does not decide, or if the error is
    significant and relevant for the limit.
    """
    decision = limits.decision(value, uncertainty, limit)
    if decision is Decision.REJECTED:
        return Grade.REPEAT
    is_significant = _is_significant(value, uncertainty, limit, n_values)
    return Grade.CHECK if is_significant or decision is Decision.OPEN else Grade.PASS


def _is_significant(
    value: float, uncertainty: float, limit: float, n_values: int
) -> bool:
    by_chance = normal_quantile(BY_CHANCE / (2 * n_values)) / COVERAGE_FACTOR
    return abs(value) > max(by_chance * uncertainty, RELEVANT * limit)
