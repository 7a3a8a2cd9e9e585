"""The step Swing: from the seat to the verdict without a key."""

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QWidget
from typing_extensions import override

from lightpen.cameras.protocol import Connection
from lightpen.swing.capture.state import SwingEvent, SwingEventKind
from lightpen.swing.preparation import SourceKind
from lightpen.swing.workflow import SwingWorkflow
from lightpen_app.face import Services, SimulatorControls, first_of
from lightpen_app.look.layouts import vertical_layout
from lightpen_app.look.phrases import first_missing
from lightpen_app.look.sounds import Sound, Sounds
from lightpen_app.steps.swing.page_state import (
    COMMANDS,
    PAUSES,
    SOUNDS,
    SideAction,
    SwingPresenter,
    finish_question,
    main_action,
    missing_text,
    other_choices_question,
    start_over_question,
    unsaved_swing_text,
)
from lightpen_app.steps.swing.view import SwingView
from lightpen_app.widgets.bars import QuestionBar
from lightpen_app.widgets.page import MainAction, Page
from lightpen_app.work.live_view import DisplayedImage
from lightpen_app.work.workbench import Workbench

SHOWING_MS = 50  # from a new state to its display; states in between are skipped
PLOTTING_MS = 40  # from one plot to the next


class SwingPage(Page):
    """Shows a swing and leads it; nothing on it must be pressed."""

    key = "swing"
    shows_images = True

    def __init__(
        self, workbench: Workbench, sounds: Sounds, services: Services = ()
    ) -> None:
        super().__init__()
        self._sounds, self._notices = sounds, workbench.notifications
        self._selection, self._run = workbench.selection, workbench.run
        self._live, self._camera = workbench.live, workbench.camera
        self._services, self._runner = tuple(services), self._run.runner
        self._presenter = SwingPresenter(self._run, self._live, self)
        self._shown = self._presenter.page_state(is_away=True)
        self._is_shown = False

        # Widgets
        self._view = SwingView(self)
        controls = first_of(services, lambda each: each.swing_controls())
        self._simulator = controls or SimulatorControls(self._live)
        self._question = QuestionBar()
        self._showing = QTimer(self, singleShot=True, interval=SHOWING_MS)
        self._plotting = QTimer(self, interval=PLOTTING_MS)

        # Layout
        vertical_layout(self, self._question, (self._view, 1), self._simulator)

        # Connections
        self._run.changed.connect(self._on_run_changed)
        self._run.happened.connect(self._on_happened)
        for each in services:
            each.changed.connect(self._show_soon)
        self._run.progressed.connect(self._on_progressed)
        self._live.image_shown.connect(self._on_image_shown)
        self._live.connection_changed.connect(self._on_connection_changed)
        self._live.other_changed.connect(self._on_connection_changed)
        self._view.side.clicked.connect(self._on_act_clicked)
        self._view.start_over.clicked.connect(self._on_start_over_clicked)
        self._view.swapped.clicked.connect(self._on_swapped_clicked)
        self._showing.timeout.connect(self._show)
        self._plotting.timeout.connect(self._plot)

        self._refresh()

    @override
    def is_complete(self) -> bool:
        return self._run.status.solution is not None

    @override
    def why_closed(self) -> str:
        return "" if self._run.status.state is not None else self._missing_input()

    @override
    def main_action(self) -> MainAction:
        return main_action(self._run.status)

    @override
    def run_main_action(self) -> None:
        if not self._run.status.is_capturing:
            self.advance_requested.emit()
        elif missing_text(self._run.status):
            self._question.ask_about(
                lambda: finish_question(self._run.status), self._finish
            )
        else:
            self._finish()

    @override
    def show_missing_input(self) -> None:
        if self._run.status.state is not None:
            self._simulator.invite()  # Enter, before there is an image to finish with

    @override
    def is_hands_free(self) -> bool:
        return True

    @override
    def toggle_pause(self) -> None:
        is_paused = self._run.status.is_paused_by_user
        self._runner.ask(SwingWorkflow.resume if is_paused else SwingWorkflow.pause)

    @override
    def first_control(self) -> QWidget:
        return self._view.dial  # no button: Space pauses, Enter continues

    @override
    def entered(self) -> None:
        self._is_shown = True
        is_recording = self._selection.preparation.source.kind == SourceKind.RECORDED
        if is_recording and self._run.status.state is None:
            self._camera.open()  # it begins with its first image
        self._runner.ask(lambda workflow: workflow.note_arrival())
        self._ask_about_choices()
        self._show()
        self._plotting.start()

    @override
    def left(self) -> None:
        self._plotting.stop()
        self._question.hide()
        self._is_shown = False
        self._runner.ask(lambda workflow: workflow.note_departure())
        self._show()

    @override
    def unsaved(self) -> str:
        return unsaved_swing_text(self._runner.status)  # newer than the window

    @override
    def shut_down(self) -> None:
        self._plotting.stop()
        self._showing.stop()

    @override
    def _refresh(self) -> None:
        self._show()

    def _missing_input(self) -> str:
        return first_missing(self._selection.preparation.missing_inputs())

    def _ask_about_choices(self) -> None:
        """Ask whether to continue a swing although the selection has changed."""
        if self._is_shown and self._run.status.has_other_choices:
            self._runner.ask(lambda workflow: workflow.keep_choices())
            self._question.ask_about(other_choices_question, self._start_anew)

    def _show_soon(self) -> None:
        if not self._showing.isActive():
            self._showing.start()

    def _show(self) -> None:
        before = self._shown
        self._shown = now = self._presenter.page_state(is_away=not self._is_shown)
        self._view.set_state(now)
        self._simulator.set_inviting(now.main.is_early)
        is_other = now.side is not before.side and {now.side, before.side} != PAUSES
        if is_other and self._view.side.hasFocus():
            self._view.dial.setFocus()  # Enter would run an action that was not shown
        if not any(each.is_here for each in self._services):
            self.operator_value_changed.emit(now.operator_value)
        if now.has_fault and not before.has_fault:
            self._sounds.play(Sound.LOST)
        if now.is_capturing is not before.is_capturing:
            self._question.hide()
        self._question.refresh()
        if (now.main, now.is_complete) != (before.main, before.is_complete):
            self.changed.emit()

    def _plot(self) -> None:
        state, setup = self._run.status.state, self._run.status.setup
        if state is not None and setup is not None:
            self._view.plots().show_next(state, setup.limits.max_uncertainty)

    def _on_image_shown(self, shown: DisplayedImage) -> None:
        self._presenter.sight.add_image(shown)
        if self.isVisible():
            self._view.set_image(shown)
        self._show_soon()

    def _on_happened(self, event: SwingEvent) -> None:
        if event.what is SwingEventKind.CONFIRMED:
            if self.isVisible() and not self.main_action().why_not:
                self.advance_requested.emit()
            return
        self._sounds.play(SOUNDS[event.what], self._presenter.fraction_kept())

    def _on_connection_changed(self, connection: Connection) -> None:
        if connection is Connection.LOST and self._run.status.is_capturing:
            self._sounds.play(Sound.LOST)
        self._show_soon()

    def _on_run_changed(self) -> None:
        self._ask_about_choices()
        self._show_soon()

    def _on_progressed(self, fraction: float) -> None:
        self._presenter.solved = fraction
        self._show_soon()

    def _on_act_clicked(self) -> None:
        side = self._shown.side
        if side is SideAction.OPEN_CAMERA:
            self._camera.open()
        self._runner.ask(COMMANDS.get(side, SwingWorkflow.try_again))

    def _finish(self) -> None:
        self._runner.ask(lambda workflow: workflow.finish())

    def _on_start_over_clicked(self) -> None:
        status = self._run.status
        if status.state is None or status.result is not None:
            self._start_anew()
        else:
            self._question.ask_about(
                lambda: start_over_question(self._run.status), self._start_anew
            )

    def _on_swapped_clicked(self) -> None:
        self._runner.ask(lambda workflow: workflow.forget_side())
        self._view.dial.setFocus()  # the button is no longer there

    def _start_anew(self) -> None:
        if why_not := self._missing_input():
            self._notices.notify(self.key, why_not)
            return
        self._runner.ask(lambda workflow: workflow.start_over())
        self._view.dial.setFocus()  # Enter would restart
