"""The step Swing: from the seat to the verdict without a key."""

from collections.abc import Callable
from dataclasses import replace
from math import isfinite
from pathlib import Path

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QVBoxLayout, QWidget
from typing_extensions import override

from lightpen.cameras.worker_events import Connection
from lightpen.model.limits import SwingLimits
from lightpen.swing.kept_images import KeptImages
from lightpen.swing.preparation import SourceKind
from lightpen.swing.rules import stillness
from lightpen.swing.shortfall import Shortfall, measure_shortfall, missing
from lightpen.swing.state import Happening, Pause, Phase, SwingEvent, SwingState
from lightpen_app.look.phrases import lack_text, phrase
from lightpen_app.look.sounds import Sound, Sounds
from lightpen_app.look.theme import GRID
from lightpen_app.steps.page import MainAction, Page
from lightpen_app.steps.swing.face import SwingFace
from lightpen_app.steps.swing.hand_panel import HandPanel
from lightpen_app.steps.swing.live_sight import SwingSight
from lightpen_app.steps.swing.moment import Moment, SwingWords
from lightpen_app.steps.swing.to_go import ToGo
from lightpen_app.widgets.live_markers import live_markers
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.question_bar import Question, QuestionBar
from lightpen_app.widgets.sign_label import Remark
from lightpen_app.work.live_view import Shown
from lightpen_app.work.workbench import Workbench

SHOWING_MS = 50  # from a new state to what is shown; the states between make one
PLOTTING_MS = 40  # from one plot to the next

SOUNDS: dict[Happening, Sound] = {
    Happening.SEATED: Sound.SEATED,
    Happening.KEPT: Sound.KEPT,
    Happening.FIELD_FULL: Sound.FIELD_FULL,
    Happening.SLIPPED: Sound.LOST,
    Happening.LOST: Sound.LOST,
    Happening.CAPTURED: Sound.CAPTURED,
    Happening.DONE: Sound.DONE,
    Happening.FAILED: Sound.FAILED,
}


