"""View of the step Review: the verdict, the result and its details."""

from functools import partial

from PySide6.QtWidgets import QTabWidget, QWidget
from typing_extensions import override

from lightpen.record.library.supervision import Signature
from lightpen.record.results.acceptance import takes_supervisor
from lightpen.swing.workflow import SwingWorkflow
from lightpen_app.face import Services, verify_step
from lightpen_app.look.layouts import (
    fill,
    horizontal_layout,
    set_stacked,
    vertical_layout,
)
from lightpen_app.look.theme import GRID, TextSize
from lightpen_app.steps.review.images_panel import ImagesPanel
from lightpen_app.steps.review.plots_panel import (
    MethodsPanel,
    PlotsPanel,
    ResidualsPanel,
    UncertaintyPanel,
)
from lightpen_app.steps.review.result_export import ResultTools
from lightpen_app.steps.review.result_panel import (
    ResultPanel,
    StatusMessageList,
    TipSummary,
)
from lightpen_app.steps.review.view_state import ReviewPageState, repeat_question
from lightpen_app.widgets.bars import (
    JobProgress,
    QuestionBar,
    ReasonBar,
    WithdrawalBar,
    usual_reasons,
)
from lightpen_app.widgets.controls import LazyWidget
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.fitting import (
    PageScroll,
    ResponsiveLayout,
    ShrinkingScrollContent,
)
from lightpen_app.widgets.state_banner import StateBanner
from lightpen_app.work.swing_run import SwingRun
from lightpen_app.work.workbench import Workbench


class DetailTabs(QTabWidget):
    """Shows the solution of a swing; hidden tabs are filled when they are shown."""

    def __init__(self, run: SwingRun, services: Services) -> None:
        super().__init__()
        self._run = run
        self.images = LazyWidget(ImagesPanel)
        self._residuals: LazyWidget[PlotsPanel] = LazyWidget(ResidualsPanel)
        self.methods: LazyWidget[PlotsPanel] = LazyWidget(MethodsPanel)
        u: LazyWidget[PlotsPanel] = LazyWidget(partial(UncertaintyPanel, services))
        self._panels = self.images, self._residuals, u, self.methods
        self._tab_of = {panel: PageScroll() for panel in self._panels}
        for panel, tab in self._tab_of.items():
            tab.setWidget(ShrinkingScrollContent(panel))
            self.addTab(tab, "")

        # Connections
        self.currentChanged.connect(self.fill)

    def fill(self) -> None:
        """Show the solution in the visible tab, or residuals without a solution."""
        has_failed = self._run.status.failure is not None
        residuals = self._tab_of[self._residuals]
        for tab in self._tab_of.values():
            self.setTabEnabled(self.indexOf(tab), tab is residuals or not has_failed)
        if has_failed:
            self.setCurrentWidget(residuals)
        for panel, tab in self._tab_of.items():
            if tab is self.currentWidget():
                self._show_solution(panel.content())

    def shut_down(self) -> None:
        """Cancel running jobs."""
        for panel in self._panels:
            content = panel.content_so_far()
            if content is not None:
                content.shut_down()

    def _show_solution(self, panel: ImagesPanel | PlotsPanel) -> None:
        solution, failure = self._run.status.solution, self._run.status.failure
        setup, residuals = self._run.status.setup, self._residuals.content_so_far()
        if panel.value() is not solution:
            limit = None if setup is None else setup.limits.max_uncertainty
            panel.set_value(solution, limit)
        if failure is not None and setup is not None and residuals is not None:
            residuals.set_failed(failure, setup.rig)


PATIENCE_MS = 300  # before the progress of a solution is shown


