"""View state of the step Review."""

from dataclasses import dataclass
from operator import attrgetter

from PySide6.QtCore import QCoreApplication

from lightpen.estimation.reports.verdict import Grade, NextStep
from lightpen.messages import Code, Message
from lightpen.model.names import Origin
from lightpen.record.results.results import Result
from lightpen.record.swings.header import Names
from lightpen.swing.capture.state import Phase
from lightpen.swing.status import Activity, SwingStatus
from lightpen_app.look.languages import worded
from lightpen_app.look.phrases import (
    GRADE_MARKS,
    accepted_phrase,
    grade_text,
    phase_text,
    phrase,
)
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import Tone
from lightpen_app.look.words import moment_text, shortened
from lightpen_app.widgets.bars import Question
from lightpen_app.widgets.page import MainAction
from lightpen_app.widgets.state_banner import State, StatusMessage

translate = QCoreApplication.translate

# What the sentence of a verdict has in it whose cause is the intrinsics file.
OF_CAMERA = {
    "share.camera",
    "share.rig",
    "warning.camera-file-contradicted",
    "warning.images-turned",
}
OF_FILES = (
    NextStep.CHECK_FILES,
    NextStep.CHECK_CAMERA,
    NextStep.CHECK_LEDS,
    NextStep.CHECK_RIG,
)


@dataclass(frozen=True)
class ReviewPageState:
    """View state of the page without the solution."""

    banner: State
    remarks: tuple[StatusMessage, ...]
    main: MainAction
    is_accepted: bool
    takes_reason: bool  # whether the tip can be accepted with a reason only
    # Why images cannot be excluded or included; what follows says likewise why a
    # button cannot be pressed.
    why_locked: str
    why_not_more: str
    why_not_repeated: str
    why_not_accepted: str
    why_not_saved: str
    why_not_printed: str
    why_not_pressed: str


def review_page_state(
    status: SwingStatus, named: Names, main: MainAction
) -> ReviewPageState:
    """Return the view state of the page, by the selection at the step Start."""
    verdict = status.verdict
    why_locked, is_accepted = why_not_changed(status), status.result is not None
    goes_on = all_read = not_swung = not_accepted = ""
    if status.is_reading:
        goes_on = translate("ReviewPage", "Swing in progress")
    if status.is_recording:
        all_read = translate("ReviewPage", "All recorded images are loaded.")
    if status.solution is None:
        not_swung = why_not_swung(status)
    if not is_accepted:
        not_accepted = translate(
            "ReviewPage",
            "Accept the tip first. The report is made from the accepted result.",
        )
    is_doubted = verdict is not None and verdict.grade is not Grade.PASS
    return ReviewPageState(
        banner=review_state(status),
        remarks=remarks(status, named),
        main=main,
        is_accepted=is_accepted,
        takes_reason=is_doubted and not is_accepted,
        why_locked=why_locked or goes_on,
        why_not_more=(why_locked if status.failure is None else goes_on) or all_read,
        why_not_repeated=why_locked if status.failure is None else goes_on,
        why_not_accepted=why_not_accepted(status),
        why_not_saved=not_swung,
        why_not_printed=not_accepted,
        why_not_pressed=not_swung or why_not_now(status) or all_read,
    )


_SHOWN = attrgetter(
    *("solution", "failure", "assessment", "result"),
    *("activity", "is_capturing", "pressed"),
)


def differs(before: SwingStatus, now: SwingStatus) -> bool:
    """Return whether two statuses give different reviews."""
    return bool(_SHOWN(before) != _SHOWN(now))


def returns_to_swing(before: SwingStatus, now: SwingStatus) -> bool:
    """Return whether the swing continues with more images, or another begins."""
    if (before.solution is None and before.failure is None) or now.is_reading:
        return False
    captures_more = now.is_capturing and (before.is_reading or not before.is_capturing)
    return captures_more or (now.solution is None and now.failure is None)


