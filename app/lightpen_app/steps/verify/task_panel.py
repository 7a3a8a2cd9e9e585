"""One task of a verification: its choice and its results."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QCheckBox, QWidget
from typing_extensions import override

from lightpen.verification.runner import VerificationRunner
from lightpen.verification.session.choices import VerificationChoices
from lightpen.verification.session.status import VerificationStatus
from lightpen.verification.tasks.registry import TASKS, AnyTask
from lightpen_app.look.grades import GRADE_MARKS
from lightpen_app.look.layouts import fill, horizontal_layout, vertical_layout
from lightpen_app.look.sentences import worded
from lightpen_app.look.theme import GRID
from lightpen_app.look.tooltips import set_tooltip
from lightpen_app.steps.verify.findings import TaskFinding
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.sign_label import SignLabel, StatusMessage
from lightpen_app.widgets.translated import Translated


class TaskPanel(Translated, QWidget):
    """Shows a task of a verification."""

    value_changed = Signal(object)  # VerificationChoices: the user chose otherwise

    def __init__(self, task: AnyTask, runner: VerificationRunner) -> None:
        super().__init__()
        self._task, self._runner = task, runner
        self._choices = VerificationChoices()

        # Widgets
        self._finding = TaskFinding(task)
        self._anew = PushButton()
        self._is_chosen = QCheckBox()
        self._verdict = SignLabel()

        # Layout
        layout = vertical_layout(self, spacing=GRID // 2)
        horizontal_layout(layout, self._is_chosen, 1, self._anew)
        fill(layout, self._verdict, (self._finding, 1))

        self._is_chosen.setVisible(task in TASKS)  # a part is not a selectable task

        # Connections
        self._is_chosen.clicked.connect(self._on_chosen)
        self._anew.clicked.connect(self._on_anew_clicked)

        self._retranslate()

    def set_choices(self, choices: VerificationChoices) -> None:
        """Show other choices."""
        self._choices = choices
        self._is_chosen.setChecked(self._task.kind in choices.kinds)

    def set_status(self, status: VerificationStatus) -> None:
        """Show a verification."""
        setup, state, task = status.setup, status.state, self._task
        self._finding.set_value(setup, state)
        found = None if state is None else state.found.get(task.kind)
        has_points = False
        if setup is not None and state is not None:
            progress = state.progress(setup, task)
            has_points = bool(progress.points or progress.runs)
        self._anew.setVisible(found is not None or has_points)
        judged = None if found is None else found.assessment
        if status.is_done and judged is status.assessment:  # shown above all tasks
            judged = None
        self._verdict.set_value(
            StatusMessage()
            if judged is None
            else StatusMessage(worded(judged.reason), *GRADE_MARKS[judged.grade])
        )

    @override
    def _retranslate(self) -> None:
        purpose = worded(self._task.purpose)
        self._is_chosen.setText(self.tr("Include: {0}").format(purpose))
        self._anew.setText(self.tr("Probe again"))
        set_tooltip(
            self._anew,
            self.tr("Repeat this task; the result so far is kept in the archive."),
        )

    def _on_chosen(self, is_chosen: bool) -> None:
        chosen = self._choices.with_task(self._task, is_chosen=is_chosen)
        self.value_changed.emit(chosen)

    def _on_anew_clicked(self) -> None:
        self._runner.ask(lambda workflow: workflow.touch_anew(self._task))
