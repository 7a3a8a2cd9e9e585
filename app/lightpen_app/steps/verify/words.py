"""What is said at one moment of a verification, as a value for the widgets."""

from dataclasses import dataclass

from PySide6.QtCore import QObject

from lightpen.cameras.worker_events import Connection
from lightpen.estimation.verdict import Grade
from lightpen.model.posture import posture_of
from lightpen.sentences import Sentence
from lightpen.verification.articulation import N_POSTURES, N_TOUCHES
from lightpen.verification.choices import TaskKind
from lightpen.verification.circle import MIN_ANGLE
from lightpen.verification.guidance import fraction_done, instruction
from lightpen.verification.session import (
    BROKEN_OFF,
    VISIT_TOUCHES,
    covered,
    rules_of,
)
from lightpen.verification.session_state import SessionSetup, SessionState, n_visits
from lightpen.verification.status import Reading, VerificationStatus
from lightpen.verification.touching import HELD_ENOUGH, TouchPhase
from lightpen_app.look.grades import GRADE_MARKS
from lightpen_app.look.phrases import Phrase, grade_text
from lightpen_app.look.sentences import worded
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import Tone
from lightpen_app.steps.verify.findings import dial_of, live_posture
from lightpen_app.widgets.operator_view import OperatorValue
from lightpen_app.widgets.posture_dial import DialValue
from lightpen_app.widgets.state_banner import State

WITH_POSTURES = TaskKind.FIXED_POINT, TaskKind.ARTICULATION, TaskKind.DRIFT


@dataclass(frozen=True, eq=False)
class VerifyMoment:
    """All that decides what is shown.

    Attributes
    ----------
    connection : Connection
        How the camera is.
    reading : float
        How much of the recorded images is read, 0 to 1.
    """

    status: VerificationStatus
    connection: Connection = Connection.STREAMING
    reading: float = 0.0


