"""The images of a solved swing as a table, worst first."""

from collections.abc import Sequence
from typing import Any

from PySide6.QtCore import QItemSelection, QItemSelectionModel, QModelIndex, Qt, Signal
from typing_extensions import override

from lightpen.detection.reasons import Reason
from lightpen.record.swings.interrupted import ImageRow
from lightpen_app.look.phrases import reason_text
from lightpen_app.look.theme import GRID
from lightpen_app.look.words import decimals_for, number_text, plain_tooltip
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.tables import RIGHT, Index, RowTable, TitledModel

NUMBER, MISFIT, LEDS, STATE = range(4)


class ImageModel(TitledModel):
    """Number, misfit, LEDs and state of each image."""

    n_columns = STATE + 1

    def __init__(self) -> None:
        super().__init__()
        self._rows: tuple[ImageRow, ...] = ()
        self._decimals = 3

    def rows(self) -> tuple[ImageRow, ...]:
        """Return the images in their order."""
        return self._rows

    def set_rows(self, rows: Sequence[ImageRow]) -> None:
        """Show other images."""
        self.beginResetModel()
        self._rows = tuple(rows)
        misfits = sorted(row.misfit for row in rows if row.is_used)
        middle = misfits[len(misfits) // 2] if misfits else 0.01
        self._decimals = decimals_for(middle)
        self.endResetModel()

    @override
    def rowCount(self, parent: Index | None = None) -> int:
        return 0 if parent is not None and parent.isValid() else len(self._rows)

    @override
    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        if role == Qt.ItemDataRole.DisplayRole:
            return self._text(self._rows[index.row()], index.column())
        if role == Qt.ItemDataRole.ToolTipRole:
            return plain_tooltip(self._text(self._rows[index.row()], STATE))
        if role == Qt.ItemDataRole.TextAlignmentRole and index.column() != STATE:
            return RIGHT
        return None

    @override
    def titles(self) -> tuple[str, ...]:
        return (
            self.tr("Image"),
            self.tr("RMS / px"),
            self.tr("LEDs"),
            self.tr("State"),
        )

    @override
    def side(self, column: int) -> Qt.AlignmentFlag:
        is_text = column == STATE
        return Qt.AlignmentFlag.AlignLeft if is_text else Qt.AlignmentFlag.AlignRight

    def _text(self, row: ImageRow, column: int) -> str:
        if column == NUMBER:
            return str(row.number)
        if column == LEDS:
            return str(row.n_leds)
        if column == STATE:
            return self._state(row)
        known = row.misfit == row.misfit
        return number_text(row.misfit, self._decimals) if known else ""

    def _state(self, row: ImageRow) -> str:
        if row.is_used:
            return self.tr("included")
        is_manual = row.reason is Reason.TAKEN_OUT
        return self.tr("excluded") if is_manual else reason_text(row.reason)


class ImageTable(Translated, RowTable):
    """Shows the images; current item and selection survive changes."""

    number_changed = Signal(int)  # of the current image
    selection_changed = Signal()  # selected images, or their state, have changed

    def __init__(self) -> None:
        self._model = ImageModel()
        super().__init__(self._model)
        self.say(self, self.tr("Images (worst first)"))
        self._model.setParent(self)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        for column, width in ((NUMBER, 7.5), (MISFIT, 11.5), (LEDS, 6.5)):
            self.setColumnWidth(column, round(width * GRID))

        # Connections
        chosen = self.selectionModel()
        chosen.currentRowChanged.connect(self._on_current_row_changed)
        chosen.selectionChanged.connect(self.selection_changed)

        self._refresh()

    def value(self) -> tuple[ImageRow, ...]:
        """Return the images in their order."""
        return self._model.rows()

    def set_value(self, rows: Sequence[ImageRow]) -> None:
        """Show images; current item and selection are kept."""
        current = self.number()
        selected = {row.number for row in self.selected()}
        chosen = self.selectionModel()
        blocked = chosen.blockSignals(True)
        self._model.set_rows(rows)
        places = {row.number: place for place, row in enumerate(self._model.rows())}
        whole = QItemSelection()
        for number in selected & places.keys():
            first = self._model.index(places[number], NUMBER)
            last = self._model.index(places[number], STATE)
            whole.select(first, last)
        at = self._model.index(places.get(current, 0) if current else 0, NUMBER)
        chosen.setCurrentIndex(at, QItemSelectionModel.SelectionFlag.NoUpdate)
        if whole.isEmpty() and at.isValid():
            whole.select(at, self._model.index(at.row(), STATE))
        chosen.select(whole, QItemSelectionModel.SelectionFlag.ClearAndSelect)
        chosen.blockSignals(blocked)
        self.viewport().update()
        if at.isValid():
            self.scrollTo(at)
            if self.number() != current:
                self.number_changed.emit(self._model.rows()[at.row()].number)
        self.selection_changed.emit()

    def number(self) -> int | None:
        """Return the number of the current image."""
        row = self.current()
        return None if row is None else row.number

    def current(self) -> ImageRow | None:
        """Return the current image."""
        at = self.currentIndex()
        return self._model.rows()[at.row()] if at.isValid() else None

    def selected(self) -> tuple[ImageRow, ...]:
        """Return the images that are selected."""
        places = self.selectionModel().selectedRows()
        return tuple(self._model.rows()[index.row()] for index in places)

    def choose(self, number: int) -> None:
        """Make an image current and the only one selected."""
        for place, row in enumerate(self._model.rows()):
            if row.number == number:
                self.selectRow(place)
                return

    @override
    def _refresh(self) -> None:
        self.show_other_words()

    def _on_current_row_changed(self, now: QModelIndex, _before: QModelIndex) -> None:
        if now.isValid():
            self.number_changed.emit(self._model.rows()[now.row()].number)
