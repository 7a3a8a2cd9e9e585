"""A question in the page that waits for an answer, and stops nothing else."""

from collections.abc import Callable
from typing import NamedTuple

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QHBoxLayout, QWidget

from lightpen_app.look.theme import GRID, TextSize, text_label
from lightpen_app.widgets.asking_bar import AskingBar
from lightpen_app.widgets.focus import give_focus
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.translated import Translated


class Question(NamedTuple):
    """What is asked, and what its answers say."""

    text: str = ""
    yes: str = ""
    no: str = ""


class QuestionBar(Translated, AskingBar):
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
        self._words: Callable[[], Question] = Question

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

    def set_words(self, words: Callable[[], Question]) -> None:
        """Change the question; its words are asked for in each language anew."""
        self._words = words
        self.refresh()

    def refresh(self) -> None:
        """Ask by the words as they are now."""
        asked = self._words()
        self._text.setText(asked.text)
        self.setAccessibleName(asked.text)
        self._agree.setText(asked.yes)
        self._decline.setText(asked.no)

    def ask(self) -> None:
        """Show the question; the answer that changes nothing has the focus."""
        self.show()
        give_focus(self._decline)

    def words(self) -> str:
        """Return the question; empty while nothing is asked."""
        return "" if self.isHidden() else self._text.text()

    def _retranslate(self) -> None:
        self.refresh()

    def _on_agree_clicked(self) -> None:
        self.hide()
        self.agreed.emit()

    def _on_decline_clicked(self) -> None:
        self.hide()
        self.declined.emit()
