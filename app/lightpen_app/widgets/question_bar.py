"""A question in the page that waits for an answer, and stops nothing else."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QHBoxLayout, QWidget

from lightpen_app.look.theme import GRID, TextSize, text_label
from lightpen_app.widgets.asking_bar import AskingBar
from lightpen_app.widgets.focus import give_focus
from lightpen_app.widgets.push_button import PushButton


class QuestionBar(AskingBar):
    """Hidden until it asks; either answer hides it again.

    Signals
    -------
    agreed()
    declined()
    """

    agreed = Signal()
    declined = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        # Widgets
        self._text = text_label(TextSize.BODY)
        self._decline = PushButton()
        self._agree = PushButton()

        # Layout
        layout = QHBoxLayout(self)
        layout.setContentsMargins(2 * GRID, GRID, GRID, GRID)
        layout.setSpacing(GRID)
        layout.addWidget(self._text, 1)
        layout.addWidget(self._decline)
        layout.addWidget(self._agree)

        # Connections
        self._agree.clicked.connect(self._on_agree_clicked)
        self._decline.clicked.connect(self._on_decline_clicked)

        self.hide()

    def set_words(self, question: str, yes: str, no: str) -> None:
        """Change the question and its answers."""
        self._text.setText(question)
        self.setAccessibleName(question)
        self._agree.setText(yes)
        self._decline.setText(no)

    def ask(self) -> None:
        """Show the question; the answer that changes nothing has the focus."""
        self.show()
        give_focus(self._decline)

    def words(self) -> str:
        """Return the question; empty while nothing is asked."""
        return "" if self.isHidden() else self._text.text()

    def _on_agree_clicked(self) -> None:
        self.hide()
        self.agreed.emit()

    def _on_decline_clicked(self) -> None:
        self.hide()
        self.declined.emit()
