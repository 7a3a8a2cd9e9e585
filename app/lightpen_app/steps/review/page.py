"""The step Review: is the tip good, how sure is it, and what next."""

from dataclasses import replace

from PySide6.QtCore import QTimer, Slot
from PySide6.QtWidgets import (
    QApplication,
    QHBoxLayout,
    QProgressBar,
    QPushButton,
    QTabWidget,
    QVBoxLayout,
    QWidget,
)
from typing_extensions import override

from lightpen.estimation.verdict import (
    NextStep,
    Verdict,
)
from lightpen.local_time import local_time
from lightpen.record.results import Result
from lightpen.record.solving import Solution
from lightpen.swing.status import Activity
from lightpen_app.look.grades import GRADE_MARKS
from lightpen_app.look.phrases import grade_text, phrase
from lightpen_app.look.sentences import worded
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import GRID, TextSize, Tone
from lightpen_app.steps.page import MainAction, Page
from lightpen_app.steps.review.doubts import ReviewDoubts
from lightpen_app.steps.review.images_panel import ImagesPanel
from lightpen_app.steps.review.plots_panel import (
    MethodsPanel,
    PlotsPanel,
    ResidualsPanel,
    UncertaintyPanel,
)
from lightpen_app.steps.review.remark_list import RemarkList
from lightpen_app.steps.review.result_panel import Outcome, ResultPanel
from lightpen_app.widgets.page_scroll import PageScroll, Squeezed
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.question_bar import QuestionBar
from lightpen_app.widgets.rearranged import Rearranged
from lightpen_app.widgets.sign_label import Remark
from lightpen_app.widgets.state_banner import State, StateBanner
from lightpen_app.work.job import Job
from lightpen_app.work.workbench import Workbench

PATIENCE_MS = 300  # before the progress of a solution is shown
RESULT_WIDTH = 46 * GRID
TAB_WIDTH = 64 * GRID  # of the result in a tab


