"""Every step can be used on a small screen: 1920 x 1080 at 200 % leaves 960 x 540.

A widget is judged by what its words need and what it has, also where it is scrolled out
of sight.
"""

import importlib.util
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import pyqtgraph as pg
import pytest
from PySide6.QtCore import QSize
from PySide6.QtGui import QFontMetricsF
from PySide6.QtWidgets import (
    QAbstractButton,
    QApplication,
    QHBoxLayout,
    QLabel,
    QScrollArea,
    QTabBar,
    QTabWidget,
    QWidget,
)
from pytestqt.qtbot import QtBot

from lightpen_app.look.languages import Language
from lightpen_app.look.theme import Appearance, TextSize, font, text_label
from lightpen_app.shell.main_window import MainWindow
from lightpen_app.widgets.fitted_text import FittedText
from lightpen_app.widgets.plots import Axes, Curve, Plot, TracePlot
from lightpen_app.widgets.push_button import PushButton

ROOT = Path(__file__).parents[2]


def load_screens() -> ModuleType:
    spec = importlib.util.spec_from_file_location("screens", ROOT / "docs/screens.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


SCREENS = load_screens()
LEAST = QSize(940, 500)
SIZES = (LEAST, QSize(960, 540), QSize(1280, 800))


@dataclass(frozen=True)
class SpotArrays:
    """What there is to complain about a step in a language at a size.

    Attributes
    ----------
    size : QSize
        Of the window.
    lack : QSize
        By how much the page is smaller than its layout can be made.
    clipped, sideways : tuple of str
        Words that are not seen whole; what is scrolled to the sides.
    """

    size: QSize
    lack: QSize
    clipped: tuple[str, ...]
    sideways: tuple[str, ...]


def lack_of(widget: QWidget) -> str:
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
    return tuple(filter(None, map(lack_of, widgets)))


def scrolled_sideways(root: QWidget) -> tuple[str, ...]:
    return tuple(
        type(area.parentWidget()).__name__
        for area in root.findChildren(QScrollArea)
        if area.isVisible() and area.horizontalScrollBar().maximum() > 0
    )


def spot_arrays(window: MainWindow) -> SpotArrays:
    page = window.page()
    layout = page.layout()
    assert layout is not None
    least = layout.minimumSize()
    lack = QSize(
        max(least.width() - page.width(), 0), max(least.height() - page.height(), 0)
    )
    return SpotArrays(
        window.size(), lack, clipped_words(window), scrolled_sideways(page)
    )


Key = tuple[str, str, int]


@pytest.fixture(scope="module")
def sights(dressed: QApplication) -> Iterator[dict[Key, list[SpotArrays]]]:
    """What is seen of each step in each language and width, a sight for each tab."""
    found: dict[Key, list[SpotArrays]] = {}
    with SCREENS.anywhere():
        stage = SCREENS.Stage(dressed)
        window = stage.wizard.window
        for step in SCREENS.STEPS:
            if step == "review":
                stage.solve()
            stage.go_to(step)
            for language in Language:
                for size in SIZES:
                    stage.set_look(SCREENS.Look(language, Appearance.DARK, size))
                    key = (step, str(language), size.width())
                    found[key] = [_seen(stage, window)]
                    for tabs in window.page().findChildren(QTabWidget):
                        for index in range(tabs.count()):
                            tabs.setCurrentIndex(index)
                            found[key].append(_seen(stage, window))
        yield found
        stage.close()


def _seen(stage: object, window: MainWindow) -> SpotArrays:
    assert isinstance(stage, SCREENS.Stage)
    stage.picture()  # once nothing moves any more
    return spot_arrays(window)


KEYS = [
    (step, str(language), size.width())
    for step in SCREENS.STEPS
    for language in Language
    for size in SIZES
]


@pytest.mark.parametrize("key", KEYS, ids=lambda key: "-".join(map(str, key)))
def test_a_step_has_room_in_a_small_window(
    sights: dict[Key, list[SpotArrays]], key: Key
) -> None:
    (size,) = (each for each in SIZES if each.width() == key[2])
    for sight in sights[key]:
        assert sight.size == size
        assert sight.lack == QSize(0, 0)
        assert sight.sideways == ()


@pytest.mark.parametrize("key", KEYS, ids=lambda key: "-".join(map(str, key)))
def test_no_words_of_a_step_are_clipped(
    sights: dict[Key, list[SpotArrays]], key: Key
) -> None:
    for sight in sights[key]:
        assert sight.clipped == ()


def test_the_tabs_of_the_review_are_all_looked_at(
    sights: dict[Key, list[SpotArrays]],
) -> None:
    assert len(sights["review", "en", LEAST.width()]) == 1 + 5  # the result is a tab
    assert len(sights["review", "en", 1280]) == 1 + 4


@pytest.mark.parametrize("room", [20, 60])
def test_words_that_are_clipped_are_noticed(qtbot: QtBot, room: int) -> None:
    label, button = QLabel("Exposure and gain"), PushButton()
    wrapped = text_label()
    wrapped.setText("Swing the pen first and then review what has come of it.")
    button.setText("Let the simulated operator swing")
    plot = TracePlot(Axes("Misfit of each image / px"), [Curve("misfit_px")])
    shelf = QWidget()  # a window of its own could not be made so small
    qtbot.addWidget(shelf)
    shelf.show()
    for widget in (label, wrapped, button, plot):
        widget.setParent(shelf)
        widget.resize(widget.sizeHint().expandedTo(QSize(400, 200)))
        widget.show()
        assert lack_of(widget) == ""

        widget.resize(room, 20)
        QApplication.processEvents()

        assert lack_of(widget)


def test_a_button_is_not_made_narrower_than_its_words(qtbot: QtBot) -> None:
    row, button, label = QWidget(), PushButton(), text_label()
    button.setText("Let the simulated operator swing")
    label.setText("A sentence that wraps where it has to. " * 3)
    layout = QHBoxLayout(row)
    layout.addWidget(label, 1)
    layout.addWidget(button)
    qtbot.addWidget(row)
    row.show()
    row.resize(row.minimumSizeHint().width(), 300)

    words = QFontMetricsF(font(TextSize.BODY)).horizontalAdvance(button.text())
    assert button.width() > words
    assert lack_of(button) == ""
