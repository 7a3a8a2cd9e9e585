"""Appearance of grades and decisions."""

from lightpen.estimation.reports.verdict import Grade
from lightpen.model.decision_rules import Decision
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import Tone

GRADE_MARKS: dict[Grade, tuple[Sign, Tone]] = {
    Grade.PASS: (Sign.CHECK, Tone.GOOD),
    Grade.SCALE: (Sign.CHECK, Tone.ACTIVE),
    Grade.STEADY: (Sign.CHECK, Tone.ACTIVE),
    Grade.CHECK: (Sign.WARNING, Tone.WARN),
    Grade.REPEAT: (Sign.CROSS, Tone.BAD),
}
DECISION_MARKS: dict[Decision | None, tuple[Sign, Tone]] = {
    Decision.ACCEPTED: (Sign.CHECK, Tone.GOOD),
    Decision.OPEN: (Sign.WARNING, Tone.WARN),
    Decision.REJECTED: (Sign.CROSS, Tone.BAD),
    None: (Sign.CHECK, Tone.PLAIN),
}
