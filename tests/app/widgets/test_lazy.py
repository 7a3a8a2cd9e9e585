"""A widget that is made when it is first seen."""

from PySide6.QtWidgets import QLabel
from pytestqt.qtbot import QtBot

from lightpen_app.widgets.controls import LazyWidget


def test_nothing_is_made_before_it_is_seen(qtbot: QtBot) -> None:
    late = LazyWidget(lambda: QLabel("here"))
    qtbot.addWidget(late)
    assert late.content_so_far() is None
    late.show()
    made = late.content_so_far()
    assert made is not None
    assert made.isVisible()


def test_what_is_asked_for_is_made_once_and_reported(qtbot: QtBot) -> None:
    late = LazyWidget(QLabel)
    qtbot.addWidget(late)
    reported: list[QLabel] = []
    late.made.connect(reported.append)
    first = late.content()
    late.show()
    assert late.content() is first
    assert reported == [first]
