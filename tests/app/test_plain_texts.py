"""Names from records are shown as plain text: a tag in a name is never interpreted."""

from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from PySide6.QtCore import QModelIndex
from PySide6.QtGui import Qt
from PySide6.QtWidgets import (
    QAbstractItemView,
    QLabel,
    QMenu,
    QMessageBox,
    QTextEdit,
    QWidget,
)
from tests.accepted_tip import accept_tip

from lightpen.formats.opened_files import CameraFile, PenFile
from lightpen.model.limits import SwingLimits
from lightpen.record.library.library_changes import Author, add_item
from lightpen.record.library.tip_library import ListedCone, ListedPen, ListedTip
from lightpen.record.swings.header import Names
from lightpen.swing.preparation import Preparation
from lightpen_app.look.words import plain_tooltip
from lightpen_app.work.settings import Settings, Station
from lightpen_extensions.simulator.scene_files import write_sample_files
from lightpen_extensions.simulator.scenes import Scene

if TYPE_CHECKING:
    from tests.app.conftest import OpenWizard, Walker

MARK = "<img src=x>"
HALL, OPERATOR, PEN, TIP, CONE = (f"{MARK}{each}" for each in "HALTC")
NAMES = Names(HALL, OPERATOR, PEN, TIP, CONE, 10.0)
NOON = datetime(2026, 1, 2, 12, tzinfo=UTC)


@pytest.fixture
def marked(
    settings: Settings, open_wizard: "OpenWizard", tmp_path: Path, small_scene: Scene
) -> "Walker":
    """The program at a station where each name has a tag."""
    data = tmp_path / "data"
    files = write_sample_files(small_scene, tmp_path / f"{MARK}files")
    camera, pen = CameraFile.read(files.camera), PenFile.read(files.pen)
    accept_tip(data, Preparation(NAMES, camera_file=camera, pen_file=pen))
    by = Author(NAMES.station, NAMES.operator, MARK)
    for item in (ListedPen, ListedTip, ListedCone):
        name = {ListedPen: NAMES.pen, ListedTip: NAMES.tip}.get(item, NAMES.cone)
        add_item(data, item(id=name, note=MARK, certificate=MARK), by, NOON)
    settings.set_station(NAMES.station, Station(NAMES, limits=SwingLimits()))
    settings.set_last(station=NAMES.station)
    return open_wizard()


@pytest.mark.slow
def test_no_tag_in_a_name_is_interpreted_on_any_page(marked: "Walker") -> None:
    walker, found = marked, set[str]()
    n_marked = 0
    for index, page in enumerate(walker.window.pages()):
        walker.window.go_to(index)
        walker.until(lambda: bool(walker.texts()))
        for owner, text, is_rich in shown_texts(walker.window):
            n_marked += "<img" in text or "&lt;img" in text
            if is_rich and "<img" in text:
                found.add(f"{page.title()}: {owner}: {text}")

    assert not found
    assert n_marked > 20  # the names are really on the pages


def test_a_tool_tip_shows_tags_literally() -> None:
    assert plain_tooltip("T-10 & T-11") == "T-10 & T-11"
    shown = plain_tooltip(f"{MARK}T")
    assert "<img" not in shown
    assert "&lt;img src=x&gt;T" in shown


def shown_texts(root: QWidget) -> Iterator[tuple[str, str, bool]]:
    """Yield the owner of each text, and whether Qt interprets tags in it."""
    shown = [each for each in root.findChildren(QMenu) if each.toolTipsVisible()]
    for action in (action for menu in shown for action in menu.actions()):
        yield "action", action.toolTip(), Qt.mightBeRichText(action.toolTip())
    for widget in (root, *root.findChildren(QWidget)):
        name = type(widget).__name__
        tip = widget.toolTip()
        yield f"tool tip of {name}", tip, Qt.mightBeRichText(tip)
        if isinstance(widget, QLabel | QMessageBox):
            text, kind = widget.text(), widget.textFormat()
            is_plain = kind == Qt.TextFormat.PlainText or (
                kind == Qt.TextFormat.AutoText and not Qt.mightBeRichText(text)
            )
            yield name, text, not is_plain
        if isinstance(widget, QTextEdit):
            yield name, widget.toHtml(), True
        if isinstance(widget, QAbstractItemView) and widget.model() is not None:
            yield from cell_texts(widget)
        title = getattr(getattr(widget, "_item", None), "titleLabel", None)
        if title is not None:
            yield f"title of {name}", title.text, True


def cell_texts(view: QAbstractItemView) -> Iterator[tuple[str, str, bool]]:
    """Yield the texts and tool tips of the cells of a list or table."""
    model, top = view.model(), QModelIndex()
    for row in range(min(model.rowCount(top), 20)):
        for column in range(20):
            index = model.index(row, column)
            if not index.isValid():
                break
            yield "cell", str(model.data(index) or ""), False
            tip = str(model.data(index, Qt.ItemDataRole.ToolTipRole) or "")
            yield "tool tip of a cell", tip, Qt.mightBeRichText(tip)
