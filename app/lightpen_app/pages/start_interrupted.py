"""The swings that were interrupted: each is offered to go on with, or to discard."""

from collections.abc import Sequence

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import (
    QFrame,
    QGroupBox,
    QHBoxLayout,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from lightpen.session.preparation import recorded_names
from lightpen.session.record import Record
from lightpen_app.theme import GRID, TextSize, Tone, text_label
from lightpen_app.widgets.page_scroll import PageScroll
from lightpen_app.widgets.translated import Translated
from lightpen_app.words import PARTED, moment_text, shortened

ROW_HEIGHT = 7 * GRID
LONGEST = 16  # characters of a name
N_ROWS_SEEN = 2  # the others are scrolled to
NEVER = Qt.ScrollBarPolicy.ScrollBarAlwaysOff


class InterruptedRow(QFrame):
    """One interrupted swing.

    Signals
    -------
    resume_requested(), discard_requested()
        The buttons; discarding was confirmed.
    """

    resume_requested = Signal()
    discard_requested = Signal()

    def __init__(self, record: Record, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._record = record

        # Widgets
        self._when = text_label(TextSize.BODY)
        self._what = text_label(TextSize.SMALL, Tone.QUIET)
        self._resume = QPushButton()
        self._discard = QPushButton()
        self._offer = _button_row(self._resume, self._discard)
        self._confirm = QPushButton()
        self._keep = QPushButton()
        # Keep is where Discard was, so that a double click discards nothing.
        self._question = _button_row(self._confirm, self._keep)

        # Layout
        words = QVBoxLayout()
        words.setSpacing(0)
        words.addStretch(1)
        words.addWidget(self._when)
        words.addWidget(self._what)
        words.addStretch(1)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(2 * GRID)
        layout.addLayout(words, 1)
        layout.addWidget(self._offer)
        layout.addWidget(self._question)

        # Connections
        self._resume.clicked.connect(self.resume_requested)
        self._discard.clicked.connect(self._on_discard_clicked)
        self._keep.clicked.connect(self._on_keep_clicked)
        self._confirm.clicked.connect(self.discard_requested)

        self._question.hide()
        self.setMinimumHeight(ROW_HEIGHT)
        self.retranslate()

    def words(self) -> tuple[str, str]:
        """Return what the row says."""
        return self._when.text(), self._what.text()

    def set_waiting(self, why: str) -> None:
        """Disable the buttons for a reason, or enable them for none."""
        for button in (self._resume, self._discard, self._keep, self._confirm):
            button.setEnabled(not why)
            button.setToolTip(why)

    def retranslate(self) -> None:
        """Set the texts in the language that is chosen."""
        when = moment_text(self._record.header.created, self.tr("d MMM yyyy, hh:mm"))
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

    def _description(self) -> str:
        names, n_images = recorded_names(self._record), len(self._record.images)
        images = (
            self.tr("1 image")
            if n_images == 1
            else self.tr("{0} images").format(n_images)
        )
        told = (*(shortened(name, LONGEST) for name in (names.pen, names.tip)), images)
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
        self.retranslate()


class InterruptedPanel(Translated, QGroupBox):
    """Lists interrupted swings; hidden while there are none.

    Signals
    -------
    resume_requested(Path), discard_requested(Path)
        The folder of the record.
    """

    resume_requested = Signal(object)
    discard_requested = Signal(object)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._value: tuple[Record, ...] = ()
        self._rows: list[InterruptedRow] = []

        # Widgets
        self._hint = text_label(TextSize.SMALL, Tone.QUIET)
        self._scroll = PageScroll()
        self._scroll.setHorizontalScrollBarPolicy(NEVER)

        # Layout
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(GRID)
        layout.addWidget(self._hint)
        layout.addWidget(self._scroll)

        self.hide()
        self._retranslate()

    def value(self) -> tuple[Record, ...]:
        """Return the records that are offered."""
        return self._value

    def set_value(self, records: Sequence[Record]) -> None:
        """Offer these records."""
        self._value = tuple(records)
        self._rows = [self._row(record) for record in records]
        content = QWidget()
        layout = QVBoxLayout(content)
        layout.setContentsMargins(0, 0, GRID, 0)
        layout.setSpacing(GRID)
        for row in self._rows:
            layout.addWidget(row)
        layout.addStretch(1)
        self._scroll.setWidget(content)
        n_seen = min(len(records), N_ROWS_SEEN)
        self._scroll.setFixedHeight(n_seen * (ROW_HEIGHT + GRID))
        self._retranslate()
        self.setVisible(bool(records))

    def rows(self) -> tuple[InterruptedRow, ...]:
        """Return the rows, the newest swing first."""
        return tuple(self._rows)

    def set_waiting(self, why: str) -> None:
        """Disable the buttons for a reason, or enable them for none."""
        for row in self._rows:
            row.set_waiting(why)

    def _row(self, record: Record) -> InterruptedRow:
        row = InterruptedRow(record)
        folder = record.folder
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
        for row in self._rows:
            row.retranslate()


def _button_row(*buttons: QPushButton) -> QWidget:
    row = QWidget()
    layout = QHBoxLayout(row)
    layout.setContentsMargins(0, 0, 0, 0)
    layout.setSpacing(GRID)
    for button in buttons:
        layout.addWidget(button)
    return row
