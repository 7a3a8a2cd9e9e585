"""Layouts, attached to the widget or layout they lie in before they are filled.

PySide makes a Python object for each item of a layout that is attached after it was
filled. Qt deletes such an item when its widget leaves, without telling PySide; what is
made at its place in memory later is taken for the item, and the program ends by a
segmentation fault in `BindingManager::releaseWrapper` (PySide 6.11).
"""

from typing import TypeAlias, TypeVar

from PySide6.QtCore import Qt
from PySide6.QtGui import QAccessible, QAccessibleAnnouncementEvent
from PySide6.QtWidgets import (
    QBoxLayout,
    QGridLayout,
    QHBoxLayout,
    QLayout,
    QVBoxLayout,
    QWidget,
)

from lightpen_app.look.theme import GRID

L = TypeVar("L", bound=QLayout)

Place: TypeAlias = QWidget | QBoxLayout | QGridLayout
# A widget, also with its stretch and alignment; a number is the stretch of a gap.
Cell: TypeAlias = (
    QWidget | int | tuple[QWidget, int] | tuple[QWidget, int, Qt.AlignmentFlag]
)
GridPlace: TypeAlias = tuple[int, int] | tuple[int, int, int, int]
Margins: TypeAlias = int | tuple[int, int, int, int] | None  # None: the style's


def vertical_layout(
    place: Place,
    *cells: Cell,
    spacing: int = GRID,
    margins: Margins = 0,
    stretch: int = 0,
    at: GridPlace = (0, 0),
) -> QVBoxLayout:
    """Return a layout, from top to bottom, of a widget or within another layout.

    Parameters
    ----------
    place : QWidget or QLayout
        Parent of the layout.
    cells : QWidget, int or tuple
        Initial content, see `fill`.
    spacing : int
        Between the cells, px; -1 for that of the style.
    margins : int, tuple or None
        Left, top, right and bottom, px.
    stretch : int
        Its share of the room in a box.
    at : tuple of int
        Its row and column in a grid; then how many of these it spans, else one.
    """
    layout = _attached(QVBoxLayout(), place, spacing, margins, stretch, at)
    fill(layout, *cells)
    return layout


def horizontal_layout(
    place: Place,
    *cells: Cell,
    spacing: int = GRID,
    margins: Margins = 0,
    stretch: int = 0,
    at: GridPlace = (0, 0),
) -> QHBoxLayout:
    """Return a layout from left to right; see `vertical_layout`."""
    layout = _attached(QHBoxLayout(), place, spacing, margins, stretch, at)
    fill(layout, *cells)
    return layout


def grid_layout(
    place: Place,
    *,
    spacing: int | tuple[int, int] = GRID,
    margins: Margins = 0,
    stretch: int = 0,
    at: GridPlace = (0, 0),
) -> QGridLayout:
    """Return an empty grid; see `vertical_layout`.

    Two numbers for `spacing` are those between columns and between rows.
    """
    columns, rows = (spacing, spacing) if isinstance(spacing, int) else spacing
    layout = _attached(QGridLayout(), place, columns, margins, stretch, at)
    layout.setVerticalSpacing(rows)
    return layout


def fill(layout: QBoxLayout, *cells: Cell) -> None:
    """Add cells: widgets, optionally with stretch and alignment, and gaps."""
    for cell in cells:
        if isinstance(cell, int):
            layout.addStretch(cell)
        elif isinstance(cell, tuple):
            layout.addWidget(*cell)
        else:
            layout.addWidget(cell)


def set_stacked(layout: QBoxLayout, stacked: bool) -> None:
    """Arrange the cells from top to bottom, or from left to right."""
    direction = QBoxLayout.Direction
    layout.setDirection(direction.TopToBottom if stacked else direction.LeftToRight)
    around = layout.parentWidget()
    if around is not None and (whole := around.layout()) is not None:
        whole.activate()  # of a hidden page Qt would keep the former width


def _attached(
    layout: L, place: Place, spacing: int, margins: Margins, stretch: int, at: GridPlace
) -> L:
    if isinstance(place, QWidget):
        place.setLayout(layout)
    elif isinstance(place, QGridLayout):
        place.addLayout(layout, *at)
    else:
        place.addLayout(layout, stretch)
    layout.setSpacing(spacing)
    if isinstance(margins, int):
        layout.setContentsMargins(margins, margins, margins, margins)
    elif margins is not None:
        layout.setContentsMargins(*margins)
    return layout


def announce(widget: QWidget, text: str) -> None:
    """Announce a text of a widget, if a screen reader is active."""
    if text and QAccessible.isActive():
        QAccessible.updateAccessibility(QAccessibleAnnouncementEvent(widget, text))
