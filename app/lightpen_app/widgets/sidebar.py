"""The left side of the window: what is calibrated, the steps, and where help is."""

from collections.abc import Sequence

from PySide6.QtCore import QPoint, Signal
from PySide6.QtWidgets import QFrame, QPushButton, QVBoxLayout, QWidget

from lightpen_app.steps import Step
from lightpen_app.theme import GRID, TextSize, Tone, text_label
from lightpen_app.widgets.step_list import StepList
from lightpen_app.widgets.translated import Translated

WIDTH = 30 * GRID


class Sidebar(Translated, QFrame):
    """The steps, with buttons for what has a function key.

    Signals
    -------
    step_chosen(int)
        Index of the step, which may be closed.
    operator_view_chosen(), help_chosen(), options_chosen()
        The buttons.
    """

    step_chosen = Signal(int)
    operator_view_chosen = Signal()
    help_chosen = Signal()
    options_chosen = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("sidebar")
        self.setFixedWidth(WIDTH)

        # Widgets
        self._name = text_label(TextSize.LEAD)
        self._subject = text_label(TextSize.SMALL, Tone.QUIET)
        self._steps = StepList()
        self._operator_view = QPushButton()
        self._help = QPushButton()
        self._options = QPushButton()
        buttons = (self._operator_view, self._help, self._options)

        # Layout
        head = QVBoxLayout()
        head.setContentsMargins(5 * GRID // 2, 0, 2 * GRID, 2 * GRID)
        head.setSpacing(GRID // 2)
        head.addWidget(self._name)
        head.addWidget(self._subject)
        foot = QVBoxLayout()
        foot.setContentsMargins(GRID, 0, GRID, 0)
        foot.setSpacing(0)
        for button in buttons:
            button.setFlat(True)
            foot.addWidget(button)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 3 * GRID, 0, 2 * GRID)
        layout.setSpacing(GRID)
        layout.addLayout(head)
        layout.addWidget(self._steps)
        layout.addStretch(1)
        layout.addLayout(foot)

        # Connections
        self._steps.step_chosen.connect(self.step_chosen)
        self._operator_view.clicked.connect(self.operator_view_chosen)
        self._help.clicked.connect(self.help_chosen)
        self._options.clicked.connect(self.options_chosen)

        self.set_subject("")
        self._retranslate()

    def steps(self) -> tuple[Step, ...]:
        """Return the steps shown."""
        return self._steps.steps()

    def set_steps(self, steps: Sequence[Step]) -> None:
        """Show these steps."""
        self._steps.set_steps(steps)

    def subject(self) -> str:
        """Return what is being calibrated."""
        return self._subject.text()

    def set_subject(self, text: str) -> None:
        """Say what is being calibrated, such as pen and cone."""
        self._subject.setText(text)
        self._subject.setVisible(bool(text))

    def options_corner(self) -> QPoint:
        """Return where on the screen the top left of the options' button is."""
        return self._options.mapToGlobal(QPoint(0, 0))

    def _retranslate(self) -> None:
        self._name.setText(self.tr("Pen tip calibration"))
        for button, text, key in (
            (self._operator_view, self.tr("Operator view"), "F11"),
            (self._help, self.tr("Help"), "F1"),
            (self._options, self.tr("Options"), "F10"),
        ):
            button.setText(f"{text}  \u00b7  {key}")
            button.setAccessibleName(text)
