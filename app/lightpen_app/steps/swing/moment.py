"""What the operator is shown at one moment of a swing, as a value for the widgets."""

from dataclasses import dataclass, replace
from math import isfinite

from PySide6.QtCore import QObject

from lightpen.cameras.worker import Connection
from lightpen.estimation.verdict import Grade, NextStep, Verdict
from lightpen.messages import SHOW_PEN, Code
from lightpen.model.origin import Origin
from lightpen.model.posture import Posture, posture_of
from lightpen.sentences import Sentence
from lightpen.simulator.follower import FIRST_LEAN
from lightpen.swing.rules import COUNTDOWN, has_just_slipped
from lightpen.swing.shortfall import Shortfall, turn_range
from lightpen.swing.state import Pause, Phase, SwingSetup, SwingState
from lightpen_app.look.grades import GRADE_MARKS
from lightpen_app.look.phrases import (
    Phrase,
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
from lightpen_app.widgets.operator_view import OperatorValue
from lightpen_app.widgets.posture_dial import DialValue
from lightpen_app.widgets.state_banner import State

ENDED = (Phase.SOLVING, Phase.VERDICT)
FLAWS = (Code.FEW_LEDS, Code.TOO_FAST, Code.BAD_FIT)  # images that are not kept
UPRIGHT = Posture(tilt=0.0, direction=0.0, turn=0.0)

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


@dataclass(frozen=True, eq=False)
class Moment:
    """All that decides what is shown.

    Attributes
    ----------
    connection : Connection
        How the camera is.
    seen : str
        What the last image shows, a few words.
    is_troubled : bool
        Whether the swing was paused because an image could not be recorded.
    solving : float or None
        How far the tip is computed, 0 to 1; None while it is not.
    is_accepted : bool
        Whether the tip is in force.
    stillness : float
        How long the pen has been upright and still after the verdict: 1 is enough.
    origin : Origin or None
        What the images are of.
    is_simulated : bool
        Whether the pen is led by the mouse, so that it leans as the camera sees it.
    """

    setup: SwingSetup
    state: SwingState
    short: Shortfall
    connection: Connection = Connection.STREAMING
    seen: str = ""
    is_troubled: bool = False
    solving: float | None = None
    verdict: Verdict | None = None
    is_accepted: bool = False
    stillness: float = 0.0
    origin: Origin | None = None
    is_simulated: bool = False

    @property
    def lacks_images(self) -> bool:
        """Whether the swing waits for the camera."""
        streams = self.connection is Connection.STREAMING
        return not streams and self.state.phase not in ENDED

    @property
    def is_unsolved(self) -> bool:
        """Whether the tip could be computed, but is not being."""
        return self.state.phase is Phase.SOLVING and self.solving is None


class SwingWords(QObject):
    """Puts a moment of a swing into words, signs and numbers."""

    def operator_value(self, moment: Moment) -> OperatorValue:
        """Return what is shown, on the page and in the operator view."""
        told = self._told(moment)
        return OperatorValue(
            instruction=told.short,
            hint=told.hint,
            state=self._banner(moment),
            count=self._count(moment),
            fraction=_fraction(moment),
            dial=_dial(moment),
        )

    def waiting_value(
        self, refusal: Sentence | None, *, is_near: bool
    ) -> OperatorValue:
        """Return what is shown before there is a swing.

        Parameters
        ----------
        refusal : Sentence or None
            Why none can begin; None while images are waited for.
        is_near : bool
            Whether images come, so that a swing begins at any moment.
        """
        if is_near and refusal is None:
            told = phrase(SHOW_PEN)
            state = State(phase_text(Phase.WAIT), "", *_LOOKS[Phase.WAIT])
            return OperatorValue(told.short, told.hint, state, dial=DialValue())
        told = self._no_images()
        if refusal is not None:
            told = Phrase(self.tr("No swing"), worded(refusal))
        return OperatorValue(
            instruction=told.short,
            hint=told.hint,
            state=State(told.short, "", Sign.CROSS, Tone.BAD),
            dial=DialValue(),
        )

    def note(self, moment: Moment) -> str:
        """Return what the count leaves out: the limit, and what was of no use."""
        limit = moment.setup.limits.max_images
        text = self.tr("images kept, at most {0} are taken").format(limit)
        if moment.setup.is_recording:
            text = self.tr("recorded images")
        n_dropped = sum(moment.state.n_dropped.values())
        if n_dropped:
            text = self.tr("{0}; {1} dropped").format(text, n_dropped)
        return text

    def _told(self, moment: Moment) -> Phrase:
        state = moment.state
        message, heading = state.message, state.heading
        if moment.lacks_images and state.pause is Pause.BY_USER:
            hint = self.tr(
                "The camera sends none; nothing is lost. Press Space to go on when "
                "they come."
            )
            return replace(self._no_images(), hint=hint)
        if moment.lacks_images:
            return self._no_images()
        if moment.is_unsolved:
            return Phrase(
                self.tr("Not computed"),
                self.tr("The images are kept. Compute the tip again, or start over."),
            )
        told = phrase(message, heading)
        if moment.is_accepted:
            return Phrase(self.tr("Accepted"), self.tr("Put the pen down."))
        if moment.verdict is not None:
            is_recording = moment.setup.is_recording
            return self._next_step(moment.verdict, is_recording=is_recording)
        if moment.is_troubled and state.pause is Pause.BY_USER:
            hint = self.tr(
                "An image could not be recorded; the notice at the top says why. Mend "
                "it, then press Space."
            )
            return Phrase(told.short, hint)
        if message.code == Code.SHOW_PEN and moment.is_simulated:
            hint = self.tr(
                "Let the simulated operator swing; or press Seat, and lean the pen by "
                "dragging the dial."
            )
            return Phrase(told.short, hint)
        if message.code == Code.FOLLOW_ARROW and state.target and heading is not None:
            return lean_phrase(state.target, _posture(moment), heading)
        return told

    def _next_step(self, verdict: Verdict, *, is_recording: bool) -> Phrase:
        steps = {
            Grade.PASS: self.tr("Done"),
            Grade.CHECK: self.tr("Look at it"),
            Grade.REPEAT: self.tr("Repeat the swing"),
        }
        step = steps[verdict.grade]
        can_go_on = verdict.next_step is NextStep.CAPTURE_MORE and not is_recording
        if not verdict.can_be_accepted and can_go_on:
            step = self.tr("Capture more")
        hint = self.tr("Hold the pen upright and still for 3 s to see the review.")
        return Phrase(step, "" if is_recording else hint)

    def _no_images(self) -> Phrase:
        return Phrase(
            self.tr("No images"),
            self.tr(
                "The camera sends none. The swing goes on by itself as soon as they "
                "come; nothing is lost."
            ),
        )

    def _banner(self, moment: Moment) -> State:
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
            word, sign, tone = self.tr("NOT KEPT"), Sign.WARNING, Tone.WARN
        elif state.phase is Phase.VERDICT:
            return self._verdict(moment)
        return State(word, moment.seen, sign, tone, fraction)

    def _verdict(self, moment: Moment) -> State:
        if moment.verdict is None:
            return State(
                phase_text(Phase.VERDICT),
                phrase(moment.state.message, moment.state.heading).hint,
                *_LOOKS[Phase.VERDICT],
            )
        if moment.is_accepted:
            told = accepted_phrase(moment.origin)
            words = told.hint or self.tr("The tip is used from now on.")
            return State(told.short, words, *GRADE_MARKS[moment.verdict.grade])
        told = phrase(moment.verdict.reason, moment.state.heading)
        grade = moment.verdict.grade
        sign, tone = GRADE_MARKS[grade]
        word = grade_text(grade)
        return State(word, told.hint, sign, tone, moment.stillness or None)

    def _count(self, moment: Moment) -> str:
        state, n_kept = moment.state, moment.state.n_kept
        if state.phase is Phase.COUNTDOWN:
            return str(state.message.values["seconds"])
        if state.phase in ENDED:
            return n_images_text(n_kept)
        if moment.setup.is_recording:
            progress = state.progress
            if not progress.n_images:
                return ""
            words = self.tr("{0} of {1} read")
            return words.format(progress.n_read, progress.n_images)
        if not isfinite(state.kept.uncertainty):
            least = moment.setup.limits.min_images
            return self.tr("{0} of at least {1}").format(n_kept, least)
        total = n_kept + moment.short.n_more
        return self.tr("{0} of about {1}").format(n_kept, total)


def _fraction(moment: Moment) -> float | None:
    n_kept, progress = moment.state.n_kept, moment.state.progress
    match moment.state.phase:
        case Phase.VERDICT:
            return None
        case Phase.SOLVING:
            return moment.solving or 0.0
    if moment.setup.is_recording:
        return progress.n_read / max(progress.n_images, 1)
    return n_kept / max(n_kept + moment.short.n_more, 1)


def _posture(moment: Moment) -> Posture | None:
    sighting = moment.state.sighting
    if sighting is None:
        return None
    return posture_of(moment.setup.pen, sighting.rotation)


def _dial(moment: Moment) -> DialValue:
    state, wanted = moment.state, moment.short.wanted
    counts = state.counts
    is_capturing = state.phase is Phase.CAPTURING and not moment.lacks_images
    posture, target = _posture(moment), state.target if is_capturing else None
    if state.phase in ENDED or moment.lacks_images:
        posture = None
    if state.heading is None and not moment.setup.is_recording:
        # Nobody knows yet how the operator sees the pen lean; right is his own right.
        if posture is not None and not moment.is_simulated:
            posture = UPRIGHT
        target = FIRST_LEAN if is_capturing else None
    return DialValue(
        counts=counts[1:],
        needed=wanted[1:],
        n_upright=int(counts[0, 0]),
        n_upright_needed=int(wanted[0, 0]),
        posture=posture,
        target=target,
        turns=turn_range(moment.setup.pen, state.kept.rotations),
        heading=-(state.heading or 0.0),
    )
