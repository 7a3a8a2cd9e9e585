"""Files and folders are dropped on their places, and nothing else is."""

from collections.abc import Sequence
from pathlib import Path

import pytest
from PySide6.QtCore import QMimeData, QPoint, QPointF, Qt, QUrl
from PySide6.QtGui import QDragEnterEvent, QDropEvent
from PySide6.QtWidgets import QApplication, QGroupBox, QVBoxLayout, QWidget
from pytestqt.qtbot import QtBot

from lightpen_app.widgets.controls import FileDrops
from lightpen_app.widgets.fields import PathField

COPY = Qt.DropAction.CopyAction
LEFT, NONE = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier


def drop(widget: QWidget, urls: Sequence[QUrl]) -> bool:
    """Drop addresses on a widget, and return whether it takes them."""
    data = QMimeData()
    data.setUrls(list(urls))
    enter = QDragEnterEvent(QPoint(5, 5), COPY, data, LEFT, NONE)
    QApplication.sendEvent(widget, enter)
    QApplication.sendEvent(widget, QDropEvent(QPointF(5, 5), COPY, data, LEFT, NONE))
    return enter.isAccepted()


@pytest.fixture
def place(qtbot: QtBot) -> QGroupBox:
    place = QGroupBox()
    qtbot.addWidget(place)
    QVBoxLayout(place).addWidget(PathField())
    return place


def test_a_file_is_taken_by_its_path(place: QGroupBox, tmp_path: Path) -> None:
    taken: list[str] = []
    FileDrops(place).dropped.connect(taken.append)

    assert drop(place, [QUrl.fromLocalFile(str(tmp_path / "a b.yaml"))])
    assert taken == [str(tmp_path / "a b.yaml")]


@pytest.mark.parametrize("addresses", [[], ["https://a.example/b"], ["file:/a"] * 2])
def test_what_is_not_one_file_of_this_machine_is_refused(
    place: QGroupBox, addresses: list[str]
) -> None:
    taken: list[str] = []
    FileDrops(place).dropped.connect(taken.append)

    assert not drop(place, [QUrl(address) for address in addresses])
    assert taken == []


def test_a_field_does_not_take_the_text_of_an_address(place: QGroupBox) -> None:
    FileDrops(place)
    (field,) = place.findChildren(PathField)

    assert place.acceptDrops()
    assert not field.edit.acceptDrops()
