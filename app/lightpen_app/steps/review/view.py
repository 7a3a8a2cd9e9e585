"""View of the step Review: the verdict, the result and its details."""

from PySide6.QtWidgets import QWidget
from typing_extensions import override

from lightpen_app.face import Services, export_formats, verify_step
from lightpen_app.look.layouts import (
    fill,
    horizontal_layout,
    set_stacked,
    vertical_layout,
)
from lightpen_app.look.theme import GRID, TextSize
from lightpen_app.steps.review.detail_tabs import DetailTabs
from lightpen_app.steps.review.message_list import StatusMessageList
from lightpen_app.steps.review.next_tips import NextTipsRow
from lightpen_app.steps.review.result_panel import ResultPanel, TipSummary
from lightpen_app.steps.review.result_tools import ResultTools
from lightpen_app.steps.review.view_state import ReviewPageState
from lightpen_app.widgets.job_progress import JobProgress
from lightpen_app.widgets.page_scroll import PageScroll
from lightpen_app.widgets.question_bar import QuestionBar
from lightpen_app.widgets.reason_bar import ReasonBar, usual_reasons
from lightpen_app.widgets.responsive_layout import ResponsiveLayout
from lightpen_app.widgets.state_banner import StateBanner
from lightpen_app.widgets.translated import Translated
from lightpen_app.widgets.withdrawal_bar import WithdrawalBar
from lightpen_app.work.save_place import SavePlace
from lightpen_app.work.swing_run import SwingRun

PATIENCE_MS = 300  # before the progress of a solution is shown


class ReviewView(ResponsiveLayout, Translated, QWidget):
    """Shows a solved swing: U, the tip and a sentence; all else in tabs."""

    # px; then tip and buttons are in the first tab, too
    narrow_below, low_below = 112 * GRID, 60 * GRID

    def __init__(
        self, run: SwingRun, place: SavePlace, services: Services = ()
    ) -> None:
        super().__init__()
        self._can_verify = bool(verify_step(services))

        # Widgets
        self._banner = StateBanner(TextSize.TITLE)
        self._banner.setMinimumHeight(self._banner.sizeHint().height())
        self.question, self.reason = QuestionBar(), ReasonBar()
        self.withdrawal = WithdrawalBar()
        self.solving = JobProgress(PATIENCE_MS)
        self._messages = StatusMessageList()
        self.result = ResultPanel()
        self._scroll = self.say(PageScroll(), self.tr("Result"))
        self.repeat = self.make_button(self.tr("Repeat swing"))
        self.capture_more = self.make_button(self.tr("Capture more"))
        self.accept = self.make_button(self.tr("Accept..."))
        self.verify = self.make_button(
            self.tr("Verify tip"),
            tip=self.tr(
                "Half a minute: leave the tip in the cone and lean the pen to six "
                "sides."
            ),
        )
        self.take_back = self.make_button(
            self.tr("Revoke acceptance..."),
            tip=self.tr(
                "Reinstate the previous result. Both results stay in the archive."
            ),
        )
        self.tools = ResultTools(export_formats(services))
        self.next_tips = NextTipsRow()
        self.tabs = self.say(DetailTabs(run, place), self.tr("Details"))
        self.summary, self._first, self._buttons = TipSummary(), QWidget(), QWidget()

        # Layout
        self._scroll.setWidget(self._first)
        self._first_box = vertical_layout(self._first, (self.result, 1))
        row = horizontal_layout(self._buttons, (self.tools, 3))
        self._button_rows = row
        others = horizontal_layout(row, (self.repeat, 1), (self.capture_more, 1))
        row.setStretchFactor(others, 2)
        fill(others, (self.accept, 1), (self.verify, 1), (self.take_back, 1))
        self._box = layout = vertical_layout(self, self._banner, self.question)
        fill(layout, self.reason, self.withdrawal, self.solving, self._messages)
        fill(layout, (self.tabs, 1), self.next_tips)
        self.tabs.insertTab(0, self._scroll, "")
        self.tabs.setCurrentIndex(0)
        self._use_room()

        # Connections
        self.reason.declined.connect(self.tabs.setFocus)
        self.withdrawal.declined.connect(self.tabs.setFocus)
        self.question.declined.connect(self.tabs.setFocus)

        self._retranslate()

    def set_state(self, state: ReviewPageState) -> None:
        """Show the state of a swing."""
        self._banner.set_value(state.banner)
        self._messages.set_value(state.remarks)
        images = self.tabs.images()
        if images is not None:
            images.set_locked(state.why_locked)
        self.capture_more.set_why_not(
            state.why_not_more, self.tr("Adds images to this swing")
        )
        self.repeat.set_why_not(
            state.why_not_repeated, self.tr("Starts a new swing without these images")
        )
        self.accept.setVisible(state.takes_reason)
        self.accept.set_why_not(state.why_not_accepted, self.tr("Accept with a reason"))
        self.tools.set_why_not(state.why_not_saved)
        self.tools.set_report_why_not(state.why_not_printed)
        self.tools.set_press_why_not(state.why_not_pressed)
        for button in (self.repeat, self.capture_more):
            is_main = button.text() == state.main.text
            button.setVisible(not state.is_accepted and not is_main)
        self.verify.setVisible(state.is_accepted and self._can_verify)
        self.take_back.setVisible(state.is_accepted)

    def end_questions(self) -> None:
        """Hide the question."""
        self.question.hide()
        self.reason.hide()
        self.withdrawal.hide()

    @override
    def _retranslate(self) -> None:
        self.tabs.setTabText(0, self.tr("Result"))
        self.tabs.set_names(
            self.tr("Images"),
            self.tr("Residuals"),
            self.tr("Uncertainty"),
            self.tr("Two-stage"),
        )
        self.solving.set_cancel_tooltip(self.tr("Keep last solution"))
        self.reason.set_words(
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