class ReviewPage(Rearranged, Page):
    """The step Review."""

    key = "review"
    narrow_below = 112 * GRID  # px; then it has the result in a tab

    def __init__(self, workbench: Workbench, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._workbench = workbench
        self._doubts = ReviewDoubts(self)
        self._run = workbench.run
        self._solution: Solution | None = None
        self._lookup: Job | None = None
        self._told: tuple[object, ...] = ()
        self._result_shown: Result | None = None
        self._wants_more = self._repeats = False

        # Widgets
        self._banner = StateBanner(TextSize.TITLE)
        self._banner.setMinimumHeight(self._banner.sizeHint().height())
        self._question = QuestionBar()
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
        self._images = ImagesPanel()
        self._panels: tuple[ImagesPanel | PlotsPanel, ...] = (
            self._images,
            ResidualsPanel(),
            UncertaintyPanel(),
            MethodsPanel(),
        )
        self._tabs = QTabWidget()
        self._tab_of = {panel: PageScroll() for panel in self._panels}
        for panel, tab in self._tab_of.items():
            tab.setWidget(Squeezed(panel))
            self._tabs.addTab(tab, "")
        self._result_side = QWidget()

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
        self._repeat.clicked.connect(self._question.ask)
        self._question.agreed.connect(self._on_repeat_agreed)
        self._question.declined.connect(self._repeat.setFocus)
        self._images.take_out_requested.connect(self._run.runner.take_out)
        self._images.put_back_requested.connect(self._run.runner.put_back)
        self._tabs.currentChanged.connect(self._fill_tab)
        for panel in self._panels:
            panel.saved.connect(self.status_changed)
            panel.failed.connect(self.notice_raised)

        self._retranslate()

    @override
    def title(self) -> str:
        return self.tr("Review")

    @override
    def lead(self) -> str:
        if self._run.status.result is not None:
            return self.tr("Next: start the next calibration, or close the program.")
        if self._run.status.verdict is None:
            return self.tr("Nothing is in force until it is accepted.")
        next_step = self._run.status.verdict.next_step
        text = worded(next_step.sentence)
        if next_step is NextStep.ACCEPT:
            text = self.tr("{0} The old one stays in force until then.").format(text)
        return text

    @override
    def is_complete(self) -> bool:
        return self._run.status.result is not None

    @override
    def why_closed(self) -> str:
        has_tip = self._run.status.solution is not None
        return "" if has_tip else self.tr("Swing the pen first.")

    @override
    def main_action(self) -> MainAction:
        if self._run.status.result is not None:
            # The second click of a double one must not go on at once.
            is_new = self._acceptance.isActive()
            why_not = self.tr("The tip is in force.") if is_new else ""
            return MainAction(self.tr("Start the next calibration"), why_not)
        return MainAction(self.tr("Accept"), self._why_not_accepted(), at_screen=True)

    @override
    def run_main_action(self) -> None:
        if self._run.status.result is not None:
            self._run.runner.abandon()
            self.step_requested.emit("start")
            return
        if self._why_not_accepted():
            return
        self._run.runner.accept()

    @override
    def first_control(self) -> QWidget:
        return self._tabs

    @override
    def entered(self) -> None:
        self._refresh()

    @override
    def unsaved(self) -> str:
        if self._run.status.solution is None or self._run.status.result is not None:
            return ""
        return self.tr(
            "The tip is not accepted. The swing is kept and offered again at the next "
            "start."
        )

    @override
    def shut_down(self) -> None:
        self._cancel_lookup()
        self._images.shut_down()

    @override
    def _retranslate(self) -> None:
        names = (
            self.tr("Images"),
            self.tr("Residuals"),
            self.tr("Uncertainty"),
            self.tr("Two-stage"),
        )
        for tab, name in zip(self._tab_of.values(), names, strict=True):
            self._tabs.setTabText(self._tabs.indexOf(tab), name)
        if self._room.is_narrow:
            self._tabs.setTabText(0, self.tr("Result"))
        self._scroll.setAccessibleName(self.tr("Result"))
        self._tabs.setAccessibleName(self.tr("Details"))
        self._progress.setAccessibleName(self.tr("Progress of the computation"))
        self._cancel.setText(self.tr("Cancel"))
        self._cancel.setToolTip(self.tr("Keep the last solution"))
        self._capture_more.setText(self.tr("Capture more"))
        self._repeat.setText(self.tr("Repeat"))
        self._question.set_words(
            self.tr("Repeat the swing from the start? These images stay on the disk."),
            self.tr("Repeat"),
            self.tr("Go on with these"),
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
        column = QVBoxLayout(self._result_side)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(GRID)
        column.addWidget(self._scroll, 1)
        column.addLayout(buttons)

        self._columns = columns = QHBoxLayout()
        columns.setSpacing(2 * GRID)
        self._use_room()  # before the tabs: the order of the Tab key
        columns.addWidget(self._tabs, 1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(GRID)
        layout.addWidget(self._banner)
        layout.addWidget(self._question)
        layout.addWidget(self._solving)
        layout.addWidget(self._remarks)
        layout.addLayout(columns, 1)

    @override
    def _use_room(self) -> None:
        """Put the result beside the tabs, or make it the first of a narrow page."""
        side = self._result_side
        if self._room.is_narrow:
            side.setFixedWidth(TAB_WIDTH)
            self._tabs.insertTab(0, side, self.tr("Result"))
            self._tabs.setCurrentIndex(0)
        else:
            side.setFixedWidth(RESULT_WIDTH)
            self._columns.insertWidget(0, side)
            if side.parentWidget() is not None:  # else it would be a window
                side.show()  # a tab that is not the current one is hidden

    def _why_not_accepted(self) -> str:
        if self._run.status.solution is None or self._run.status.verdict is None:
            return self.tr("Swing the pen first.")
        if self._run.status.is_solving or self._lookup is not None:
            return self.tr("The tip is being computed.")
        if self._run.status.is_reading:
            return self.tr("The swing goes on.")
        if self._run.status.activity is Activity.ACCEPTING:
            return self.tr("The result is being stored.")
        if not self._run.status.verdict.can_be_accepted:
            return self.tr("Not good enough: capture more images, or repeat the swing.")
        return ""

    @Slot()
    def _on_run_changed(self) -> None:
        status = self._run.status
        told = (
            *(status.solution, status.verdict, status.result),
            *(status.activity, status.is_capturing),
        )
        if told == self._told:
            return  # a swing that is captured changes twenty times a second
        self._told = told
        if status.result is not self._result_shown:
            self._result_shown = status.result
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
        if self._repeats and status.solution is None:
            self._repeats = False
            self.step_requested.emit("swing")

    def _refresh(self) -> None:
        """Show what there is now."""
        self._take_solution()
        self._fill_tab()
        self._refresh_words()

    def _take_solution(self) -> None:
        solution = self._run.status.solution
        if solution is not self._solution:
            self._solution = solution
            self._question.hide()
            self._look_up_last(solution)

    def _fill_tab(self) -> None:
        """Show the solution in the tab that is seen; the others wait until they are."""
        for panel, tab in self._tab_of.items():
            is_seen = tab is self._tabs.currentWidget()
            if is_seen and panel.value() is not self._solution:
                panel.set_value(self._solution)

    def _look_up_last(self, solution: Solution | None) -> None:
        """Show a solution as soon as the result before it is known."""
        self._cancel_lookup()
        shown = self._result.value()
        if solution is None:
            self._result.set_value(None)
            return
        if shown is not None and shown.solution.source.folder == solution.source.folder:
            self._result.set_value(replace(shown, solution=solution))
            return
        archive, names = self._run.archive, self._run.status.names
        self._lookup = job = Job(lambda _: archive.in_force(names.pen, names.tip), self)

        # Connections
        job.succeeded.connect(self._on_looked_up)
        job.failed.connect(self._on_lookup_failed)
        job.crashed.connect(self._on_looked_up)
        job.start()

    def _on_looked_up(self, last: Result | None = None) -> None:
        assert self._solution is not None
        self._lookup = None
        self._result.set_value(Outcome(self._solution, self._run.status.names, last))
        self._refresh_words()
        self.changed.emit()

    def _on_lookup_failed(self, sentence: str) -> None:
        self.notice_raised.emit(sentence)
        self._on_looked_up()

    def _cancel_lookup(self) -> None:
        if self._lookup is not None:
            self._lookup.cancel()
            self._lookup = None

    def _refresh_words(self) -> None:
        status = self._run.status
        self._banner.set_value(self._state())
        self._remarks.set_value(self._warnings())
        why_locked = ""
        if status.result is not None:
            why_locked = self.tr("The tip is accepted; start the next calibration.")
        elif status.solution is None:
            why_locked = self.tr("Swing the pen first.")
        goes_on = self.tr("The swing goes on.") if status.is_reading else ""
        self._images.set_locked(why_locked or goes_on)
        for button, step, what in (
            (
                self._capture_more,
                NextStep.CAPTURE_MORE,
                self.tr("Add images to this swing"),
            ),
            (
                self._repeat,
                NextStep.REPEAT,
                self.tr("Swing anew without these images"),
            ),
        ):
            button.set_why_not(why_locked, what)
            _recommend(button, not why_locked and _is_next(status.verdict, step))

    def _state(self) -> State:
        status = self._run.status
        if status.result is not None:
            since = f"{local_time(status.result.accepted):%Y-%m-%d %H:%M:%S}"
            text = self.tr("Since {0}. Earlier results are kept.").format(since)
            return State(self.tr("IN FORCE"), text, Sign.CHECK, Tone.GOOD)
        if status.verdict is None:
            text = self.tr("The tip shows here once the pen is swung.")
            return State(self.tr("NO TIP YET"), text, Sign.WAIT, Tone.QUIET)
        heading = None if status.state is None else status.state.heading
        said = phrase(status.verdict.reason, heading)
        sign, tone = GRADE_MARKS[status.verdict.grade]
        word = self.tr("{0}: {1}").format(grade_text(status.verdict.grade), said.short)
        return State(word, said.hint, sign, tone)

    def _warnings(self) -> tuple[Remark, ...]:
        outcome = self._result.value()
        if outcome is None:
            return ()
        texts = self._doubts.sentences(outcome, self._workbench.preparation.names)
        return tuple(Remark(text, Sign.WARNING, Tone.WARN) for text in texts)

    def _on_progressed(self, fraction: float) -> None:
        self._progress.setValue(round(100 * fraction))

    def _on_capture_more_clicked(self) -> None:
        self._wants_more = True
        self._run.runner.capture_more()

    def _on_repeat_agreed(self) -> None:
        self._repeats = True
        self._run.runner.set_aside()

    def _on_run_troubled(self) -> None:
        self._repeats = False


def _is_next(verdict: Verdict | None, step: NextStep) -> bool:
    return verdict is not None and verdict.next_step is step


def _recommend(button: QPushButton, recommended: bool) -> None:
    """Mark a button as the one to press next."""
    if button.property("recommended") != recommended:
        button.setProperty("recommended", recommended)
        button.style().unpolish(button)
        button.style().polish(button)