class SwingPage(Page):
    """Shows a swing and leads it; nothing on it must be pressed."""

    key = "swing"
    shows_images = True

    def __init__(
        self, workbench: Workbench, sounds: Sounds, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self._workbench, self._sounds = workbench, sounds
        self._run, self._live = self._workbench.run, self._workbench.live
        self._runner = self._run.runner
        self._sight = SwingSight(self._run, self)
        self._words = SwingWords(self)
        self._solved = 0.0  # how far the tip is computed
        self._measured: tuple[KeptImages, Shortfall] | None = None
        self._to_go: ToGo | None = None
        self._to_go_of: tuple[Path | None, SwingLimits] | None = None
        self._said: tuple[MainAction, bool] | None = None
        self._is_entered = False
        self._was_capturing = False
        self._was_troubled = False
        self._press_act: Callable[[], object] = self.toggle_pause
        self._on_yes: Callable[[], object] = self._runner.finish

        # Widgets
        self._act = PushButton()
        self._start_over = PushButton()
        self._face = SwingFace((self._act, self._start_over), self)
        self._hand = HandPanel(self._live, self)
        self._question = QuestionBar()
        self._showing = QTimer(self)
        self._showing.setSingleShot(True)
        self._showing.setInterval(SHOWING_MS)
        self._plotting = QTimer(self)
        self._plotting.setInterval(PLOTTING_MS)

        # Layout
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(GRID)
        layout.addWidget(self._question)
        layout.addWidget(self._face, 1)
        layout.addWidget(self._hand)

        # Connections
        self._run.changed.connect(self._on_run_changed)
        self._run.happened.connect(self._on_happened)
        self._workbench.verification.changed.connect(self._show_soon)
        self._run.progressed.connect(self._on_progressed)
        self._live.image_shown.connect(self._on_image_shown)
        self._live.connection_changed.connect(self._on_connection_changed)
        self._live.other_changed.connect(self._on_connection_changed)
        self._question.agreed.connect(self._on_question_agreed)
        self._act.clicked.connect(self._on_act_clicked)
        self._start_over.clicked.connect(self._on_start_over_clicked)
        self._face.dial.leaned.connect(self._hand.lean)
        self._hand.led_by_itself.connect(self._face.dial.forget_wish)
        self._showing.timeout.connect(self._show)
        self._plotting.timeout.connect(self._plot)

        self._retranslate()

    @override
    def title(self) -> str:
        return self.tr("Swing")

    @override
    def is_complete(self) -> bool:
        return self._run.status.solution is not None

    @override
    def why_closed(self) -> str:
        lacks = self._workbench.preparation.lacks()
        return lack_text(lacks[0]) if lacks and self._run.status.state is None else ""

    @override
    def main_action(self) -> MainAction:
        state = self._run.status.state
        if state is None or (self._run.status.is_capturing and not state.n_kept):
            why_not = self.tr("No image is kept yet.")
            return MainAction(self.tr("Finish early"), why_not)
        if self._run.status.is_capturing:
            return MainAction(self.tr("Finish early"))
        return MainAction(self.tr("Review"), self._why_no_review(state))

    @override
    def run_main_action(self) -> None:
        if not self._run.status.is_capturing:
            self.advance_requested.emit()
            return
        if self._missing():
            self._ask(self._finishing, self._runner.finish)
        else:
            self._runner.finish()

    @override
    def is_hands_free(self) -> bool:
        return True

    @override
    def toggle_pause(self) -> None:
        if self._run.status.is_paused_by_user:
            self._runner.resume()
        else:
            self._runner.pause()

    @override
    def first_control(self) -> QWidget:
        return self._face.dial  # no button: Space pauses, Enter goes on

    @override
    def entered(self) -> None:
        self._is_entered = True
        is_recording = self._workbench.preparation.source.kind == SourceKind.RECORDED
        if is_recording and self._run.status.state is None:
            self._workbench.open_camera()  # it begins with its first image
        self._runner.come()
        self._ask_about_choices()
        self._show()
        self._plotting.start()

    @override
    def left(self) -> None:
        self._plotting.stop()
        self._question.hide()
        self._is_entered = False
        self._runner.leave()
        self._show()

    @override
    def unsaved(self) -> str:
        state = self._runner.status.state  # also what the window was not told yet
        if state is None or state.phase is Phase.VERDICT or not state.n_kept:
            return ""
        return self.tr(
            "The swing is not finished. The images kept so far ({0}) are safe; it is "
            "offered again at the next start."
        ).format(state.n_kept)

    @override
    def shut_down(self) -> None:
        self._plotting.stop()
        self._showing.stop()

    @override
    def _retranslate(self) -> None:
        self._start_over.setText(self.tr("Start over"))
        self._start_over.setToolTip(
            self.tr("Set this swing aside and begin anew. Its images are kept.")
        )
        self._show()

    def _why_no_review(self, state: SwingState) -> str:
        if self._run.status.is_solving:
            return self.tr("The tip is being computed.")
        if self._run.status.is_reading:
            return self.tr("The swing goes on.")
        if self._run.status.solution is not None:
            return ""
        if state.phase is Phase.VERDICT and self._run.status.is_recording:
            return self.tr("There is no tip to review: choose other images.")
        if state.phase is Phase.VERDICT:
            return self.tr("There is no tip to review: capture more, or start over.")
        return self.tr("The tip is not computed yet.")

    def _missing(self) -> str:
        """Return what the swing lacks, in sentences."""
        state, setup = self._run.status.state, self._run.status.setup
        if state is None or setup is None:
            return ""
        lacks = missing(setup, state)
        return " ".join(phrase(each, state.heading).hint for each in lacks)

    def _moment(self) -> Moment | None:
        status = self._run.status
        state, setup = status.state, status.setup
        if state is None or setup is None:
            return None
        if self._measured is None or self._measured[0] is not state.kept:
            self._measured = state.kept, measure_shortfall(setup, state)
            self._count_to_go(self._measured[1].n_more)
        return Moment(
            setup=setup,
            state=state,
            short=self._measured[1],
            connection=self._live.worst_connection,
            seen=self._sight.words(),
            is_troubled=status.is_troubled,
            solving=self._solved if status.is_solving else None,
            verdict=status.verdict,
            is_accepted=status.result is not None,
            stillness=stillness(state) if state.phase is Phase.VERDICT else 0.0,
            origin=status.origin,
            is_simulated=self._live.operator is not None,
            is_away=not self._is_entered,
            to_go=self._to_go,
        )

    def _count_to_go(self, n_more: int) -> None:
        """Take the next estimate of how many images are to go."""
        status = self._run.status
        state, setup = status.state, status.setup
        assert state is not None
        assert setup is not None
        swing = status.record_folder, setup.limits
        if not isfinite(state.kept.uncertainty):  # nothing is told yet
            self._to_go = None
        elif self._to_go is None or swing != self._to_go_of:
            self._to_go = ToGo.first(n_more, state.n_kept)
        else:
            self._to_go = self._to_go.after(n_more, state.n_kept)
        self._to_go_of = swing

    def _ask(self, words: Callable[[], Question], on_yes: Callable[[], object]) -> None:
        self._on_yes = on_yes
        self._question.set_words(words)
        self._question.ask()

    def _finishing(self) -> Question:
        lacks = self._missing()
        return Question(lacks, self.tr("Finish now"), self.tr("Go on swinging"))

    def _with_other_choices(self) -> Question:
        return Question(
            self.tr(
                "Something else was chosen meanwhile. This swing goes on with the "
                "files, names and limits that it began with."
            ),
            self.tr("Start over with the new ones"),
            self.tr("Go on with this swing"),
        )

    def _starting_over(self) -> Question:
        state = self._run.status.state
        text = self.tr(
            "Begin anew? The images of this swing ({0}) are set aside; they stay on "
            "the disk."
        )
        return Question(
            text.format(0 if state is None else state.n_kept),
            self.tr("Begin anew"),
            self.tr("Go on with this swing"),
        )

    def _ask_about_choices(self) -> None:
        """Ask whether a swing goes on though something else was chosen meanwhile."""
        if not (self._is_entered and self._run.status.has_other_choices):
            return
        self._runner.keep_choices()
        self._ask(self._with_other_choices, self._start_anew)

    def _show_soon(self) -> None:
        if not self._showing.isActive():
            self._showing.start()

    def _show(self) -> None:
        """Show what is the case now, here and in the operator view."""
        moment = self._moment()
        if moment is None:
            is_near = self._live.worst_connection is Connection.STREAMING
            value = self._words.waiting_value(self._run.status.refusal, is_near=is_near)
            self._face.set_value(value)
            self._face.set_warning(Remark())
            self._face.set_stand(None)
            if not self._is_entered:
                value = self._words.resting_value()
        else:
            value = self._words.operator_value(moment)
            is_verdict = moment.state.phase is Phase.VERDICT
            self._face.set_value(value, self._words.note(moment), is_verdict=is_verdict)
            self._face.set_warning(self._words.warning(moment))
            self._face.set_stand(self._words.stand(moment))
            if is_verdict and not moment.asks_upright:
                value = replace(value, dial=None)
        if not self._workbench.verification.status.is_here:
            self.operator_value_changed.emit(value)
        self._face.dial.set_interactive(self._live.operator is not None)
        text, self._press_act = self._offered()
        self._act.setText(text)
        self._act.set_why_not(self._why_not_offered())
        if self._run.status.is_capturing is not self._was_capturing:
            self._was_capturing = self._run.status.is_capturing
            self._question.hide()
        if self._question.words():
            self._question.refresh()  # of what is missing there is less by now
            self._question.setVisible(bool(self._question.words()))
        said = self.main_action(), self.is_complete()
        if said != self._said:
            self._said = said
            self.changed.emit()

    def _offered(self) -> tuple[str, Callable[[], object]]:
        """Return what the button beside Start over does now."""
        state = self._run.status.state
        if state is None or self._run.status.is_capturing:
            if self._live.worst_connection is Connection.CLOSED:
                return self.tr("Open the camera"), self._try_again
            if state is None:
                return self.tr("Try again"), self._try_again
            if state.pause is Pause.BY_USER:
                return self.tr("Go on (Space)"), self.toggle_pause
            return self.tr("Pause (Space)"), self.toggle_pause
        if self._run.status.is_solving:
            return self.tr("Stop computing"), self._runner.cancel
        if state.phase is Phase.SOLVING:
            return self.tr("Compute again"), self._runner.solve
        return self.tr("Capture more"), self._runner.capture_more

    def _why_not_offered(self) -> str:
        status, state = self._run.status, self._run.status.state
        is_judged = state is not None and state.phase is Phase.VERDICT
        if is_judged and status.is_recording:
            return self.tr("All recorded images are read.")
        return ""

    def _plot(self) -> None:
        state, setup = self._run.status.state, self._run.status.setup
        if state is not None and setup is not None:
            self._face.plots().show_next(state, setup.limits.max_uncertainty)

    def _on_image_shown(self, shown: Shown) -> None:
        self._sight.take(shown)
        if self.isVisible():
            rings = (replace(ring, label="") for ring in live_markers(shown.seen))
            self._face.set_image(shown.half, shown.size, tuple(rings))
        self._show_soon()

    def _on_happened(self, event: SwingEvent) -> None:
        if event.what is Happening.CONFIRMED:
            if self.isVisible() and not self.main_action().why_not:
                self.advance_requested.emit()
            return
        moment = self._moment()
        progress = 0.0
        if moment is not None:
            n_kept = moment.state.n_kept
            progress = n_kept / max(n_kept + moment.short.n_more, 1)
        self._sounds.play(SOUNDS[event.what], progress)

    def _on_connection_changed(self, connection: Connection) -> None:
        if connection is Connection.LOST and self._run.status.is_capturing:
            self._sounds.play(Sound.LOST)
        self._show_soon()

    def _on_run_changed(self) -> None:
        is_troubled = self._run.status.is_troubled
        if is_troubled and not self._was_troubled:
            self._sounds.play(Sound.LOST)
        self._was_troubled = is_troubled
        self._ask_about_choices()
        self._show_soon()

    def _on_progressed(self, fraction: float) -> None:
        self._solved = fraction
        self._show_soon()

    def _on_question_agreed(self) -> None:
        self._on_yes()

    def _on_act_clicked(self) -> None:
        self._press_act()

    def _on_start_over_clicked(self) -> None:
        status = self._run.status
        if status.state is None or status.result is not None:
            self._start_anew()
            return
        self._ask(self._starting_over, self._start_anew)

    def _start_anew(self) -> None:
        lacks = self._workbench.preparation.lacks()
        if lacks:
            self.notice_raised.emit(lack_text(lacks[0]))
            return
        self._runner.start_over()
        self._face.dial.setFocus()  # Enter would begin anew again

    def _try_again(self) -> None:
        """Open the camera again, or begin where it was refused."""
        if self._live.worst_connection is Connection.CLOSED:
            self._workbench.open_camera()
        self._runner.try_again()
