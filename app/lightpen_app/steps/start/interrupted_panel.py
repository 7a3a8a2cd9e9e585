"""Interrupted swings and verifications, to resume or discard.

One that another program captures, or that is damaged, is reported and not offered.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from PySide6.QtCore import QEvent, Qt, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QFrame, QGroupBox, QWidget
from typing_extensions import override

from lightpen_app.face import RowWords
from lightpen_app.look.layouts import horizontal_layout, vertical_layout
from lightpen_app.look.theme import GRID, TextSize, Tone, set_tone, text_label
from lightpen_app.look.words import unbroken
from lightpen_app.widgets.bars import Question, QuestionBar
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.fitting import PageScroll

N_ROWS_SEEN = 2  # the others are scrolled to
NEVER = Qt.ScrollBarPolicy.ScrollBarAlwaysOff


@dataclass(frozen=True, eq=False)
class InterruptedEntry:
    """Interrupted work, and what can be done with it; None where it cannot."""

    words: RowWords
    resume: Callable[[], object] | None
    discard: Callable[[], object] | None
    is_damaged: bool = False


class InterruptedRow(Translated, QFrame):
    """Interrupted work with its buttons."""

    discard_requested = Signal()

    def __init__(self, entry: InterruptedEntry) -> None:
        super().__init__()
        words = entry.words

        # Widgets
        self._when = text_label(TextSize.BODY)
        self._when.setText(words.heading)
        self._what = text_label(TextSize.SMALL, Tone.QUIET)
        self._what.setText(words.description)
        self._resume = self.make_button(words.resume[0], entry.resume or bool)
        self._discard = self.make_button(words.discard[0], self.discard_requested)
        self.say(self._resume, name=words.resume[1].format(words.heading))
        self.say(self._discard, name=words.discard[1].format(words.heading))

        # Layout
        layout = vertical_layout(self, spacing=GRID // 2)
        horizontal_layout(layout, (self._when, 1), self._resume, self._discard)
        layout.addWidget(self._what, 1, Qt.AlignmentFlag.AlignTop)

        self._resume.setVisible(entry.resume is not None)
        self._discard.setVisible(entry.discard is not None)
        if entry.is_damaged:
            set_tone(self._when, Tone.BAD)

    def words(self) -> tuple[str, str]:
        """Return the texts of the row."""
        return self._when.text(), unbroken(self._what.text())

    def height_for(self, width: int) -> int:
        """Return the height of the row that shows its text completely, px."""
        for each in self.findChildren(QWidget):
            each.ensurePolished()  # its font is known only then
        return self.heightForWidth(width)

    def set_waiting(self, why: str) -> None:
        """Disable the buttons for a reason, or enable them for none."""
        self._resume.set_why_not(why)
        self._discard.set_why_not(why)


class InterruptedPanel(Translated, QGroupBox):
    """Lists swings and other work that have no end; hidden while there are none."""

    search_requested = Signal()  # search again

    def __init__(self) -> None:
        super().__init__()
        self._rows: list[InterruptedRow] = []
        self._why_waiting = ""

        # Widgets
        self._hint = self.say(
            text_label(TextSize.SMALL, Tone.QUIET),
            self.tr("A resumed swing keeps its images and its files."),
        )
        self._scroll = PageScroll()
        self._scroll.setHorizontalScrollBarPolicy(NEVER)
        self._question = QuestionBar()
        self._again = self.make_button(self.tr("Search again"), self.search_requested)

        # Layout
        left = Qt.AlignmentFlag.AlignLeft
        vertical_layout(
            self, self._hint, self._scroll, self._question, (self._again, 0, left)
        )

        self.hide()

    def set_entries(self, entries: Sequence[InterruptedEntry]) -> None:
        """List interrupted work."""
        self._question.hide()
        self._rows = [self._row(entry) for entry in entries]
        content = QWidget()
        vertical_layout(content, *self._rows, 1, margins=(0, 0, GRID, 0))
        self._scroll.setWidget(content)
        self._hint.setVisible(any(each.resume for each in entries))
        self._again.setVisible(not all(each.resume for each in entries))
        self.set_waiting(self._why_waiting)
        self.setTitle(self.tr("Interrupted: {0}").format(len(entries)))
        self.setVisible(bool(entries))
        self._hold_rows()

    @override
    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._hold_rows()

    def set_waiting(self, why: str) -> None:
        """Disable the buttons for a reason, or enable them for none."""
        self._why_waiting = why
        for row in self._rows:
            row.set_waiting(why)

    def _hold_rows(self) -> None:
        """Keep the first rows fully visible, however their text wraps."""
        width = self._scroll.viewport().width() - GRID
        heights = (row.height_for(width) + GRID for row in self._rows[:N_ROWS_SEEN])
        self._scroll.setFixedHeight(sum(heights))

    def _row(self, entry: InterruptedEntry) -> InterruptedRow:
        row = InterruptedRow(entry)
        row.discard_requested.connect(lambda: self._ask(entry))
        return row

    def _ask(self, entry: InterruptedEntry) -> None:
        """Ask below the rows, so that a double click discards nothing."""
        words = entry.words
        asked = f"{words.heading}: {words.question}"
        question = Question(asked, words.discard[0], self.tr("Keep"))
        self._question.ask_about(lambda: question, entry.discard or bool)

    @override
    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.LanguageChange and self._rows:
            self.search_requested.emit()  # what is found is worded anew
