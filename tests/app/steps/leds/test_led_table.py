import pytest
from PySide6.QtCore import QModelIndex, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLineEdit
from pytestqt.qtbot import QtBot

from lightpen.pen_check.draft import PenDraft
from lightpen_app.steps.leds.table_panel import MISFIT, LedTable
from lightpen_extensions.simulator.swings import paper_pen

DRAFT = PenDraft.of(paper_pen())


@pytest.fixture
def table(qtbot: QtBot) -> LedTable:
    table = LedTable()
    qtbot.addWidget(table)
    table.resize(420, 360)
    table.set_value(DRAFT)
    table.show()
    return table


def cell(table: LedTable, led: int, column: int) -> QModelIndex:
    return table.model().index(led - 1, column)


def shown(table: LedTable, led: int, column: int) -> str:
    return str(cell(table, led, column).data())


def type_into(table: LedTable, led: int, column: int, text: str) -> None:
    table.setCurrentIndex(cell(table, led, column))
    QTest.keyClick(table, Qt.Key.Key_F2)
    editor = QApplication.focusWidget()
    assert isinstance(editor, QLineEdit)
    editor.selectAll()
    QTest.keyClicks(editor, text)
    QTest.keyClick(editor, Qt.Key.Key_Return)
    QApplication.processEvents()  # the view takes the text when it is back


def test_long_numbers_are_shown_rounded_but_kept_whole(table: LedTable) -> None:
    table.set_value(DRAFT.with_cell(0, 0, "12.345678"))

    assert shown(table, 1, 1) == "12.346"
    assert cell(table, 1, 1).data(Qt.ItemDataRole.EditRole) == "12.345678"


def test_typing_changes_the_draft(table: LedTable, qtbot: QtBot) -> None:
    with qtbot.waitSignal(table.value_changed) as changed:
        type_into(table, 3, 2, "121,5")

    assert changed.args == [DRAFT.with_cell(2, 1, "121,5")]
    assert table.value() == DRAFT.with_cell(2, 1, "121,5")


def test_what_is_typed_outlives_what_the_live_match_tells_meanwhile(
    table: LedTable,
) -> None:
    table.setCurrentIndex(cell(table, 3, 2))
    QTest.keyClick(table, Qt.Key.Key_F2)
    editor = QApplication.focusWidget()
    assert isinstance(editor, QLineEdit)
    editor.selectAll()
    QTest.keyClicks(editor, "12")

    table.set_misfits({3: 0.8})
    table.set_marked({3: "LED 3 sits 0.80 mm off its place."})
    QTest.keyClicks(editor, "1.5")
    QTest.keyClick(editor, Qt.Key.Key_Return)
    QApplication.processEvents()

    assert shown(table, 3, 2) == "121.5"
    assert shown(table, 3, MISFIT) == "0.800"


def test_a_bad_cell_is_marked_and_reported(table: LedTable) -> None:
    type_into(table, 3, 2, "12,4O")

    bad = cell(table, 3, 2)
    sentence = 'LED 3, y: "12,4O" is not a number (letter O).'
    assert bad.data(Qt.ItemDataRole.ToolTipRole) == sentence
    assert sentence in bad.data(Qt.ItemDataRole.AccessibleTextRole)
    good = cell(table, 4, 2)
    assert not good.data(Qt.ItemDataRole.ToolTipRole)
    table.grab()


def test_the_number_and_the_misfit_cannot_be_typed(table: LedTable) -> None:
    for column in (0, MISFIT):
        assert not cell(table, 1, column).flags() & Qt.ItemFlag.ItemIsEditable


def test_enter_opens_a_cell_and_goes_no_further(table: LedTable) -> None:
    table.setCurrentIndex(cell(table, 2, 1))
    QTest.keyClick(table, Qt.Key.Key_Return)

    assert isinstance(QApplication.focusWidget(), QLineEdit)


def test_normals_are_hidden_until_they_are_asked_for(table: LedTable) -> None:
    assert all(table.isColumnHidden(column) for column in (4, 5, 6))

    table.show_normals(True)

    assert not any(table.isColumnHidden(column) for column in (4, 5, 6))
    assert table.model().headerData(4, Qt.Orientation.Horizontal) == "nx"


def test_choosing_a_row_tells_its_led(table: LedTable, qtbot: QtBot) -> None:
    with qtbot.waitSignal(table.led_chosen) as chosen:
        place = table.visualRect(cell(table, 6, 1)).center()
        QTest.mouseClick(table.viewport(), Qt.MouseButton.LeftButton, pos=place)

    assert chosen.args == [6]
    assert table.chosen() == 6


def test_a_row_that_is_removed_is_chosen_no_more(table: LedTable) -> None:
    table.set_chosen(10)

    table.set_value(DRAFT.without_led(9))

    assert table.chosen() == 9
    assert table.model().rowCount() == 9


def test_tab_leaves_the_table(table: LedTable) -> None:
    assert not table.tabKeyNavigation()
    assert table.focusPolicy() & Qt.FocusPolicy.TabFocus


def test_no_cell_is_cut_at_its_usual_width(table: LedTable) -> None:
    table.set_value(DRAFT.with_cell(0, 0, "-374.559123"))
    width = table.columnWidth(1)
    needed = table.fontMetrics().horizontalAdvance("-374.559")

    assert needed + 8 < width
    assert table.visualRect(cell(table, 10, 1)).bottom() < table.viewport().height()
