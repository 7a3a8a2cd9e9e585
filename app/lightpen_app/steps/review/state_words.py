"""What the step Review says of a swing as it stands."""

from PySide6.QtCore import QCoreApplication

from lightpen.estimation.verdict import Grade, NextStep
from lightpen.local_time import local_time
from lightpen.model.origin import Origin
from lightpen.record.names import Names
from lightpen.record.results import Result
from lightpen.sentences import Sentence
from lightpen.swing.status import Activity, SwingStatus
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


def next_step_text(status: SwingStatus) -> str:
    """Return the sentence of what comes next."""
    translate = QCoreApplication.translate
    if status.result is not None:
        return translate(
            "ReviewPage", "Next: start the next calibration, or close the program."
        )
    if status.verdict is None:
        return translate("ReviewPage", "Nothing is in force until it is accepted.")
    next_step = status.verdict.next_step
    text = worded(next_step.sentence)
    if next_step is NextStep.CAPTURE_MORE and status.is_recording:
        text = translate(
            "ReviewPage", "Next: record more images, and read them all again."
        )
    has_last = status.assessment is not None and status.assessment.last is not None
    is_practice = status.origin is Origin.SIMULATED
    if next_step is NextStep.ACCEPT and has_last and not is_practice:
        form = translate("ReviewPage", "{0} The old one stays in force until then.")
        text = form.format(text)
    return text


def why_not_now(status: SwingStatus) -> str:
    """Return why nothing can be done with the tip at this moment."""
    translate = QCoreApplication.translate
    if status.solution is None or status.verdict is None:
        return translate("ReviewPage", "Swing the pen first.")
    if status.is_solving:
        return translate("ReviewPage", "The tip is being computed.")
    if status.is_reading:
        return translate("ReviewPage", "The swing goes on.")
    if status.activity is Activity.ACCEPTING:
        return translate("ReviewPage", "The result is being stored.")
    return ""


def why_not_accepted(status: SwingStatus) -> str:
    """Return why the tip cannot be accepted with a reason."""
    verdict, why_not = status.verdict, why_not_now(status)
    if why_not or verdict is None or verdict.can_be_accepted:
        return why_not
    return QCoreApplication.translate(
        "ReviewPage", "Not good enough: capture more images, or repeat the swing."
    )


def why_not_changed(status: SwingStatus) -> str:
    """Return why the swing cannot be changed."""
    translate = QCoreApplication.translate
    if status.result is not None:
        return translate(
            "ReviewPage", "The tip is accepted; start the next calibration."
        )
    if status.solution is None:
        return translate("ReviewPage", "Swing the pen first.")
    return ""


def unsaved_text(status: SwingStatus) -> str:
    """Return what to think of before the window closes; nothing where all is done."""
    translate = QCoreApplication.translate
    if status.solution is None or status.result is not None:
        return ""
    taken = status.taken_back
    if taken is not None and taken.record == status.record_folder:
        # Its swing is over, however little is in force.
        return translate(
            "ReviewPage",
            "The tip was taken back and is not accepted. The swing is kept; the "
            "file swing.lightpen in {0} opens it again.",
        ).format(status.record_folder)
    return translate(
        "ReviewPage",
        "The tip is not accepted. The swing is kept and offered again at the next "
        "start.",
    )


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
