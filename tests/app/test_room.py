"""What has no room in a window is noticed."""

import pytest
from PySide6.QtCore import QSize
from PySide6.QtGui import QFontMetricsF
from PySide6.QtWidgets import QApplication, QHBoxLayout, QLabel, QWidget
from pytestqt.qtbot import QtBot
from tests.app.room import missing_input_of

from lightpen_app.look.theme import TextSize, font, text_label
from lightpen_app.widgets.plots import Axes, Curve, TracePlot
from lightpen_app.widgets.push_button import PushButton


@pytest.mark.parametrize("room", [20, 60])
def test_words_that_are_clipped_are_noticed(qtbot: QtBot, room: int) -> None:
    label, button = QLabel("Exposure and gain"), PushButton()
    wrapped = text_label()
    wrapped.setText("Swing the pen first and then review what has come of it.")
    button.setText("Let the simulated operator swing")
    plot = TracePlot(Axes("RMS residual per image / px"), [Curve("misfit_px")])
    shelf = QWidget()  # a window of its own could not be made so small
    qtbot.addWidget(shelf)
    shelf.show()
    for widget in (label, wrapped, button, plot):
        widget.setParent(shelf)
        widget.resize(widget.sizeHint().expandedTo(QSize(400, 200)))
        widget.show()
        assert missing_input_of(widget) == ""

        widget.resize(room, 20)
        QApplication.processEvents()

        assert missing_input_of(widget)


def test_a_button_is_not_made_narrower_than_its_words(qtbot: QtBot) -> None:
    row, button, label = QWidget(), PushButton(), text_label()
    button.setText("Let the simulated operator swing")
    label.setText("A sentence that wraps where it has to. " * 3)
    layout = QHBoxLayout(row)
    layout.addWidget(label, 1)
    layout.addWidget(button)
    qtbot.addWidget(row)
    row.show()
    row.resize(row.minimumSizeHint().width(), 300)

    words = QFontMetricsF(font(TextSize.BODY)).horizontalAdvance(button.text())
    assert button.width() > words
    assert missing_input_of(button) == ""
