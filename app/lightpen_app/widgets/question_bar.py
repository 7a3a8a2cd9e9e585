"""A non-modal question in the page."""

from collections.abc import Callable
from typing import NamedTuple

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QWidget

from lightpen_app.look.layouts import horizontal_layout
from lightpen_app.look.theme import GRID, TextSize, text_label
from lightpen_app.widgets.focus import give_focus
from lightpen_app.widgets.prompt_bar import AskingBar
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.translated import Translated


class Question(NamedTuple):
    """A question with the labels of its answers."""

    text: str = ""
    yes: str = ""
    no: str = ""


class QuestionBar(Translated, AskingBar):
    """Hidden until it asks; either answer hides it again."""

    agreed = Signal()
    declined = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._words: Callable[[], Question] = Question
        self._on_yes: Callable[[], object] = bool  # does nothing

        # Widgets
        self._text = text_label(TextSize.BODY)
        self._decline = PushButton()
        self._agree = PushButton()

        # Layout
        horizontal_layout(
            self,
            (self._text, 1),
            self._decline,
            self._agree,
            margins=(2 * GRID, GRID, GRID, GRID),
        )

        # Connections
        self._agree.clicked.connect(self._on_agree_clicked)
        self._decline.clicked.connect(self._on_decline_clicked)

        self.hide()

    def set_words(self, words: Callable[[], Question]) -> None:
        """Change the question; its words are requested in each language again."""
        self._words = words
        self.refresh()

    def ask_about(
        self, words: Callable[[], Question], on_yes: Callable[[], object]
    ) -> None:
        """Replace the question and the action on consent."""
        self._on_yes = on_yes
        self.set_words(words)
        self.ask()

    def refresh(self) -> None:
        """Update the question; an empty text hides it."""
        asked = self._words()
        if not asked.text:
            self.hide()
        self._text.setText(asked.text)
        self.setAccessibleName(asked.text)
        self._agree.setText(asked.yes)
        self._decline.setText(asked.no)

    def ask(self) -> None:
        """Show the question, with the focus on the answer that changes nothing."""
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
        self._on_yes()

    def _on_decline_clicked(self) -> None:
        self.hide()
        self.declined.emit()
