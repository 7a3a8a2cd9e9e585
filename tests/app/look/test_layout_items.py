"""What PySide keeps of the items of layouts does not end the program."""

import subprocess
import sys

from PySide6.QtWidgets import (
    QApplication,
    QHBoxLayout,
    QLabel,
    QLayout,
    QLayoutItem,
    QSpacerItem,
    QVBoxLayout,
    QWidget,
    QWidgetItem,
)
from shiboken6 import Shiboken

from lightpen_app.look.layout_items import __name__ as place
from lightpen_app.look.layout_items import forget_layout_items

# Crashes at once where nothing is forgotten: in a process of its own.
PROGRAM = f"""
import gc, sys
from PySide6.QtCore import QEvent, QObject, QTranslator
from PySide6.QtWidgets import QApplication, QHBoxLayout, QLabel, QVBoxLayout, QWidget
from {place} import forget_layout_items

gc.disable()
application = QApplication([])
window, row = QWidget(), QHBoxLayout()
labels = [QLabel() for _ in range(3000)]
for label in labels:
    row.addWidget(label)
QVBoxLayout(window).addLayout(row)
if "forget" in sys.argv:
    forget_layout_items()
for label in labels:
    label.deleteLater()
del label, labels
application.sendPostedEvents(None, QEvent.Type.DeferredDelete)

parent = QObject()
others = [QTranslator(parent) for _ in range(4000)]
for other in others:
    other.deleteLater()
del other, others
application.sendPostedEvents(None, QEvent.Type.DeferredDelete)
print("alive")
"""


def said(*arguments: str) -> str:
    """What the program says before it ends, in whatever way."""
    return subprocess.run(
        [sys.executable, "-c", PROGRAM, *arguments],
        capture_output=True,
        text=True,
        check=False,
    ).stdout


def test_what_comes_to_the_place_of_a_layouts_item_can_be_deleted() -> None:
    assert said("forget") == "alive\n"


def test_what_pyside_keeps_of_the_items_of_layouts_is_forgotten(
    dressed: QApplication,
) -> None:
    window, row = QWidget(), QHBoxLayout()
    labels = [QLabel() for _ in range(3)]
    for label in labels:
        row.addWidget(label)
    row.addStretch()
    QVBoxLayout(window).addLayout(row)
    assert len(kept(row)) == 4

    forget_layout_items()

    assert kept(row) == []
    assert row.count() == 4
    window.deleteLater()


def kept(layout: QLayout) -> list[QLayoutItem]:
    """What PySide has of the items of a layout."""
    every = Shiboken.getAllValidWrappers()
    items = [each for each in every if isinstance(each, (QWidgetItem, QSpacerItem))]
    now = [layout.itemAt(index) for index in range(layout.count())]
    places = {address(item) for item in now if item is not None}
    return [item for item in items if address(item) in places]


def address(item: QLayoutItem) -> int:
    (place,) = Shiboken.getCppPointer(item)
    return int(place)
