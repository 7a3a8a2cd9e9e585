"""Interrupted swings and verifications, to resume or discard.

One that another program captures, or that is damaged, is reported and not offered.
"""

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QGroupBox, QWidget
from typing_extensions import override

from lightpen.record.swings.interrupted import DamagedSwing, InterruptedSwings
from lightpen.record.swings.reading import Record, recorded_names
from lightpen_app.face import InterruptedWork, RowWords
from lightpen_app.look.layouts import vertical_layout
from lightpen_app.look.phrases import n_images_text
from lightpen_app.look.sentences import worded
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.look.words import PARTED, breakable, moment_text, shortened
from lightpen_app.steps.start.interrupted_item import InterruptedItem, RowKind
from lightpen_app.widgets.page_scroll import PageScroll
from lightpen_app.widgets.translated import Translated

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
