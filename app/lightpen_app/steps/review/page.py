"""The step Review: is the tip good, how sure is it, and what next."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from PySide6.QtCore import QSize, QTimer, Slot
from PySide6.QtWidgets import (
    QApplication,
    QBoxLayout,
    QHBoxLayout,
    QProgressBar,
    QVBoxLayout,
    QWidget,
)
from typing_extensions import override

from lightpen.estimation.verdict import Grade, NextStep
from lightpen.record.acceptance import takes_supervisor
from lightpen.record.assessment import Assessment
from lightpen.record.results import Result
from lightpen_app.look.theme import GRID, TextSize
from lightpen_app.steps.page import MainAction, Page
from lightpen_app.steps.review.detail_tabs import DetailTabs
from lightpen_app.steps.review.next_tips_control import NextTipsControl
from lightpen_app.steps.review.next_tips_row import NextTipsRow
from lightpen_app.steps.review.remark_list import RemarkList
from lightpen_app.steps.review.result_panel import Outcome, ResultPanel
from lightpen_app.steps.review.result_tools import ResultTools
from lightpen_app.steps.review.state_words import (
    next_step_text,
    remarks,
    review_state,
    step_of_file,
    unsaved_text,
    why_not_accepted,
    why_not_changed,
    why_not_now,
)
from lightpen_app.steps.review.taking_along import TakingAlong
from lightpen_app.widgets.page_scroll import PageScroll
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.question_bar import Question, QuestionBar
from lightpen_app.widgets.rearranged import Rearranged
from lightpen_app.widgets.reason_bar import ReasonBar
from lightpen_app.widgets.state_banner import StateBanner
from lightpen_app.work.save_place import SavePlace
from lightpen_app.work.workbench import Workbench

if TYPE_CHECKING:
    from lightpen_app.steps.review.images_panel import ImagesPanel

PATIENCE_MS = 300  # before the progress of a solution is shown
RESULT_WIDTH, LARGE_RESULT_WIDTH = 46 * GRID, 80 * GRID
ANY_WIDTH = 16777215  # QWIDGETSIZE_MAX
OF_FILES = (
    *(NextStep.CHECK_FILES, NextStep.CHECK_CAMERA),
    *(NextStep.CHECK_LEDS, NextStep.CHECK_RIG),
)


class ReviewPage(Rearranged, Page):
    """The step Review."""

    key = "review"
    narrow_below = 112 * GRID  # px; then it has the result in a tab
    vast_from = QSize(240 * GRID, 140 * GRID)  # px; then the result is larger

    def __init__(self, workbench: Workbench, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._workbench = workbench
        self._run = workbench.run
        self._assessed: Assessment | None = None
        self._told: tuple[object, ...] = ()
        self._result_shown: Result | None = None
        self._wants_more = self._repeats = self._to_next_tip = False
        self._place = SavePlace(workbench)
        self._on_yes: Callable[[], object] = self._repeat_swing

        # Widgets
        self._banner = StateBanner(TextSize.TITLE)
        self._banner.setMinimumHeight(self._banner.sizeHint().height())
        self._question = QuestionBar()
        self._reason = ReasonBar()
        self._progress = QProgressBar()
        self._cancel = PushButton()
        self._solving = QWidget()
        self._patience = QTimer(self)
        self._patience.setSingleShot(True)
        self._patience.setInterval(PATIENCE_MS)
        self._acceptance = QTimer(self)
        self._acceptance.setSingleShot(True)
        self._remarks = RemarkList()
        self._result = ResultPanel()
        self._scroll = PageScroll()
        self._repeat = PushButton()
        self._capture_more = PushButton()
        self._accept = PushButton()
        self._verify = PushButton()
        self._take_back = PushButton()
        self._tools = ResultTools()
        self._next_tips = NextTipsRow()
        self._next = NextTipsControl(workbench, self._next_tips)
        self._tabs = DetailTabs(self._run, self._place)
        self._result_side = QWidget()
        self._along = TakingAlong(self._run, self._place, self._tabs.pictures, self)

        # Layout
        self._arrange()

        # Connections
        self._run.changed.connect(self._on_run_changed)
        self._run.troubled.connect(self._on_run_troubled)
        self._run.progressed.connect(self._on_progressed)
        self._cancel.clicked.connect(self._run.runner.cancel)
        self._patience.timeout.connect(self._solving.show)
        self._acceptance.timeout.connect(self.changed)
        self._capture_more.clicked.connect(self._on_capture_more_clicked)
        self._repeat.clicked.connect(self._ask_to_repeat)
        self._verify.clicked.connect(self._on_verify_clicked)
        self._take_back.clicked.connect(self._ask_to_take_back)
        self._accept.clicked.connect(self._ask_reason)
        self._reason.given.connect(self._run.runner.accept)
        self._reason.declined.connect(self._tabs.setFocus)
        self._question.agreed.connect(self._on_question_agreed)
        self._question.declined.connect(self._tabs.setFocus)
        self._tabs.images_made.connect(self._on_images_made)
        self._tabs.saved.connect(self.status_changed)
        self._tabs.failed.connect(self.notice_raised)
        self._along.follow(self._tools)
        self._along.told.connect(self.status_changed)
        self._along.failed.connect(self.notice_raised)
        self._next.chosen.connect(self._on_next_tip_chosen)

        self._retranslate()

    @override
    def title(self) -> str:
        return self.tr("Review")

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
        has_tip = self._run.status.solution is not None
        return "" if has_tip else self.tr("Swing the pen first.")

    @override
    def main_action(self) -> MainAction:
        status = self._run.status
        if status.result is not None:
            # The second click of a double one must not go on at once.
            is_new = self._acceptance.isActive()
            why_not = self.tr("The tip is accepted.") if is_new else ""
            return MainAction(self.tr("Start the next calibration"), why_not)
        verdict, why_not = status.verdict, why_not_now(status)
        match None if verdict is None else verdict.next_step:
            case None | NextStep.ACCEPT:
                return MainAction(self.tr("Accept"), why_not, at_screen=True)
            case NextStep.CAPTURE_MORE if not status.is_recording:
                return MainAction(self.tr("Capture more"), why_not)
            case NextStep.SEE_TO_CAUSE:
                return MainAction(self.tr("Check the settings"), why_not)
            case step if step in OF_FILES:
                return MainAction(self.tr("Check the files"), why_not)
        return MainAction(self.tr("Repeat"), why_not)

    @override
    def run_main_action(self) -> None:
        status = self._run.status
        if status.result is not None:
            self._run.runner.abandon()
            self.step_requested.emit("start")
            return
        if status.verdict is None or why_not_now(status):
            return
        match status.verdict.next_step:
            case NextStep.ACCEPT:
                self._run.runner.accept()
            case NextStep.CAPTURE_MORE if not status.is_recording:
                self._on_capture_more_clicked()
            case NextStep.SEE_TO_CAUSE:
                self.step_requested.emit("start")
            case step if step in OF_FILES:
                self.step_requested.emit(step_of_file(status.verdict.reason))
            case _:
                self._ask_to_repeat()

    @override
    def first_control(self) -> QWidget:
        return self._tabs

    @override
    def entered(self) -> None:
        self._refresh()

    @override
    def unsaved(self) -> str:
        return unsaved_text(self._run.status)

    @override
    def shut_down(self) -> None:
        self._next.shut_down()
        self._along.shut_down()
        self._tabs.shut_down()

    @override
    def _retranslate(self) -> None:
        self._tabs.set_names(
            self.tr("Images"),
            self.tr("Residuals"),
            self.tr("Uncertainty"),
            self.tr("Two-stage"),
        )
        if self._room.is_narrow:
            self._tabs.setTabText(0, self.tr("Result"))
        self._scroll.setAccessibleName(self.tr("Result"))
        self._tabs.setAccessibleName(self.tr("Details"))
        self._progress.setAccessibleName(self.tr("Progress of the computation"))
        self._cancel.setText(self.tr("Cancel"))
        self._cancel.setToolTip(self.tr("Keep the last solution"))
        self._capture_more.setText(self.tr("Capture more"))
        self._repeat.setText(self.tr("Repeat"))
        self._accept.setText(self.tr("Accept..."))
        self._verify.setText(self.tr("Verify it"))
        self._verify.setToolTip(
            self.tr("Prove the tip in minutes by touching what is known.")
        )
        self._take_back.setText(self.tr("Take back..."))
        self._take_back.setToolTip(
            self.tr("Put the result before in force again; both are kept.")
        )
        self._reason.set_words(
            self.tr(
                "The tip is to be checked. Why is it accepted nevertheless? The reason "
                "is stored with it."
            ),
            self.tr("Reason"),
            self.tr("Accept with this reason"),
            self.tr("Do not accept"),
        )
        self._refresh_words()

    def _arrange(self) -> None:
        """Put all widgets in their places."""
        solving = QHBoxLayout(self._solving)
        solving.setContentsMargins(0, 0, 0, 0)
        solving.setSpacing(GRID)
        solving.addWidget(self._progress, 1)
        solving.addWidget(self._cancel)
        self._solving.hide()

        self._scroll.setWidget(self._result)
        buttons = QHBoxLayout()
        buttons.setSpacing(GRID)
        buttons.addWidget(self._repeat, 1)
        buttons.addWidget(self._capture_more, 1)
        buttons.addWidget(self._accept, 1)
        buttons.addWidget(self._verify, 1)
        buttons.addWidget(self._take_back, 1)
        below = QVBoxLayout()
        below.setSpacing(GRID)
        below.addWidget(self._tools)
        below.addLayout(buttons)
        below.addWidget(self._next_tips)
        below.addStretch(0)
        self._result_box = QBoxLayout(
            QBoxLayout.Direction.TopToBottom, self._result_side
        )
        self._result_box.setContentsMargins(0, 0, 0, 0)
        self._result_box.setSpacing(GRID)
        self._result_box.addWidget(self._scroll, 1)
        self._result_box.addLayout(below)

        self._columns = columns = QHBoxLayout()
        columns.setSpacing(2 * GRID)
        self._use_room()  # before the tabs: the order of the Tab key
        columns.addWidget(self._tabs, 1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(GRID)
        layout.addWidget(self._banner)
        layout.addWidget(self._question)
        layout.addWidget(self._reason)
        layout.addWidget(self._solving)
        layout.addWidget(self._remarks)
        layout.addLayout(columns, 1)

    @override
    def _use_room(self) -> None:
        """Put the result beside the tabs, or make it the first of a narrow page."""
        side, direction = self._result_side, QBoxLayout.Direction
        self._result.set_large(self._room.is_vast)
        if self._room.is_narrow:
            self._result_box.setDirection(direction.LeftToRight)
            side.setMinimumWidth(0)
            side.setMaximumWidth(ANY_WIDTH)
            self._tabs.insertTab(0, side, self.tr("Result"))
            self._tabs.setCurrentIndex(0)
        else:
            self._result_box.setDirection(direction.TopToBottom)
            is_vast = self._room.is_vast
            side.setFixedWidth(LARGE_RESULT_WIDTH if is_vast else RESULT_WIDTH)
            self._columns.insertWidget(0, side)
            if side.parentWidget() is not None:  # else it would be a window
                side.show()  # a tab that is not the current one is hidden

    def _lock(self, images: "ImagesPanel") -> None:
        goes_on = self.tr("The swing goes on.") if self._run.status.is_reading else ""
        images.set_locked(why_not_changed(self._run.status) or goes_on)

    @Slot()
    def _on_run_changed(self) -> None:
        status = self._run.status
        told = (
            *(status.solution, status.assessment, status.result),
            *(status.activity, status.is_capturing),
        )
        if told == self._told:
            return  # a swing that is captured changes twenty times a second
        self._told = told
        if status.result is not self._result_shown:
            self._result_shown = status.result
            self._next.follow(status.result)
            self._question.hide()
            self._reason.hide()
            self._acceptance.start(2 * QApplication.doubleClickInterval())
        if status.is_solving:
            self._progress.setValue(0)
            self._patience.start()
        else:
            self._patience.stop()
            self._solving.hide()
        self._take_solution()  # seen or not, so that all is known when it is
        if self.isVisible():
            self._refresh()
        self.changed.emit()
        if self._wants_more and not status.is_reading:
            self._wants_more = False
            if status.is_capturing:
                self.step_requested.emit("swing")
        if self._to_next_tip and status.result is None:
            self._to_next_tip = False
            self.step_requested.emit("swing")
        if self._repeats and status.solution is None:
            self._repeats = False
            self.step_requested.emit("swing")

    def _refresh(self) -> None:
        """Show what there is now."""
        self._take_solution()
        self._tabs.fill()
        self._refresh_words()

    def _take_solution(self) -> None:
        status = self._run.status
        assessment = status.assessment
        if assessment is self._assessed:
            return
        self._assessed = assessment
        self._question.hide()
        self._reason.hide()
        if status.solution is None or assessment is None:
            self._result.set_value(None)
        else:
            outcome = Outcome(status.solution, status.names, assessment)
            self._result.set_value(outcome)

    def _on_images_made(self, images: "ImagesPanel") -> None:
        self._lock(images)
        images.take_out_requested.connect(self._run.runner.take_out)
        images.put_back_requested.connect(self._run.runner.put_back)

    def _refresh_words(self) -> None:
        status = self._run.status
        self._banner.set_value(review_state(status))
        self._remarks.set_value(remarks(status, self._workbench.preparation.names))
        why_locked = why_not_changed(status)
        images = self._tabs.images()
        if images is not None:
            self._lock(images)
        all_read = ""
        if status.is_recording:
            all_read = self.tr("All recorded images are read.")
        self._capture_more.set_why_not(
            why_locked or all_read, self.tr("Add images to this swing")
        )
        self._repeat.set_why_not(why_locked, self.tr("Swing anew without these images"))
        is_doubted = status.verdict is not None and (
            status.verdict.grade is not Grade.PASS
        )
        self._accept.setVisible(is_doubted and status.result is None)
        self._accept.set_why_not(
            why_not_accepted(status), self.tr("Put it in force with a reason")
        )
        self._tools.set_why_not(
            self.tr("Swing the pen first.") if status.solution is None else ""
        )
        is_accepted, main = status.result is not None, self.main_action().text
        self._tools.set_paper_why_not(
            "" if is_accepted else self.tr("Accept the tip first: it is of the result.")
        )
        for button in (self._repeat, self._capture_more):
            button.setVisible(not is_accepted and button.text() != main)
        self._verify.setVisible(is_accepted)
        self._take_back.setVisible(is_accepted)

    def _on_progressed(self, fraction: float) -> None:
        self._progress.setValue(round(100 * fraction))

    def _on_capture_more_clicked(self) -> None:
        self._wants_more = True
        self._run.runner.capture_more()

    def _ask_to_repeat(self) -> None:
        self._ask(self._repeating, self._repeat_swing)

    def _repeating(self) -> Question:
        return Question(
            self.tr("Repeat the swing from the start? These images stay on the disk."),
            self.tr("Repeat"),
            self.tr("Go on with these"),
        )

    def _on_verify_clicked(self) -> None:
        self.step_requested.emit("verify")

    def _ask_reason(self) -> None:
        assessment = self._run.status.assessment
        supervision = self._workbench.supervision
        if assessment is not None:
            of_supervisor = takes_supervisor(supervision, assessment)
            self._reason.ask(of_supervisor=of_supervisor)

    def _ask_to_take_back(self) -> None:
        self._ask(self._taking_back, self._withdraw)

    def _taking_back(self) -> Question:
        return Question(
            self.tr(
                "Take this acceptance back? The result before is in force again; both "
                "are kept."
            ),
            self.tr("Take back"),
            self.tr("Leave it in force"),
        )

    def _ask(self, words: Callable[[], Question], on_yes: Callable[[], object]) -> None:
        self._on_yes = on_yes
        self._question.set_words(words)
        self._question.ask()

    def _on_question_agreed(self) -> None:
        self._on_yes()

    def _repeat_swing(self) -> None:
        self._repeats = True
        self._run.runner.set_aside()

    def _withdraw(self) -> None:
        result = self._run.status.result
        if result is not None:
            operator = self._workbench.preparation.names.operator
            self._run.runner.take_back(result, operator)

    def _on_next_tip_chosen(self) -> None:
        self._to_next_tip = True

    def _on_run_troubled(self) -> None:
        self._repeats = False
        if self._run.status.result is None:
            self._reason.refuse()
        images = self._tabs.images()
        if images is not None:
            images.forget_refused()
