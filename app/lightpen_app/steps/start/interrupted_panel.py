"""Interrupted swings and verifications, to resume or discard.

One that another program captures, or that is damaged, is reported and not offered.
"""

from enum import StrEnum

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QFrame, QGroupBox, QPushButton, QWidget
from typing_extensions import override

from lightpen.record.swings.interrupted import DamagedSwing, InterruptedSwings
from lightpen.record.swings.reading import Record, recorded_names
from lightpen_app.face import InterruptedWork, RowWords
from lightpen_app.look.languages import worded
from lightpen_app.look.layouts import fill, horizontal_layout, vertical_layout
from lightpen_app.look.phrases import n_images_text
from lightpen_app.look.theme import GRID, TextSize, Tone, set_tone, text_label
from lightpen_app.look.words import PARTED, breakable, moment_text, shortened, unbroken
from lightpen_app.widgets.controls import PushButton, give_focus
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.fitting import PageScroll

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


LONGEST = 16  # characters of a name
N_ROWS_SEEN = 2  # the others are scrolled to
NEVER = Qt.ScrollBarPolicy.ScrollBarAlwaysOff


class InterruptedRow(InterruptedItem):
    """One swing without a verdict."""

    def __init__(
        self, swing: Record | DamagedSwing, is_under_way: bool = False
    ) -> None:
        self._swing = swing
        kind = RowKind.UNDER_WAY if is_under_way else RowKind.OFFERED
        if isinstance(swing, DamagedSwing):
            kind = RowKind.DAMAGED
        super().__init__(kind)

    @override
    def _words(self) -> RowWords:
        return RowWords(
            self._heading(),
            self._description(),
            self.tr("Discard this swing? Its images remain on the disk."),
            (self.tr("Resume"), self.tr("Resume the swing of {0}")),
            (self.tr("Discard"), self.tr("Discard the swing of {0}")),
            (self.tr("Keep"), self.tr("Keep the swing of {0}")),
        )

    def _heading(self) -> str:
        match self._swing:
            case DamagedSwing(folder):
                return self.tr("Damaged: {0}").format(shortened(folder.name))
            case Record(header=header):
                return moment_text(header.created)

    def _description(self) -> str:
        if isinstance(self._swing, DamagedSwing):
            return breakable(worded(self._swing.message))
        if self._kind is RowKind.UNDER_WAY:
            return self.tr("In use by another program")
        names, n_images = recorded_names(self._swing), len(self._swing.images)
        called = (shortened(name, LONGEST) for name in (names.pen, names.tip))
        parts = (*called, n_images_text(n_images))
        return PARTED.join(filter(None, parts))


class WorkRow(InterruptedItem):
    """One work of an extension that was interrupted."""

    def __init__(self, work: InterruptedWork) -> None:
        self._work = work
        super().__init__(RowKind.DAMAGED if work.names is None else RowKind.OFFERED)

    @override
    def _words(self) -> RowWords:
        return self._work.words()


class InterruptedPanel(Translated, QGroupBox):
    """Lists swings and other work that have no end; hidden while there are none."""

    # Path: the folder of the record
    resume_requested = Signal(object)
    discard_requested = Signal(object)
    continue_requested = Signal(object)  # InterruptedWork
    close_requested = Signal(object)  # InterruptedWork
    search_requested = Signal()  # search again

    def __init__(self) -> None:
        super().__init__()
        self._value = InterruptedSwings()
        self._works: tuple[InterruptedWork, ...] = ()
        self._rows: list[InterruptedItem] = []
        self._why_waiting = ""

        # Widgets
        self._hint = self.say(
            text_label(TextSize.SMALL, Tone.QUIET),
            self.tr("A resumed swing keeps its images and its files."),
        )
        self._scroll = PageScroll()
        self._scroll.setHorizontalScrollBarPolicy(NEVER)
        self._again = self.make_button(self.tr("Search again"), self.search_requested)

        # Layout
        left = Qt.AlignmentFlag.AlignLeft
        vertical_layout(self, self._hint, self._scroll, (self._again, 0, left))

        self.hide()
        self._retranslate()

    def value(self) -> InterruptedSwings:
        """Return the swings that are listed."""
        return self._value

    def set_value(
        self, swings: InterruptedSwings, works: tuple[InterruptedWork, ...] = ()
    ) -> None:
        """List these swings and works of extensions."""
        self._value, self._works = swings, works
        self._rows = [
            *map(self._work_row, works),
            *(self._row(record) for record in swings.interrupted),
            *(self._row(record, is_under_way=True) for record in swings.under_way),
            *(self._row(swing) for swing in swings.damaged),
        ]
        for row in self._rows:
            row.set_waiting(self._why_waiting)
        content = QWidget()
        vertical_layout(content, *self._rows, 1, margins=(0, 0, GRID, 0))
        self._scroll.setWidget(content)
        can_go_on = any(each.names is not None for each in works)
        self._hint.setVisible(bool(swings.interrupted) or can_go_on)
        self._again.setVisible(bool(swings.under_way or swings.damaged))
        self._retranslate()
        self.setVisible(bool(self._rows))
        self._hold_rows()

    @override
    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._hold_rows()

    def rows(self) -> tuple[InterruptedItem, ...]:
        """Return the rows: interrupted, running, and damaged."""
        return tuple(self._rows)

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

    def _row(
        self, swing: Record | DamagedSwing, is_under_way: bool = False
    ) -> InterruptedRow:
        row = InterruptedRow(swing, is_under_way)
        folder = swing.folder
        row.resume_requested.connect(lambda: self.resume_requested.emit(folder))
        row.discard_requested.connect(lambda: self.discard_requested.emit(folder))
        return row

    def _work_row(self, work: InterruptedWork) -> WorkRow:
        row = WorkRow(work)
        row.resume_requested.connect(lambda: self.continue_requested.emit(work))
        row.discard_requested.connect(lambda: self.close_requested.emit(work))
        return row

    def _retranslate(self) -> None:
        self.setTitle(self._title())

    def _title(self) -> str:
        n_rows = len(self._rows)
        if self._works:
            return self.tr("Interrupted: {0}").format(n_rows)
        if n_rows > 1:
            return self.tr("Interrupted swings: {0}").format(n_rows)
        return self.tr("Interrupted swing")
