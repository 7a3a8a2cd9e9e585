"""Tests of Review where two cameras saw the pen: the images of each can be seen."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pyqtgraph as pg
import pytest
from PySide6.QtCore import QThreadPool
from PySide6.QtWidgets import QAbstractButton, QWidget
from pytestqt.qtbot import QtBot
from tests.app.pictures import data_of

from lightpen.arrays import FloatArray
from lightpen.record.swings.reading import open_record
from lightpen.record.swings.solving import Solution, solve_record
from lightpen_app.look.figures import MANY, cell_means
from lightpen_app.steps.review.image_table import ImageTable
from lightpen_app.steps.review.images_panel import ImagesPanel
from lightpen_app.steps.review.plots_panel import ResidualsPanel
from lightpen_app.steps.review.residual_plots import ResidualView
from lightpen_app.widgets.live_markers import CameraSwitch
from lightpen_app.widgets.result_plots import ArrowPlot
from lightpen_app.widgets.state_banner import SignLabel


@pytest.fixture(scope="module")
def solution(swung: Callable[..., Path]) -> Solution:
    return solve_record(open_record(swung(14, by_two=True)))


@pytest.fixture
def panel(qtbot: QtBot) -> ImagesPanel:
    """Return a panel that lasts as long as the thread that reads its images."""

    def let_go(panel: ImagesPanel) -> None:
        panel.shut_down()
        QThreadPool.globalInstance().waitForDone()

    panel = ImagesPanel()
    qtbot.addWidget(panel, before_close_func=let_go)
    return panel


def press(panel: QWidget, text: str) -> None:
    buttons = panel.findChildren(QAbstractButton)
    button = next(each for each in buttons if each.text() == text)
    assert button.isVisibleTo(panel)
    button.click()


def seen(solution: Solution, camera: int, index: int) -> FloatArray:
    points = solution.seen_by(camera).seen_pixels[index]
    return np.asarray(points[np.isfinite(points[:, 0])])


def are_ringed(view: ResidualView, points: FloatArray) -> bool:
    return np.array_equal([(ring.x, ring.y) for ring in view.markers()], points)


@pytest.mark.slow
def test_the_residuals_are_of_both_cameras(solution: Solution) -> None:
    for c, images in enumerate(solution.calibration.cameras):
        squares = np.square(solution.residuals[:, c]).sum(axis=-1)
        rms = np.sqrt(squares[images.leds_used].mean())
        assert rms == pytest.approx(images.total_rms)
    used = solution.calibration.used
    np.testing.assert_allclose(
        solution.misfits[used], solution.calibration.joint.image_rms
    )


def test_the_images_of_the_second_camera_are_shown_with_what_it_saw(
    solution: Solution, panel: ImagesPanel, qtbot: QtBot
) -> None:
    panel.set_value(solution)
    panel.findChildren(ImageTable)[0].choose(5)
    view = panel.findChildren(ResidualView)[0]

    for camera in (1, 0):
        press(panel, f"Camera {camera + 1}")
        expected = seen(solution, camera, 4)
        qtbot.waitUntil(partial(are_ringed, view, expected))
        assert len(view._arrows.points) == len(expected)


def test_the_residuals_over_the_image_are_of_the_camera_that_is_chosen(
    solution: Solution, qtbot: QtBot
) -> None:
    panel = ResidualsPanel()
    qtbot.addWidget(panel)
    panel.set_value(solution)
    arrows = panel.findChildren(ArrowPlot)[0]

    for camera in (1, 0):
        press(panel, f"Camera {camera + 1}")
        used = solution.calibration.cameras[camera].leds_used
        points = solution.seen_by(camera).seen_pixels[used]
        starts = data_of(arrows, pg.PlotCurveItem)[:, ::6].T
        if len(points) > MANY:
            points, _ = cell_means(points, points)
        np.testing.assert_allclose(starts, points)


def test_two_cameras_need_no_more_width_than_one(
    solution: Solution, panel: ImagesPanel, qtbot: QtBot
) -> None:
    panel.resize(500, 460)
    panel.show()
    width = panel.minimumSizeHint().width()

    panel.set_value(solution)

    (switch,) = panel.findChildren(CameraSwitch)
    qtbot.waitUntil(switch.isVisible)
    assert panel.minimumSizeHint().width() == width


def test_why_there_is_no_monte_carlo_of_two_cameras_is_seen(
    solution: Solution, qtbot: QtBot
) -> None:
    from lightpen_app_extensions.comparisons.monte_carlo_row import MonteCarloRow

    row = MonteCarloRow()
    qtbot.addWidget(row)
    row.set_value(solution)

    start = next(b for b in row.findChildren(QAbstractButton) if b.isVisibleTo(row))
    assert not start.isEnabled()
    shown = [each for each in row.findChildren(SignLabel) if each.isVisibleTo(row)]
    words = [each.value().text for each in shown]
    assert words == ["Available for swings with one camera only."]
