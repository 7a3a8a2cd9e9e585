"""Whether what a window says has room in it.

A widget is judged by what its words need and what it has, also where it is scrolled out
of sight.
"""

from dataclasses import dataclass

import pyqtgraph as pg
from PySide6.QtCore import QSize
from PySide6.QtGui import QFontMetricsF
from PySide6.QtWidgets import QAbstractButton, QLabel, QScrollArea, QTabBar, QWidget

from lightpen_app.look.theme import TextSize
from lightpen_app.shell.main_window import MainWindow
from lightpen_app.steps.leds.table_panel import LedTable
from lightpen_app.widgets.fitting import FittedText
from lightpen_app.widgets.plots import Plot


@dataclass(frozen=True)
class SizeClass:
    """What there is to complain about in a window.

    Attributes
    ----------
    size : QSize
        Of the window.
    lack : QSize
        By how much the page is smaller than its layout can be made.
    clipped, sideways : tuple of str
        Words that are not seen whole; what is scrolled to the sides.
    downwards : tuple of str
        Parts of the page that are scrolled; of tables only that of the LEDs.
    """

    size: QSize
    lack: QSize
    clipped: tuple[str, ...]
    sideways: tuple[str, ...]
    downwards: tuple[str, ...]


def missing_input_of(widget: QWidget) -> str:
    """Return which words of a widget need more room than it has, or nothing."""
    needed = has = QSize()
    words = ""
    match widget:
        case QLabel() if widget.text() and widget.wordWrap():
            words, has = widget.text(), widget.size()
            needed = QSize(_widest_word(widget), widget.heightForWidth(has.width()))
        case QLabel() if widget.text():
            words, has, needed = widget.text(), widget.size(), widget.sizeHint()
        case QAbstractButton() if widget.text():
            words, has, needed = widget.text(), widget.size(), widget.sizeHint()
        case QTabBar():
            words, has = "tabs", widget.size()
            needed = QSize(widget.sizeHint().width(), 0)
        case FittedText() if widget.text():
            words, has = widget.text(), QSize(0, round(widget.size_px()))
            needed = QSize(0, TextSize.SMALL)
        case Plot():
            words, has = widget.accessibleName(), widget.size()
            needed = QSize(_title_end(widget), 0)
    if needed.width() > has.width() or needed.height() > has.height():
        return f"{words!r} needs {needed.toTuple()}, has {has.toTuple()}"
    return ""


def _widest_word(label: QLabel) -> int:
    """Return how wide a label must be; Chinese words may be broken anywhere."""
    if not label.text().isascii():
        return 0
    metrics = QFontMetricsF(label.font())
    return round(max(map(metrics.horizontalAdvance, label.text().split()), default=0))


def _title_end(plot: Plot) -> int:
    """Return where the title of a plot ends, px from its left."""
    graphics = plot.findChild(pg.PlotWidget)
    assert graphics is not None
    title = graphics.getPlotItem().titleLabel.item
    end: float = title.mapRectToScene(title.boundingRect()).right()
    return round(end)


def clipped_words(root: QWidget) -> tuple[str, ...]:
    widgets = (each for each in root.findChildren(QWidget) if each.isVisible())
    return tuple(filter(None, map(missing_input_of, widgets)))


def scrolled_sideways(root: QWidget) -> tuple[str, ...]:
    return tuple(
        type(area.parentWidget()).__name__
        for area in root.findChildren(QScrollArea)
        if area.isVisible() and area.horizontalScrollBar().maximum() > 0
    )


def scrolled_downwards(root: QWidget) -> tuple[str, ...]:
    areas = *root.findChildren(QScrollArea), *root.findChildren(LedTable)
    return tuple(
        type(area if isinstance(area, LedTable) else area.parentWidget()).__name__
        for area in areas
        if area.isVisible() and area.verticalScrollBar().maximum() > 0
    )


def room_of(window: MainWindow) -> SizeClass:
    page = window.page()
    layout = page.layout()
    assert layout is not None
    least = layout.minimumSize()
    lack = QSize(
        max(least.width() - page.width(), 0), max(least.height() - page.height(), 0)
    )
    return SizeClass(
        window.size(),
        lack,
        clipped_words(window),
        scrolled_sideways(page),
        scrolled_downwards(page),
    )
