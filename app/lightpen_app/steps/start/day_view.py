"""The day page: tips of the station, and readiness for a swing."""

from collections.abc import Sequence
from functools import partial

from PySide6.QtCore import QModelIndex, Signal
from PySide6.QtGui import QColor, QKeyEvent, QStandardItem, QStandardItemModel
from PySide6.QtWidgets import QAbstractItemView, QFrame, QHeaderView, QLineEdit, QWidget
from typing_extensions import override

from lightpen.model.limits import COLDEST, WARMEST
from lightpen_app.face import ReadinessItem
from lightpen_app.look.layouts import (
    fill,
    horizontal_layout,
    set_stacked,
    vertical_layout,
)
from lightpen_app.look.theme import (
    GRID,
    TextSize,
    Tone,
    colors_of,
    set_tone,
    text_label,
)
from lightpen_app.look.words import set_tooltip
from lightpen_app.steps.start.day_state import TipRow
from lightpen_app.widgets.controls import ENTER_KEYS, PushButton
from lightpen_app.widgets.fields import ChoiceField, Translated
from lightpen_app.widgets.number_field import NumberField, is_refusing
from lightpen_app.widgets.state_banner import SignLabel, StatusMessage
from lightpen_app.widgets.tables import RIGHT, RowTable


class ReadinessLine(QFrame):
    """Shows station and operator, what is ready, and below it what is not."""

    step_requested = Signal(str)  # where an item is put right

    def __init__(self, n_items: int) -> None:
        super().__init__()
        self.setProperty("area", "panel")
        self._items: tuple[ReadinessItem, ...] = ()

        # Widgets
        self._place = text_label(TextSize.LEAD)
        self._buttons = tuple(PushButton(0) for _ in range(n_items))
        self._reasons = tuple(SignLabel() for _ in range(n_items))

        # Layout
        margins = (2 * GRID, GRID, 2 * GRID, GRID)
        layout = vertical_layout(self, margins=margins)
        self._row = horizontal_layout(layout, (self._place, 1))
        pairs = (self._buttons[i : i + 2] for i in range(0, n_items, 2))
        self._pairs = horizontal_layout(self._row)
        for pair in pairs:
            horizontal_layout(self._pairs, *pair, 1)
        for reason in self._reasons:
            layout.addWidget(reason)

        # Connections
        for index, button in enumerate(self._buttons):
            button.setFlat(True)
            button.clicked.connect(partial(self._on_clicked, index))

    def items(self) -> tuple[ReadinessItem, ...]:
        """Return the displayed value."""
        return self._items

    def set_narrow(self, narrow: bool) -> None:
        """Put the place above the items where there is little width."""
        for row in (self._row, self._pairs):
            set_stacked(row, narrow)

    def set_place(self, place: str) -> None:
        """Show station and operator."""
        self._place.setText(place)

    def set_items(self, items: Sequence[ReadinessItem]) -> None:
        """Show other items; those not ready with name and reason."""
        if tuple(items) == self._items:
            return
        self._items = tuple(items)
        for button in self._buttons[len(items) :]:
            button.hide()
        for item, button, reason in zip(
            items, self._buttons, self._reasons, strict=False
        ):
            text = item.name if item.is_amber else item.message.text
            button.setText(text)
            button.set_mark(item.message.sign, item.message.tone)
            button.setAccessibleDescription(item.message.text)
            set_tooltip(button, item.message.text if item.is_amber else "")
            set_tone(button, item.message.tone)
            reason.set_value(item.message if item.is_amber else StatusMessage())

    def _on_clicked(self, index: int) -> None:
        if index < len(self._items):
            self.step_requested.emit(self._items[index].step)


N_ITEMS = 4  # of the readiness line
N_COLUMNS = 6
LEAST_HEIGHT = 22 * GRID  # px, of the table


class SearchEdit(QLineEdit):
    """A field whose Enter takes what is typed; empty, it leaves Enter to the page."""

    entered = Signal(str)

    @override
    def keyPressEvent(self, event: QKeyEvent) -> None:
        text = self.text().strip()
        if event.key() in ENTER_KEYS and text:
            self.clear()
            self.entered.emit(text)
            return
        super().keyPressEvent(event)


