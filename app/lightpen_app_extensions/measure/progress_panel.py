"""Instruction, progress and buttons of a verification."""

from functools import partial
from pathlib import Path

from PySide6.QtGui import QKeySequence
from PySide6.QtWidgets import QProgressBar, QWidget
from typing_extensions import override

from lightpen_app.look.languages import worded
from lightpen_app.look.layouts import (
    fill,
    grid_layout,
    horizontal_layout,
    vertical_layout,
)
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.widgets.bars import Question, QuestionBar
from lightpen_app.widgets.controls import PushButton
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.fitting import (
    NO_ROOM,
    FittedText,
    PageScroll,
    ResponsiveLayout,
)
from lightpen_app.widgets.state_banner import StateBanner
from lightpen_app.widgets.tables import Figures, NumberTable
from lightpen_app.work.workbench import Workbench
from lightpen_app_extensions.measure.presenter import VerifyView
from lightpen_app_extensions.measure.service import VerificationRun
from lightpen_app_extensions.report.control import PrintReportControl
from lightpen_extensions.measure.measuring.report import ResultTable, points_table
from lightpen_extensions.measure.session import SessionSetup, SessionState

PROGRESS_STEPS = 1000
STATE_HEIGHT, LOW_STATE_HEIGHT = 9 * GRID, 5 * GRID  # px, at least


