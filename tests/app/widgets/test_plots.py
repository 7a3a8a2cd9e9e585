"""Plots show new data without being made anew, and save themselves."""

import numpy as np
import pyqtgraph as pg
import pytest
from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QFontMetricsF, QImage, QPainter
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot
from tests.app.pictures import colors_in, data_of, items_on, ranges_of

from lightpen.estimation.uncertainty.budget import ContributionName
from lightpen_app.look.figures import arrow_scale, budget_figure
from lightpen_app.look.languages import LanguageSwitch
from lightpen_app.look.theme import DARK, LIGHT, TextSize, apply_theme, font
from lightpen_app.steps.review.residual_plots import MisfitPlot
from lightpen_app.steps.swing.view import SwingPlots
from lightpen_app.widgets.figure import Axes, Figure
from lightpen_app.widgets.plots import Canvas, TracePlot
from lightpen_app.widgets.result_plots import (
    HEAD,
    ArrowPlot,
    BarPlot,
    BudgetPlot,
    PosturePlot,
)

IMAGES = np.arange(1.0, 6.0)
VALUES = np.array([0.06, 0.05, np.nan, 0.07, 0.06])


def show(qtbot: QtBot, plot: Figure) -> None:
    qtbot.addWidget(plot)
    plot.resize(360, 240)
    plot.show()
    QApplication.processEvents()


def shown_colors(plot: Figure) -> set[str]:
    QApplication.processEvents()
    return colors_in(plot.grab().toImage())


@pytest.fixture
def trace(qtbot: QtBot) -> TracePlot:
    plot = TracePlot(Axes("RMS residual / px", "image"), y_zero=True)
    show(qtbot, plot)
    plot.set_data(IMAGES, VALUES)
    return plot


def test_the_range_holds_all_data_the_zero_and_the_limit(trace: TracePlot) -> None:
    trace.set_limit(0.2)
    trace.set_data(IMAGES, VALUES)

    (left, right), (bottom, top) = ranges_of(trace)

    assert left <= 1
    assert right >= 5
    assert bottom <= 0
    assert top >= 0.2


def test_new_data_draws_on_the_same_curve(trace: TracePlot) -> None:
    n_items = len(items_on(trace))

    for n in range(1, 50):
        trace.set_data(np.arange(n, dtype=float), np.ones(n))

    assert len(items_on(trace)) == n_items


def test_one_value_or_none_is_no_fault(trace: TracePlot) -> None:
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


def test_arrows_point_along_the_residuals_with_v_downwards(qtbot: QtBot) -> None:
    plot = ArrowPlot(Axes("Residuals"))
    show(qtbot, plot)
    points = np.array([[1000.0, 500.0], [600.0, 1500.0]])
    residuals = np.array([[0.05, 0.0], [0.0, -0.1]])

    plot.set_data((2448, 2048), points, residuals)

    x, y = data_of(plot, pg.PlotCurveItem)
    scale = plot.scale()
    assert (x[0], y[0], x[1], y[1]) == (1000, 500, 1000 + 0.05 * scale, 500)
    assert (x[6], y[6], x[7], y[7]) == (600, 1500, 600, 1500 - 0.1 * scale)


def test_the_place_of_the_leds_stays_in_sight_when_the_plot_is_resized(
    qtbot: QtBot,
) -> None:
    plot = ArrowPlot(Axes("Residuals"))
    show(qtbot, plot)
    points = np.array([[1000.0, 500.0], [600.0, 1500.0]])
    plot.set_data((2448, 2048), points, np.ones((2, 2)))

    plot.resize(700, 300)
    QApplication.processEvents()

    (left, right), (top, bottom) = ranges_of(plot)
    assert left <= 600
    assert right >= 1000
    assert top <= 500
    assert bottom >= 1500


def test_of_many_arrows_the_means_are_drawn(qtbot: QtBot) -> None:
    plot = ArrowPlot(Axes("Residuals"))
    show(qtbot, plot)
    rng = np.random.default_rng(1)
    points = rng.uniform(0, 2000, (3000, 2))
    pattern = np.array([0.02, -0.01])

    plot.set_data((2448, 2048), points, pattern + rng.normal(0, 0.05, (3000, 2)))

    x, y = data_of(plot, pg.PlotCurveItem)
    assert 300 < len(x) / 6 <= 21 * 21
    shafts = np.column_stack([x[1::6] - x[0::6], y[1::6] - y[0::6]]) / plot.scale()
    np.testing.assert_allclose(shafts.mean(axis=0), pattern, atol=0.005)


