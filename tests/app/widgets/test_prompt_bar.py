"""A bar that asks borrows the focus, and gives it back."""

from collections.abc import Callable
from typing import TypeVar

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QLineEdit,
    QPushButton,
    QStackedWidget,
    QVBoxLayout,
    QWidget,
)
from pytestqt.qtbot import QtBot
from typing_extensions import override

from lightpen_app.steps.leds.file_panel import LedFilePanel
from lightpen_app.widgets.bars import QuestionBar, ReasonBar
from lightpen_app.widgets.fields import SupervisorFields
from lightpen_app.work.workbench import Workbench

W = TypeVar("W", bound=QWidget)


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


@pytest.mark.parametrize(
    "ask",
    [
        lambda page, _: asked(on_page(page, QuestionBar())),
        lambda page, _: asked(on_page(page, ReasonBar())),
        lambda page, _: on_page(page, SupervisorFields()).clear_password(),
        lambda page, workbench: on_page(page, LedFilePanel(workbench)).ask_units("a"),
    ],
    ids=["question", "reason", "password", "units"],
)
def test_what_is_asked_on_a_page_that_is_not_shown_leaves_the_focus_where_it_is(
    qtbot: QtBot, workbench: Workbench, ask: Callable[[QWidget, Workbench], None]
) -> None:
    pages, field, other = QStackedWidget(), QLineEdit(), QWidget()
    pages.addWidget(field)
    pages.addWidget(other)
    qtbot.addWidget(pages)
    pages.show()
    pages.activateWindow()
    field.setFocus()
    qtbot.waitUntil(field.hasFocus)

    ask(other, workbench)

    assert field.hasFocus()


def on_page(page: QWidget, panel: W) -> W:
    panel.setParent(page)
    return panel


def asked(bar: QuestionBar | ReasonBar) -> None:
    bar.ask()


class Behind(QWidget):
    """What lies behind a bar, and takes the keys that the bar leaves."""

    def __init__(self) -> None:
        super().__init__()
        self.keys: list[int] = []

    @override
    def keyPressEvent(self, event: QKeyEvent) -> None:
        self.keys.append(event.key())


def test_enter_without_a_reason_reaches_nothing_behind_the_bar(qtbot: QtBot) -> None:
    page = Behind()
    bar = ReasonBar()
    QVBoxLayout(page).addWidget(bar)
    qtbot.addWidget(page)
    page.show()
    bar.ask()
    field = page.focusWidget()
    assert isinstance(field, QLineEdit)

    QTest.keyClick(field, Qt.Key.Key_Return)
    QTest.keyClick(field, Qt.Key.Key_PageDown)

    assert page.keys == [Qt.Key.Key_PageDown]
    assert bar.isVisible()


def test_a_bar_that_asks_nothing_reports_nothing(qtbot: QtBot) -> None:
    bar = QuestionBar()
    qtbot.addWidget(bar)
    changes: list[None] = []
    bar.asking_changed.connect(lambda: changes.append(None))

    bar.refresh()
    assert not changes

    asked(bar)
    bar.hide()
    bar.refresh()
    assert len(changes) == 2
