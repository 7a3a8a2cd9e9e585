"""The step Review: the tip, its uncertainty, and the next step."""

from dataclasses import replace
from functools import partial

from PySide6.QtCore import QTimer, Slot
from PySide6.QtGui import QPaintEvent
from PySide6.QtWidgets import QApplication, QWidget
from typing_extensions import override

from lightpen.estimation.reports.verdict import Grade, NextStep
from lightpen.model.names import Method
from lightpen.record.results.acceptance import SwingAssessment
from lightpen.swing.status import SwingStatus
from lightpen.swing.workflow import SwingWorkflow
from lightpen_app.face import PressComparison, Services, first_of, verify_step
from lightpen_app.look.layouts import vertical_layout
from lightpen_app.steps.review.images_panel import ImagesPanel
from lightpen_app.steps.review.plots_panel import MethodsPanel
from lightpen_app.steps.review.result_panel import bending_message, reviewed_result
from lightpen_app.steps.review.view import ReviewView
from lightpen_app.steps.review.view_state import (
    OF_FILES,
    differs,
    next_step,
    next_step_text,
    returns_to_swing,
    review_action,
    review_page_state,
    step_of_file,
    unsaved_text,
    why_not_now,
)
from lightpen_app.widgets.page import MainAction, Page
from lightpen_app.work.workbench import Workbench

READING_MS = 1000  # from the first sight of a result to its acceptance, at least