def next_step(status: SwingStatus) -> NextStep | None:
    """Return the next step after the verdict; None without a verdict."""
    if status.verdict is not None:
        return status.verdict.next_step
    if status.failure is None:
        return None
    is_misfit = status.failure.causes[0].code == Code.LEDS_MISFIT
    return NextStep.CHECK_FILES if is_misfit else NextStep.CAPTURE_MORE


def review_action(
    status: SwingStatus, *, is_new: bool, is_read: bool = True, next_tip: str = ""
) -> MainAction:
    """Return the present action of the main button.

    A new tip was accepted a moment ago; a result is read once it was shown long enough.
    ``next_tip`` is empty where something is missing for a swing.
    """
    if status.result is not None:
        why_not = translate("ReviewPage", "Tip accepted.") if is_new else ""
        if not next_tip:
            return MainAction(translate("ReviewPage", "Back to Start"), why_not)
        text = translate("ReviewPage", "Swing tip {0}").format(shortened(next_tip, 12))
        return MainAction(text, why_not)
    why_not = why_not_now(status)
    match next_step(status):
        case None | NextStep.ACCEPT:
            text = translate("ReviewPage", "Accept")
            if not is_read:
                why_not = why_not or translate("ReviewPage", "Read the result first.")
            return MainAction(text, why_not, at_screen=True)
        case NextStep.CAPTURE_MORE if not status.is_recording:
            return MainAction(translate("ReviewPage", "Capture more"), why_not)
        case NextStep.USE_PART:
            return MainAction(translate("ReviewPage", "Use longer part"), why_not)
        case NextStep.REPORT_JOINT:
            return MainAction(translate("ReviewPage", "Report joint fit"), why_not)
        case NextStep.SEE_TO_CAUSE:
            return MainAction(translate("ReviewPage", "Check settings"), why_not)
        case step if step in OF_FILES:
            return MainAction(translate("ReviewPage", "Check files"), why_not)
    return MainAction(translate("ReviewPage", "Repeat swing"), why_not)


def repeat_question() -> Question:
    """Return whether to swing again."""
    return Question(
        translate(
            "ReviewPage",
            "Repeat the swing from the start? These images remain on the disk.",
        ),
        translate("ReviewPage", "Repeat swing"),
        translate("ReviewPage", "Continue with these"),
    )


def review_state(status: SwingStatus) -> State:
    """Return the banner: verdict, or since when the tip is current."""
    if status.result is not None:
        return _accepted_state(status.result)
    if status.failure is not None:
        assert status.state is not None
        instruction = phrase(status.state.message, status.state.heading)
        return State(phase_text(Phase.VERDICT), instruction.hint, Sign.CROSS, Tone.BAD)
    if status.verdict is None:
        text = translate("ReviewPage", "The tip appears here after the swing.")
        word = translate("ReviewPage", "NO TIP YET")
        return State(word, text, Sign.WAIT, Tone.QUIET)
    heading = None if status.state is None else status.state.heading
    instruction = phrase(status.verdict.reason, heading)
    sign, tone = GRADE_MARKS[status.verdict.grade]
    form = translate("ReviewPage", "{0}: {1}")
    word = form.format(grade_text(status.verdict.grade), instruction.short)
    return State(word, instruction.hint, sign, tone)


def remarks(status: SwingStatus, named: Names) -> tuple[StatusMessage, ...]:
    """Return the doubts, and whether the step Start names another pen or tip by now."""
    doubts: tuple[Message, ...] = ()
    if status.failure is not None:
        doubts = status.failure.causes[1:]
    elif status.assessment is not None:
        doubts = status.assessment.doubts
    else:
        return ()
    texts = (_other_names(status.names, named), *map(worded, doubts))
    return tuple(StatusMessage.warning(text) for text in texts if text)