class ProgressPanel(ResponsiveLayout, Translated, QWidget):
    """Shows instruction, state and progress of a verification in one row."""

    narrow_below = 100 * GRID  # px; then the instruction stands above

    def __init__(self, workbench: Workbench, run: VerificationRun) -> None:
        super().__init__()
        self._workbench, self._run = workbench, run
        self._runner = self._run.runner
        self._room = NO_ROOM

        # Widgets
        self._question = QuestionBar()
        self._question.set_words(self._starting_over)
        self._instruction = FittedText(TextSize.TITLE)
        self._instruction.setMinimumHeight(4 * GRID)
        self._act = PushButton()
        self._start_over = self.make_button(
            self.tr("Start over"),
            self._on_start_over_clicked,
            tip=self.tr("Discard all points, and start with the current tip."),
        )
        self._report = self.make_button(self.tr("Report..."), self._on_report_clicked)
        self._print_report = PrintReportControl(workbench.save_place, self)
        tip = self.tr("Discard the last point of the current task.")
        self._undo = self.make_button(self.tr("Undo point"), self._undo_point, tip=tip)
        self._undo.setShortcut(QKeySequence.StandardKey.Undo)
        self._hint = FittedText(TextSize.LEAD, least=TextSize.BODY)
        self._banner = StateBanner(TextSize.TITLE)
        self._banner.setMinimumHeight(STATE_HEIGHT)
        self.state, self._numbers, self._buttons = (QWidget() for _ in range(3))
        self._count = FittedText(TextSize.DISPLAY)
        self._count.setMaximumHeight(self._count.sizeHint().height())  # one line
        bar = QProgressBar(maximum=PROGRESS_STEPS, textVisible=False)
        self._progress = self.say(bar, self.tr("Progress"))

        # Layout
        layout = vertical_layout(self, self._question)
        self._rows = grid_layout(layout, spacing=(2 * GRID, GRID // 2))
        horizontal_layout(
            self.state, (self._banner, 3), (self._numbers, 2), spacing=2 * GRID
        )
        numbers = 1, self._count, self._progress, 1
        vertical_layout(self._numbers, *numbers, spacing=GRID // 2)
        buttons = self._report, self._act, self._undo, self._start_over
        self._row = horizontal_layout(self._buttons, *buttons, 1)
        self._use_room()

        # Connections
        self._act.clicked.connect(self.toggle_pause)
        self._question.agreed.connect(self._begin_anew)
        self._print_report.failed.connect(partial(workbench.notifications.notify, self))
        self._print_report.saved.connect(self._on_saved)

        self._refresh()

    def set_value(self, view: VerifyView) -> None:
        """Show another snapshot of the verification."""
        operator = view.operator
        self._instruction.set_text(operator.instruction)
        self._hint.set_text(operator.hint, bold=False)
        self._banner.set_value(operator.state)
        self._count.set_text(operator.count)
        self._numbers.setVisible(operator.fraction is not None)
        self._progress.setValue(round(PROGRESS_STEPS * (operator.fraction or 0.0)))
        self._act.setText(view.pause)
        self._act.setVisible(view.task is not None)
        self._undo.setVisible(view.task is not None)
        self._undo.setEnabled(view.can_undo)
        self._start_over.setVisible(view.can_start_over)
        self._report.setVisible(view.has_report)

    def set_low(self, *, low: bool) -> None:
        """Make do with little height, or not."""
        self._banner.set_word_size(TextSize.LEAD if low else TextSize.TITLE)
        self._banner.setMinimumHeight(LOW_STATE_HEIGHT if low else STATE_HEIGHT)

    def add_button(self, button: QWidget) -> None:
        """Add a button, or several, after the others."""
        self._row.insertWidget(self._row.count() - 1, button)

    def toggle_pause(self) -> None:
        """Pause the verification, or continue."""
        self._runner.ask(lambda workflow: workflow.toggle_pause())

    def hide_question(self) -> None:
        """Hide the question."""
        self._question.hide()

    @override
    def _use_room(self) -> None:
        """Place the state beside the instruction, or below where width is little."""
        is_narrow = self._room.is_narrow
        wide = (0, 0), (1, 0), (2, 0), (0, 1, 3, 1)
        narrow = (0, 0), (1, 0, 1, 2), (0, 1), (2, 0, 1, 2)
        cells = self._instruction, self._hint, self._buttons, self.state
        for cell, place in zip(cells, narrow if is_narrow else wide, strict=True):
            self._rows.removeWidget(cell)
            self._rows.addWidget(cell, *place)
        self._rows.setColumnStretch(0, 1)
        self._rows.setColumnStretch(1, 0 if is_narrow else 1)

    def _starting_over(self) -> Question:
        return Question(
            self.tr("Start over? Results are kept."),
            self.tr("Start over"),
            self.tr("Continue"),
        )

    def _begin_anew(self) -> None:
        self._runner.ask(lambda workflow: workflow.start_over())

    def _undo_point(self) -> None:
        self._runner.ask(lambda workflow: workflow.undo())

    def _on_report_clicked(self) -> None:
        """Show the report of the only task, or of the conclusion of several."""
        *tasks, conclusion = self._run.status.files
        self._print_report.show_verification(
            tasks[0] if len(tasks) == 1 else conclusion
        )

    def _on_saved(self, path: Path) -> None:
        words = self.tr("Saved: {0}").format(path)
        self._workbench.notifications.show_status(words)

    def _on_start_over_clicked(self) -> None:
        status = self._run.status
        if status.state is not None and status.state.is_begun and not status.is_done:
            self._question.ask()
        else:
            self._begin_anew()


MOST_TABLES = 3  # of a task


class FiguresView(QWidget):
    """A table of figures below its title, and sentences below it."""

    def __init__(self) -> None:
        super().__init__()
        # Widgets
        self._head = text_label(TextSize.SMALL, Tone.QUIET)
        self._table = NumberTable()
        self._table.set_letters(TextSize.SMALL)
        self._notes = text_label(TextSize.BODY, Tone.QUIET)

        # Layout
        vertical_layout(self, self._head, self._table, self._notes, spacing=GRID // 2)

    def set_value(self, value: ResultTable | None) -> None:
        """Show another table, or none, in the present language."""
        self.setVisible(value is not None)
        if value is None:
            return
        title = worded(value.title)
        self._head.setText(title)
        self._table.setAccessibleName(title)
        self._table.set_value(figures_of(value))
        self._table.setVisible(bool(value.rows))
        self._notes.setText(" ".join(map(worded, value.notes)))
        self._notes.setVisible(bool(value.notes))


class DetailsView(PageScroll):
    """Scrolls through the tables of a session."""

    def __init__(self) -> None:
        super().__init__()
        self._tables = tuple(FiguresView() for _ in range(MOST_TABLES))
        content = QWidget()
        layout = vertical_layout(content, margins=GRID)
        fill(layout, *self._tables, 1)
        self.setWidget(content)

    def set_value(self, setup: SessionSetup | None, state: SessionState | None) -> None:
        """Show a session; None for none."""
        tables: tuple[ResultTable, ...] = ()
        if setup is not None and state is not None:
            tables = (points_table([each.point_cam for each in state.touches]),)
            if state.found is not None:
                tables = setup.task.tables(state.found, setup.conditions)
        for index, view in enumerate(self._tables):
            view.set_value(tables[index] if index < len(tables) else None)


def figures_of(table: ResultTable) -> Figures:
    """Return a table with its words in the language that is chosen."""
    return Figures(
        tuple(map(worded, table.columns)) if table.rows else (),
        tuple(worded(row.name) for row in table.rows),
        tuple(
            (
                *row.texts(),
                *([worded(row.remark)] if len(row.values) < len(table.columns) else ()),
            )
            for row in table.rows
        ),
    )