class TemperatureField(NumberField):
    """A temperature of the pen, or the lowest value for none; Enter enters it."""

    entered = Signal()

    def __init__(self) -> None:
        super().__init__("\N{DEGREE SIGN}C", (COLDEST, WARMEST), 1)

    @override
    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in ENTER_KEYS:
            self.settle()
            self.entered.emit()
            return
        super().keyPressEvent(event)

    def temperature(self) -> float | None:
        """Return the temperature, degrees Celsius; None if not measured."""
        return None if self.value() == COLDEST else self.value()


class DayView(Translated, QWidget):
    """Daily settings; the station setup is a view of its own."""

    tip_chosen = Signal(str, str)  # pen and tip of the row that was chosen
    tip_entered = Signal(str)  # text of the field
    rows_changed = Signal()  # the user narrowed the table or widened it
    # Temperature of the pen, degrees Celsius, or None if not measured.
    temperature_entered = Signal(object)
    step_requested = Signal(str)  # where something is put right
    swing_requested = Signal()  # the plain buttons
    setup_requested = Signal()

    def __init__(self) -> None:
        super().__init__()
        self._rows: tuple[TipRow, ...] = ()
        self._shown: tuple[TipRow, ...] = ()
        self._chosen = ("", "")

        # Widgets
        self._ready = ReadinessLine(N_ITEMS)
        self._question = self.say(
            text_label(TextSize.BODY), self.tr("Pen temperature today")
        )
        self._temperature = self.say(
            TemperatureField(),
            self.tr("Pen temperature today"),
            hint=self.tr("not measured"),
        )
        self._answer = self.make_button(self.tr("Confirm"), self._on_answered)
        self._asking = QWidget()
        self._asking.hide()  # as it appears, it offers the last temperature
        self._question.setBuddy(self._temperature)
        self._search = self.say(
            SearchEdit(), self.tr("Search tips"), hint=self.tr("Scan or type a tip")
        )
        self._which = self.say(ChoiceField(), self.tr("Tips shown"))
        self.say_items(self._which, (self.tr("All tips"), self.tr("Due tips")))
        columns = (
            self.tr("Tip"),
            self.tr("Pen"),
            self.tr("Due"),
            self.tr("U (k = 2)"),
            self.tr("Calibrated"),
            self.tr("Verdict"),
        )
        self._model = QStandardItemModel(0, len(columns), self)
        self.say_items(self._model, columns)
        self._table = self.say(RowTable(self._model), self.tr("Tips of this station"))
        self._table.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        self._table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self._table.setMinimumHeight(LEAST_HEIGHT)
        across = self._table.horizontalHeader()
        across.setStretchLastSection(False)
        across.setSectionResizeMode(QHeaderView.ResizeMode.Stretch)
        self._details = text_label(TextSize.BODY, Tone.QUIET)
        self._swing = self.make_button(self.tr("Swing anyway"), self.swing_requested)
        self._setup = self.make_button(
            self.tr("Set up station..."), self.setup_requested
        )

        # Layout
        layout = vertical_layout(self, spacing=2 * GRID)
        fill(layout, self._ready, self._asking)
        asked = self._question, self._temperature, self._answer
        horizontal_layout(self._asking, *asked, 1)
        self._columns = horizontal_layout(layout, spacing=3 * GRID, stretch=1)
        left = vertical_layout(self._columns, stretch=3)
        horizontal_layout(left, (self._search, 1), self._which)
        fill(left, (self._table, 1), self._details)
        # The last result, beside the table.
        self.side = vertical_layout(self._columns, spacing=2 * GRID, stretch=2)
        horizontal_layout(layout, self._setup, 1, self._swing)

        # Connections
        self._ready.step_requested.connect(self._on_step_requested)
        self._temperature.entered.connect(self._on_answered)
        self._search.textChanged.connect(self._on_narrowed)
        self._search.entered.connect(self.tip_entered)
        self._which.activated.connect(self._on_narrowed)
        self._table.selectionModel().currentRowChanged.connect(self._on_row_changed)

        self._refresh()

    def first_control(self) -> QWidget:
        """Return the field that has the focus at first."""
        return self._search

    def readiness(self) -> tuple[ReadinessItem, ...]:
        """Return the text on the swing."""
        return self._ready.items()

    def set_question(self, temperature_c: float | None, *, is_asked: bool) -> None:
        """Ask for the pen's temperature; the last one is offered, or none."""
        if is_asked and self._asking.isHidden():
            last = COLDEST if temperature_c is None else temperature_c
            self._temperature.set_value(last)
        self._asking.setVisible(is_asked)

    def rows(self) -> tuple[TipRow, ...]:
        """Return the rows that are shown."""
        return self._shown

    def search(self) -> str:
        """Return the text that the rows match."""
        return self._search.text().strip()

    def set_narrow(self, narrow: bool) -> None:
        """Put the last result below the table where there is little width."""
        set_stacked(self._columns, narrow)
        self._ready.set_narrow(narrow)

    def set_ready(
        self, place: str, items: Sequence[ReadinessItem], *, can_swing: bool
    ) -> None:
        """Show station, operator and readiness; offer a swing if it is incomplete."""
        self._ready.set_place(place)
        self._ready.set_items(items)
        is_amber = any(item.is_amber for item in items)
        self._swing.setVisible(is_amber and can_swing)

    def set_tips(
        self, rows: Sequence[TipRow], chosen: tuple[str, str], details: str
    ) -> None:
        """Show other tips; ``chosen`` is the selected pen and tip."""
        self._details.setText(details)
        if tuple(rows) == self._rows and chosen == self._chosen:
            return
        self._rows, self._chosen = tuple(rows), chosen
        self._fill()

    def _fill(self) -> None:
        """Show the rows that match what is typed."""
        text, is_all = self.search(), self._which.currentIndex() == 0
        self._shown = tuple(
            row
            for row in self._rows
            if row.matches(text)
            and (is_all or row.is_due or (row.pen, row.tip) == self._chosen)
        )
        selection = self._table.selectionModel()
        blocked = selection.blockSignals(True)
        self._model.removeRows(0, self._model.rowCount())
        for index, row in enumerate(self._shown):
            self._model.appendRow(self._cells(row))
            if (row.pen, row.tip) == self._chosen:
                self._table.selectRow(index)
        selection.blockSignals(blocked)
        self._table.viewport().update()

    def _on_narrowed(self) -> None:
        self._fill()
        self.rows_changed.emit()

    def _cells(self, row: TipRow) -> list[QStandardItem]:
        texts = (row.tip, row.pen, row.due.text, row.uncertainty, row.age)
        cells = [QStandardItem(text) for text in (*texts, row.grade.text)]
        colors = colors_of(self.palette())
        for column, tone in ((2, row.due.tone), (5, row.grade.tone)):
            cells[column].setForeground(QColor(colors.tone(tone)))
        cells[3].setTextAlignment(RIGHT)
        for cell in cells:
            set_tooltip(cell, cell.text())
        return cells

    def _on_step_requested(self, step: str) -> None:
        """Go to a step, or to the setup on this one."""
        if step == "temperature":
            self.take_temperature()
        else:
            self.step_requested.emit(step)

    def take_temperature(self) -> None:
        """Lead to the question, or to where an answer is changed."""
        if self._asking.isHidden():
            self.setup_requested.emit()
        else:
            self._temperature.setFocus()
            self._temperature.selectAll()

    def _on_answered(self) -> None:
        if not is_refusing(self._asking):
            self.temperature_entered.emit(self._temperature.temperature())

    def _on_row_changed(self, now: QModelIndex) -> None:
        if now.isValid() and now.row() < len(self._shown):
            row = self._shown[now.row()]
            if (row.pen, row.tip) != self._chosen:
                self.tip_chosen.emit(row.pen, row.tip)

    @override
    def _refresh(self) -> None:
        self._fill()
