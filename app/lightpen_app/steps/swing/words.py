"""The step Swing in words, signs and numbers."""

from dataclasses import replace
from math import ceil, isfinite

from PySide6.QtCore import QObject

from lightpen.arrays import FloatArray
from lightpen.estimation.contact.single_images import USUAL_SIGMA
from lightpen.estimation.reports.verdict import Grade, NextStep, Verdict
from lightpen.messages import Message, message
from lightpen.swing.capture.rules import COUNTDOWN, has_just_slipped
from lightpen.swing.capture.shortfall import out_of_reach
from lightpen.swing.capture.state import Pause, Phase
from lightpen.swing_messages import SHOW_PEN, Code
from lightpen_app.look.grades import GRADE_MARKS
from lightpen_app.look.phrases import (
    Instruction,
    accepted_phrase,
    grade_text,
    lean_phrase,
    n_images_text,
    phase_text,
    phrase,
)
from lightpen_app.look.sentences import worded
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import Tone
from lightpen_app.look.words import PARTED
from lightpen_app.steps.swing.view_state import ENDED, SwingViewState
from lightpen_app.widgets.operator_view import OperatorValue
from lightpen_app.widgets.pen_in_space import DisplayedPosture
from lightpen_app.widgets.posture_dial import DialValue
from lightpen_app.widgets.sign_label import StatusMessage
from lightpen_app.widgets.state_banner import State