class ReviewPage(Page):
    """The step Review."""

    key = "review"

    def __init__(self, workbench: Workbench, services: Services = ()) -> None:
        super().__init__()
        verify = verify_step(services)
        self._selection = workbench.selection
        self._run, self._ask = workbench.run, workbench.run.runner.ask
        self._shown = SwingStatus()

        # Widgets
        self._view = view = ReviewView(workbench, services)
        self._accepted = QTimer(self, singleShot=True)
        self._reading = QTimer(self, singleShot=True)
        self._methods: MethodsPanel | None = None
        self._painted: SwingAssessment | None = None  # since it is shown
        comparison = first_of(services, lambda each: each.press_comparison())
        self._press = comparison or PressComparison()
        self._library, self._now = workbench.library, workbench.around.now

        # Layout
        vertical_layout(self, view)

        # Connections
        notices = workbench.notifications
        self._run.changed.connect(self._on_run_changed)
        self._run.progressed.connect(view.solving.set_fraction)
        self._accepted.timeout.connect(self.changed)
        self._reading.timeout.connect(self.changed)
        cancel = partial(self._ask, lambda workflow: workflow.solving.cancel())
        view.solving.cancelled.connect(cancel)
        view.capture_more.clicked.connect(lambda: self._ask(SwingWorkflow.capture_more))
        view.verify.clicked.connect(lambda: self.step_requested.emit(verify))
        view.tabs.images.made.connect(self._on_images_made)
        view.tabs.methods.made.connect(self._on_methods_made)
        view.tools.set_can_press(self._press.is_here)
        view.tools.press_requested.connect(lambda: self._ask(SwingWorkflow.press))
        self._library.changed.connect(self._show_bending)
        self._press.compared.connect(view.result.set_bending)
        view.tools.message_sent.connect(notices.show_status)
        view.tools.failed.connect(partial(notices.notify, self.key))

        self._refresh()

    @override
    def lead(self) -> str:
        return next_step_text(self._run.status)

    @override
    def is_complete(self) -> bool:
        return self._run.status.result is not None

    @override
    def is_doubtful(self) -> bool:
        result = self._run.status.result
        return result is not None and result.grade != Grade.PASS

    @override
    def why_closed(self) -> str:
        status = self._run.status
        is_judged = status.solution is not None or status.failure is not None
        return "" if is_judged else self.tr("Swing the pen first.")

    @override
    def main_action(self) -> MainAction:
        # The second click of a double one must not continue at once.
        status, painted = self._run.status, self._painted
        is_read = painted is status.assessment and not self._reading.isActive()
        is_new = self._accepted.isActive()
        tip = self._next_tip()
        return review_action(status, is_new=is_new, is_read=is_read, next_tip=tip)

    @override
    def run_main_action(self) -> None:
        status = self._run.status
        if status.result is not None:
            if not self._next_tip():
                self.step_requested.emit("start")
            # this leads to the next swing
            self._ask(SwingWorkflow.abandon)
            return
        if why_not_now(status):
            return
        match next_step(status):
            case NextStep.ACCEPT:
                self._ask(lambda workflow: workflow.solving.accept())
            case NextStep.CAPTURE_MORE if not status.is_recording:
                self._ask(SwingWorkflow.capture_more)
            case NextStep.USE_PART:
                self._ask(lambda workflow: workflow.solving.use_part())
            case NextStep.REPORT_JOINT:
                self._report_by("joint")
            case NextStep.SEE_TO_CAUSE:
                self.step_requested.emit("start")
            case step if step in OF_FILES:
                verdict = status.verdict
                self.step_requested.emit(
                    "leds" if verdict is None else step_of_file(verdict.reason)
                )
            case _:
                self._view.ask_to_repeat()

    @override
    def first_control(self) -> QWidget:
        return self._view.tabs

    @override
    def entered(self) -> None:
        self._on_run_changed()
        self._show_all()

    @override
    def left(self) -> None:
        self._painted = None

    @override
    def paintEvent(self, event: QPaintEvent) -> None:
        super().paintEvent(event)
        assessment = self._run.status.assessment
        if assessment is not self._painted:
            self._painted = assessment
            self._reading.start(READING_MS)

    @override
    def unsaved(self) -> str:
        return unsaved_text(self._run.status)

    @override
    def shut_down(self) -> None:
        self._press.shut_down()
        self._view.tools.shut_down()
        self._view.tabs.shut_down()

    @Slot()
    def _on_run_changed(self) -> None:
        before, now = self._shown, self._run.status
        if not differs(before, now):
            return  # during capture, the status changes twenty times a second
        self._shown = now
        if now.result is not before.result:
            self._accepted.start(2 * QApplication.doubleClickInterval())
        if (now.result, now.assessment) != (before.result, before.assessment):
            self._view.end_questions()
        self._view.solving.set_running(now.is_solving)
        if (now.solution, now.pressed) != (before.solution, before.pressed):
            self._show_bending()
        self._press.follow(now)
        if now.assessment is not before.assessment:
            reviewed = reviewed_result(now)
            self._view.summary.set_value(reviewed)
            self._view.result.set_value(reviewed)  # also while hidden
        if self.isVisible():
            self._show_all()
        self.changed.emit()
        if self.isVisible() and returns_to_swing(before, now):
            self.step_requested.emit("swing")

    def _show_bending(self) -> None:
        """Show the bending that counts for the tip of the swing."""
        library, today = self._library.library, self._now().date()
        words = partial(bending_message, self._run.status, library, today)
        self._view.result.set_bending(words)

    def _show_all(self) -> None:
        """Show the current state."""
        self._view.tabs.fill()
        self._refresh()

    @override
    def _refresh(self) -> None:
        names = self._selection.preparation.names
        state = review_page_state(self._run.status, names, self.main_action())
        self._view.set_state(state)
        if self._methods is not None:
            self._methods.set_locked(state.why_locked)

    def _on_images_made(self, images: ImagesPanel) -> None:
        self._refresh()
        images.exclude_requested.connect(self._exclude)
        images.include_requested.connect(self._include)

    def _on_methods_made(self, methods: MethodsPanel) -> None:
        self._methods = methods
        self._refresh()
        methods.method_chosen.connect(self._report_by)

    def _report_by(self, method: Method) -> None:
        """Report this swing and later ones at the station by a method."""
        self._ask(lambda workflow: workflow.solving.report_by(method))
        chosen = replace(self._selection.preparation, method=method)
        self._selection.set_preparation(chosen)

    def _exclude(self, numbers: list[int]) -> None:
        self._ask(lambda workflow: workflow.solving.exclude(numbers))

    def _include(self, numbers: list[int]) -> None:
        self._ask(lambda workflow: workflow.solving.include(numbers))

    def _next_tip(self) -> str:
        """Return the tip that can be swung at once, as it is chosen by now."""
        now = self._selection.preparation
        return "" if now.missing_inputs() else now.names.tip