@pytest.mark.parametrize(
    ("size", "scale"), [(0.05, 1000), (0.04, 2000), (3.0, 20), (0.0, 1)]
)
def test_arrows_are_enlarged_by_a_round_factor(size: float, scale: float) -> None:
    residuals = size * np.array([[1.0, 0.0], [0.0, -1.0]])

    assert arrow_scale(residuals, 2448) == pytest.approx(scale)


@pytest.fixture
def misfits(qtbot: QtBot) -> MisfitPlot:
    plot = MisfitPlot(Axes("RMS residual / px", "image"))
    show(qtbot, plot)
    numbers = np.array([1, 2, 4, 5])
    values = np.array([0.05, 0.06, 3.0, np.nan])
    plot.set_data(numbers, values, np.array([True, True, False, False]))
    return plot


def test_images_far_off_leave_the_others_apart(misfits: MisfitPlot) -> None:
    (_, _), (bottom, top) = ranges_of(misfits)

    assert bottom == pytest.approx(0, abs=0.01)
    assert top < 0.2
    assert data_of(misfits, pg.ScatterPlotItem, 1)[:, 1].tolist() == [2, 0.06]
    assert data_of(misfits, pg.ScatterPlotItem, 2)[1, 0] < top


def test_the_marked_image_stays_marked_over_new_data(misfits: MisfitPlot) -> None:
    misfits.set_number(2)

    misfits.set_data(np.array([1, 2]), np.array([0.1, 0.2]), np.array([True, False]))

    assert data_of(misfits, pg.ScatterPlotItem).T.tolist() == [[2, pytest.approx(0.16)]]
    misfits.set_number(None)
    assert data_of(misfits, pg.ScatterPlotItem).size == 0


def test_a_click_on_a_dot_chooses_its_image(misfits: MisfitPlot, qtbot: QtBot) -> None:
    (canvas,) = misfits.findChildren(Canvas)
    canvas.fit()
    view = canvas.getPlotItem().vb
    scene = view.mapViewToScene(QPointF(2, 0.06))
    place = canvas.mapFromScene(scene)

    with qtbot.waitSignal(misfits.number_chosen) as chosen:
        QTest.mouseClick(
            canvas.viewport(),
            Qt.MouseButton.LeftButton,
            Qt.KeyboardModifier.NoModifier,
            place,
        )

    assert chosen.args == [2]


def test_bars_stand_at_their_labels(qtbot: QtBot) -> None:
    plot = BarPlot(Axes("LEDs"), ("rms", "mean"))
    show(qtbot, plot)

    plot.set_data(["1", "2"], np.array([0.05, np.nan]), np.array([-0.01, 0.01]))

    (left, right), (bottom, top) = ranges_of(plot)
    assert left <= -0.4
    assert right >= 1.4
    assert bottom <= -0.01
    assert top >= 0.05


def test_the_budget_is_sorted_and_says_what_is_assumed_and_the_limit(
    qtbot: QtBot,
) -> None:
    shares = (
        (ContributionName.NOISE, 0.003, False),
        (ContributionName.FORM, 0.004, True),
        (ContributionName.CAMERA, 0.0, False),
    )
    plot = BudgetPlot(Axes(""))
    show(qtbot, plot)

    plot.set_value(budget_figure(shares, 0.005, 0.012))

    shown = [(each.name, each.value, each.assumed) for each in plot.value().bars]
    assert shown == [
        *(("combined", 0.005, False), ("form of ball, cone", 0.004, True)),
        *(("noise", 0.003, False), ("camera", 0.0, False)),
    ]
    within = shown_colors(plot)
    assert DARK.accent in within
    assert DARK.bad not in within

    plot.set_value(budget_figure(shares, 0.005, 0.004))

    assert DARK.bad in shown_colors(plot)  # beyond its limit


def test_the_bars_of_a_budget_are_as_long_as_their_values(qtbot: QtBot) -> None:
    plot = BudgetPlot(Axes(""))
    show(qtbot, plot)
    shares = ((ContributionName.NOISE, 0.001, False),)

    plot.set_value(budget_figure(shares, 0.004, None))

    image = plot.grab().toImage()
    lengths = [
        sum(image.pixelColor(x, y).name() == DARK.accent for x in range(image.width()))
        for y in range(image.height())
    ]
    longest = max(lengths)
    others = [n for n in lengths if 0 < n < 0.9 * longest]
    assert max(others) == pytest.approx(longest / 4, abs=2)


