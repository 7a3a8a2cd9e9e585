"""Tables: of numbers that can be edited, and of rows that can be chosen."""

from dataclasses import dataclass
from typing import Any

from PySide6.QtCore import (
    QAbstractItemModel,
    QAbstractTableModel,
    QModelIndex,
    QPersistentModelIndex,
    QSize,
    Qt,
)
from PySide6.QtGui import QGuiApplication, QKeyEvent, QKeySequence, QResizeEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHeaderView,
    QSizePolicy,
    QTableView,
    QTableWidget,
    QTableWidgetItem,
)
from typing_extensions import override

from lightpen_app.look.theme import GRID, TextSize, set_size
from lightpen_app.look.words import plain_tooltip

Index = QModelIndex | QPersistentModelIndex
ROW_HEIGHT = 7 * GRID // 2
LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
RIGHT = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter


class TitledModel(QAbstractTableModel):
    """A model whose columns have titles."""

    n_columns: int

    def titles(self) -> tuple[str, ...]:
        """Return the titles of the columns in the selected language."""
        raise NotImplementedError

    def side(self, column: int) -> Qt.AlignmentFlag | None:
        """Return the horizontal alignment of a title; None for the view's."""

    def hint(self, column: int) -> str | None:
        """Return the tool tip of a title, if it has one."""

    @override
    def columnCount(self, parent: Index | None = None) -> int:
        is_cell = parent is not None and parent.isValid()
        return 0 if is_cell else self.n_columns

    @override
    def headerData(
        self,
        section: int,
        orientation: Qt.Orientation,
        role: int = Qt.ItemDataRole.DisplayRole,
    ) -> Any:
        if orientation != Qt.Orientation.Horizontal:
            return None
        match role:
            case Qt.ItemDataRole.DisplayRole:
                return self.titles()[section]
            case Qt.ItemDataRole.ToolTipRole:
                return self.hint(section)
            case Qt.ItemDataRole.TextAlignmentRole:
                side = self.side(section)
                return None if side is None else side | Qt.AlignmentFlag.AlignVCenter
        return None


class RowTable(QTableView):
    """Shows the rows of a model, all of one height; several can be selected."""

    def __init__(self, model: QAbstractItemModel) -> None:
        super().__init__()
        self.setModel(model)
        self.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.setSelectionMode(QAbstractItemView.SelectionMode.ExtendedSelection)
        self.setTabKeyNavigation(False)
        self.setShowGrid(False)
        self.setWordWrap(False)
        self.verticalHeader().hide()
        self.verticalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Fixed)
        self.verticalHeader().setDefaultSectionSize(ROW_HEIGHT)
        across = self.horizontalHeader()
        across.setHighlightSections(False)
        across.setDefaultAlignment(LEFT)
        across.setStretchLastSection(True)

    def show_other_words(self) -> None:
        """Update the texts in the selected language."""
        model = self.model()
        across = Qt.Orientation.Horizontal
        model.headerDataChanged.emit(across, 0, model.columnCount() - 1)
        self.viewport().update()


NUMBER_ROW_HEIGHT = 3 * GRID  # px; also of the header
WIDEST_NAME = 28 * GRID  # px, of a row; a longer one loses its end


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
        down.setTextElideMode(Qt.TextElideMode.ElideRight)
        down.setMaximumWidth(WIDEST_NAME)
        down.setSectionResizeMode(QHeaderView.ResizeMode.Fixed)
        down.setHighlightSections(False)
        self.set_letters(TextSize.BODY)

    def set_letters(self, size: TextSize) -> None:
        """Show the figures smaller or as usual."""
        # Before the heights: none is less than the letters are high.
        for each in (self, self.horizontalHeader(), self.verticalHeader()):
            set_size(each, size)
        self.horizontalHeader().setFixedHeight(NUMBER_ROW_HEIGHT)
        self.verticalHeader().setDefaultSectionSize(NUMBER_ROW_HEIGHT)
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
        for i, name in enumerate(value.rows):
            self.verticalHeaderItem(i).setToolTip(plain_tooltip(name))
        for i, row in enumerate(value.cells):
            for j, text in enumerate(row):
                item = QTableWidgetItem(text)
                item.setTextAlignment(RIGHT)
                self.setItem(i, j, item)
        self._share_width()
        self.updateGeometry()

    @override
    def sizeHint(self) -> QSize:
        height = NUMBER_ROW_HEIGHT * (1 + self.rowCount()) + 2
        return QSize(super().sizeHint().width(), height)

    @override
    def minimumSizeHint(self) -> QSize:
        names = min(self.verticalHeader().sizeHint().width(), WIDEST_NAME)
        width = sum(self._needed()) + names
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