def next_step_text(status: SwingStatus) -> str:
    """Return the next step as a sentence."""
    if status.result is not None:
        return translate(
            "ReviewPage", "Next: start the next calibration or close the program."
        )
    step = next_step(status)
    if step is None:
        return translate("ReviewPage", "The result takes effect when it is accepted.")
    text = worded(step.message)
    if step is NextStep.CAPTURE_MORE and status.is_recording:
        text = translate(
            "ReviewPage", "Next: record more images and load all of them again."
        )
    verdict = status.verdict
    if verdict is not None and verdict.reason.code == Code.MANY_EXCLUDED:
        text = translate(
            "ReviewPage", "Next: include the images again, or repeat the swing."
        )
    has_last = status.assessment is not None and status.assessment.last is not None
    is_practice = status.origin is Origin.SIMULATED
    if step is NextStep.ACCEPT and has_last and not is_practice:
        form = translate(
            "ReviewPage", "{0} Until then the previous result remains current."
        )
        text = form.format(text)
    return text


def why_not_now(status: SwingStatus) -> str:
    """Return why no command is possible now; empty if one is."""
    if status.failure is None and (status.solution is None or status.verdict is None):
        return translate("ReviewPage", "Swing the pen first.")
    if status.is_solving:
        return translate("ReviewPage", "Computing the tip")
    if status.is_reading:
        return translate("ReviewPage", "Swing in progress")
    if status.activity is Activity.ACCEPTING:
        return translate("ReviewPage", "Saving the result")
    return ""


def why_not_accepted(status: SwingStatus) -> str:
    """Return why the tip cannot be accepted with a reason."""
    verdict, why_not = status.verdict, why_not_now(status)
    if why_not or verdict is None or verdict.can_be_accepted:
        return why_not
    return translate(
        "ReviewPage", "Result not acceptable. Capture more images or repeat the swing."
    )


def why_not_changed(status: SwingStatus) -> str:
    """Return why the swing cannot be changed."""
    if status.result is not None:
        return translate("ReviewPage", "Tip accepted. Start the next calibration.")
    return why_not_swung(status)


def why_not_swung(status: SwingStatus) -> str:
    """Return why there is no solution."""
    if status.failure is not None:
        return translate("ReviewPage", "These images gave no tip.")
    if status.solution is None:
        return translate("ReviewPage", "Swing the pen first.")
    return ""


def unsaved_text(status: SwingStatus) -> str:
    """Return the question before the window closes; empty if all is done."""
    if status.solution is None or status.result is not None:
        return ""
    taken = status.revoked
    if taken is not None and taken.record == status.record_folder:
        # Its swing is over, though its tip is not current.
        return translate(
            "ReviewPage",
            "Acceptance revoked. The swing is saved; open it with the file "
            "swing.lightpen in {0}.",
        ).format(status.record_folder)
    return translate(
        "ReviewPage",
        "Tip not accepted. The swing is saved; you can resume it at the next start.",
    )


def step_of_file(reason: Message) -> str:
    """Return the key of the step at which the file is opened that a reason names."""
    codes = {part.code for part in reason.parts()}
    return "camera" if codes & OF_CAMERA else "leds"


def _accepted_state(result: Result) -> State:
    accepted = accepted_phrase(result.origin)
    text = translate(
        "ReviewPage", "Saved {0}. Earlier results stay in the archive."
    ).format(moment_text(result.accepted))
    if result.reason:
        text = translate(
            "ReviewPage", "Saved {0}, check needed. Reason for acceptance: {1}"
        ).format(moment_text(result.accepted), result.reason)
    sign, tone = GRADE_MARKS[result.grade]
    return State(
        accepted.short, " ".join(filter(None, (accepted.hint, text))), sign, tone
    )


def _other_names(swung: Names, named: Names) -> str:
    if (swung.pen, swung.tip) == (named.pen, named.tip):
        return ""
    text = translate(
        "ReviewPage",
        "This swing belongs to tip {0}, pen {1}; the step Start now shows tip {2}, "
        "pen {3}.",
    )
    names = (swung.tip, swung.pen, named.tip, named.pen)
    return text.format(*map(shortened, names))
