"""The step Swing in words, signs and numbers."""

from dataclasses import replace
from math import isfinite

from PySide6.QtCore import QObject

from lightpen.arrays import FloatArray
from lightpen.detection.labelling.causes import UNKNOWN_CAUSE
from lightpen.detection.reasons import Reason
from lightpen.estimation.contact.single_images import USUAL_SIGMA
from lightpen.estimation.reports.verdict import Grade, NextStep, Verdict
from lightpen.messages import SHOW_PEN, Code, Message, message
from lightpen.swing.capture.guidance import out_of_reach
from lightpen.swing.capture.rules import COUNTDOWN, SLIP_REPORTED, has_just_slipped
from lightpen.swing.capture.state import Pause, Phase, SwingState
from lightpen_app.look.languages import worded
from lightpen_app.look.phrases import (
    GRADE_MARKS,
    Instruction,
    accepted_phrase,
    grade_text,
    lean_phrase,
    n_images_text,
    phase_text,
    phrase,
)
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import Tone
from lightpen_app.look.words import PARTED, time_left_text
from lightpen_app.steps.swing.view_state import ENDED, SwingViewState
from lightpen_app.widgets.operator_view import OperatorValue
from lightpen_app.widgets.posture_dial import DialValue
from lightpen_app.widgets.state_banner import State, StatusMessage

PRESSED = (  # shown where the tip is to be pressed into the cone
    Code.SEAT_TIP,
    Code.SWING_TO_SEAT,
    Code.HOLD_STILL,
    Code.STARTS_IN,
    Code.FOLLOW_ARROW,
)
FLAWS = (Code.FEW_LEDS, Code.TOO_FAST, Code.BAD_FIT)  # images that are not kept
PACE_S, N_PACING = 15.0, 6  # last seconds and images for the remaining time
LEAST_JUDGED = 5  # kept images, from which on misfitting LEDs are reported

_LOOKS: dict[Phase, tuple[Sign, Tone]] = {
    Phase.WAIT: (Sign.WAIT, Tone.QUIET),
    Phase.SEEN: (Sign.EYE, Tone.ACTIVE),
    Phase.SETTLED: (Sign.CHECK, Tone.GOOD),
    Phase.COUNTDOWN: (Sign.PLAY, Tone.ACTIVE),
    Phase.CAPTURING: (Sign.RECORD, Tone.GOOD),
    Phase.PAUSED: (Sign.PAUSE, Tone.WARN),
    Phase.SOLVING: (Sign.WAIT, Tone.ACTIVE),
    Phase.VERDICT: (Sign.CROSS, Tone.BAD),
}


