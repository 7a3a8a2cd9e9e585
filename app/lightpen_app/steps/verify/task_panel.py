"""One task of a verification: its options, its results, and recorded images."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QWidget
from typing_extensions import override

from lightpen.verification.runner import VerificationRunner
from lightpen.verification.session.choices import VerificationChoices
from lightpen.verification.session.status import VerificationStatus
from lightpen.verification.tasks.registry import AnyTask
from lightpen_app.look.grades import GRADE_MARKS
from lightpen_app.look.layouts import vertical_layout
from lightpen_app.look.sentences import worded
from lightpen_app.look.theme import GRID
from lightpen_app.look.tooltips import set_tooltip
from lightpen_app.steps.verify.findings import TaskFinding
from lightpen_app.steps.verify.images_row import ImagesRow
from lightpen_app.steps.verify.task_form import TaskForm
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.sign_label import SignLabel, StatusMessage
from lightpen_app.widgets.translated import Translated


class TaskPanel(Translated, QWidget):
    """Shows a task of a verification."""

    value_changed = Signal(object)  # VerificationChoices: the user chose otherwise

    def __init__(self, task: AnyTask, runner: VerificationRunner) -> None:
        super().__init__()
        self._task, self._runner = task, runner

        # Widgets
        self._finding = TaskFinding(task)
        self._anew = PushButton()
        self._recorded = PushButton()
        self._recorded.setCheckable(True)
        self._form = TaskForm(task, self._recorded, self._anew)
        self._verdict = SignLabel()
        self._images = ImagesRow()

        # Layout
        rows = self._form, self._images, self._verdict, (self._finding, 1)
        vertical_layout(self, *rows, spacing=GRID // 2)

        # Connections
        self._form.value_changed.connect(self._on_form_changed)
        self._recorded.toggled.connect(self._images.setVisible)
        self._anew.clicked.connect(self._on_anew_clicked)
        self._images.read_requested.connect(self._on_read_requested)
        self._images.cancel_requested.connect(self._on_cancel_requested)

        self._images.hide()
        self._retranslate()

    def set_choices(self, choices: VerificationChoices) -> None:
        """Show other choices."""
        self._form.set_value(choices)

    def set_status(self, status: VerificationStatus, reading: float | None) -> None:
        """Show a verification, and the progress of reading images."""
        setup, state, task = status.setup, status.state, self._task
        self._finding.set_value(setup, state)
        found = None if state is None else state.found.get(task.kind)
        has_points = False
        if setup is not None and state is not None:
            progress = state.progress(setup, task)
            has_points = bool(progress.points or progress.runs)
        self._anew.setEnabled(found is not None or has_points)
        judged = None if found is None else found.assessment
        if status.is_done and judged is status.assessment:  # shown above all tasks
            judged = None
        self._verdict.set_value(
            StatusMessage()
            if judged is None
            else StatusMessage(worded(judged.reason), *GRADE_MARKS[judged.grade])
        )
        self._images.set_progress(reading)

    @override
    def _retranslate(self) -> None:
        self._recorded.setText(self.tr("Recorded images..."))
        set_tooltip(self._recorded, self.tr("Do this task with recorded images."))
        self._anew.setText(self.tr("Probe again"))
        set_tooltip(
            self._anew,
            self.tr("Repeat this task; the result so far is kept in the archive."),
        )

    def _on_form_changed(self) -> None:
        self.value_changed.emit(self._form.value())

    def _on_anew_clicked(self) -> None:
        self._runner.ask(lambda workflow: workflow.touch_anew(self._task))

    def _on_read_requested(self, place: str, is_still: bool) -> None:
        self._runner.ask(
            lambda workflow: workflow.read(self._task, place, is_still=is_still)
        )

    def _on_cancel_requested(self) -> None:
        self._runner.ask(lambda workflow: workflow.cancel())
