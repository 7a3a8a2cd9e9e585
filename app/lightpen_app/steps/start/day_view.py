"""The day page: tips of the station, and readiness for a swing."""

from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from PySide6.QtCore import QModelIndex, QTimer, Signal
from PySide6.QtGui import QColor, QKeyEvent, QStandardItem, QStandardItemModel
from PySide6.QtWidgets import QAbstractItemView, QFrame, QHeaderView, QLineEdit, QWidget
from typing_extensions import override

from lightpen.model.limits import COLDEST, WARMEST
from lightpen.swing.preparation import Preparation
from lightpen_app.face import ReadinessItem, Services
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
from lightpen_app.look.words import PARTED, set_tooltip, shortened
from lightpen_app.steps.start.day_state import (
    CameraState,
    TipRow,
    readiness,
    tip_details,
    tip_rows,
)
from lightpen_app.widgets.controls import ENTER_KEYS, PushButton
from lightpen_app.widgets.fields import ChoiceField, Translated
from lightpen_app.widgets.number_field import NumberField, is_refusing
from lightpen_app.widgets.page import MainAction
from lightpen_app.widgets.state_banner import SignLabel, StatusMessage
from lightpen_app.widgets.tables import RIGHT, RowTable
from lightpen_app.work.live_view import DisplayedImage
from lightpen_app.work.workbench import Workbench

