"""Page state of the step Swing, computed from the status of the swing."""

from dataclasses import dataclass, replace
from enum import Enum, auto
from pathlib import Path

from PySide6.QtCore import QCoreApplication, QObject

from lightpen.cameras.protocol import Connection
from lightpen.swing.capture.guidance import Shortfall, measure_shortfall, missing
from lightpen.swing.capture.kept_images import AcceptedImages
from lightpen.swing.capture.rules import stillness
from lightpen.swing.capture.state import Pause, Phase, SwingEventKind
from lightpen.swing.status import SwingStatus
from lightpen.swing.workflow import SwingWorkflow
from lightpen_app.look.phrases import phrase
from lightpen_app.look.sounds import Sound
from lightpen_app.look.words import TimeLeft
from lightpen_app.steps.swing.view_state import LiveDetectionView, SwingViewState
from lightpen_app.steps.swing.words import SwingWords
from lightpen_app.widgets.bars import Question
from lightpen_app.widgets.operator_view import OperatorValue
from lightpen_app.widgets.page import MainAction
from lightpen_app.widgets.state_banner import StatusMessage
from lightpen_app.work.live_view import LiveView
from lightpen_app.work.swing_run import SwingRun

translate = QCoreApplication.translate

SOUNDS: dict[SwingEventKind, Sound] = {
    SwingEventKind.SEATED: Sound.SEATED,
    SwingEventKind.KEPT: Sound.KEPT,
    SwingEventKind.FIELD_FULL: Sound.FIELD_FULL,
    SwingEventKind.SLIPPED: Sound.LOST,
    SwingEventKind.LOST: Sound.LOST,
    SwingEventKind.CAPTURED: Sound.CAPTURED,
    SwingEventKind.DONE: Sound.DONE,
    SwingEventKind.FAILED: Sound.FAILED,
}


class SideAction(Enum):
    """Action of the button beside Start over."""

    OPEN_CAMERA = auto()
    TRY_AGAIN = auto()
    RESUME = auto()
    PAUSE = auto()
    STOP_COMPUTING = auto()
    COMPUTE = auto()
    CAPTURE_MORE = auto()


PAUSES = {SideAction.PAUSE, SideAction.RESUME}
COMMANDS = {
    SideAction.PAUSE: SwingWorkflow.pause,
    SideAction.RESUME: SwingWorkflow.resume,
    SideAction.STOP_COMPUTING: lambda workflow: workflow.solving.cancel(),
    SideAction.COMPUTE: lambda workflow: workflow.solving.solve(),
    SideAction.CAPTURE_MORE: SwingWorkflow.capture_more,
}


@dataclass(frozen=True, eq=False)
class SwingPageState:
    """Content of the page."""

    value: OperatorValue
    operator_value: OperatorValue
    note: str  # images that are not counted
    warning: StatusMessage
    is_verdict: bool
    is_capturing: bool
    has_fault: bool
    is_complete: bool
    main: MainAction
    side: SideAction
    why_not_side: str  # why the button beside Start over cannot be pressed
    knows_side: bool  # whether the operator may say that left and right are swapped


class SwingPresenter(QObject):
    """Computes the page state; counts images beside the swing."""

    def __init__(self, run: SwingRun, live: LiveView, parent: QObject) -> None:
        super().__init__(parent)
        self._run, self._live = run, live
        self._words = SwingWords(self)
        self._kept: AcceptedImages | None = None
        self._short: Shortfall | None = None  # of these images
        self.sight = LiveDetectionView(run, self)
        self.solved = 0.0  # how far the tip is computed, 0 to 1
        self._time_left = TimeLeft()
        self._timed: tuple[Path | None, Phase | None] = None, None

    def view_state(self, *, is_away: bool) -> SwingViewState | None:
        """Return the view state of the swing; None without one."""
        status = self._run.status
        state, setup = status.state, status.setup
        if state is None or setup is None:
            self._kept = self._short = None
            return None
        if self._short is None or state.kept is not self._kept:
            self._kept, self._short = state.kept, measure_shortfall(setup, state)
        view = SwingViewState(
            setup=setup,
            state=state,
            short=self._short,
            connection=self._live.worst_connection,
            seen=self.sight.words(),
            has_unfit_spots=self.sight.has_unfit_spots(),
            has_fault=status.has_fault,
            solving=self.solved if status.is_solving else None,
            verdict=status.verdict,
            is_accepted=status.result is not None,
            stillness=stillness(state) if state.phase is Phase.VERDICT else 0.0,
            origin=status.origin,
            is_simulated=self._live.operator is not None,
            is_away=is_away,
        )
        return replace(view, time_left=self._job_time_left(view))

    def _job_time_left(self, view: SwingViewState) -> str:
        """Return the time left of reading recorded images, or of the computation."""
        phase = view.state.phase
        timed = self._run.status.record_folder, phase
        if timed != self._timed:
            self._timed = timed
            self._time_left.restart()
        is_reading = phase is Phase.CAPTURING and view.setup.is_recording
        is_job = is_reading or view.solving is not None
        return self._time_left.text(view.fraction or 0.0) if is_job else ""

    def fraction_kept(self) -> float:
        """Return the fraction of accepted images, 0 to 1."""
        state, short = self._run.status.state, self._short
        if state is None or short is None:
            return 0.0
        return state.n_kept / max(state.n_kept + short.n_more, 1)

    def page_state(self, *, is_away: bool) -> SwingPageState:
        """Return the page state."""
        status, view = self._run.status, self.view_state(is_away=is_away)
        connection, words = self._live.worst_connection, self._words
        is_near = connection is Connection.STREAMING
        is_verdict = view is not None and view.state.phase is Phase.VERDICT
        if view is None:
            value = words.waiting_value(status.refusal, is_near=is_near)
            shown = words.resting_value() if is_away else value
        else:
            value = shown = words.operator_value(view)
            if is_verdict and not view.asks_upright:
                shown = replace(value, dial=None)
        return SwingPageState(
            value=value,
            operator_value=shown,
            note="" if view is None else words.note(view),
            warning=StatusMessage() if view is None else words.warning(view),
            is_verdict=is_verdict,
            is_capturing=status.is_capturing,
            has_fault=status.has_fault,
            is_complete=status.solution is not None,
            main=main_action(status),
            side=side_action(status, connection),
            why_not_side=why_not_more(status),
            knows_side=view is not None and view.knows_side,
        )


