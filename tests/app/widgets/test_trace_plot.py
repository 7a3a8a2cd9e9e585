"""Traces over the number of the image: decades, a limit, and the newest values."""

from itertools import pairwise

import numpy as np
import pyqtgraph as pg
import pytest
from PySide6.QtGui import QImage, QPainter
from pytestqt.qtbot import QtBot
from tests.app.pictures import ranges_of

from lightpen_app.look.theme import TextSize, font
from lightpen_app.widgets.figure import Axes
from lightpen_app.widgets.plots import Canvas, TracePlot


def shown(qtbot: QtBot, plot: TracePlot) -> TracePlot:
    qtbot.addWidget(plot)
    plot.resize(280, 130)
    plot.show()
    return plot


@pytest.fixture
def decades(qtbot: QtBot) -> TracePlot:
    return shown(qtbot, TracePlot(Axes("U / um"), y_log=True))


def test_decades_are_drawn_by_their_logarithm(decades: TracePlot) -> None:
    values = np.array([np.nan, 0.0, 1000.0, 10.0, 1.0])
    decades.set_data(np.arange(1.0, 6.0), values)

    (_, _), (low, high) = ranges_of(decades)

    assert -0.5 < low <= 0
    assert 3 <= high < 3.5


def test_a_limit_is_in_sight(decades: TracePlot) -> None:
    decades.set_limit(50.0)
    decades.set_data(np.arange(1.0, 4.0), np.array([4.0, 2.0, 1.0]))

    (_, _), (_, high) = ranges_of(decades)

    assert high > np.log10(50.0)


def test_the_first_values_do_not_hide_the_others(qtbot: QtBot) -> None:
    plot = shown(qtbot, TracePlot(Axes("Tip / um"), is_robust=True))
    values = np.where(np.arange(40) < 8, 5000.0, 0.5 * np.cos(np.arange(40)))
    plot.set_data(np.arange(1.0, 41.0), values)

    (left, _), (_, high) = ranges_of(plot)

    assert left <= 1
    assert high < 2


def test_the_newest_value_is_in_sight_however_far_off_it_is(qtbot: QtBot) -> None:
    plot = shown(qtbot, TracePlot(Axes("Tip / um"), is_robust=True))
    values = np.where(np.arange(40) < 38, np.cos(np.arange(40)), 5000.0)
    plot.set_data(np.arange(1.0, 41.0), values)

    _, (_, high) = ranges_of(plot)

    assert high > 5000


def test_curves_differ_by_more_than_their_colour(qtbot: QtBot) -> None:
    plot = shown(qtbot, TracePlot(Axes("Tip"), "xyz"))
    plot.set_data(np.arange(1.0, 41.0), *np.ones((3, 40)))
    canvas = plot.findChild(Canvas)
    assert canvas is not None
    items = canvas.getPlotItem().items
    pens = [item.opts["pen"] for item in items if isinstance(item, pg.PlotCurveItem)]
    symbols = [
        item.opts["symbol"] for item in items if isinstance(item, pg.ScatterPlotItem)
    ]

    assert len({pen.style() for pen in pens}) == 3
    assert [pen.width() for pen in pens] == [2, 2, 2]
    assert len(set(symbols)) == 3


def test_axes_are_drawn_anew_only_when_their_range_changes(qtbot: QtBot) -> None:
    plot = shown(qtbot, TracePlot(Axes("Tip / um")))
    canvas = plot.findChild(Canvas)
    assert canvas is not None
    axis = canvas.getPlotItem().getAxis("left")
    images = np.arange(1.0, 9.0)
    drawn: list[object] = []
    for values in (images, 0.8 * images + 1, images[::-1], 0.3 * images, 9 * images):
        plot.set_data(images, values)
        plot.grab()
        drawn.append(axis.picture)
        (_, _), (bottom, top) = ranges_of(plot)
        assert bottom < values.min() < values.max() < top

    assert drawn[0] is not None
    assert drawn[0] is drawn[1] is drawn[2]
    assert len(set(map(id, drawn))) == 3


def test_few_images_are_not_drawn_as_fractions(qtbot: QtBot) -> None:
    plot = shown(qtbot, TracePlot(Axes("RMS residual / px")))
    (left, right), _ = ranges_of(plot)
    assert right - left >= 9

    plot.set_data(np.array([1.0, 2.0]), np.array([0.1, 0.2]))

    (left, right), _ = ranges_of(plot)
    assert left <= 1
    assert right >= 10


def numbers_of(plot: TracePlot) -> list[tuple[float, float, str]]:
    """Return top, bottom and words of the numbers along y."""
    graphics = plot.findChild(pg.PlotWidget)
    assert graphics is not None
    image = QImage(400, 400, QImage.Format.Format_RGB32)
    painter = QPainter(image)
    painter.setFont(font(TextSize.SMALL))
    specs = graphics.getPlotItem().getAxis("left").generateDrawSpecs(painter)
    painter.end()
    assert specs is not None
    return [(rect.top(), rect.bottom(), text) for rect, _, text in specs[2]]


@pytest.mark.parametrize("y_log", [False, True])
@pytest.mark.parametrize("height", [72, 80, 96, 130, 300])
def test_the_numbers_of_a_low_plot_do_not_overlap(
    qtbot: QtBot, y_log: bool, height: int
) -> None:
    plot = shown(qtbot, TracePlot(Axes("U / um"), y_log=y_log))
    plot.resize(280, height)
    plot.set_data(np.arange(1.0, 61.0), np.geomspace(30.0, 0.5, 60))
    plot.grab()

    numbers = sorted(numbers_of(plot))

    assert numbers
    assert all(text for _, _, text in numbers)
    assert all(upper[1] <= lower[0] for upper, lower in pairwise(numbers))


def test_decades_are_numbered_before_what_is_between_them(decades: TracePlot) -> None:
    decades.resize(280, 84)
    decades.set_data(np.arange(1.0, 61.0), np.geomspace(120.0, 0.8, 60))
    decades.grab()

    assert {"1", "100"} <= {text for _, _, text in numbers_of(decades)}


def test_without_images_the_axes_are_as_at_the_beginning(qtbot: QtBot) -> None:
    plot = shown(qtbot, TracePlot(Axes("RMS residual / px")))
    before = ranges_of(plot)
    plot.set_data(np.arange(20.0, 80.0), np.linspace(3.0, 9.0, 60))
    assert ranges_of(plot) != before

    plot.set_data(np.empty(0), np.empty(0))

    assert ranges_of(plot) == before
