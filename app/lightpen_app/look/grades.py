"""Appearance of the grades."""

from lightpen.estimation.reports.verdict import Grade
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import Tone

GRADE_MARKS: dict[Grade, tuple[Sign, Tone]] = {
    Grade.PASS: (Sign.CHECK, Tone.GOOD),
    Grade.SCALE: (Sign.CHECK, Tone.ACTIVE),
    Grade.STEADY: (Sign.CHECK, Tone.ACTIVE),
    Grade.CHECK: (Sign.WARNING, Tone.WARN),
    Grade.REPEAT: (Sign.CROSS, Tone.BAD),
}
