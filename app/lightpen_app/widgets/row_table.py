"""A table with selection of whole rows, and its model."""

from typing import Any

from PySide6.QtCore import (
    QAbstractItemModel,
    QAbstractTableModel,
    QModelIndex,
    QPersistentModelIndex,
    Qt,
)
from PySide6.QtWidgets import QAbstractItemView, QHeaderView, QTableView
from typing_extensions import override

from lightpen_app.look.theme import GRID

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
