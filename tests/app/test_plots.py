"""Plots show new data without being made anew, and save themselves."""

from pathlib import Path

import numpy as np
import pytest
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from lightpen.errors import FileError
from lightpen_app.theme import DARK, LIGHT, apply_theme
from lightpen_app.widgets.plots import (
    ArrowPlot,
    Axes,
    Curve,
    DotPlot,
    Histogram,
    Plot,
    TracePlot,
)

IMAGES = np.arange(1.0, 6.0)
VALUES = np.array([0.06, 0.05, np.nan, 0.07, 0.06])


def show(qtbot: QtBot, plot: Plot) -> None:
    qtbot.addWidget(plot)
    plot.resize(360, 240)
    plot.show()
    QApplication.processEvents()


def shown_colors(plot: Plot) -> set[str]:
    QApplication.processEvents()
    image = plot.grab().toImage()
    return {
        image.pixelColor(x, y).name()
        for x in range(image.width())
        for y in range(image.height())
    }


@pytest.fixture
def trace(qtbot: QtBot) -> TracePlot:
    plot = TracePlot(Axes("Misfit / px", "image"), [Curve("misfit_px")], y_zero=True)
    show(qtbot, plot)
    plot.set_data(IMAGES, VALUES)
    return plot


def test_the_range_holds_all_data_the_zero_and_the_limit(trace: TracePlot) -> None:
    trace.set_limit(0.2, "limit 0.2")
    trace.set_data(IMAGES, VALUES)

    (left, right), (bottom, top) = trace.ranges()

    assert left <= 1
    assert right >= 5
    assert bottom <= 0
    assert top >= 0.2


def test_new_data_draws_on_the_same_curve(trace: TracePlot) -> None:
    n_items = trace.n_items()

    for n in range(1, 50):
        trace.set_data(np.arange(n, dtype=float), np.ones(n))

    assert trace.n_items() == n_items


def test_one_value_or_none_is_no_trouble(trace: TracePlot) -> None:
    trace.set_data(np.array([]), np.array([]))
    trace.set_data(np.array([1.0]), np.array([0.0]))
    trace.set_data(np.array([1.0]), np.array([np.nan]))

    assert trace.grab().width() == 360


def test_a_change_of_theme_colours_plots_that_are_there(
    trace: TracePlot, qapp: QApplication
) -> None:
    dark = shown_colors(trace)
    apply_theme(qapp, LIGHT)
    light = shown_colors(trace)

    assert {DARK.panel, DARK.accent} <= dark
    assert {LIGHT.panel, LIGHT.accent} <= light
    assert DARK.panel not in light


def test_the_numbers_are_saved_as_they_are(trace: TracePlot, tmp_path: Path) -> None:
    path = tmp_path / "misfit.csv"

    trace.save_csv(path)

    assert path.read_text().splitlines() == [
        "image,misfit_px",
        "1,0.06",
        "2,0.05",
        "3,nan",
        "4,0.07",
        "5,0.06",
    ]


def test_the_picture_is_saved_at_twice_its_size(
    trace: TracePlot, tmp_path: Path
) -> None:
    path = tmp_path / "misfit.png"

    trace.save_png(path)

    saved = QImage(str(path))
    assert (saved.width(), saved.height()) == (720, 480)
    colors = {
        saved.pixelColor(x, y).name() for x in range(720) for y in range(100, 400)
    }
    assert DARK.accent in colors


@pytest.mark.parametrize("save", ["save_png", "save_csv"])
def test_a_file_that_cannot_be_written_is_told(
    trace: TracePlot, tmp_path: Path, save: str
) -> None:
    with pytest.raises(FileError, match="cannot be written"):
        getattr(trace, save)(tmp_path)


def test_arrows_point_along_the_residuals_with_v_downwards(qtbot: QtBot) -> None:
    plot = ArrowPlot(Axes("Residuals"), (2448, 2048))
    show(qtbot, plot)
    points = np.array([[1000.0, 500.0], [600.0, 1500.0]])
    residuals = np.array([[0.05, 0.0], [0.0, -0.1]])

    plot.set_data(points, residuals, scale=2000)

    x, y = plot.lines()
    assert (x[0], y[0], x[1], y[1]) == (1000, 500, 1100, 500)
    assert (x[6], y[6], x[7], y[7]) == (600, 1500, 600, 1300)
    (_, _), (top, bottom) = plot.ranges()
    assert top <= 0
    assert bottom >= 2048
    assert list(plot.columns()) == [
        "x_px",
        "y_px",
        "residual_x_px",
        "residual_y_px",
    ]


def test_a_histogram_counts_every_residual(qtbot: QtBot) -> None:
    plot = Histogram(Axes("Residuals / px"), "residual_px")
    show(qtbot, plot)
    values = np.random.default_rng(1).normal(0, 0.05, 4000)

    plot.set_data(values)

    columns = plot.columns()
    assert columns["count"].sum() == 4000
    middles = columns["residual_px"]
    np.testing.assert_allclose(middles, -middles[::-1], atol=1e-12)
    plot.set_data(np.zeros(0))
    plot.set_data(np.zeros(3))
    assert plot.columns()["count"].sum() == 3


def test_dots_keep_their_numbers(qtbot: QtBot) -> None:
    plot = DotPlot(Axes("Residuals / px", "x", "y"), ("x_px", "y_px"), square=True)
    show(qtbot, plot)

    plot.set_data(np.array([1.0, 2.0]), np.array([3.0, 5.0]))

    np.testing.assert_array_equal(plot.columns()["y_px"], [3, 5])
    (left, right), (bottom, top) = plot.ranges()
    assert right - left >= 1
    assert top - bottom >= 2