def test_the_names_of_a_budget_never_overlap(qtbot: QtBot) -> None:
    names = (*ContributionName,)
    plot = BudgetPlot(Axes("U"))
    show(qtbot, plot)

    plot.set_value(budget_figure([(name, 0.001, False) for name in names], 0.004, 0.01))

    rows = 1 + len(plot.value().bars)  # and the limit
    height = QFontMetricsF(font(TextSize.SMALL)).height()
    assert plot.minimumHeight() >= HEAD + rows * height


def test_the_name_of_an_axis_that_is_too_short_for_it_is_left_out(qtbot: QtBot) -> None:
    plot = TracePlot(Axes("Uncertainty", "image", "U (k = 2) / mm"))
    label = plot.findChildren(pg.PlotWidget)[0].getPlotItem().getAxis("left").label
    for height, is_named in ((240, True), (110, False), (240, True)):
        show(qtbot, plot)
        plot.resize(360, height)
        QApplication.processEvents()
        assert label.isVisible() is is_named


def test_series_are_renamed_with_the_language(qtbot: QtBot) -> None:
    bars = BarPlot(Axes("U"), ("x", "y"))
    show(qtbot, bars)

    bars.set_names(["a", "b"])

    assert bars.names() == ("a", "b")


def test_postures_lie_where_the_pen_leant_as_the_camera_sees_it(qtbot: QtBot) -> None:
    plot = PosturePlot(Axes("Postures"))
    show(qtbot, plot)

    plot.set_data(np.radians([10.0, 20.0]), np.radians([0.0, 90.0]))

    dots = data_of(plot, pg.ScatterPlotItem)
    np.testing.assert_allclose(dots, [[10, 0], [0, 20]], atol=1e-9)
    (left, right), (bottom, top) = ranges_of(plot)
    assert left <= -36
    assert right >= 36
    assert bottom <= -36
    assert top >= 36


def test_new_data_makes_no_new_items(qtbot: QtBot) -> None:
    bars = BarPlot(Axes("LEDs"), ("rms",))
    show(qtbot, bars)
    before = len(items_on(bars))

    for n in range(2, 30):
        bars.set_data([str(i) for i in range(n)], np.ones(n))

    assert len(items_on(bars)) == before


def test_the_numbers_of_an_axis_have_as_many_decimals(qtbot: QtBot) -> None:
    plot = TracePlot(Axes("x / mm", "swing"))
    show(qtbot, plot)
    canvas = plot.findChild(Canvas)
    assert canvas is not None
    axis = canvas.getPlotItem().getAxis("left")
    for values in (VALUES, -1.31 - 0.001 * IMAGES, 1000.0 * IMAGES, 1e-5 * IMAGES):
        plot.set_data(IMAGES, values)
        plot.grab()

        image = QImage(1, 1, QImage.Format.Format_RGB32)
        with QPainter(image) as painter:
            _, _, words = axis.generateDrawSpecs(painter)

        assert len(words) > 1
        assert len({len(text.partition(".")[2]) for *_, text in words}) == 1, words


def test_an_axis_within_a_decade_has_more_than_one_number(qtbot: QtBot) -> None:
    plot = TracePlot(Axes("U", "swing"), y_log=True)
    show(qtbot, plot)
    canvas = plot.findChild(Canvas)
    assert canvas is not None
    plot.set_data(IMAGES, 11.0 + 7.0 * IMAGES)
    plot.grab()

    image = QImage(1, 1, QImage.Format.Format_RGB32)
    with QPainter(image) as painter:
        axis = canvas.getPlotItem().getAxis("left")
        _, _, words = axis.generateDrawSpecs(painter)

    assert len(words) > 1, words


def test_the_words_of_a_plot_follow_every_change_of_language(
    qapp: QApplication, qtbot: QtBot
) -> None:
    plots = SwingPlots()
    qtbot.addWidget(plots)
    switch, plot = LanguageSwitch(qapp), plots.plots()[0]
    english = plot.accessibleName()
    for language in ("zh_CN", "en", "zh_CN", "en"):
        switch.set_language(language)
        qapp.processEvents()
        assert (plot.accessibleName() == english) is (language == "en")
    switch.remove()
