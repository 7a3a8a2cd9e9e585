"""A table with selection of whole rows."""

from PySide6.QtCore import QAbstractItemModel, Qt
from PySide6.QtWidgets import QAbstractItemView, QHeaderView, QTableView, QWidget

from lightpen_app.look.theme import GRID

ROW_HEIGHT = 7 * GRID // 2


class RowTable(QTableView):
    """Shows the rows of a model, all of one height; several can be selected."""

    def __init__(
        self, model: QAbstractItemModel, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
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
        across.setDefaultAlignment(
            Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
        )
        across.setStretchLastSection(True)

    def show_other_words(self) -> None:
        """Update the texts in the selected language."""
        model = self.model()
        across = Qt.Orientation.Horizontal
        model.headerDataChanged.emit(across, 0, model.columnCount() - 1)
        self.viewport().update()
