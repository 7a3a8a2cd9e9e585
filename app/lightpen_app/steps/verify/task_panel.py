"""One task of a verification: what is chosen, what is found, and recorded images."""

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout, QWidget
from typing_extensions import override

from lightpen.verification.choices import TaskKind, VerificationChoices
from lightpen.verification.status import VerificationStatus
from lightpen_app.look.grades import GRADE_MARKS
from lightpen_app.look.sentences import worded
from lightpen_app.look.theme import GRID
from lightpen_app.steps.verify.findings import TaskFinding
from lightpen_app.steps.verify.images_row import ImagesRow
from lightpen_app.steps.verify.strips import TaskStrip
from lightpen_app.widgets.page_scroll import PageScroll, Squeezed
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.sign_label import Remark, SignLabel
from lightpen_app.widgets.translated import Translated

LEAST_HEIGHT = 16 * GRID  # px, of what is found


class TaskPanel(Translated, QWidget):
    """Shows a task of a verification.

    Parameters
    ----------
    strip : TaskStrip
        Above what is found.
    finding : TaskFinding

    Signals
    -------
    value_changed(VerificationChoices)
        The user chose otherwise.
    anew_requested(TaskKind)
        The task is to be done again.
    read_requested(TaskKind, str, bool)
        See `ImagesRow`.
    cancel_requested()
    """

    value_changed = Signal(object)
    anew_requested = Signal(object)
    read_requested = Signal(object, str, bool)
    cancel_requested = Signal()

    def __init__(
        self, strip: TaskStrip, finding: TaskFinding, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)

        # Widgets
        self._strip = strip
        self._finding = finding
        self._anew = PushButton()
        self._recorded = PushButton()
        self._recorded.setCheckable(True)
        self._verdict = SignLabel()
        self._images = ImagesRow()

        # Layout
        below = QHBoxLayout()
        below.setSpacing(GRID)
        below.addWidget(self._verdict, 1, Qt.AlignmentFlag.AlignTop)
        below.addStretch(0)
        below.addWidget(self._recorded, 0, Qt.AlignmentFlag.AlignTop)
        below.addWidget(self._anew, 0, Qt.AlignmentFlag.AlignTop)
        scroll = PageScroll()
        scroll.setWidget(Squeezed(finding))
        scroll.setMinimumHeight(LEAST_HEIGHT)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 2 * GRID, 0, 0)
        layout.setSpacing(GRID)
        layout.addWidget(strip)
        layout.addLayout(below)
        layout.addWidget(self._images)
        layout.addWidget(scroll, 1)

        # Connections
        strip.value_changed.connect(self._on_strip_changed)
        self._recorded.toggled.connect(self._images.setVisible)
        self._anew.clicked.connect(self._on_anew_clicked)
        self._images.read_requested.connect(self._on_read_requested)
        self._images.cancel_requested.connect(self.cancel_requested)

        self._images.hide()
        self._retranslate()

    @property
    def kind(self) -> TaskKind:
        """Which task it is."""
        return self._finding.kind

    def set_choices(self, choices: VerificationChoices) -> None:
        """Show other choices."""
        self._strip.set_value(choices)

    def set_status(self, status: VerificationStatus, reading: float | None) -> None:
        """Show a verification, and how much of recorded images is read."""
        setup, state = status.setup, status.state
        self._finding.set_value(setup, state)
        found = None if state is None else state.found(self.kind)
        is_at_hand = state is not None and status.task is self.kind
        has_touches = state is not None and bool(state.touches or state.runs)
        if self.kind is TaskKind.DRIFT:
            is_at_hand = is_at_hand or (state is not None and bool(state.visits))
            has_touches = is_at_hand
        self._anew.setEnabled(found is not None or (is_at_hand and has_touches))
        told = None if found is None else found.assessment
        if status.is_done and told is status.assessment:  # it stands above all tasks
            told = None
        self._verdict.set_value(
            Remark()
            if told is None
            else Remark(worded(told.reason), *GRADE_MARKS[told.grade])
        )
        self._images.set_progress(reading)

    @override
    def _retranslate(self) -> None:
        self._recorded.setText(self.tr("Recorded images..."))
        self._recorded.setToolTip(
            self.tr("Do this task with images that were recorded before.")
        )
        self._anew.setText(self.tr("Touch again"))
        self._anew.setToolTip(
            self.tr("Do this task again; what it found before is kept.")
        )

    def _on_strip_changed(self) -> None:
        self.value_changed.emit(self._strip.value())

    def _on_anew_clicked(self) -> None:
        self.anew_requested.emit(self.kind)

    def _on_read_requested(self, place: str, is_still: bool) -> None:
        self.read_requested.emit(self.kind, place, is_still)
