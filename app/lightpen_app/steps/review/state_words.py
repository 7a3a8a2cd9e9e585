"""What the step Review says of a swing as it stands."""

from PySide6.QtCore import QCoreApplication

from lightpen.estimation.verdict import Grade
from lightpen.local_time import local_time
from lightpen.record.names import Names
from lightpen.record.results import Result
from lightpen.sentences import Sentence
from lightpen.swing.status import SwingStatus
from lightpen_app.look.grades import GRADE_MARKS
from lightpen_app.look.phrases import accepted_phrase, grade_text, phrase
from lightpen_app.look.sentences import worded
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import Tone
from lightpen_app.look.words import shortened
from lightpen_app.widgets.sign_label import Remark
from lightpen_app.widgets.state_banner import State

# What the sentence of a verdict has in it whose cause is the intrinsics file.
OF_CAMERA = {"share.camera", "share.rig", "warning.camera-file-contradicted"}


def review_state(status: SwingStatus) -> State:
    """Return the banner: what the tip is worth, or since when it is in force."""
    translate = QCoreApplication.translate
    if status.result is not None:
        return _accepted_state(status.result)
    if status.verdict is None:
        text = translate("ReviewPage", "The tip shows here once the pen is swung.")
        word = translate("ReviewPage", "NO TIP YET")
        return State(word, text, Sign.WAIT, Tone.QUIET)
    heading = None if status.state is None else status.state.heading
    said = phrase(status.verdict.reason, heading)
    sign, tone = GRADE_MARKS[status.verdict.grade]
    form = translate("ReviewPage", "{0}: {1}")
    word = form.format(grade_text(status.verdict.grade), said.short)
    return State(word, said.hint, sign, tone)


def remarks(status: SwingStatus, named: Names) -> tuple[Remark, ...]:
    """Return the doubts, and whether the step Start names another pen or tip by now."""
    if status.assessment is None:
        return ()
    texts = (_other_names(status.names, named), *map(worded, status.assessment.doubts))
    return tuple(Remark(text, Sign.WARNING, Tone.WARN) for text in texts if text)


def step_of_file(reason: Sentence) -> str:
    """Return the key of the step at which the file is opened that a reason names."""
    codes = {part.code for part in reason.parts()}
    return "camera" if codes & OF_CAMERA else "leds"


def _accepted_state(result: Result) -> State:
    translate = QCoreApplication.translate
    since = f"{local_time(result.accepted):%Y-%m-%d %H:%M:%S}"
    told = accepted_phrase(result.origin)
    text = translate("ReviewPage", "Since {0}. Earlier results are kept.").format(since)
    if result.reason:
        text = translate(
            "ReviewPage", "Since {0}, to be checked; accepted with the reason: {1}"
        ).format(since, result.reason)
    sign, tone = GRADE_MARKS[Grade(result.grade)]
    return State(told.short, " ".join(filter(None, (told.hint, text))), sign, tone)


def _other_names(swung: Names, named: Names) -> str:
    if (swung.pen, swung.tip) == (named.pen, named.tip):
        return ""
    text = QCoreApplication.translate(
        "ReviewPage",
        "This swing is of tip {0}, pen {1}, whatever the step Start names now: tip "
        "{2}, pen {3}.",
    )
    names = (swung.tip, swung.pen, named.tip, named.pen)
    return text.format(*map(shortened, names))
