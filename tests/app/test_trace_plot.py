"""Traces over the number of the image: decades, a limit, and the newest values."""

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from lightpen_app.widgets.plots import Axes, Curve, TracePlot


def shown(qtbot: QtBot, plot: TracePlot) -> TracePlot:
    qtbot.addWidget(plot)
    plot.resize(280, 130)
    plot.show()
    return plot


@pytest.fixture
def decades(qtbot: QtBot) -> TracePlot:
    return shown(qtbot, TracePlot(Axes("U / um"), [Curve("u_um")], y_log=True))


def test_decades_are_drawn_by_their_logarithm_and_saved_as_they_are(
    decades: TracePlot,
) -> None:
    values = np.array([np.nan, 0.0, 1000.0, 10.0, 1.0])
    decades.set_data(np.arange(1.0, 6.0), values)

    (_, _), (low, high) = decades.ranges()

    assert -0.5 < low <= 0
    assert 3 <= high < 3.5
    np.testing.assert_array_equal(decades.columns()["u_um"], values)


def test_a_limit_has_room_for_its_words_above_it(decades: TracePlot) -> None:
    decades.set_limit(5.0, "limit 5")
    decades.set_data(np.arange(1.0, 4.0), np.array([4.0, 2.0, 1.0]))

    (_, _), (_, high) = decades.ranges()

    assert high > np.log10(5.0) + 0.3


def test_the_first_values_do_not_hide_the_newest(qtbot: QtBot) -> None:
    plot = shown(qtbot, TracePlot(Axes("Tip / um"), [Curve("x_um")], tail=0.75))
    values = np.where(np.arange(40) < 8, 5000.0, 0.5)
    plot.set_data(np.arange(1.0, 41.0), values)

    (left, _), (_, high) = plot.ranges()

    assert left <= 1
    assert high < 2


def test_few_images_are_not_drawn_as_fractions(qtbot: QtBot) -> None:
    plot = shown(qtbot, TracePlot(Axes("Misfit / px"), [Curve("misfit_px")]))
    (left, right), _ = plot.ranges()
    assert right - left >= 9

    plot.set_data(np.array([1.0, 2.0]), np.array([0.1, 0.2]))

    (left, right), _ = plot.ranges()
    assert left <= 1
    assert right >= 10
