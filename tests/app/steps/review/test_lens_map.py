"""The field of the lens that the images support is shown as a map."""

from pathlib import Path

import numpy as np
import pyqtgraph as pg
from pytestqt.qtbot import QtBot
from tests.app.pictures import data_of
from tests.simulated_centers import observe_pixels, simulate_centers

from lightpen.arrays import FloatArray
from lightpen.estimation.calibrate import calibrate
from lightpen.formats.images import ImageSource
from lightpen.model.rigid import rig_of
from lightpen.record.swings.solving import RecordSource, Solution
from lightpen_app.steps.review.plots_panel import ResidualsPanel
from lightpen_app.widgets.result_plots import ArrowPlot
from lightpen_extensions.simulator.swings import paper_camera, paper_pen, swing_poses

N_IMAGES = 32


def solution_with_lens(amplitude: float) -> Solution:
    """Return a solution whose images have waves of an amplitude, px."""
    camera, pen, rng = paper_camera(), paper_pen(), np.random.default_rng(26)
    swing = swing_poses(N_IMAGES, rng)
    exact = simulate_centers(
        camera, pen, swing.rotations, swing.translations, 0.03, rng
    )
    waves: FloatArray = np.sin(exact[..., ::-1] / 280.0)
    seen = observe_pixels(exact + amplitude * waves, camera, pen)
    found = calibrate(camera, pen, seen)
    nothing = ImageSource((), (), lambda: iter(()))
    source = RecordSource(Path(), (nothing,), rig_of(camera), pen, (), (), Path())
    residuals = found.joint.residuals.reshape(-1, 1, pen.n_leds, 2)
    numbers = np.arange(1, N_IMAGES + 1)
    return Solution(source, numbers, seen, {}, found, residuals)


def test_the_lens_field_is_mapped_where_the_images_support_one(qtbot: QtBot) -> None:
    panel = ResidualsPanel()
    qtbot.addWidget(panel)
    panel.resize(1100, 900)
    panel.show()
    *_, card = panel._cards
    assert not card.isVisible()
    panel.set_value(solution_with_lens(0.15))
    assert card.isVisible()
    (plot,) = card.findChildren(ArrowPlot)
    assert plot.accessibleName().startswith("Lens field")
    assert len(data_of(plot, pg.PlotCurveItem)[0]) > 6