REFRESH_MS = 500
LONGEST_NAME = 16  # letters of a tip on the main button
N_MISFITS = 10  # images by which the LEDs are judged


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
    """Shows tips and readiness, and chooses tips; the setup is a view of its own."""

    changed = Signal()  # `main_action` may be different
    step_requested = Signal(str)  # key of the step to show
    code_entered = Signal(str)  # of a tip that is not the only one in the table
    setup_requested = Signal()

    def __init__(self, workbench: Workbench, services: Services) -> None:
        super().__init__()
        self._selection, self._live = workbench.selection, workbench.live
        self._tips, self._pens = workbench.library, workbench.pens
        self._services = tuple(services)
        self._misfits: deque[float] = deque(maxlen=N_MISFITS)
        self._refreshing = QTimer(self, interval=REFRESH_MS)
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
        self._swing = self.make_button(
            self.tr("Swing anyway"), lambda: self.step_requested.emit("swing")
        )
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
        self._search.entered.connect(self._on_tip_entered)
        self._which.activated.connect(self._on_narrowed)
        self._table.selectionModel().currentRowChanged.connect(self._on_row_changed)
        self._refreshing.timeout.connect(self._show_readiness)
        self._selection.changed.connect(self._on_selected)
        self._tips.changed.connect(self._refresh)
        self._pens.changed.connect(self._show_readiness)
        self._live.image_shown.connect(self._on_image_shown)
        self._live.connection_changed.connect(self._show_readiness)

    def start(self) -> None:
        """Follow the camera while the page is shown."""
        self._misfits.clear()
        self._refresh()
        self._refreshing.start()

    def stop(self) -> None:
        """Stop updating the page."""
        self._refreshing.stop()

    def first_control(self) -> QWidget:
        """Return the field that has the focus at first."""
        return self._search

    def rows(self) -> tuple[TipRow, ...]:
        """Return the rows that are shown."""
        return self._shown

    def set_narrow(self, narrow: bool) -> None:
        """Put the last result below the table where there is little width."""
        set_stacked(self._columns, narrow)
        self._ready.set_narrow(narrow)

    def main_action(self) -> MainAction:
        """Return the action of the main button: swing, or show the missing input."""
        amber = self._first_amber()
        if amber is None:
            tip = shortened(self._selection.preparation.names.tip, LONGEST_NAME)
            return MainAction(
                self.tr("Swing tip {0}").format(tip), self._why_not_swing()
            )
        return MainAction(amber.action)

    def run_main_action(self) -> None:
        """Run the action of the main button."""
        amber = self._first_amber()
        if amber is not None and amber.step == "temperature":
            self._lead_to_temperature()
        else:
            self.step_requested.emit("swing" if amber is None else amber.step)

    @override
    def _refresh(self) -> None:
        now, statuses = self._selection.preparation, self._tips.statuses
        rows, chosen = tip_rows(now, statuses), self._names()
        self._details.setText(tip_details(now, statuses))
        if (rows, chosen) != (self._rows, self._chosen):
            self._rows, self._chosen = rows, chosen
            self._fill()
        self._show_readiness()

    def _show_readiness(self) -> None:
        """Show whether a swing can start, and ask for the temperature of the pen."""
        now, items = self._selection.preparation, self._items()
        is_asked = now.asks_temperature or now.lacks_temperature
        if is_asked and self._asking.isHidden():  # the last one is offered, or none
            last = now.assumptions.temperature_c
            self._temperature.set_value(COLDEST if last is None else last)
        self._asking.setVisible(is_asked)
        is_other = items != self._ready.items()
        place = PARTED.join(map(shortened, (now.names.station, now.names.operator)))
        self._ready.set_place(place)
        self._ready.set_items(items)
        is_amber = any(item.is_amber for item in items)
        can_swing = not (now.missing_inputs() or self._why_not_swing())
        self._swing.setVisible(is_amber and can_swing)
        if is_other:
            self.changed.emit()

    def _why_not_swing(self) -> str:
        """Return that the chosen tip is not among those that are searched."""
        names, text, rows = self._names(), self._searched(), self._shown
        if not text or any((row.pen, row.tip) == names for row in rows):
            return ""
        if rows:
            return self.tr("Choose a tip in the table, or clear the search.")
        words = self.tr("No tip matches {0}. Press Enter, or clear the search.")
        return words.format(shortened(text))

    def _names(self) -> tuple[str, str]:
        names = self._selection.preparation.names
        return names.pen, names.tip

    def _first_amber(self) -> ReadinessItem | None:
        return next((item for item in self._items() if item.is_amber), None)

    def _items(self) -> tuple[ReadinessItem, ...]:
        misfit = float(np.median(self._misfits)) if self._misfits else None
        rate = self._live.settings.frame_rate if self._live.is_open else None
        camera = CameraState(self._live.worst_connection, rate, misfit)
        own = readiness(
            self._selection.preparation, self._tips.statuses, camera, self._pens.doubt()
        )
        return (*own, *(item for each in self._services for item in each.readiness()))

    def _searched(self) -> str:
        return self._search.text().strip()

    def _fill(self) -> None:
        """Show the rows that match what is typed."""
        text, is_all = self._searched(), self._which.currentIndex() == 0
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
        self._show_readiness()
        self.changed.emit()

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
            self._lead_to_temperature()
        else:
            self.step_requested.emit(step)

    def _lead_to_temperature(self) -> None:
        """Lead to the question, or to where an answer is changed."""
        if self._asking.isHidden():
            self.setup_requested.emit()
        else:
            self._temperature.setFocus()
            self._temperature.selectAll()

    def _on_answered(self) -> None:
        if not is_refusing(self._asking):
            now, answer = self._selection.preparation, self._temperature.temperature()
            self._selection.set_preparation(now.with_temperature(answer))

    def _on_row_changed(self, now: QModelIndex) -> None:
        if now.isValid() and now.row() < len(self._shown):
            row = self._shown[now.row()]
            if (row.pen, row.tip) != self._chosen:
                self._choose(row.pen, row.tip)

    def _on_selected(self, before: Preparation) -> None:
        now = self._selection.preparation
        if now.pen is not before.pen or now.camera is not before.camera:
            self._misfits.clear()
        self._refresh()

    def _on_image_shown(self, shown: DisplayedImage) -> None:
        detection = shown.seen.detection
        if detection is not None and detection.has_pose:
            self._misfits.append(detection.sigma)

    def _choose(self, pen: str, tip: str) -> None:
        now, listed = self._selection.preparation, self._tips.library.tip(tip)
        chosen = now.renamed(replace(now.names, pen=pen, tip=tip))
        if listed is not None:
            chosen = chosen.with_listed(listed)
        self._selection.set_preparation(chosen)

    def _on_tip_entered(self, text: str) -> None:
        """Choose the only tip that matches; else find it in the library."""
        rows = self._shown
        exact = [row for row in rows if row.tip.casefold() == text.casefold()]
        matching = exact or [row for row in rows if row.matches(text)]
        if len(matching) == 1:
            self._choose(matching[0].pen, matching[0].tip)
        else:
            self.code_entered.emit(text)
