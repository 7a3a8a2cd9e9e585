"""A row for interrupted work: resume, or discard after a question."""

from enum import StrEnum

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QFrame, QPushButton, QWidget

from lightpen_app.face import RowWords
from lightpen_app.look.layouts import fill, horizontal_layout, vertical_layout
from lightpen_app.look.theme import GRID, TextSize, Tone, set_tone, text_label
from lightpen_app.look.words import unbroken
from lightpen_app.widgets.focus import give_focus
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.translated import Translated

ROW_HEIGHT, SENTENCE_HEIGHT = 7 * GRID, 17 * GRID


class RowKind(StrEnum):
    """Possible actions for interrupted work."""

    OFFERED = "offered"  # to continue with
    UNDER_WAY = "under way"  # in another program
    DAMAGED = "damaged"


class InterruptedItem(Translated, QFrame):
    """Interrupted work; subclasses provide the texts."""

    # The buttons; discarding was confirmed.
    resume_requested = Signal()
    discard_requested = Signal()

    def __init__(self, kind: RowKind) -> None:
        super().__init__()
        self._kind = kind
        self._had_focus: PushButton | None = None

        # Widgets
        self._when = text_label(TextSize.BODY)
        self._what = text_label(TextSize.SMALL, Tone.QUIET)
        self._resume = PushButton()
        self._discard = PushButton()
        self._offer = _button_row(self._resume, self._discard)
        self._confirm = PushButton()
        self._keep = PushButton()
        # Keep is where Discard was, so that a double click discards nothing.
        self._question = _button_row(self._confirm, self._keep)

        # Layout
        layout = vertical_layout(self, spacing=GRID // 2)
        line = horizontal_layout(layout, spacing=2 * GRID)
        words = vertical_layout(line, 1, self._when, spacing=0, stretch=1)
        if kind is not RowKind.DAMAGED:
            fill(words, self._what)
        fill(words, 1)
        fill(line, self._offer, self._question)
        if kind is RowKind.DAMAGED:
            fill(layout, (self._what, 1, Qt.AlignmentFlag.AlignTop))

        # Connections
        self._resume.clicked.connect(self.resume_requested)
        self._discard.clicked.connect(self._on_discard_clicked)
        self._keep.clicked.connect(self._on_keep_clicked)
        self._confirm.clicked.connect(self.discard_requested)

        self._question.hide()
        self._offer.setVisible(kind is not RowKind.UNDER_WAY)
        self._resume.setVisible(kind is not RowKind.DAMAGED)
        if kind is RowKind.DAMAGED:
            set_tone(self._when, Tone.BAD)
        self.setMinimumHeight(ROW_HEIGHT)
        self._retranslate()

    def words(self) -> tuple[str, str]:
        """Return the texts of the row."""
        return self._when.text(), unbroken(self._what.text())

    def height_for(self, width: int) -> int:
        """Return the height of the row that shows its text completely, px."""
        least = SENTENCE_HEIGHT if self._kind is RowKind.DAMAGED else ROW_HEIGHT
        for each in self.findChildren(QWidget):
            each.ensurePolished()  # its font is known only then
        return max(least, self.heightForWidth(width))

    def set_waiting(self, why: str) -> None:
        """Disable the buttons for a reason, or enable them for none.

        The focus comes back to the one that had it.
        """
        buttons = (self._resume, self._discard, self._keep, self._confirm)
        if why and self._had_focus is None:
            self._had_focus = next((each for each in buttons if each.hasFocus()), None)
        for button in buttons:
            button.set_why_not(why)
        if not why and self._had_focus is not None:
            give_focus(self._had_focus)
            self._had_focus = None

    def _words(self) -> RowWords:
        raise NotImplementedError

    def _retranslate(self) -> None:
        words = self._words()
        self._when.setText(words.heading)
        asks = self._question.isVisibleTo(self)
        self._what.setText(words.question if asks else words.description)
        for button, (text, name) in (
            (self._resume, words.resume),
            (self._discard, words.discard),
            (self._keep, words.keep),
            (self._confirm, words.discard),
        ):
            button.setText(text)
            button.setAccessibleName(name.format(words.heading))

    def _on_discard_clicked(self) -> None:
        self._ask(True)
        self._keep.setFocus()

    def _on_keep_clicked(self) -> None:
        self._ask(False)
        self._discard.setFocus()

    def _ask(self, asks: bool) -> None:
        self._question.setVisible(asks)
        self._offer.setVisible(not asks)
        self._retranslate()


def _button_row(*buttons: QPushButton) -> QWidget:
    row = QWidget()
    horizontal_layout(row, *buttons)
    return row