PRESSED = (  # shown where the tip is to be pressed into the cone
    Code.SEAT_TIP,
    Code.SWING_TO_SEAT,
    Code.HOLD_STILL,
    Code.STARTS_IN,
    Code.FOLLOW_ARROW,
)
FLAWS = (Code.FEW_LEDS, Code.TOO_FAST, Code.BAD_FIT)  # images that are not kept
PACE_S, N_PACING = 15.0, 6  # last seconds and images for the remaining time
LONG_S = 90.0  # shown in minutes
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

    def operator_value(self, moment: SwingViewState) -> OperatorValue:
        """Return the content of page and operator view."""
        instruction = self._current_instruction(moment)
        return OperatorValue(
            instruction=instruction.short,
            hint=instruction.hint,
            state=self._banner(moment),
            count=self._count(moment),
            time_left=self._time_left(moment),
            fraction=moment.fraction,
            keys=self._keys(moment),
            dial=moment.dial,
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

    def note(self, moment: SwingViewState) -> str:
        """Return the text beside the count: time, limit and unused images."""
        text = self.tr("at most {0} images").format(moment.setup.limits.max_images)
        if moment.setup.is_recording:
            text = self._read(moment) if moment.state.phase in ENDED else ""
            text = text or self.tr("recorded images")
        elif moment.state.phase in ENDED:
            text = ""
        n_dropped = sum(moment.state.n_dropped.values())
        rejected = self.tr("{0} rejected").format(n_dropped) if n_dropped else ""
        parts = self._time_left(moment), text, rejected, self._why_more(moment)
        return PARTED.join(filter(None, parts))

    def _why_more(self, moment: SwingViewState) -> str:
        """Return why more images are to go than before."""
        is_counted = moment.state.phase is Phase.CAPTURING
        if not is_counted or moment.to_go is None or not moment.to_go.has_risen:
            return ""
        short = moment.short
        if short.n_for_uncertainty >= short.n_more:
            return self.tr("More images needed: U (k = 2) has increased")
        return self.tr("More images needed to complete the postures")

    def warning(self, moment: SwingViewState) -> StatusMessage:
        """Return a warning that no swing can resolve."""
        kept = moment.state.kept
        why = out_of_reach(moment.setup.limits, moment.state, moment.short)
        if len(kept) >= LEAST_JUDGED and kept.sigma > USUAL_SIGMA:
            why = message(Code.LEDS_MISFIT, sigma=kept.sigma, usual=USUAL_SIGMA)
        elif moment.has_unfit_spots and moment.state.phase in (Phase.WAIT, Phase.SEEN):
            n_leds = moment.setup.pen.n_leds
            why = message("diagnosis.spots-do-not-fit", n_needed=n_leds, n_leds=n_leds)
        is_asked = not moment.setup.is_recording
        if why is None or not is_asked or moment.state.phase is Phase.VERDICT:
            return StatusMessage()
        return StatusMessage.warning(worded(why))

    def pen_posture(self, moment: SwingViewState) -> DisplayedPosture | None:
        """Return the view of the pen in space; None if its tip is unknown."""
        pen, seat = moment.setup.pen, moment.state.kept.seat or moment.state.seat
        tip = pen.nominal_tip if seat is None else seat.tip_pen
        if tip is None:
            return None
        dial = moment.dial
        return DisplayedPosture(pen, tip, dial.posture, dial.target, dial.heading)

    def _current_instruction(self, moment: SwingViewState) -> Instruction:
        state = moment.state
        message, heading = state.message, state.heading
        if moment.lacks_images and state.pause is Pause.BY_USER:
            hint = self.tr(
                "The camera sends no images. No data is lost. Press Space to "
                "continue when images are received."
            )
            return replace(self._no_images(), hint=hint)
        if moment.lacks_images:
            return self._no_images()
        if moment.is_unsolved:
            return Instruction(
                self.tr("Not computed"),
                self.tr("The images are saved. Compute the tip again or start over."),
            )
        instruction = phrase(message, heading)
        if moment.is_accepted:
            return Instruction(
                self.tr("Accepted"), self.tr("You can put the pen down.")
            )
        if moment.verdict is not None:
            return self._next_step(moment, moment.verdict)
        if state.phase is Phase.VERDICT:
            return Instruction(instruction.short)  # the banner has the reason
        if moment.is_away and state.pause is Pause.BY_USER:
            hint = self.tr("Return to the step Swing at the computer to continue.")
            return Instruction(instruction.short, hint)
        if moment.has_fault and state.pause is Pause.BY_USER:
            hint = self.tr(
                "An image could not be recorded (see the message at the top). "
                "Correct the cause, then press Space."
            )
            return Instruction(instruction.short, hint)
        if message.code == Code.SOLVING and moment.setup.is_recording:
            return Instruction(instruction.short, self.tr("Computing the tip"))
        if message.code == Code.SHOW_PEN and moment.is_simulated:
            hint = self.tr(
                "Let the simulated operator swing; or press Seat and tilt the pen "
                "by dragging the dial."
            )
            return Instruction(instruction.short, hint)
        if message.code == Code.FOLLOW_ARROW and state.target and heading is not None:
            instruction = lean_phrase(state.target, moment.posture, heading)
        if moment.setup.is_press_test and message.code in PRESSED:
            hint = self.tr("Press test: press the tip firmly into the cone.")
            return replace(instruction, hint=hint)
        return instruction

    def _next_step(self, moment: SwingViewState, verdict: Verdict) -> Instruction:
        steps = {
            Grade.PASS: self.tr("Done"),
            Grade.CHECK: self.tr("Check needed"),
            Grade.REPEAT: self.tr("Repeat swing"),
        }
        step, is_recording = steps[verdict.grade], moment.setup.is_recording
        can_go_on = verdict.next_step is NextStep.CAPTURE_MORE and not is_recording
        if not verdict.can_be_accepted and can_go_on:
            step = self.tr("Capture more")
        if moment.is_away and is_recording:
            hint = self.tr("Continue at the computer.")
        elif moment.is_away:
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

    def _banner(self, moment: SwingViewState) -> State:
        state = moment.state
        word, (sign, tone) = phase_text(state.phase, state.pause), _LOOKS[state.phase]
        fraction = None
        if moment.lacks_images:
            return State(self.tr("NO IMAGES"), "", Sign.CROSS, Tone.BAD)
        if moment.is_unsolved:
            word, sign, tone = self.tr("STOPPED"), Sign.PAUSE, Tone.WARN
        elif state.phase is Phase.SOLVING:
            fraction = moment.solving
        elif state.phase is Phase.COUNTDOWN:
            fraction = min((state.time - state.since) / COUNTDOWN, 1.0)
        elif state.phase is Phase.CAPTURING and moment.setup.is_recording:
            word, tone = self.tr("READING"), Tone.ACTIVE
        elif state.phase is Phase.CAPTURING and has_just_slipped(state):
            word, sign, tone = self.tr("TIP SLIPPED"), Sign.WARNING, Tone.BAD
        elif state.phase is Phase.CAPTURING and state.message.code in FLAWS:
            word, sign, tone = self.tr("NOT SAVED"), Sign.WARNING, Tone.WARN
        elif state.phase is Phase.VERDICT:
            return self._verdict(moment)
        # What the last image shows is no news beside the pen being lost.
        seen = "" if state.pause is Pause.LOST else moment.seen
        return State(word, seen, sign, tone, fraction)

    def _verdict(self, moment: SwingViewState) -> State:
        if moment.verdict is None:
            return State(
                phase_text(Phase.VERDICT),
                phrase(moment.state.message, moment.state.heading).hint,
                *_LOOKS[Phase.VERDICT],
            )
        if moment.is_accepted:
            instruction = accepted_phrase(moment.origin)
            words = instruction.hint or self.tr("The tip is now in use.")
            return State(instruction.short, words, *GRADE_MARKS[moment.verdict.grade])
        instruction = phrase(moment.verdict.reason, moment.state.heading)
        grade = moment.verdict.grade
        sign, tone = GRADE_MARKS[grade]
        word = grade_text(grade)
        fraction = moment.stillness if moment.asks_upright else 0.0
        return State(word, instruction.hint, sign, tone, fraction or None)

    def _count(self, moment: SwingViewState) -> str:
        state, n_kept = moment.state, moment.state.n_kept
        if state.phase is Phase.COUNTDOWN:
            return str(state.message.values["seconds"])
        if state.phase in ENDED:
            return n_images_text(n_kept)
        if moment.setup.is_recording:
            return self._read(moment)
        if not isfinite(state.kept.uncertainty):
            least = moment.setup.limits.min_images
            return self.tr("{0} of {1} (minimum)").format(n_kept, least)
        words = self.tr("{0} of about {1} images")
        return words.format(n_kept, moment.remaining.n_in_all)

    def _read(self, moment: SwingViewState) -> str:
        """Return the progress of reading a recording; empty before the first image."""
        progress = moment.state.progress
        if not progress.n_images:
            return ""
        words = self.tr("{0} of {1} images loaded")
        return words.format(progress.n_read, progress.n_images)

    def _time_left(self, moment: SwingViewState) -> str:
        state, is_recording = moment.state, moment.setup.is_recording
        is_on = state.phase is Phase.CAPTURING and not is_recording
        if not is_on or not isfinite(state.kept.uncertainty):
            return ""
        times = state.kept.times
        period = images_period(times[times > state.time - PACE_S])
        if period is None or moment.lacks_images:
            return ""
        seconds = moment.n_more * period
        if seconds > LONG_S:
            return self.tr("about {0} min left").format(ceil(seconds / 60))
        return self.tr("about {0} s left").format(max(10 * ceil(seconds / 10), 10))

    def _keys(self, moment: SwingViewState) -> str:
        if moment.is_away:
            return ""
        if moment.verdict is not None:
            return self.tr("Enter: review")
        if moment.state.phase in ENDED:
            return ""
        if moment.state.pause is Pause.BY_USER:
            return self.tr("Space: continue")
        return self.tr("Space: pause")


def images_period(times: FloatArray) -> float | None:
    """Return the interval between images at times (N,), s; None for too few."""
    if len(times) < N_PACING:
        return None
    return float(times[-1] - times[0]) / (len(times) - 1)
