"""What a verification found: a grade, the reason that counts most, and what to do."""

from collections.abc import Iterable
from dataclasses import dataclass

from lightpen.estimation.verdict import Grade
from lightpen.sentences import Sentence, sentence

USE_TIP = sentence("verification.use-tip", "Next: use the tip.")
CALIBRATE_AGAIN = sentence(
    "verification.calibrate-again",
    "Next: seat the tip firmly, calibrate it again, and verify the new result.",
)
VERIFY_AGAIN = sentence(
    "verification.verify-again",
    "Next: clean tip and artefact, clamp artefact and camera, and verify again.",
)
CHECK_FILES = sentence(
    "verification.check-files",
    "Next: check that camera file and LED file are of this camera and this pen.",
)


WORST = (Grade.PASS, Grade.CHECK, Grade.REPEAT)  # last


@dataclass(frozen=True)
class Conformity:
    """What a verification found.

    Accepted is what lies within its limit (simple acceptance); U is stated beside it
    and may itself not be larger than the limit.
    """

    grade: Grade
    reason: Sentence
    next_step: Sentence

    @property
    def is_accepted(self) -> bool:
        """Whether nothing was found against the tip."""
        return self.grade is Grade.PASS


def worst(found: Iterable[Conformity]) -> Conformity:
    """Return the worst of several; of equals the first."""
    return max(found, key=lambda each: WORST.index(each.grade))


def accepted(reason: Sentence, next_step: Sentence = USE_TIP) -> Conformity:
    """Return that all is well."""
    return Conformity(Grade.PASS, reason, next_step)


def check(reason: Sentence, next_step: Sentence) -> Conformity:
    """Return that something is to be looked into."""
    return Conformity(Grade.CHECK, reason, next_step)


def refused(reason: Sentence, next_step: Sentence) -> Conformity:
    """Return that a limit is not kept."""
    return Conformity(Grade.REPEAT, reason, next_step)
