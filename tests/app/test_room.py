"""What has no room in a window is noticed."""

from PySide6.QtGui import QFontMetricsF
from PySide6.QtWidgets import QHBoxLayout, QWidget
from pytestqt.qtbot import QtBot
from tests.app.room import missing_input_of

from lightpen_app.look.theme import TextSize, font, text_label
from lightpen_app.widgets.controls import PushButton


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
