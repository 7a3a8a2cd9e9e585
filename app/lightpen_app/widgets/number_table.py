"""A table of numbers that can be copied."""

from dataclasses import dataclass

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QGuiApplication, QKeyEvent, QKeySequence, QResizeEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHeaderView,
    QSizePolicy,
    QTableWidget,
    QTableWidgetItem,
)
from typing_extensions import override

from lightpen_app.look.theme import GRID, TextSize, set_size
from lightpen_app.widgets.row_table import LEFT, RIGHT

NUMBER_ROW_HEIGHT, LARGE_ROW_HEIGHT = 3 * GRID, 4 * GRID  # px; also of the header


@dataclass(frozen=True)
class Figures:
    """Content of a table."""

    columns: tuple[str, ...] = ()  # names
    rows: tuple[str, ...] = ()  # names
    cells: tuple[tuple[str, ...], ...] = ()  # row by row


class NumberTable(QTableWidget):
    """Shows a table without scrolling; Ctrl+C copies the selection."""

    def __init__(self) -> None:
        super().__init__()
        self._value = Figures()
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setTabKeyNavigation(False)
        self.setShowGrid(False)
        self.setWordWrap(False)
        self.setFrameShape(QTableWidget.Shape.NoFrame)
        self.setProperty("role", "figures")
        never = Qt.ScrollBarPolicy.ScrollBarAlwaysOff
        self.setVerticalScrollBarPolicy(never)
        self.setHorizontalScrollBarPolicy(never)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setCornerButtonEnabled(False)
        across, down = self.horizontalHeader(), self.verticalHeader()
        across.setSectionResizeMode(QHeaderView.ResizeMode.Stretch)
        across.setDefaultAlignment(RIGHT)
        across.setHighlightSections(False)
        down.setDefaultAlignment(LEFT)
        down.setSectionResizeMode(QHeaderView.ResizeMode.Fixed)
        down.setHighlightSections(False)
        self.set_letters(TextSize.BODY)

    def set_letters(self, size: TextSize) -> None:
        """Show the figures larger, for a large window, smaller or as usual."""
        # Before the heights: none is less than the letters are high.
        for each in (self, self.horizontalHeader(), self.verticalHeader()):
            set_size(each, size)
        is_large = size > TextSize.BODY
        self._row_height = LARGE_ROW_HEIGHT if is_large else NUMBER_ROW_HEIGHT
        self.horizontalHeader().setFixedHeight(self._row_height)
        self.verticalHeader().setDefaultSectionSize(self._row_height)
        self.updateGeometry()

    def value(self) -> Figures:
        """Return the figures that are shown."""
        return self._value

    def set_value(self, value: Figures) -> None:
        """Show other figures."""
        if value == self._value:
            return
        self._value = value
        self.setRowCount(len(value.rows))
        self.setColumnCount(len(value.columns))
        self.setHorizontalHeaderLabels(value.columns)
        self.setVerticalHeaderLabels(value.rows)
        for i, row in enumerate(value.cells):
            for j, text in enumerate(row):
                item = QTableWidgetItem(text)
                item.setTextAlignment(RIGHT)
                self.setItem(i, j, item)
        self._share_width()
        self.updateGeometry()

    @override
    def sizeHint(self) -> QSize:
        height = self._row_height * (1 + self.rowCount()) + 2
        return QSize(super().sizeHint().width(), height)

    @override
    def minimumSizeHint(self) -> QSize:
        width = sum(self._needed()) + self.verticalHeader().sizeHint().width()
        return QSize(max(width, 20 * GRID), self.sizeHint().height())

    def _needed(self) -> list[int]:
        """Return the width of each column, px."""
        heads = self.horizontalHeader()
        return [
            max(self.sizeHintForColumn(i), heads.sectionSizeHint(i))
            for i in range(self.columnCount())
        ]

    def _share_width(self) -> None:
        """Make the columns equally wide, or as needed where there is little room."""
        heads, needed = self.horizontalHeader(), self._needed()
        spare = self.viewport().width() - sum(needed)
        is_short = self.viewport().width() < len(needed) * max(needed, default=0)
        mode = QHeaderView.ResizeMode
        heads.setSectionResizeMode(mode.Fixed if is_short else mode.Stretch)
        if is_short:
            for i, width in enumerate(needed):
                heads.resizeSection(i, width + max(spare, 0) // len(needed))

    @override
    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._share_width()

    @override
    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.matches(QKeySequence.StandardKey.Copy):
            QGuiApplication.clipboard().setText(self._selected_text())
        else:
            super().keyPressEvent(event)

    def _selected_text(self) -> str:
        """Return the selected cells: tabs between columns, lines between rows."""
        lines: dict[int, list[str]] = {}
        for index in sorted(self.selectedIndexes()):
            lines.setdefault(index.row(), []).append(index.data() or "")
        return "\n".join("\t".join(cells) for cells in lines.values())
