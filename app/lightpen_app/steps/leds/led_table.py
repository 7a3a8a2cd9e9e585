"""The LEDs of a pen as an editable table."""

from collections.abc import Mapping

from PySide6.QtCore import QItemSelectionModel, QModelIndex, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QKeyEvent, QPainter
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHeaderView,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QTableView,
    QWidget,
)
from typing_extensions import override

from lightpen.pen_check.draft import COLUMNS, CellError, PenDraft
from lightpen_app.look.quantities import number_text
from lightpen_app.look.sentences import worded
from lightpen_app.look.signs import Sign, draw_sign
from lightpen_app.look.theme import GRID, Tone, colors_of
from lightpen_app.look.tooltips import plain_tooltip
from lightpen_app.widgets.keys import ENTER_KEYS
from lightpen_app.widgets.row_table import Index, TitledModel
from lightpen_app.widgets.translated import Translated

N_COORDINATES = 3
MISFIT = 1 + len(COLUMNS)  # the last column; the first is the LED's number
ROW_HEIGHT = 25  # px; ten rows fit the window at 1280 x 800
LEAST_HEIGHT = 22 * GRID  # px; the head and five rows
SHOWN_DECIMALS = 3
NUMBER_WIDTH, MISFIT_WIDTH = 6 * GRID, 10 * GRID
SIGN_SIDE = 14
SIGN_ROLE = Qt.ItemDataRole.UserRole
ANYWHERE = QModelIndex()


