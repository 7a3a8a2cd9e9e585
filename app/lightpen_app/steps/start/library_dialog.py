"""The tip library: pens, tips and cones with their state, limits and due dates."""

from dataclasses import dataclass

from msgspec import structs
from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QStandardItem, QStandardItemModel
from PySide6.QtWidgets import (
    QAbstractItemView,
    QCheckBox,
    QDialog,
    QFrame,
    QTabBar,
    QWidget,
)
from typing_extensions import override

from lightpen.local_time import local_now
from lightpen.record.library.supervision import Signature
from lightpen.record.library.tip_library import (
    MADE,
    SWUNG,
    AnyItem,
    ItemKind,
    ListedTip,
    StationStatus,
    TipStatus,
)
from lightpen_app.look.layouts import horizontal_layout, vertical_layout
from lightpen_app.look.theme import GRID, TextSize, colors_of, text_label
from lightpen_app.look.words import PARTED
from lightpen_app.steps.start.item_form import ItemForm
from lightpen_app.widgets.controls import PushButton
from lightpen_app.widgets.fields import EnterEdit, SupervisorFields, Translated
from lightpen_app.widgets.fitting import FittedWindow
from lightpen_app.widgets.number_field import is_refusing
from lightpen_app.widgets.state_banner import SignLabel, StatusMessage, status_message
from lightpen_app.widgets.tables import RIGHT, ROW_HEIGHT, RowTable

LEAST_ROWS = 7
WIDTHS = (11, 16, 12, 11, 15, 20)  # of the columns but the last, in GRID
NUMBERS = (3, 4)  # columns of them
LIST_HEIGHT = 47 * GRID  # px, at least: its lead may take two lines
KINDS = (ItemKind.TIP, ItemKind.PEN, ItemKind.CONE, ItemKind.CAMERA, ItemKind.REFERENCE)
LONGEST_REASON = 200  # characters


@dataclass(frozen=True)
class RequestedChange:
    """A change that is requested."""

    item: AnyItem
    is_new: bool  # whether to add the item
    reason: str
    signature: Signature | None  # signature of a supervisor, if one is required
    before: AnyItem | None = None  # the item as displayed; None for a new one