def main_action(status: SwingStatus) -> MainAction:
    """Return the present action of the main button."""
    state = status.state
    if state is None or status.is_capturing:
        has_images = state is not None and state.n_kept > 0
        why_not = translate("SwingPage", "No image captured yet")
        finish = translate("SwingPage", "Finish early")
        return MainAction(finish, "" if has_images else why_not, is_early=True)
    return MainAction(translate("SwingPage", "Review"), _why_no_review(status))


def _why_no_review(status: SwingStatus) -> str:
    if status.is_solving:
        return translate("SwingPage", "Computing the tip")
    if status.is_reading:
        return translate("SwingPage", "Swing in progress")
    if status.solution is not None or status.failure is not None:
        return ""
    return translate("SwingPage", "Tip not computed yet")


def side_action(status: SwingStatus, connection: Connection) -> SideAction:
    """Return the present action of the button beside Start over."""
    state = status.state
    if state is None or status.is_capturing:
        if connection is Connection.CLOSED:
            return SideAction.OPEN_CAMERA
        if state is None:
            return SideAction.TRY_AGAIN
        is_paused = state.pause is Pause.BY_USER
        return SideAction.RESUME if is_paused else SideAction.PAUSE
    if status.is_solving:
        return SideAction.STOP_COMPUTING
    is_unsolved = state.phase is Phase.SOLVING
    return SideAction.COMPUTE if is_unsolved else SideAction.CAPTURE_MORE


def side_text(action: SideAction) -> str:
    """Return the label of the button beside Start over."""
    texts = {
        SideAction.OPEN_CAMERA: translate("SwingPage", "Open the camera"),
        SideAction.TRY_AGAIN: translate("SwingPage", "Try again"),
        SideAction.RESUME: translate("SwingPage", "Continue (Space)"),
        SideAction.PAUSE: translate("SwingPage", "Pause (Space)"),
        SideAction.STOP_COMPUTING: translate("SwingPage", "Stop computing"),
        SideAction.COMPUTE: translate("SwingPage", "Compute again"),
        SideAction.CAPTURE_MORE: translate("SwingPage", "Capture more"),
    }
    return texts[action]


def why_not_more(status: SwingStatus) -> str:
    """Return why no more images can be captured after the verdict."""
    is_judged = status.state is not None and status.state.phase is Phase.VERDICT
    if is_judged and status.is_recording:
        return translate("SwingPage", "All recorded images are loaded.")
    return ""


def missing_text(status: SwingStatus) -> str:
    """Return the shortfall of the swing as messages."""
    state, setup = status.state, status.setup
    if state is None or setup is None:
        return ""
    return " ".join(phrase(each, state.heading).hint for each in missing(setup, state))


def unsaved_swing_text(status: SwingStatus) -> str:
    """Return the question before the window closes; empty if all is done."""
    state = status.state
    if state is None or state.phase is Phase.VERDICT or not state.n_kept:
        return ""
    text = translate(
        "SwingPage",
        "Swing not finished. The captured images ({0}) are saved; you can resume "
        "the swing at the next start.",
    )
    return text.format(state.n_kept)


def finish_question(status: SwingStatus) -> Question:
    """Return whether to finish though something is missing."""
    return Question(
        missing_text(status),
        translate("SwingPage", "Finish now"),
        translate("SwingPage", "Continue swinging"),
    )


def other_choices_question() -> Question:
    """Return the question whether to continue although the selection has changed."""
    return Question(
        translate(
            "SwingPage",
            "Settings were changed during this swing. The swing continues with its "
            "original files, names and limits.",
        ),
        translate("SwingPage", "Restart with new settings"),
        translate("SwingPage", "Continue this swing"),
    )


def start_over_question(status: SwingStatus) -> Question:
    """Return whether to abandon a swing and restart."""
    text = translate(
        "SwingPage",
        "Start over? The images of this swing ({0}) are set aside and remain on the "
        "disk.",
    )
    return Question(
        text.format(0 if status.state is None else status.state.n_kept),
        translate("SwingPage", "Restart swing"),
        translate("SwingPage", "Continue this swing"),
    )
