"""The swings without a verdict: offered to go on with, or to discard.

One that another program captures, or that is damaged, is told of and not offered.
"""

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import (
    QFrame,
    QGroupBox,
    QHBoxLayout,
    QPushButton,
    QVBoxLayout,
    QWidget,
)
from typing_extensions import override

from lightpen.record.reading import Record, recorded_names
from lightpen.record.unfinished import DamagedSwing, Unfinished
from lightpen_app.look.phrases import n_images_text
from lightpen_app.look.sentences import worded
from lightpen_app.look.theme import GRID, TextSize, Tone, set_tone, text_label
from lightpen_app.look.words import PARTED, breakable, moment_text, shortened, unbroken
from lightpen_app.widgets.page_scroll import PageScroll
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.translated import Translated

ROW_HEIGHT, SENTENCE_HEIGHT = 7 * GRID, 17 * GRID
LONGEST = 16  # characters of a name
N_ROWS_SEEN = 2  # the others are scrolled to
NEVER = Qt.ScrollBarPolicy.ScrollBarAlwaysOff


class InterruptedRow(Translated, QFrame):
    """One swing without a verdict.

    Parameters
    ----------
    is_under_way : bool
        Whether another program captures it.

    Signals
    -------
    resume_requested(), discard_requested()
        The buttons; discarding was confirmed.
    """

    resume_requested = Signal()
    discard_requested = Signal()

    def __init__(
        self,
        swing: Record | DamagedSwing,
        is_under_way: bool = False,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._swing = swing
        self._is_under_way = is_under_way

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
        words = QVBoxLayout()
        words.setSpacing(0)
        words.addStretch(1)
        words.addWidget(self._when)
        if isinstance(swing, Record):
            words.addWidget(self._what)
        words.addStretch(1)
        line = QHBoxLayout()
        line.setSpacing(2 * GRID)
        line.addLayout(words, 1)
        line.addWidget(self._offer)
        line.addWidget(self._question)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(GRID // 2)
        layout.addLayout(line)
        if isinstance(swing, DamagedSwing):
            layout.addWidget(self._what, 1, Qt.AlignmentFlag.AlignTop)

        # Connections
        self._resume.clicked.connect(self.resume_requested)
        self._discard.clicked.connect(self._on_discard_clicked)
        self._keep.clicked.connect(self._on_keep_clicked)
        self._confirm.clicked.connect(self.discard_requested)

        self._question.hide()
        self._offer.setVisible(not is_under_way)
        self._resume.setVisible(isinstance(swing, Record))
        if isinstance(swing, DamagedSwing):
            set_tone(self._when, Tone.BAD)
        self.setMinimumHeight(ROW_HEIGHT)
        self._retranslate()

    def words(self) -> tuple[str, str]:
        """Return what the row says."""
        return self._when.text(), unbroken(self._what.text())

    def height_for(self, width: int) -> int:
        """Return how high the row must be to show its words whole, px."""
        least = SENTENCE_HEIGHT if isinstance(self._swing, DamagedSwing) else ROW_HEIGHT
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
            self._had_focus.setFocus(Qt.FocusReason.OtherFocusReason)
            self._had_focus = None

    def _retranslate(self) -> None:
        """Set the texts in the language that is chosen."""
        when = self._heading()
        self._when.setText(when)
        self._what.setText(
            self.tr("Discard it? Its images stay on the disk.")
            if self._question.isVisibleTo(self)
            else self._description()
        )
        for button, text, name in (
            (self._resume, self.tr("Resume"), self.tr("Resume the swing of {0}")),
            (self._discard, self.tr("Discard"), self.tr("Discard the swing of {0}")),
            (self._keep, self.tr("Keep"), self.tr("Keep the swing of {0}")),
            (self._confirm, self.tr("Discard"), self.tr("Discard the swing of {0}")),
        ):
            button.setText(text)
            button.setAccessibleName(name.format(when))

    def _heading(self) -> str:
        match self._swing:
            case DamagedSwing(folder):
                return self.tr("Damaged: {0}").format(shortened(folder.name))
            case Record(header=header):
                return moment_text(header.created, self.tr("d MMM yyyy, hh:mm"))

    def _description(self) -> str:
        if isinstance(self._swing, DamagedSwing):
            return breakable(worded(self._swing.sentence))
        if self._is_under_way:
            return self.tr("Another program is capturing it.")
        names, n_images = recorded_names(self._swing), len(self._swing.images)
        called = (shortened(name, LONGEST) for name in (names.pen, names.tip))
        told = (*called, n_images_text(n_images))
        return PARTED.join(filter(None, told))

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


class InterruptedPanel(Translated, QGroupBox):
    """Lists swings without a verdict; hidden while there are none.

    Signals
    -------
    resume_requested(Path), discard_requested(Path)
        The folder of the record.
    search_requested()
        They are to be looked for again.
    """

    resume_requested = Signal(object)
    discard_requested = Signal(object)
    search_requested = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._value = Unfinished()
        self._rows: list[InterruptedRow] = []

        # Widgets
        self._hint = text_label(TextSize.SMALL, Tone.QUIET)
        self._scroll = PageScroll()
        self._scroll.setHorizontalScrollBarPolicy(NEVER)
        self._again = PushButton()

        # Layout
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(GRID)
        layout.addWidget(self._hint)
        layout.addWidget(self._scroll)
        layout.addWidget(self._again, 0, Qt.AlignmentFlag.AlignLeft)

        # Connections
        self._again.clicked.connect(self.search_requested)

        self.hide()
        self._retranslate()

    def value(self) -> Unfinished:
        """Return the swings that are listed."""
        return self._value

    def set_value(self, swings: Unfinished) -> None:
        """List these swings."""
        self._value = swings
        self._rows = [
            *(self._row(record) for record in swings.interrupted),
            *(self._row(record, is_under_way=True) for record in swings.under_way),
            *(self._row(swing) for swing in swings.damaged),
        ]
        content = QWidget()
        layout = QVBoxLayout(content)
        layout.setContentsMargins(0, 0, GRID, 0)
        layout.setSpacing(GRID)
        for row in self._rows:
            layout.addWidget(row)
        layout.addStretch(1)
        self._scroll.setWidget(content)
        self._hint.setVisible(bool(swings.interrupted))
        self._again.setVisible(bool(swings.under_way or swings.damaged))
        self._retranslate()
        self.setVisible(bool(self._rows))
        self._hold_rows()

    @override
    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._hold_rows()

    def rows(self) -> tuple[InterruptedRow, ...]:
        """Return the rows: what is offered, under way, and damaged."""
        return tuple(self._rows)

    def set_waiting(self, why: str) -> None:
        """Disable the buttons for a reason, or enable them for none."""
        for row in self._rows:
            row.set_waiting(why)

    def _hold_rows(self) -> None:
        """Let the first rows be seen whole, however their words are wrapped."""
        width = self._scroll.viewport().width() - GRID
        heights = (row.height_for(width) + GRID for row in self._rows[:N_ROWS_SEEN])
        self._scroll.setFixedHeight(sum(heights))

    def _row(
        self, swing: Record | DamagedSwing, is_under_way: bool = False
    ) -> InterruptedRow:
        row = InterruptedRow(swing, is_under_way)
        folder = swing.folder
        row.resume_requested.connect(lambda: self.resume_requested.emit(folder))
        row.discard_requested.connect(lambda: self.discard_requested.emit(folder))
        return row

    def _retranslate(self) -> None:
        n_rows = len(self._rows)
        self.setTitle(
            self.tr("Interrupted swings: {0}").format(n_rows)
            if n_rows > 1
            else self.tr("Interrupted swing")
        )
        self._hint.setText(
            self.tr("Resumed, it has all its images and the files it began with.")
        )
        self._again.setText(self.tr("Look again"))


def _button_row(*buttons: QPushButton) -> QWidget:
    row = QWidget()
    layout = QHBoxLayout(row)
    layout.setContentsMargins(0, 0, 0, 0)
    layout.setSpacing(GRID)
    for button in buttons:
        layout.addWidget(button)
    return row