class LibraryDialog(FittedWindow, Translated, QDialog):
    """Lists the items of the library; adds, changes and retires them."""

    change_asked = Signal(object)  # RequestedChange
    chosen = Signal(object, str)  # ItemKind, str: item to calibrate with

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.say(self, self.tr("Tip library"))
        self._statuses = StationStatus()
        self._pen = ""
        self._is_guarded = False
        self._item: AnyItem | None = None  # that is being added or changed
        self._before: AnyItem | None = None  # as first shown
        self._is_new = False
        self._asked: RequestedChange | None = None  # pending: not known to be stored

        # Widgets
        self._lead = self.say(
            text_label(TextSize.BODY),
            self.tr(
                "Pens, tips, cones, cameras and references with their limits. Each "
                "change is recorded in the archive with name and time."
            ),
        )
        self._names = (
            self.tr("Tips"),
            self.tr("Pens"),
            self.tr("Cones"),
            self.tr("Cameras"),
            self.tr("References"),
        )
        self._tabs = self.say_items(QTabBar(), self._names)
        columns = (
            self.tr("ID"),
            self.tr("State"),
            self.tr("Expiry date"),
            self.tr("Ball / mm"),
            self.tr("Change / mm"),
            self.tr("Calibrated on pens"),
            self.tr("Comment"),
        )
        self._model = QStandardItemModel(0, len(columns), self)
        self.say_items(self._model, columns)
        for column in NUMBERS:
            role = Qt.ItemDataRole.TextAlignmentRole
            self._model.setHeaderData(column, Qt.Orientation.Horizontal, RIGHT, role)
        self._table = RowTable(self._model)
        self._table.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        self._table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self._table.setMinimumHeight((LEAST_ROWS + 1) * ROW_HEIGHT)
        self._retired = self.say(QCheckBox(), self.tr("Show retired items"))
        self._use = self.make_button(self.tr("Choose"), self._on_use_clicked)
        self._add = self.make_button(self.tr("Add..."))
        self._edit = self.make_button(self.tr("Change..."), self._on_edit_clicked)
        self._retire = PushButton()
        self._close = self.make_button(self.tr("Close"))
        self._panel = QFrame()
        self._panel.setProperty("area", "panel")
        self._what = text_label(TextSize.LEAD)
        self.form = ItemForm()
        reason = self.tr("Reason for change")
        self._reason = self.say(EnterEdit(maxLength=LONGEST_REASON), hint=reason)
        self._supervisor = SupervisorFields()
        self._fault = SignLabel()
        self._save = self.make_button(self.tr("Save"), self._on_save_clicked)
        self._leave = self.make_button(self.tr("Cancel"), self._stop_editing)
        self._save.setDefault(True)

        # Layout
        self._list = QWidget()
        self._list.setMinimumHeight(LIST_HEIGHT)
        margins = (2 * GRID, GRID, 2 * GRID, GRID)
        vertical_layout(self, (self._list, 1), self._panel, spacing=-1, margins=margins)
        listed = vertical_layout(self._list, self._lead)
        horizontal_layout(listed, (self._tabs, 1), self._retired, spacing=-1)
        listed.addWidget(self._table, 1)
        horizontal_layout(
            listed, self._use, self._add, self._edit, self._retire, 1, self._close
        )
        parts = (self._what, self.form, self._supervisor, self._fault)
        panel = vertical_layout(self._panel, *parts, margins=margins)
        horizontal_layout(panel, (self._reason, 1), self._leave, self._save)
        self.setMinimumWidth(100 * GRID)
        self.resize(136 * GRID, 70 * GRID)

        # Connections
        self._tabs.currentChanged.connect(self._on_kind_changed)
        self._retired.toggled.connect(self._fill)
        self._table.selectionModel().currentRowChanged.connect(self._refresh_buttons)
        self._table.doubleClicked.connect(self._on_use_clicked)
        self._add.clicked.connect(lambda: self.add(""))
        self._retire.clicked.connect(self._on_retire_clicked)
        self._close.clicked.connect(self.accept)
        self.form.value_edited.connect(self._refresh_buttons)
        self._supervisor.value_edited.connect(self._refresh_buttons)

        self._stop_editing()
        self._refresh()

    @override
    def reject(self) -> None:
        """Close the open form, or the dialog if no form is open."""
        if self._panel.isVisible():
            self._stop_editing()
        else:
            super().reject()

    @override
    def done(self, result: int) -> None:
        self._stop_editing()
        super().done(result)

    def kind(self) -> ItemKind:
        """Return the kind of the shown items."""
        return KINDS[self._tabs.currentIndex()]

    def set_kind(self, kind: ItemKind) -> None:
        """Show the items of another kind."""
        self._tabs.setCurrentIndex(KINDS.index(kind))

    def set_value(self, statuses: StationStatus, pen: str, *, is_guarded: bool) -> None:
        """Show the status of all items; tips of a pen, if one is selected.

        If guarded, a supervisor has to sign each change.
        """
        self._statuses, self._pen, self._is_guarded = statuses, pen, is_guarded
        self._fill()

    def add(self, name: str, kind: ItemKind | None = None) -> None:
        """Open the form for a new item, optionally with its id."""
        self.set_kind(kind or self.kind())
        made = structs.replace(MADE[self.kind()](id="?"), id=name)
        self._start_editing(made, self.tr("New item"), is_new=True)

    def show_kept(self, asked: RequestedChange) -> None:
        """Show that the requested change is done, if still pending."""
        if asked is self._asked:
            self._stop_editing()

    def show_refused(self, asked: RequestedChange, fault: str) -> bool:
        """Show why a change was refused; return whether it was still pending."""
        if asked is not self._asked:
            return False
        self._asked = None
        self._fault.set_value(StatusMessage.fault(fault))
        self._refresh_buttons()
        return True

    def current(self) -> AnyItem | None:
        """Return the item that is chosen in the table."""
        at = self._table.currentIndex()
        if not at.isValid():
            return None
        name = self._model.item(at.row(), 0).text()
        return self._statuses.library.item(self.kind(), name)

    def _fill(self) -> None:
        present, library = self.current(), self._statuses.library
        self._model.removeRows(0, self._model.rowCount())
        for item in library.items(self.kind()).values():
            if self._retired.isChecked() or not item.is_retired:
                self._model.appendRow(self._row(item))
                if present is not None and item.id == present.id:
                    self._table.selectRow(self._model.rowCount() - 1)
        if self.current() is None:
            self._table.selectRow(0)
        self._refresh_buttons()

    def _row(self, item: AnyItem) -> list[QStandardItem]:
        status, due = self._statuses.of_item(item.kind, item.id), item.due
        ball, change, pens = "", "", ""
        if isinstance(item, ListedTip):
            ball = "" if item.ball_diameter_mm is None else f"{item.ball_diameter_mm:g}"
            change = "" if item.max_change_mm is None else f"{item.max_change_mm:g}"
            pens = PARTED.join(self._statuses.pens_of(item.id))
            if self._pen and status is not TipStatus.RETIRED:
                status = self._statuses.of_tip(self._pen, item.id)
                due = self._statuses.due(self._pen, item.id) or due
        remark = status_message(status)
        texts = (
            item.id,
            remark.text,
            "" if due is None else f"{due}",
            ball,
            change,
            pens,
            item.note,
        )
        row = [QStandardItem(text) for text in texts]
        for column in NUMBERS:
            row[column].setTextAlignment(RIGHT)
        row[1].setForeground(colors_of(self.palette()).tone(remark.tone))
        return row

    def _start_editing(self, item: AnyItem, what: str, *, is_new: bool) -> None:
        self._item, self._before, self._is_new = item, None if is_new else item, is_new
        self._what.setText(what)
        self.form.set_value(item, is_new=is_new)
        self.form.show()
        self._open_panel()
        self.form.focus_first()

    def _open_panel(self) -> None:
        self._asked = None
        self._reason.clear()
        self._supervisor.clear()
        self._supervisor.setVisible(self._is_guarded)
        self._fault.set_value(StatusMessage())
        self._list.hide()  # both are too high for a low screen
        self._panel.show()
        self._refresh_buttons()
        self.resize(self.width(), self.sizeHint().height())

    def _stop_editing(self) -> None:
        self._item = self._asked = None
        self._panel.hide()
        self._list.show()
        self._refresh_buttons()
        self.resize(self.width(), self.sizeHint().height())

    def _on_kind_changed(self) -> None:
        self._stop_editing()
        self._fill()
        self._refresh()

    def _on_edit_clicked(self) -> None:
        item = self.current()
        if item is not None:
            self._start_editing(item, item.id, is_new=False)

    def _on_retire_clicked(self) -> None:
        """Retire an item or return it to use, with a reason."""
        item = self.current()
        if item is None:
            return
        back = item.is_retired
        self._item, self._before = structs.replace(item, is_retired=not back), item
        self._is_new = False
        words = self.tr("Reactivate {0}") if back else self.tr("Retire {0}")
        self._what.setText(words.format(item.id))
        self.form.hide()
        self._open_panel()

    def _on_use_clicked(self) -> None:
        item = self.current()
        if item is not None and not item.is_retired and item.kind in SWUNG:
            self.accept()
            self.chosen.emit(item.kind, item.id)

    def _on_save_clicked(self) -> None:
        if self._item is None or not self._save.isEnabled():
            return
        is_typed = not self.form.isHidden()
        if is_typed and is_refusing(self.form):
            return
        item = self.form.value() if is_typed else self._item
        signature = self._supervisor.value() if self._is_guarded else None
        self._fault.set_value(StatusMessage())
        reason = self._reason.text().strip()
        self._asked = RequestedChange(
            item, self._is_new, reason, signature, self._before
        )
        self._refresh_buttons()
        self.change_asked.emit(self._asked)

    def _refresh_buttons(self) -> None:
        item = self.current()
        nothing = "" if item is not None else self.tr("Select an item in the table.")
        is_retired = item is not None and item.is_retired
        why_not = self.tr("This item is retired.") if is_retired else nothing
        self._use.setVisible(self.kind() in SWUNG)
        self._use.set_why_not(why_not, self.tr("Use this item for calibration"))
        self._edit.set_why_not(nothing, self.tr("Edit this item"))
        self._retire.set_why_not(nothing, self.tr("Retired items stay in the archive"))
        self._retire.setText(
            self.tr("Reactivate...") if is_retired else self.tr("Retire...")
        )
        is_typed = not self.form.isHidden()
        missing_inputs = ""
        if is_typed and not self.form.has_id():
            missing_inputs = self.tr("Enter an ID.")
        elif is_typed and not self.form.has_day():
            missing_inputs = self.tr(
                "Enter a date such as 2026-08-14, or leave it empty."
            ).replace("2026", str(local_now().year + 1))  # due dates lie in the future
        if not missing_inputs and self._is_guarded and not self._supervisor.is_filled():
            missing_inputs = self.tr("Changes need a supervisor's signature.")
        is_asked = self.tr("Saving") if self._asked is not None else ""
        self._save.set_why_not(
            is_asked or missing_inputs, self.tr("Saved with your name and the time")
        )
        self._leave.set_why_not(is_asked)

    @override
    def _refresh(self) -> None:
        is_tips = self.kind() is ItemKind.TIP
        for column, width in enumerate(WIDTHS):
            self._table.setColumnWidth(column, width * GRID)
            self._table.setColumnHidden(column, 3 <= column <= 5 and not is_tips)
        self.say(self._table, self._names[self._tabs.currentIndex()])
        self._fill()
