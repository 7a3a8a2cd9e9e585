"""How the grades of a calibration look, wherever they are shown."""

from lightpen.session.verdict import Grade
from lightpen_app.theme import Tone
from lightpen_app.widgets.signs import Sign

GRADE_MARKS: dict[Grade, tuple[Sign, Tone]] = {
    Grade.PASS: (Sign.CHECK, Tone.GOOD),
    Grade.CHECK: (Sign.WARNING, Tone.WARN),
    Grade.REPEAT: (Sign.CROSS, Tone.BAD),
}