class ReviewView(ResponsiveLayout, Translated, QWidget):
    """Shows a solved swing: U, the tip and a sentence; all else in tabs."""

    # px; then tip and buttons are in the first tab, too
    narrow_below, low_below = 112 * GRID, 60 * GRID

    def __init__(self, workbench: Workbench, services: Services = ()) -> None:
        super().__init__()
        run, place = workbench.run, workbench.save_place
        self._selection, self._run = workbench.selection, run
        self._ask = run.runner.ask
        self._can_verify = bool(verify_step(services))

        # Widgets
        self._banner = StateBanner(TextSize.TITLE)
        self._banner.setMinimumHeight(self._banner.sizeHint().height())
        self._question, self._reason = QuestionBar(), ReasonBar()
        self._withdrawal = WithdrawalBar()
        self.solving = JobProgress(PATIENCE_MS)
        self._messages = StatusMessageList()
        self.result = ResultPanel()
        self._scroll = self.say(PageScroll(), self.tr("Result"))
        self._repeat = self.make_button(self.tr("Repeat swing"))
        self.capture_more = self.make_button(self.tr("Capture more"))
        self._accept = self.make_button(self.tr("Accept..."))
        self.verify = self.make_button(
            self.tr("Verify tip"),
            tip=self.tr(
                "Half a minute: leave the tip in the cone and lean the pen to six "
                "sides."
            ),
        )
        self._take_back = self.make_button(
            self.tr("Revoke acceptance..."),
            tip=self.tr(
                "Reinstate the previous result. Both results stay in the archive."
            ),
        )
        self.tools = ResultTools(run, place, services)
        self.tabs = self.say(DetailTabs(run, services), self.tr("Details"))
        self.summary, self._first, self._buttons = TipSummary(), QWidget(), QWidget()

        # Layout
        self._scroll.setWidget(self._first)
        self._first_box = vertical_layout(self._first, (self.result, 1))
        row = horizontal_layout(self._buttons, (self.tools, 3))
        self._button_rows = row
        others = horizontal_layout(row, (self._repeat, 1), (self.capture_more, 1))
        row.setStretchFactor(others, 2)
        fill(others, (self._accept, 1), (self.verify, 1), (self._take_back, 1))
        self._box = layout = vertical_layout(self, self._banner, self._question)
        fill(layout, self._reason, self._withdrawal, self.solving, self._messages)
        fill(layout, (self.tabs, 1))
        self.tabs.insertTab(0, self._scroll, "")
        names = (
            self.tr("Result"),
            self.tr("Images"),
            self.tr("Residuals"),
            self.tr("Uncertainty"),
            self.tr("Two-stage"),
        )
        self.say_items(self.tabs, names)
        self.tabs.setCurrentIndex(0)
        self._use_room()

        # Connections
        self._accept.clicked.connect(self._ask_reason)
        self._reason.given.connect(self._on_reason_given)
        self._repeat.clicked.connect(self.ask_to_repeat)
        self._take_back.clicked.connect(self._ask_to_revoke)
        self._withdrawal.given.connect(self._revoke)
        run.refused.connect(self._on_refused)
        self._reason.declined.connect(self.tabs.setFocus)
        self._withdrawal.declined.connect(self.tabs.setFocus)
        self._question.declined.connect(self.tabs.setFocus)

        self._refresh()

    def set_state(self, state: ReviewPageState) -> None:
        """Show the state of a swing."""
        self._banner.set_value(state.banner)
        self._messages.set_value(state.remarks)
        images = self.tabs.images.content_so_far()
        if images is not None:
            images.set_locked(state.why_locked)
        self.capture_more.set_why_not(
            state.why_not_more, self.tr("Adds images to this swing")
        )
        self._repeat.set_why_not(
            state.why_not_repeated, self.tr("Starts a new swing without these images")
        )
        self._accept.setVisible(state.takes_reason)
        self._accept.set_why_not(
            state.why_not_accepted, self.tr("Accept with a reason")
        )
        self.tools.set_why_not(state.why_not_saved)
        self.tools.set_report_why_not(state.why_not_printed)
        self.tools.set_press_why_not(state.why_not_pressed)
        for button in (self._repeat, self.capture_more):
            is_main = button.text() == state.main.text
            button.setVisible(not state.is_accepted and not is_main)
        self.verify.setVisible(state.is_accepted and self._can_verify)
        self._take_back.setVisible(state.is_accepted)

    def ask_to_repeat(self) -> None:
        """Ask whether to set the swing aside and repeat it."""
        discard = partial(self._ask, SwingWorkflow.discard)
        self._question.ask_about(repeat_question, discard)

    def _ask_reason(self) -> None:
        status = self._run.status
        if status.assessment is not None:
            supervision, station = self._selection.supervision, status.names.station
            of_supervisor = takes_supervisor(supervision, status.assessment, station)
            self._reason.ask(of_supervisor=of_supervisor)

    def _on_reason_given(self, reason: str, signature: Signature | None) -> None:
        self._ask(lambda workflow: workflow.solving.accept(reason, signature))

    def _ask_to_revoke(self) -> None:
        is_guarded = self._selection.supervision.is_guarded
        self._withdrawal.ask(of_supervisor=is_guarded)

    def _revoke(self, reason: str, signature: Signature | None) -> None:
        result = self._run.status.result
        if result is not None:
            operator = self._selection.preparation.names.operator
            self._ask(
                lambda workflow: workflow.solving.revoke(
                    result, operator, reason, signature
                )
            )

    def _on_refused(self) -> None:
        if self._run.status.result is None:
            self._reason.refuse()

    def end_questions(self) -> None:
        """Hide the question."""
        self._question.hide()
        self._reason.hide()
        self._withdrawal.hide()

    @override
    def _refresh(self) -> None:
        self._reason.set_words(
            self.tr("This result needs checking. Enter the reason for accepting it."),
            self.tr("Reason"),
            self.tr("Accept with reason"),
            self.tr("Do not accept"),
            usual_reasons(),
        )

    @override
    def _use_room(self) -> None:
        """Place tip and buttons around the tabs, or in the first of a small page."""
        is_small = self._room.is_narrow or self._room.is_low
        set_stacked(self._button_rows, self._room.is_narrow)
        box = self._first_box if is_small else self._box
        if box.indexOf(self.summary) >= 0:
            return
        around = self.result if is_small else self.tabs
        box.insertWidget(box.indexOf(around), self.summary)
        box.insertWidget(box.indexOf(around) + (not is_small), self._buttons)
        for each in (self.summary, self._buttons):
            each.show()
