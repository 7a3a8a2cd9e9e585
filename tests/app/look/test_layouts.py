"""Layouts are attached before they are filled: so PySide keeps nothing of their items.

What it keeps of an item that Qt has deleted ends the program.
"""

import gc
import re
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import PySide6
import pytest
from PySide6.QtWidgets import (
    QApplication,
    QHBoxLayout,
    QLabel,
    QSpacerItem,
    QVBoxLayout,
    QWidget,
    QWidgetItem,
)
from shiboken6 import Shiboken

import lightpen_app
from lightpen_app.look.layouts import (
    fill,
    grid_layout,
    horizontal_layout,
    vertical_layout,
)
from lightpen_app.widgets.controls import LazyWidget

if TYPE_CHECKING:
    from tests.app.conftest import OpenWizard

# The items of its layout are deleted, and something else is made at their places.
PROGRAM = """
import gc
from PySide6.QtCore import QEvent, QObject, QTranslator
from PySide6.QtWidgets import QApplication, QLabel, QWidget
from lightpen_app.look.layouts import horizontal_layout, vertical_layout

gc.disable()
application = QApplication([])
window = QWidget()
labels = [QLabel() for _ in range(3000)]
horizontal_layout(vertical_layout(window), *labels)
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


@pytest.mark.slow
def test_what_comes_to_the_place_of_a_layouts_item_can_be_deleted() -> None:
    command = [sys.executable, "-c", PROGRAM]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)

    assert ended.stdout == "alive\n"


def test_a_layout_that_is_attached_first_keeps_no_items(dressed: QApplication) -> None:
    before, window = kept(), QWidget()
    column = vertical_layout(window, 1, QLabel(), spacing=0)
    row = horizontal_layout(column, QLabel(), (QLabel(), 1), stretch=1)
    grid = grid_layout(column)
    vertical_layout(grid, QLabel(), at=(0, 1))
    fill(row, 1)

    assert kept() == before
    assert (column.count(), row.count(), grid.count()) == (4, 3, 1)
    window.deleteLater()


@pytest.mark.skipif(PySide6.__version_info__ >= (6, 12), reason="PySide6 6.12 mends it")
def test_a_layout_that_is_filled_first_keeps_its_items(dressed: QApplication) -> None:
    before, window, row = kept(), QWidget(), QHBoxLayout()
    labels = [QLabel() for _ in range(50)]
    for label in labels:
        row.addWidget(label)
    QVBoxLayout(window).addLayout(row)

    assert kept() > before
    for item in items():
        Shiboken.invalidate(item)
    window.deleteLater()


@pytest.mark.slow
def test_no_page_keeps_items_of_its_layouts(open_wizard: "OpenWizard") -> None:
    before = kept()
    window = open_wizard().window
    for width in (1280, 800, 2600, 1280):
        window.resize(width, 800)
        for page in window.pages():
            page.resize(width, 800)
        for lazy in window.findChildren(LazyWidget):
            lazy.content()
        QApplication.processEvents()

    assert kept() == before


def test_layouts_are_made_by_the_functions_that_attach_them() -> None:
    folder = Path(lightpen_app.__file__).parent
    made = re.compile(r"\bQ(VBox|HBox|Grid|Box)Layout\(")
    found = [
        str(path.relative_to(folder))
        for path in folder.rglob("*.py")
        if made.search(path.read_text("utf-8"))
    ]

    assert found == ["look/layouts.py"]


def kept() -> int:
    """How many items of layouts PySide keeps."""
    gc.collect()
    return len(items())


def items() -> list[QWidgetItem | QSpacerItem]:
    """The items of layouts that PySide keeps, but for those that tell it of their end.

    Those do that Python made, such as the gaps in the menus of pyqtgraph.
    """
    every = Shiboken.getAllValidWrappers()
    of_layouts = (each for each in every if isinstance(each, QWidgetItem | QSpacerItem))
    return [each for each in of_layouts if not Shiboken.createdByPython(each)]
