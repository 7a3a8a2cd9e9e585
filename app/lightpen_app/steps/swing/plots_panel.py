"""Live plots of a swing."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QTabBar, QWidget

from lightpen.arrays import FloatArray
from lightpen.swing.capture.kept_images import AcceptedImages
from lightpen.swing.capture.seat import tip_offsets
from lightpen.swing.capture.state import SwingState
from lightpen_app.look.layouts import horizontal_layout, vertical_layout
from lightpen_app.look.quantities import AXES, MICROMETRES
from lightpen_app.look.theme import GRID
from lightpen_app.widgets.figure import Axes
from lightpen_app.widgets.plots import Curve, TracePlot
from lightpen_app.widgets.translated import Translated

LEAST_HEIGHT = 15 * GRID
CAMERA_AXES = ("u", "v", "w")
N_SHOWN = 2  # plots at a time


@dataclass
class _Trace:
    """A plot, how it shows a swing, and the swing that it shows."""

    plot: TracePlot
    show: Callable[[SwingState], None]
    shown: SwingState | None = None


class SwingPlots(Translated, QWidget):
    """Residuals and U, or in their place the tip of each image and its estimate."""

    def __init__(self) -> None:
        super().__init__()
        self._limit: float | None = None  # of U, µm
        self._turn = 0

        # Widgets
        self._choice = QTabBar(documentMode=True, drawBase=False)
        self._choice.setFocusPolicy(Qt.FocusPolicy.TabFocus)  # Space is the swing's
        self.say_items(self._choice, (self.tr("Residuals and U"), self.tr("Tip")))
        image = self.tr("image")
        axes = Axes(self.tr("Residual of each image"), image, "RMS / px")
        misfit = self.say(
            TracePlot(axes, [Curve("misfit_px")], y_zero=True),
            tip=self.tr(
                "How far the LEDs of an image are from where the fit expects them. "
                "This fit takes the LEDs as in their file; that of the review may "
                "correct them, and leave smaller residuals."
            ),
        )
        axes = Axes(self.tr("Uncertainty of the tip"), image, self.tr("U (k = 2) / µm"))
        curves = [Curve("expanded_uncertainty_um"), Curve("floor_um")]
        uncertainty = self.say(
            TracePlot(axes, curves, y_log=True),
            tip=self.tr(
                "U of the tip in its weakest direction. The swing ends below the limit "
                "(horizontal line). Dashed: what more images cannot improve."
            ),
        )
        axes = Axes(self.tr("Tip of each image"), image, "µm")
        curves = [Curve(f"{a}_um", a) for a in CAMERA_AXES]
        scatter = self.say(
            TracePlot(axes, curves, is_robust=True),
            tip=self.tr(
                "The tip by each image alone, from the cone: u to the right, v down, w "
                "away from the camera. A step means that the tip has slipped."
            ),
        )
        axes = Axes(self.tr("Estimate of the tip"), image, "µm")
        curves = [Curve(f"{a}_um", a) for a in AXES]
        estimate = self.say(
            TracePlot(axes, curves, is_robust=True),
            tip=self.tr(
                "The tip by all images so far, from its newest value. First estimates "
                "that are far off are cut off."
            ),
        )
        self._traces = (
            _Trace(misfit, self._show_misfit),
            _Trace(uncertainty, self._show_uncertainty),
            _Trace(scatter, self._show_scatter),
            _Trace(estimate, self._show_estimate),
        )

        # Layout
        layout = vertical_layout(self, self._choice, spacing=0)
        row = horizontal_layout(layout, *((plot, 1) for plot in self.plots()))
        layout.setStretchFactor(row, 1)
        for plot in self.plots():
            plot.setMinimumHeight(LEAST_HEIGHT)

        # Connections
        self._choice.currentChanged.connect(self._on_choice_changed)

        self._on_choice_changed()
        self._retranslate()

    def plots(self) -> tuple[TracePlot, ...]:
        """Return the plots: misfit, uncertainty, scatter and estimate."""
        return tuple(trace.plot for trace in self._traces)

    def show_next(self, state: SwingState, max_uncertainty: float) -> None:
        """Update one of the plots in sight, in turn; the limit of U is in mm.

        One at a time, so that the window is never held up by all of them.
        """
        if self._limit != MICROMETRES * max_uncertainty:
            self._limit = MICROMETRES * max_uncertainty
            self._retranslate()
        self._turn = (self._turn + 1) % N_SHOWN
        trace = self._traces[N_SHOWN * self._choice.currentIndex() + self._turn]
        if trace.shown is not state:
            trace.shown = state
            trace.show(state)

    def _on_choice_changed(self) -> None:
        for i, plot in enumerate(self.plots()):
            plot.setVisible(i // N_SHOWN == self._choice.currentIndex())

    def _show_misfit(self, state: SwingState) -> None:
        self._traces[0].plot.set_data(_numbers(state.kept), state.kept.misfits)

    def _show_uncertainty(self, state: SwingState) -> None:
        trace = state.trace
        finite = np.where(np.isfinite(trace.uncertainties), trace.uncertainties, np.nan)
        floors = np.where(np.isfinite(finite), trace.floors, np.nan)
        n_images = trace.n_images.astype(np.float64)
        values = MICROMETRES * finite, MICROMETRES * floors
        self._traces[1].plot.set_data(n_images, *values)

    def _show_scatter(self, state: SwingState) -> None:
        kept = state.kept
        offsets: FloatArray = np.zeros((len(kept), 3))
        if kept.seat is not None:
            offsets = tip_offsets(kept.seat, kept.rotations, kept.translations)
        self._traces[2].plot.set_data(_numbers(kept), *(MICROMETRES * offsets.T))

    def _show_estimate(self, state: SwingState) -> None:
        trace = state.trace
        changes = MICROMETRES * (trace.tips - trace.tips[-1:])
        self._traces[3].plot.set_data(trace.n_images.astype(np.float64), *changes.T)

    def _retranslate(self) -> None:
        words = "" if self._limit is None else f"{self._limit:g}"
        limit = self.tr("limit {0}").format(words)
        plot = self._traces[1].plot
        plot.set_limit(self._limit, limit)
        plot.set_names("U", self.tr("achievable"))


def _numbers(kept: AcceptedImages) -> FloatArray:
    """Return the numbers (N,) of accepted images."""
    return kept.numbers.astype(np.float64)