class SwingWords(QObject):
    """Puts a snapshot of a swing into words, signs and numbers."""

    def operator_value(self, view: SwingViewState) -> OperatorValue:
        """Return the content of page and operator view."""
        instruction = self._current_instruction(view)
        return OperatorValue(
            instruction=instruction.short,
            hint=instruction.hint,
            state=self._banner(view),
            count=self._count(view),
            time_left=self._time_left(view),
            fraction=view.fraction,
            keys=self._keys(view),
            dial=view.dial,
        )

    def resting_value(self) -> OperatorValue:
        """Return the content without a swing, while another step is shown."""
        instruction = Instruction(
            self.tr("No swing yet"),
            self.tr("The swing starts when the step Swing is opened at the computer."),
        )
        state = State(phase_text(Phase.WAIT), "", *_LOOKS[Phase.WAIT])
        return OperatorValue(instruction.short, instruction.hint, state)

    def waiting_value(self, refusal: Message | None, *, is_near: bool) -> OperatorValue:
        """Return the content before a swing, which a refusal prevents.

        It is near if images come, so that it begins at any moment.
        """
        if is_near and refusal is None:
            instruction = phrase(SHOW_PEN)
            state = State(phase_text(Phase.WAIT), "", *_LOOKS[Phase.WAIT])
            return OperatorValue(
                instruction.short, instruction.hint, state, dial=DialValue()
            )
        instruction = self._no_images()
        if refusal is not None:
            instruction = Instruction(self.tr("No swing"), worded(refusal))
        return OperatorValue(
            instruction=instruction.short,
            hint=instruction.hint,
            state=State(instruction.short, "", Sign.CROSS, Tone.BAD),
            dial=DialValue(),
        )

    def note(self, view: SwingViewState) -> str:
        """Return the text beside the count: time, limit and unused images."""
        text = self.tr("at most {0} images").format(view.setup.limits.max_images)
        if view.setup.is_recording:
            text = self._read(view) if view.state.phase in ENDED else ""
            text = text or self.tr("recorded images")
        elif view.state.phase in ENDED:
            text = ""
        n_dropped = sum(view.state.n_dropped.values())
        rejected = self.tr("{0} rejected").format(n_dropped) if n_dropped else ""
        parts = self._time_left(view), text, rejected
        return PARTED.join(filter(None, parts))

    def warning(self, view: SwingViewState) -> StatusMessage:
        """Return a warning that no swing can resolve."""
        kept = view.state.kept
        why = out_of_reach(view.setup.limits, view.state, view.short)
        if len(kept) >= LEAST_JUDGED and kept.sigma > USUAL_SIGMA:
            why = message(
                Code.LEDS_MISFIT,
                sigma=kept.sigma,
                usual=USUAL_SIGMA,
                cause=UNKNOWN_CAUSE,
            )
        elif view.has_unfit_spots and view.state.phase in (Phase.WAIT, Phase.SEEN):
            n_leds = view.setup.pen.n_leds
            why = message("diagnosis.spots-do-not-fit", n_needed=n_leds, n_leds=n_leds)
        is_asked = not view.setup.is_recording
        if why is None or not is_asked or view.state.phase is Phase.VERDICT:
            return StatusMessage()
        return StatusMessage.warning(worded(why))

    def _current_instruction(self, view: SwingViewState) -> Instruction:
        state = view.state
        message, heading = state.message, state.heading
        if view.lacks_images and state.pause is Pause.BY_USER:
            hint = self.tr(
                "The camera sends no images. No data is lost. Press Space to "
                "continue when images are received."
            )
            return replace(self._no_images(), hint=hint)
        if view.lacks_images:
            return self._no_images()
        if view.is_unsolved:
            return Instruction(
                self.tr("Not computed"),
                self.tr("The images are saved. Compute the tip again or start over."),
            )
        instruction = phrase(message, heading)
        if view.is_accepted:
            return Instruction(
                self.tr("Accepted"), self.tr("You can put the pen down.")
            )
        if view.verdict is not None:
            return self._next_step(view, view.verdict)
        if state.phase is Phase.VERDICT:
            return Instruction(instruction.short)  # the banner has the reason
        if view.is_away and state.pause is Pause.BY_USER:
            hint = self.tr("Return to the step Swing at the computer to continue.")
            return Instruction(instruction.short, hint)
        if view.has_fault and state.pause is Pause.BY_USER:
            hint = self.tr(
                "An image could not be recorded (see the message at the top). "
                "Correct the cause, then press Space."
            )
            return Instruction(instruction.short, hint)
        if message.code == Code.SOLVING and view.setup.is_recording:
            return Instruction(instruction.short, self.tr("Computing the tip"))
        if message.code == Code.SHOW_PEN and view.is_simulated:
            hint = self.tr("Let the simulated operator swing.")
            return Instruction(instruction.short, hint)
        if message.code == Code.FOLLOW_ARROW and state.target and heading is not None:
            instruction = lean_phrase(state.target, view.posture, heading)
        if message.code != Code.TIP_SLIPPED and (slip := _slip_text(state)):
            return replace(instruction, hint=slip)
        if view.setup.is_press_test and message.code in PRESSED:
            hint = self.tr("Press test: press the tip firmly into the cone.")
            return replace(instruction, hint=hint)
        return instruction

    def _next_step(self, view: SwingViewState, verdict: Verdict) -> Instruction:
        steps = {
            Grade.PASS: self.tr("Done"),
            Grade.CHECK: self.tr("Check needed"),
            Grade.REPEAT: self.tr("Repeat swing"),
        }
        step, is_recording = steps[verdict.grade], view.setup.is_recording
        can_go_on = verdict.next_step is NextStep.CAPTURE_MORE and not is_recording
        if not verdict.can_be_accepted and can_go_on:
            step = self.tr("Capture more")
        if view.is_away and is_recording:
            hint = self.tr("Continue at the computer.")
        elif view.is_away:
            hint = self.tr("Put the pen down. Continue at the computer.")
        elif is_recording:
            hint = self.tr("Continue with the review.")
        else:
            hint = self.tr("Hold the pen upright and still for 3 s to see the review.")
        return Instruction(step, hint)

    def _no_images(self) -> Instruction:
        return Instruction(
            self.tr("No images"),
            self.tr(
                "The camera sends no images. No data is lost. The swing continues "
                "automatically when images are received."
            ),
        )

    def _banner(self, view: SwingViewState) -> State:
        state = view.state
        word, (sign, tone) = phase_text(state.phase, state.pause), _LOOKS[state.phase]
        fraction = None
        if view.lacks_images:
            return State(self.tr("NO IMAGES"), "", Sign.CROSS, Tone.BAD)
        if view.is_unsolved:
            word, sign, tone = self.tr("STOPPED"), Sign.PAUSE, Tone.WARN
        elif state.phase is Phase.SOLVING:
            fraction = view.solving
        elif state.phase is Phase.COUNTDOWN:
            fraction = min((state.time - state.since) / COUNTDOWN, 1.0)
        elif state.phase is Phase.CAPTURING and view.setup.is_recording:
            word, tone = self.tr("READING"), Tone.ACTIVE
        elif state.phase is Phase.CAPTURING and has_just_slipped(state):
            word, sign, tone = self.tr("TIP SLIPPED"), Sign.WARNING, Tone.BAD
        elif state.phase is Phase.CAPTURING and state.message.code in FLAWS:
            word, sign, tone = self.tr("NOT SAVED"), Sign.WARNING, Tone.WARN
        elif state.phase is Phase.VERDICT:
            return self._verdict(view)
        # What the last image shows is no news beside the pen being lost.
        seen = "" if state.pause is Pause.LOST else view.seen
        return State(word, seen, sign, tone, fraction)

    def _verdict(self, view: SwingViewState) -> State:
        if view.verdict is None:
            return State(
                phase_text(Phase.VERDICT),
                phrase(view.state.message, view.state.heading).hint,
                *_LOOKS[Phase.VERDICT],
            )
        if view.is_accepted:
            instruction = accepted_phrase(view.origin)
            words = instruction.hint or self.tr("The tip is now in use.")
            return State(instruction.short, words, *GRADE_MARKS[view.verdict.grade])
        instruction = phrase(view.verdict.reason, view.state.heading)
        grade = view.verdict.grade
        sign, tone = GRADE_MARKS[grade]
        word = grade_text(grade)
        fraction = view.stillness if view.asks_upright else 0.0
        return State(word, instruction.hint, sign, tone, fraction or None)

    def _count(self, view: SwingViewState) -> str:
        state, n_kept = view.state, view.state.n_kept
        if state.phase is Phase.COUNTDOWN:
            return str(state.message.values["seconds"])
        if state.phase in ENDED:
            return n_images_text(n_kept)
        if view.setup.is_recording:
            return self._read(view)
        if not isfinite(state.kept.uncertainty):
            least = view.setup.limits.min_images
            return self.tr("{0} of {1} (minimum)").format(n_kept, least)
        words = self.tr("{0} of about {1} images")
        return words.format(n_kept, view.n_in_all)

    def _read(self, view: SwingViewState) -> str:
        """Return the progress of reading a recording; empty before the first image."""
        progress = view.state.progress
        if not progress.n_images:
            return ""
        words = self.tr("{0} of {1} images loaded")
        return words.format(progress.n_read, progress.n_images)

    def _time_left(self, view: SwingViewState) -> str:
        state, is_recording = view.state, view.setup.is_recording
        if view.time_left:
            return view.time_left
        is_on = state.phase is Phase.CAPTURING and not is_recording
        if not is_on or not isfinite(state.kept.uncertainty):
            return ""
        times = state.kept.times
        period = images_period(times[times > state.time - PACE_S])
        if period is None or view.lacks_images:
            return ""
        return time_left_text(view.short.n_more * period)

    def _keys(self, view: SwingViewState) -> str:
        if view.is_away:
            return ""
        if view.verdict is not None:
            return self.tr("Enter: review")
        if view.state.phase in ENDED:
            return ""
        if view.state.pause is Pause.BY_USER:
            return self.tr("Space: continue")
        return self.tr("Space: pause")


def _slip_text(state: SwingState) -> str:
    """Return what a slip cost for a while, although images are kept again."""
    at = state.slipped_at
    if state.phase is not Phase.CAPTURING or at is None:
        return ""
    if state.time - at >= SLIP_REPORTED:
        return ""
    n_dropped = state.n_dropped.get(Reason.SLIPPED, 0)
    said = phrase(message(Code.TIP_SLIPPED, n_dropped=n_dropped))
    return PARTED.join((said.short, said.hint))


def images_period(times: FloatArray) -> float | None:
    """Return the interval between images at times (N,), s; None for too few."""
    if len(times) < N_PACING:
        return None
    return float(times[-1] - times[0]) / (len(times) - 1)
