from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import QModelIndex, Qt
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot
from tests.simulated_pens import fanned_pen

from lightpen_app.steps.leds.table_panel import MISFIT, LedTable
from lightpen_extensions.simulator.swings import paper_pen


@pytest.fixture
def table(qtbot: QtBot) -> LedTable:
    table = LedTable()
    qtbot.addWidget(table)
    table.resize(420, 360)
    table.set_value(paper_pen())
    table.show()
    return table


def cell(table: LedTable, led: int, column: int) -> QModelIndex:
    return table.model().index(led - 1, column)


def test_numbers_are_rounded_without_idle_zeros(table: LedTable) -> None:
    leds = paper_pen().leds.copy()
    leds[0] = [-1e-9, 12.5, -374.559123]

    table.set_value(replace(paper_pen(), leds=leds))

    shown = [cell(table, 1, column).data() for column in (1, 2, 3)]
    assert shown == ["0", "12.5", "-374.559"]
    needed = table.fontMetrics().horizontalAdvance("-374.559")
    assert needed + 8 < table.columnWidth(3)
    assert table.visualRect(cell(table, 10, 1)).bottom() < table.viewport().height()


def test_an_led_that_does_not_fit_is_marked_with_the_reason(table: LedTable) -> None:
    reason = "LED 3 is 0.80 mm from its file position."
    table.set_match({3: 0.8}, {3: reason})

    marked, other = cell(table, 3, 0), cell(table, 4, 0)
    assert marked.data(Qt.ItemDataRole.ToolTipRole) == reason
    assert marked.data(Qt.ItemDataRole.DecorationRole) is not None
    assert cell(table, 3, MISFIT).data() == "0.800"
    assert not other.data(Qt.ItemDataRole.ToolTipRole)

    table.set_match({}, {})
    assert marked.data(Qt.ItemDataRole.DecorationRole) is None


def test_normals_are_shown_where_a_disc_does_not_face_forward(table: LedTable) -> None:
    assert all(table.isColumnHidden(column) for column in (4, 5, 6))

    table.set_value(fanned_pen())

    assert not any(table.isColumnHidden(column) for column in (4, 5, 6))
    assert table.model().headerData(4, Qt.Orientation.Horizontal) == "nx"
    normals = [float(cell(table, 1, column).data()) for column in (4, 5, 6)]
    np.testing.assert_allclose(normals, fanned_pen().normals[0], atol=5e-4)


def test_choosing_a_row_tells_its_led(table: LedTable, qtbot: QtBot) -> None:
    with qtbot.waitSignal(table.led_chosen) as chosen:
        place = table.visualRect(cell(table, 6, 1)).center()
        QTest.mouseClick(table.viewport(), Qt.MouseButton.LeftButton, pos=place)

    assert chosen.args == [6]
    assert table.currentRow() == 5


def test_tab_leaves_the_table(table: LedTable) -> None:
    assert not table.tabKeyNavigation()
    assert table.focusPolicy() & Qt.FocusPolicy.TabFocus