class LedTable(Translated, QTableView):
    """Shows a draft; cells without a number, and LEDs that do not fit, are marked."""

    value_changed = Signal(object)  # PenDraft: the user typed into a cell
    led_chosen = Signal(int)  # number of the LED in the current row; 0 for none

    def __init__(self) -> None:
        super().__init__()
        self.say(self, self.tr("LED coordinates"))
        self.setObjectName("led_table")

        # Widgets
        self._model = _DraftModel(self)
        self.setModel(self._model)
        self.setItemDelegate(_SignDelegate(self))
        self.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectItems)
        self.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        self.setTabKeyNavigation(False)
        self.setEditTriggers(
            QAbstractItemView.EditTrigger.AnyKeyPressed
            | QAbstractItemView.EditTrigger.DoubleClicked
            | QAbstractItemView.EditTrigger.EditKeyPressed
        )
        self.verticalHeader().hide()
        rows = self.verticalHeader()
        rows.setSectionResizeMode(QHeaderView.ResizeMode.Fixed)
        rows.setDefaultSectionSize(ROW_HEIGHT)
        columns = self.horizontalHeader()
        columns.setSectionResizeMode(QHeaderView.ResizeMode.Stretch)
        for column, width in ((0, NUMBER_WIDTH), (MISFIT, MISFIT_WIDTH)):
            columns.setSectionResizeMode(column, QHeaderView.ResizeMode.Fixed)
            self.setColumnWidth(column, width)
        columns.setHighlightSections(False)
        columns.setMinimumSectionSize(6 * GRID)
        self.setWordWrap(False)
        self.setMinimumHeight(LEAST_HEIGHT)

        # Connections
        self._model.typed.connect(self.value_changed)
        self.selectionModel().currentChanged.connect(self._on_current_changed)

        self.show_normals(False)
        self._retranslate()

    def value(self) -> PenDraft:
        """Return the value."""
        return self._model.draft

    def set_value(self, value: PenDraft) -> None:
        """Show another draft; the current cell stays."""
        self._model.set_draft(value)

    def set_misfits(self, misfits: Mapping[int, float]) -> None:
        """Show the errors of LEDs in the image, by number, px."""
        self._model.set_misfits(misfits)

    def set_marked(self, reasons: Mapping[int, str]) -> None:
        """Mark LEDs by number, with the reason."""
        self._model.set_marked(reasons)

    def show_normals(self, shown: bool) -> None:
        """Show or hide the columns of the normals."""
        for column in range(1 + N_COORDINATES, MISFIT):
            self.setColumnHidden(column, not shown)

    def chosen(self) -> int:
        """Return the number of the current LED, 0 for none."""
        index = self.currentIndex()
        return index.row() + 1 if index.isValid() else 0

    def set_chosen(self, led: int) -> None:
        """Make the row of another LED current, in the column as before."""
        if led == self.chosen() or not 1 <= led <= self._model.rowCount():
            return
        column = max(self.currentIndex().column(), 1)
        index = self._model.index(led - 1, column)
        flags = QItemSelectionModel.SelectionFlag.ClearAndSelect
        self.selectionModel().setCurrentIndex(index, flags)
        self.scrollTo(index)

    @override
    def sizeHint(self) -> QSize:
        return QSize(42 * GRID, 40 * GRID)

    @override
    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Let Enter open the cell, not press the main button of the window."""
        index = self.currentIndex()
        if event.key() in ENTER_KEYS and index.isValid():
            is_open = self.state() == QAbstractItemView.State.EditingState
            if not is_open and index.flags() & Qt.ItemFlag.ItemIsEditable:
                self.edit(index)
            event.accept()  # an open cell has taken it already
        else:
            super().keyPressEvent(event)

    def _on_current_changed(self, current: Index, previous: Index) -> None:
        led = current.row() + 1 if current.isValid() else 0
        before = previous.row() + 1 if previous.isValid() else 0
        if led != before:
            self.led_chosen.emit(led)

    @override
    def _retranslate(self) -> None:
        self._model.retranslate()


class _DraftModel(TitledModel):
    """A draft with its errors and the live match of each LED."""

    n_columns = MISFIT + 1
    typed = Signal(object)

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.draft = PenDraft()
        self._flaws: dict[tuple[int, int], CellError] = {}
        self._misfits: Mapping[int, float] = {}
        self._reasons: Mapping[int, str] = {}

    def set_draft(self, draft: PenDraft) -> None:
        if draft == self.draft:
            return
        n_before, n_after = self.draft.n_leds, draft.n_leds
        if n_after < n_before:
            self.beginRemoveRows(QModelIndex(), n_after, n_before - 1)
        elif n_after > n_before:
            self.beginInsertRows(QModelIndex(), n_before, n_after - 1)
        self.draft = draft
        self._flaws = {(flaw.row, flaw.column): flaw for flaw in draft.flaws()}
        if n_after < n_before:
            self.endRemoveRows()
        elif n_after > n_before:
            self.endInsertRows()
        self._emit_data_changed(0, MISFIT)

    def set_misfits(self, misfits: Mapping[int, float]) -> None:
        if misfits != self._misfits:
            self._misfits = misfits
            self._emit_data_changed(MISFIT, MISFIT)

    def set_marked(self, reasons: Mapping[int, str]) -> None:
        if reasons != self._reasons:
            self._reasons = reasons
            self._emit_data_changed(0, 0)

    def retranslate(self) -> None:
        self.headerDataChanged.emit(Qt.Orientation.Horizontal, 0, MISFIT)

    @override
    def rowCount(self, parent: Index = ANYWHERE) -> int:
        return 0 if parent.isValid() else self.draft.n_leds

    @override
    def flags(self, index: Index) -> Qt.ItemFlag:
        flags = Qt.ItemFlag.ItemIsSelectable | Qt.ItemFlag.ItemIsEnabled
        if 0 < index.column() < MISFIT:
            flags |= Qt.ItemFlag.ItemIsEditable
        return flags

    @override
    def titles(self) -> tuple[str, ...]:
        coordinates = COLUMNS[:N_COORDINATES]
        return (
            self.tr("LED"),
            *(f"{name} / mm" for name in coordinates),
            *COLUMNS[N_COORDINATES:],
            self.tr("RMS / px"),
        )

    @override
    def hint(self, column: int) -> str | None:
        if column != MISFIT:
            return None
        return self.tr(
            "Distance between the detected LED and its table position in the "
            "live image / px"
        )

    @override
    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> object:
        row, column = index.row(), index.column()
        match role:
            case Qt.ItemDataRole.DisplayRole:
                return self._shown(row, column)
            case Qt.ItemDataRole.EditRole:
                return self._text(row, column)
            case Qt.ItemDataRole.TextAlignmentRole:
                middle = column == 0
                side = Qt.AlignmentFlag.AlignHCenter if middle else _RIGHT
                return side | Qt.AlignmentFlag.AlignVCenter
            case Qt.ItemDataRole.ToolTipRole:
                return plain_tooltip(self._remark(row, column))
            case Qt.ItemDataRole.AccessibleTextRole:
                return ": ".join(
                    filter(None, (self._text(row, column), self._remark(row, column)))
                )
            case _ if role == SIGN_ROLE:
                return Sign.WARNING if self._remark(row, column) else Sign.NONE
        return None

    @override
    def setData(
        self, index: Index, value: object, role: int = Qt.ItemDataRole.EditRole
    ) -> bool:
        draft = self.draft.with_cell(index.row(), index.column() - 1, str(value))
        if draft == self.draft:
            return False
        self.set_draft(draft)
        self.typed.emit(draft)
        return True

    def _text(self, row: int, column: int) -> str:
        if column == 0:
            return str(row + 1)
        if column == MISFIT:
            misfit = self._misfits.get(row + 1)
            return "" if misfit is None else f"{misfit:.3f}"
        return self.draft.rows[row][column - 1]

    def _shown(self, row: int, column: int) -> str:
        """Return the text of a cell, long numbers rounded; editing shows them whole."""
        text = self._text(row, column)
        is_long = len(text.partition(".")[2]) > SHOWN_DECIMALS
        if not is_long or column in (0, MISFIT) or (row, column - 1) in self._flaws:
            return text
        return number_text(float(text), SHOWN_DECIMALS)

    def _remark(self, row: int, column: int) -> str:
        if column in (0, MISFIT):
            return self._reasons.get(row + 1, "") if column == 0 else ""
        flaw = self._flaws.get((row, column - 1))
        return "" if flaw is None else worded(flaw.message)

    def _emit_data_changed(self, first: int, last: int) -> None:
        """Redraw columns; an open editor in one of them restarts."""
        end = self.index(self.rowCount() - 1, last)
        self.dataChanged.emit(self.index(0, first), end)


class _SignDelegate(QStyledItemDelegate):
    """Draws the warning sign at the left of a cell."""

    @override
    def paint(
        self, painter: QPainter, option: QStyleOptionViewItem, index: Index
    ) -> None:
        super().paint(painter, option, index)
        sign = index.data(SIGN_ROLE)
        if sign is Sign.NONE:
            return
        box = QRectF(option.rect)
        left = box.left() + GRID / 2
        place = QRectF(left, box.top(), SIGN_SIDE, box.height())
        color = colors_of(option.palette).tone(Tone.WARN)
        draw_sign(painter, place, sign, color)


_RIGHT = Qt.AlignmentFlag.AlignRight
