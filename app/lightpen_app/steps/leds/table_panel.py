"""The LEDs as a table with what belongs to them: discs and nominal tip."""

from collections.abc import Mapping
from dataclasses import replace
from enum import Enum, auto

from PySide6.QtCore import QItemSelectionModel, QModelIndex, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QKeyEvent, QPainter
from PySide6.QtWidgets import (
    QAbstractItemView,
    QCheckBox,
    QGroupBox,
    QHeaderView,
    QLabel,
    QLineEdit,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QTableView,
    QWidget,
)
from typing_extensions import override

from lightpen.messages import Message
from lightpen.model.pen import MAX_LEDS, MIN_LEDS
from lightpen.pen_check.draft import COLUMNS, CellError, PenDraft
from lightpen_app.look.languages import worded
from lightpen_app.look.layouts import grid_layout, vertical_layout
from lightpen_app.look.signs import Sign, draw_sign
from lightpen_app.look.theme import (
    GRID,
    TextSize,
    Tone,
    colors_of,
    set_tone,
    text_label,
)
from lightpen_app.look.words import (
    AXES,
    in_unit,
    number_text,
    plain_tooltip,
    set_tooltip,
)
from lightpen_app.widgets.controls import ENTER_KEYS
from lightpen_app.widgets.fields import EnterEdit, Translated
from lightpen_app.widgets.state_banner import SignLabel, StatusMessage
from lightpen_app.widgets.tables import Index, TitledModel

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
            case Qt.ItemDataRole.ForegroundRole if (row, column - 1) in self._flaws:
                widget = self.parent()
                assert isinstance(widget, QWidget)
                return colors_of(widget.palette()).tone(Tone.BAD)
            case _ if role == SIGN_ROLE:
                return Sign.WARNING if self._remark(row, column) else Sign.NONE
        return None

    @override
    def setData(
        self, index: Index, value: object, role: int = Qt.ItemDataRole.EditRole
    ) -> bool:
        column = index.column() - 1
        text = in_unit(str(value), "mm") if column < N_COORDINATES else str(value)
        draft = self.draft.with_cell(index.row(), column, text)
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


class Changes(Enum):
    """Difference of the table from the file in use."""

    NONE = auto()
    FOREIGN = auto()  # it shows another file, which cannot be used
    EDITED = auto()


