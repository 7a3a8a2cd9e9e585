"""The widgets of the review: figures to copy, remarks, a question, digits."""

import numpy as np
import pytest
from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QGuiApplication, QKeySequence
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QPushButton, QWidget
from pytestqt.qtbot import QtBot
from tests.app.pictures import coordinates_of

from lightpen.detection.reasons import Reason
from lightpen.record.swings.interrupted import ImageRow
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import TextSize, Tone
from lightpen_app.look.words import decimals_for, number_text
from lightpen_app.steps.review.image_table import ImageTable
from lightpen_app.steps.review.residual_plots import Arrows, ResidualView
from lightpen_app.steps.review.result_panel import (
    MOST,
    StatusMessageList,
    TipReadout,
    TipValue,
)
from lightpen_app.widgets.bars import Question, QuestionBar
from lightpen_app.widgets.state_banner import StatusMessage
from lightpen_app.widgets.tables import Figures, NumberTable


@pytest.mark.parametrize(
    ("uncertainty", "decimals"),
    [
        (0.0046, 4),
        (0.0101, 3),
        (0.0998, 2),  # rounds to 0.10, not to 0.100
        (0.012, 3),
        (3.14, 1),
        (41.0, 0),
        (410.0, 0),
        (1e-9, 6),
        (0.0, 6),
        (float("nan"), 6),
    ],
)
def test_an_uncertainty_is_shown_by_two_digits(
    uncertainty: float, decimals: int
) -> None:
    assert decimals_for(uncertainty) == decimals


def test_zero_has_no_sign() -> None:
    assert number_text(-0.00001, 3) == "0.000"
    assert number_text(-0.5, 1) == "-0.5"


def test_coordinates_have_the_digits_of_the_sentences(qtbot: QtBot) -> None:
    readout = TipReadout()
    qtbot.addWidget(readout)

    readout.set_value(TipValue((-1.319796, -90.40969, 0.0), (0.00011, 0.0031, 0.02)))

    assert coordinates_of(readout) == [
        "-1.3198 \xb1 0.0001",
        "-90.4097 \xb1 0.0031",
        "0.0000 \xb1 0.0200",
    ]
    readout.set_value(None)
    assert {text.strip() for text in coordinates_of(readout)} == {""}


FIGURES = Figures(("x", "y"), ("a", "b"), (("1", "2"), ("3", "4")))


def test_figures_are_copied_as_a_spreadsheet_takes_them(qtbot: QtBot) -> None:
    table = NumberTable()
    qtbot.addWidget(table)
    table.set_value(FIGURES)
    table.selectAll()

    QTest.keySequence(table, QKeySequence(QKeySequence.StandardKey.Copy))

    assert QGuiApplication.clipboard().text() == "1\t2\n3\t4"


def test_a_table_is_as_high_as_its_figures_and_lets_tab_pass(qtbot: QtBot) -> None:
    table = NumberTable()
    qtbot.addWidget(table)
    empty = table.sizeHint().height()

    table.set_value(FIGURES)

    assert table.sizeHint().height() == empty + 2 * 24
    assert not table.tabKeyNavigation()


def test_a_table_is_wide_enough_for_its_longest_figure(qtbot: QtBot) -> None:
    table = NumberTable()
    qtbot.addWidget(table)
    rows = ("A name of some length", "b")
    table.set_value(Figures(("x", "y"), rows, (("1", "2"), ("-1087.4606", "4"))))
    table.show()

    for size in (TextSize.SMALL, TextSize.BODY, TextSize.LEAD):
        table.set_letters(size)
        table.resize(table.minimumSizeHint())
        QApplication.processEvents()
        assert table.columnWidth(0) >= table.sizeHintForColumn(0)
        names = table.verticalHeader()
        assert names.width() >= names.sizeHint().width()


def test_messages_take_no_more_room_than_they_need(qtbot: QtBot) -> None:
    remarks = StatusMessageList()
    qtbot.addWidget(remarks)
    assert remarks.isHidden()
    warning = StatusMessage("Look into this.", Sign.WARNING, Tone.WARN)

    remarks.set_value([warning])
    low = remarks.sizeHint().height()
    remarks.set_value([warning] * 12)

    assert not remarks.isHidden()
    assert low < MOST
    assert remarks.sizeHint().height() == MOST
    remarks.set_value([])
    assert remarks.isHidden()


@pytest.mark.parametrize(("answer", "signal"), [("Yes", "agreed"), ("No", "declined")])
def test_a_question_is_answered_once(qtbot: QtBot, answer: str, signal: str) -> None:
    around = QWidget()
    qtbot.addWidget(around)
    bar = QuestionBar()
    bar.setParent(around)
    bar.set_words(lambda: Question("Really?", "Yes", "No"))
    around.show()
    assert bar.words() == ""

    bar.ask()
    assert bar.words() == "Really?"
    buttons = bar.findChildren(QPushButton)
    chosen = next(each for each in buttons if each.text() == answer)
    with qtbot.waitSignal(getattr(bar, signal)):
        QTest.mouseClick(chosen, Qt.MouseButton.LeftButton)

    assert bar.words() == ""


def row(number: int, misfit: float, reason: Reason = Reason.NONE) -> ImageRow:
    return ImageRow(number, misfit, 10, reason, can_be_included=bool(reason))


def test_the_current_image_stays_current_when_the_order_changes(qtbot: QtBot) -> None:
    table = ImageTable()
    qtbot.addWidget(table)
    table.set_value([row(4, 0.09), row(2, 0.08), row(1, 0.05)])
    assert table.number() == 4
    table.choose(2)

    table.set_value([row(2, 0.2, Reason.TAKEN_OUT), row(4, 0.09), row(1, 0.05)])

    assert table.number() == 2
    assert [each.number for each in table.selected()] == [2]
    table.choose(77)
    assert table.number() == 2
    table.set_value([])
    assert table.number() is None
    assert table.selected() == ()


def test_arrows_are_drawn_about_the_pen_that_fills_the_view(qtbot: QtBot) -> None:
    view = ResidualView()
    qtbot.addWidget(view)
    view.resize(400, 300)
    view.set_half(np.zeros((1024, 1224), np.uint8), QSize(2448, 2048))
    view.show()
    points = np.array([[1000.0, 800.0], [1200.0, 1200.0]])
    plain = view.grab().toImage()

    view.show_around(points)
    view.set_arrows(Arrows(points, np.array([[0.05, 0.0], [0.0, 0.05]]), 1000.0))

    assert view._zoom > 2
    for point in points:
        assert view.rect().contains(view.place_of(*point).toPoint())
    middle = view.place_of(*points.mean(axis=0))
    assert middle.x() == pytest.approx(200, abs=2)
    assert middle.y() == pytest.approx(150, abs=2)
    assert view.grab().toImage() != plain
    view.show_around(np.zeros((0, 2)))
    assert view._zoom == 1
