"""A bar that asks borrows the focus, and gives it back."""

import pytest
from PySide6.QtWidgets import QLineEdit, QPushButton, QVBoxLayout, QWidget
from pytestqt.qtbot import QtBot

from lightpen_app.widgets.question_bar import QuestionBar
from lightpen_app.widgets.reason_bar import ReasonBar


@pytest.mark.parametrize("kind", [QuestionBar, ReasonBar])
def test_what_had_the_focus_before_a_question_has_it_again(
    qtbot: QtBot, kind: type[QuestionBar] | type[ReasonBar]
) -> None:
    page = QWidget()
    bar, field, leaving = kind(), QLineEdit(), QPushButton("Back")
    layout = QVBoxLayout(page)
    for widget in (bar, field, leaving):
        layout.addWidget(widget)
    qtbot.addWidget(page)
    page.show()
    field.setFocus()

    bar.ask()
    focused = page.focusWidget()
    assert focused is not None
    assert bar.isAncestorOf(focused)
    bar.hide()
    assert page.focusWidget() is field

    bar.ask()
    leaving.setFocus()
    bar.hide()
    assert page.focusWidget() is leaving
