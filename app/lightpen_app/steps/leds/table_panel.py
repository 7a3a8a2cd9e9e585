"""The LEDs as a table, with what belongs to them: discs and nominal tip."""

from collections.abc import Mapping

import numpy as np
from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtWidgets import (
    QAbstractItemView,
    QGroupBox,
    QHeaderView,
    QTableWidget,
    QTableWidgetItem,
)
from typing_extensions import override

from lightpen.arrays import FloatArray
from lightpen.model.pen import Pen
from lightpen_app.look.layouts import vertical_layout
from lightpen_app.look.signs import Sign, sign_icon
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.look.words import number_text, set_tooltip
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.tables import RIGHT

NORMALS = (4, 5, 6)  # columns; before them are number and coordinates
MISFIT = 7  # the last column
ROW_HEIGHT = 25  # px; ten rows fit the window at 1280 x 800
LEAST_HEIGHT = 22 * GRID  # px; the head and five rows
SHOWN_DECIMALS = 3
NUMBER_WIDTH, MISFIT_WIDTH = 6 * GRID, 10 * GRID  # px
FACING = (0.0, 0.0, 1.0)  # normal of most discs


class LedTable(Translated, QTableWidget):
    """Lists the LEDs of a pen; those that do not fit the images are marked."""

    led_chosen = Signal(int)  # number of the LED in the current row; 0 for none

    def __init__(self) -> None:
        super().__init__(0, MISFIT + 1)
        self.say(self, self.tr("LED coordinates"))
        self.setObjectName("led_table")
        self.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setTabKeyNavigation(False)
        self.setWordWrap(False)
        self.setMinimumHeight(LEAST_HEIGHT)
        rows, columns = self.verticalHeader(), self.horizontalHeader()
        rows.hide()
        rows.setSectionResizeMode(QHeaderView.ResizeMode.Fixed)
        rows.setDefaultSectionSize(ROW_HEIGHT)
        columns.setSectionResizeMode(QHeaderView.ResizeMode.Stretch)
        for column, width in ((0, NUMBER_WIDTH), (MISFIT, MISFIT_WIDTH)):
            columns.setSectionResizeMode(column, QHeaderView.ResizeMode.Fixed)
            self.setColumnWidth(column, width)
        columns.setHighlightSections(False)
        columns.setMinimumSectionSize(6 * GRID)

        # Connections
        self.currentCellChanged.connect(self._on_current_changed)

        self._refresh()

    def set_value(self, pen: Pen | None) -> None:
        """Show another pen; None clears the table."""
        leds = np.zeros((0, 6)) if pen is None else np.hstack([pen.leds, pen.normals])
        self.setRowCount(len(leds))
        for row, numbers in enumerate(leds.tolist()):
            self._set(row, 0, str(row + 1), Qt.AlignmentFlag.AlignCenter)
            for column, number in enumerate(numbers, 1):
                self._set(row, column, _shown(number))
        is_plain = bool(np.all(leds[:, 3:] == FACING))
        for column in NORMALS:
            self.setColumnHidden(column, is_plain)

    def set_match(
        self, misfits: Mapping[int, float], reasons: Mapping[int, str]
    ) -> None:
        """Show errors in the image, px, and findings of LEDs, by number."""
        for row in range(self.rowCount()):
            misfit, reason = misfits.get(row + 1), reasons.get(row + 1, "")
            self._set(row, MISFIT, "" if misfit is None else f"{misfit:.3f}")
            number = self._set(row, 0, str(row + 1), Qt.AlignmentFlag.AlignCenter)
            number.setToolTip(reason)
            sign = sign_icon(self, Sign.WARNING, Tone.WARN) if reason else None
            number.setData(Qt.ItemDataRole.DecorationRole, sign)

    def set_chosen(self, led: int) -> None:
        """Make the row of another LED current."""
        self.setCurrentCell(led - 1, 0)

    @override
    def sizeHint(self) -> QSize:
        return QSize(42 * GRID, 40 * GRID)

    def _set(
        self, row: int, column: int, text: str, side: Qt.AlignmentFlag = RIGHT
    ) -> QTableWidgetItem:
        item = self.item(row, column)
        if item is None:
            item = QTableWidgetItem()
            item.setTextAlignment(side)
            self.setItem(row, column, item)
        item.setText(text)
        return item

    def _on_current_changed(self, row: int, _: int, before: int) -> None:
        if row != before:
            self.led_chosen.emit(row + 1)

    @override
    def _refresh(self) -> None:
        places = (f"{axis} / mm" for axis in "xyz")
        self.setHorizontalHeaderLabels(
            [self.tr("LED"), *places, "nx", "ny", "nz", self.tr("RMS / px")]
        )
        words = self.tr(
            "Distance between the detected LED and its table position in the live "
            "image / px"
        )
        head = self.horizontalHeaderItem(MISFIT)
        assert head is not None
        head.setToolTip(words)


class LedTablePanel(Translated, QGroupBox):
    """Shows the LEDs of a file, their discs and the nominal tip."""

    def __init__(self) -> None:
        super().__init__()
        self.say(self, self.tr("LED coordinates"))
        self._pen: Pen | None = None
        self._tip: FloatArray | None = None

        # Widgets
        self.table = LedTable()
        self._facts = text_label(TextSize.SMALL, Tone.QUIET)

        # Layout
        vertical_layout(self, (self.table, 1), self._facts)

        self._refresh()

    def set_value(self, pen: Pen | None, tip: FloatArray | None) -> None:
        """Show another pen, or none.

        Parameters
        ----------
        pen : Pen or None
            The pen.
        tip : (3,) array or None
            Nominal tip of the step Start, mm, which overrides the file's.
        """
        self._pen, self._tip = pen, tip
        self.table.set_value(pen)
        self._refresh()

    @override
    def _refresh(self) -> None:
        pen, tip = self._pen, self._tip
        if pen is None:
            self._facts.setText("")
            return
        words = [self.tr("Disc \u00d8 {0:g} mm").format(pen.diameter)]
        if tip is not None:
            text = self.tr("Nominal tip in use (step Start): {0} mm")
            words.append(text.format(_point(tip)))
        elif pen.nominal_tip is not None:
            text = self.tr("Nominal tip: {0} mm")
            words.append(text.format(_point(pen.nominal_tip)))
        self._facts.setText("\n".join(words))
        set_tooltip(self._facts, pen.name)


def _point(point: FloatArray) -> str:
    return "  ".join(f"{each:g}" for each in point.tolist())


def _shown(value: float) -> str:
    """Return a coordinate, rounded, without idle zeros."""
    text = number_text(value, SHOWN_DECIMALS)
    return text.rstrip("0").rstrip(".")