class LedTablePanel(Translated, QGroupBox):
    """Shows and edits a draft."""

    value_changed = Signal(object)  # PenDraft: the user changed it
    discard_requested = Signal()
    led_chosen = Signal(int)  # number of the current LED, 0 for none

    def __init__(self, undo: QWidget) -> None:
        super().__init__()
        self._value = PenDraft()
        self._changes = Changes.NONE
        self._override = ""

        # Widgets
        self._table = LedTable()
        self._flaw = SignLabel()
        self._add = self.make_button(
            self.tr("Add"), self._on_add_clicked, least_width=0
        )
        self._remove = self.make_button(
            self.tr("Remove"), self._on_remove_clicked, least_width=0
        )
        self._discard = self.make_button(
            self.tr("Discard"), self.discard_requested, least_width=0
        )
        self._normals = self.say(QCheckBox(), self.tr("Show normals"))
        self._diameter_label = self.say(QLabel(), self.tr("&Disc \u00d8, mm"))
        self._diameter = self.say(EnterEdit(), self.tr("Diameter of the LED discs, mm"))
        self._diameter_label.setBuddy(self._diameter)
        self._tip_label = self.say(QLabel(), self.tr("&Tip x y z, mm"))
        self._tip = tuple(EnterEdit() for _ in AXES)
        self._tip_label.setBuddy(self._tip[0])
        self._override_label = text_label(TextSize.SMALL, Tone.QUIET)

        # Layout
        layout = vertical_layout(self, (self._table, 1), self._flaw)
        buttons = grid_layout(layout)
        buttons.addWidget(self._add, 0, 0)
        buttons.addWidget(self._remove, 0, 1)
        buttons.addWidget(self._discard, 0, 2)
        buttons.addWidget(undo, 1, 0, 1, 3)
        for column in range(3):
            buttons.setColumnStretch(column, 1)
        fields = grid_layout(layout)
        fields.addWidget(self._diameter_label, 0, 0)
        fields.addWidget(self._diameter, 0, 1)
        fields.addWidget(self._normals, 0, 2, 1, 2)
        fields.addWidget(self._tip_label, 1, 0)
        for column, edit in enumerate(self._tip, 1):
            fields.addWidget(edit, 1, column)
            fields.setColumnStretch(column, 1)
        layout.addWidget(self._override_label)

        # Connections
        self._table.value_changed.connect(self._take)
        self._table.led_chosen.connect(self._on_led_chosen)
        self._normals.toggled.connect(self._table.show_normals)
        self._diameter.textEdited.connect(self._on_diameter_edited)
        for edit in self._tip:
            edit.textEdited.connect(self._on_tip_edited)
        for edit in (self._diameter, *self._tip):
            edit.editingFinished.connect(self._on_typed)

        self._retranslate()

    def set_value(self, value: PenDraft, changes: Changes) -> None:
        """Show another draft; one that differs from the file can be discarded."""
        self._value = value
        self._changes = changes
        self._table.set_value(value)
        if value.has_normals:
            self._normals.setChecked(True)
        _show(self._diameter, value.diameter)
        for edit, text in zip(self._tip, value.tip, strict=True):
            _show(edit, text)
        self._refresh()

    def set_flaw(self, flaw: Message | None) -> None:
        """Show which cell or field is wrong."""
        self._flaw.set_value(StatusMessage(worded(flaw), Sign.WARNING, Tone.BAD))
        code, axis = ("", "") if flaw is None else (flaw.code, flaw.values.get("axis"))
        is_wrong = code in ("draft.diameter", "draft.disc-diameter")
        set_tone(self._diameter, Tone.BAD if is_wrong else Tone.PLAIN)
        for own, edit in zip(AXES, self._tip, strict=True):
            is_wrong = code == "draft.nominal-tip" and axis == own
            set_tone(edit, Tone.BAD if is_wrong else Tone.PLAIN)

    def flaw(self) -> str:
        """Return the message on the cells."""
        return self._flaw.value().text

    def set_overriding_tip(self, point: str) -> None:
        """Show that another nominal tip is in use; hide it with an empty text."""
        self._override = point
        self._refresh()

    def set_misfits(self, misfits: Mapping[int, float]) -> None:
        """Show the errors of LEDs in the image, by number, px."""
        self._table.set_misfits(misfits)

    def set_marked(self, reasons: Mapping[int, str]) -> None:
        """Mark LEDs by number, with the reason."""
        self._table.set_marked(reasons)

    def focus_cells(self) -> None:
        """Move the focus from a vanishing button to the cells."""
        self._table.setFocus(Qt.FocusReason.OtherFocusReason)

    def set_chosen(self, led: int) -> None:
        """Make the row of another LED current."""
        self._table.set_chosen(led)

    def _take(self, draft: PenDraft) -> None:
        self.value_changed.emit(draft)

    def _on_led_chosen(self, led: int) -> None:
        self._refresh()
        self.led_chosen.emit(led)

    def _on_add_clicked(self) -> None:
        self._take(self._value.with_led())
        self._table.set_chosen(self._value.n_leds)
        self._table.setFocus()

    def _on_remove_clicked(self) -> None:
        self._take(self._value.without_led(self._table.chosen() - 1))

    def _on_diameter_edited(self, text: str) -> None:
        self._take(replace(self._value, diameter=text.strip()))

    def _on_typed(self) -> None:
        """Show what was typed in another unit in mm."""
        diameter = in_unit(self._diameter.text(), "mm")
        tip = tuple(in_unit(edit.text(), "mm") for edit in self._tip)
        if (diameter, tip) != (self._value.diameter, self._value.tip):
            self._take(replace(self._value, diameter=diameter, tip=tip))

    def _on_tip_edited(self) -> None:
        tip = tuple(edit.text().strip() for edit in self._tip)
        self._take(replace(self._value, tip=tip))

    def _refresh(self) -> None:
        self.setTitle(
            self.tr("LED coordinates (modified)")
            if self._changes is Changes.EDITED
            else self.tr("LED coordinates")
        )
        n_leds, chosen = self._value.n_leds, self._table.chosen()
        self._add.setEnabled(n_leds < MAX_LEDS)
        set_tooltip(self._add, self.tr("Add an LED at the end"))
        if not chosen:
            why_not = self.tr("Select an LED in the table.")
        elif n_leds <= MIN_LEDS:
            why_not = self.tr("A pen needs at least {0} LEDs.").format(MIN_LEDS)
        else:
            why_not = ""
        tooltip = self.tr("Remove LED {0}; the following LEDs are renumbered.").format(
            chosen
        )
        self._remove.set_why_not(why_not, tooltip)
        unchanged = self._changes is Changes.NONE
        why_not = self.tr("No changes") if unchanged else ""
        tooltip = (
            self.tr("Restore the coordinates of the file")
            if self._changes is Changes.EDITED
            else self.tr("Restore the file in use")
        )
        self._discard.set_why_not(why_not, tooltip)
        text = self.tr("Nominal tip in use (step Start): {0} mm")
        self._override_label.setText(text.format(self._override))
        self._override_label.setVisible(bool(self._override))

    def _retranslate(self) -> None:
        for axis, edit in zip(AXES, self._tip, strict=True):
            name = self.tr("Nominal tip centre, {0}, mm").format(axis)
            edit.setAccessibleName(name)
            set_tooltip(edit, name)
            edit.setPlaceholderText(axis)
        set_tooltip(self._diameter, self._diameter.accessibleName())
        self._refresh()


def _show(edit: QLineEdit, text: str) -> None:
    """Show a text unless the user is editing it."""
    if edit.text().strip() != text:
        edit.setText(text)
