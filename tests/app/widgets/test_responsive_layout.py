"""Tests of widgets that are arranged otherwise where they have little room."""

from PySide6.QtWidgets import QWidget
from pytestqt.qtbot import QtBot
from typing_extensions import override

from lightpen_app.widgets.fitting import ResponsiveLayout, SizeClass


class Arranged(ResponsiveLayout, QWidget):
    narrow_below, low_below = 300, 200

    def __init__(self) -> None:
        super().__init__()
        self.arranged_for: list[SizeClass] = []

    @override
    def _use_room(self) -> None:
        self.arranged_for.append(self._room)


def test_a_widget_is_arranged_anew_only_when_its_room_changes(qtbot: QtBot) -> None:
    widget = Arranged()
    qtbot.addWidget(widget)
    widget.resize(300, 200)
    widget.show()
    for size in ((500, 400), (299, 400), (250, 199), (200, 150), (300, 200)):
        widget.resize(*size)

    assert widget.arranged_for == [
        SizeClass(is_narrow=True),
        SizeClass(is_narrow=True, is_low=True),
        SizeClass(),
    ]
