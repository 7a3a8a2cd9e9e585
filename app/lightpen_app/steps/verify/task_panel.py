"""One task of a verification: its choice and its results."""

from dataclasses import replace

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QRadioButton, QWidget
from typing_extensions import override

from lightpen.verification.runner import VerificationRunner
from lightpen.verification.session.choices import VerificationChoices
from lightpen.verification.session.status import VerificationStatus
from lightpen.verification.tasks.registry import TASKS, AnyTask
from lightpen_app.look.grades import GRADE_MARKS
from lightpen_app.look.layouts import fill, vertical_layout
from lightpen_app.look.sentences import worded
from lightpen_app.look.theme import GRID
from lightpen_app.steps.verify.findings import TaskFinding
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
        self._is_chosen = QRadioButton()
        self._verdict = SignLabel()

        # Layout
        layout = vertical_layout(self, spacing=GRID // 2)
        fill(layout, self._is_chosen, self._verdict, (self._finding, 1))

        self._is_chosen.setVisible(task in TASKS)  # a part is not a selectable task

        # Connections
        self._is_chosen.clicked.connect(self._on_chosen)

        self._retranslate()

    def set_choices(self, choices: VerificationChoices) -> None:
        """Show other choices."""
        self._choices = choices
        self._is_chosen.setChecked(choices.task is self._task)

    def set_status(self, status: VerificationStatus) -> None:
        """Show a verification."""
        setup, state, task = status.setup, status.state, self._task
        self._finding.set_value(setup, state)
        found = None if state is None else state.found_by(task)
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
        self._is_chosen.setText(self.tr("Do now: {0}").format(purpose))

    def _on_chosen(self) -> None:
        self.value_changed.emit(replace(self._choices, kind=self._task.kind))