class VerifyWords(QObject):
    """Puts a moment of a verification into words, signs and numbers."""

    def operator_value(self, moment: VerifyMoment) -> OperatorValue:
        """Return what is shown, on the page and in the operator view."""
        told, status = self._told(moment), moment.status
        setup, state = status.setup, status.state
        value = OperatorValue(told.short, told.hint, self._banner(moment))
        if setup is None or state is None or status.task is None:
            return value
        return OperatorValue(
            instruction=told.short,
            hint=told.hint,
            state=value.state,
            count=self.count(setup, state),
            fraction=fraction_done(setup, state),
            keys=self._keys(status),
            dial=_dial(setup, state),
        )

    def _keys(self, status: VerificationStatus) -> str:
        is_paused = status.is_paused
        return self.tr("Space: go on") if is_paused else self.tr("Space: pause")

    def count(self, setup: SessionSetup, state: SessionState) -> str:
        """Return how much of the task at hand is touched."""
        choices, n_touches = setup.choices, len(state.touches)
        run, n_runs = len(state.runs) + 1, 1
        match state.task(setup):
            case TaskKind.FIXED_POINT:
                text = self.tr("{0} of {1} touches")
                return text.format(n_touches, choices.n_touches)
            case TaskKind.CIRCLE:
                text = self.tr("{0} of {1}\xb0")
                text = text.format(round(covered(state.touches)), round(MIN_ANGLE))
                n_runs = choices.n_runs
            case TaskKind.ARTICULATION:
                text = self.tr("{0} of {1} touches").format(n_touches, N_TOUCHES)
                n_runs = N_POSTURES
            case TaskKind.DRIFT:
                text = self.tr("{0} of {1} touches").format(n_touches, VISIT_TOUCHES)
                run = len(state.visits) + 1
                n_runs = max(n_visits(choices), run)
            case _:
                text = self.tr("{0} of 2 ends").format(n_touches)
                n_runs = choices.n_places
        if n_runs > 1:
            text = self.tr("{0}, run {1} of {2}").format(text, run, n_runs)
        return text

    def tab(self, kind: TaskKind, status: VerificationStatus) -> str:
        """Return the name of a task, and how far it is if it is to be done."""
        name = {
            TaskKind.FIXED_POINT: self.tr("Fixed point"),
            TaskKind.CIRCLE: self.tr("Ring"),
            TaskKind.LENGTH: self.tr("Length"),
            TaskKind.ARTICULATION: self.tr("Postures"),
            TaskKind.DRIFT: self.tr("Witness"),
        }[kind]
        found = None if status.state is None else status.state.found(kind)
        is_chosen = status.setup is None or kind in status.setup.choices.kinds
        if found is not None:
            far = grade_text(found.assessment.grade)
        elif not is_chosen:
            return name
        elif kind is status.task:
            far = self.tr("now")
        else:
            far = self.tr("to do")
        return self.tr("{0}: {1}").format(name, far)

    def _told(self, moment: VerifyMoment) -> Phrase:
        status = moment.status
        setup, state = status.setup, status.state
        if status.reading is Reading.IMAGES:
            hint = self.tr("The touches of recorded images are measured.")
            return Phrase(self.tr("Reading images"), hint)
        if status.refusal is not None:
            return Phrase(self.tr("Nothing to verify"), worded(status.refusal))
        if setup is None or state is None:
            return Phrase(self.tr("Wait"), self.tr("The tip in force is being read."))
        if status.assessment is not None and status.is_done:
            return Phrase(
                {
                    Grade.PASS: self.tr("Tip proven"),
                    Grade.CHECK: self.tr("Look at it"),
                    Grade.REPEAT: self.tr("Not proven"),
                }[status.assessment.grade],
                worded(status.assessment.next_step),
            )
        if moment.connection is not Connection.STREAMING:
            hint = self.tr(
                "The camera sends none. It goes on by itself as soon as they come."
            )
            return Phrase(self.tr("No images"), hint)
        if status.is_paused:
            return Phrase(self.tr("Paused"), self.tr("Press Space to go on."))
        return Phrase(self._short(setup, state), worded(instruction(setup, state)))

    def _short(self, setup: SessionSetup, state: SessionState) -> str:
        """Return in a few words what to do."""
        task, touching = state.task(setup), state.touching
        if touching.phase is TouchPhase.HOLDING and len(touching.held) >= HELD_ENOUGH:
            return self.tr("Hold still")
        if touching.phase is TouchPhase.KNOWN:
            return self.tr("Touched before")
        if state.trouble is not None:
            return self._trouble(state.trouble)
        is_next = touching.phase is TouchPhase.TAKEN and bool(state.touches)
        match task:
            case TaskKind.FIXED_POINT:
                another = self.tr("Lean another way")
                return another if is_next else self.tr("Touch the cone")
            case TaskKind.CIRCLE:
                another = self.tr("Next point")
                return another if is_next else self.tr("Touch the ring")
            case TaskKind.ARTICULATION:
                again = self.tr("Lift, touch again")
                other = self.tr("Another posture") if state.runs else ""
                return again if is_next else other or self.tr("Touch the cone")
            case TaskKind.DRIFT:
                again = self.tr("Lift, touch again")
                return again if is_next else self.tr("Touch the cone upright")
            case _:
                another = self.tr("The other end")
                return another if is_next else self.tr("Touch one end")

    def _trouble(self, trouble: Sentence) -> str:
        if trouble.code == BROKEN_OFF.code:
            return self.tr("Not taken")
        return self.tr("Not counted")

    def _banner(self, moment: VerifyMoment) -> State:
        status = moment.status
        setup, state, task = status.setup, status.state, status.task
        if status.reading is Reading.IMAGES:
            word = self.tr("READING")
            return State(word, "", Sign.WAIT, Tone.ACTIVE, moment.reading)
        if status.refusal is not None:
            return State(self.tr("NOT POSSIBLE"), "", Sign.CROSS, Tone.BAD)
        if setup is None or state is None:
            return State(self.tr("READING"), "", Sign.WAIT, Tone.ACTIVE)
        if task is None and status.assessment is not None:
            grade = status.assessment.grade
            why = worded(status.assessment.reason)
            return State(grade_text(grade), why, *GRADE_MARKS[grade])
        if moment.connection is not Connection.STREAMING:
            return State(self.tr("NO IMAGES"), "", Sign.CROSS, Tone.BAD)
        if status.is_paused:
            return State(self.tr("PAUSED"), "", Sign.PAUSE, Tone.WARN)
        assert task is not None
        touching = state.touching
        if touching.phase is TouchPhase.TAKEN:
            return State(self.tr("TAKEN"), "", Sign.CHECK, Tone.GOOD)
        if touching.phase is TouchPhase.KNOWN:
            return State(self.tr("TOUCHED BEFORE"), "", Sign.WARNING, Tone.WARN)
        if touching.phase is TouchPhase.HOLDING and len(touching.held) >= HELD_ENOUGH:
            fraction = touching.progress(rules_of(setup, task))
            return State(self.tr("HELD"), "", Sign.RECORD, Tone.ACTIVE, fraction)
        if state.trouble is not None:
            return State(self.tr("NOT TAKEN"), "", Sign.WARNING, Tone.WARN)
        if touching.n_lost or not (touching.held or touching.path):
            return State(self.tr("WAITING"), "", Sign.WAIT, Tone.QUIET)
        return State(self.tr("PEN SEEN"), "", Sign.EYE, Tone.ACTIVE)


def _dial(setup: SessionSetup, state: SessionState) -> DialValue | None:
    task = state.task(setup)
    if task not in WITH_POSTURES:
        return None
    pen = setup.instrument.pen
    before = state.visits if task is TaskKind.DRIFT else state.runs
    touched = [touch for run in (*before, state.touches) for touch in run]
    postures = [posture_of(pen, touch.rotation) for touch in touched]
    return dial_of(postures, live_posture(setup, state))
