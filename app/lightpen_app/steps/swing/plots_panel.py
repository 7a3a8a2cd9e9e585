"""Live plots of a swing."""

from collections import deque

import numpy as np
from PySide6.QtWidgets import QWidget

from lightpen.arrays import FloatArray
from lightpen.swing.capture.kept_images import AcceptedImages
from lightpen.swing.capture.seat import tip_offsets
from lightpen.swing.capture.state import SwingState
from lightpen_app.look.layouts import grid_layout
from lightpen_app.look.quantities import MICROMETRES
from lightpen_app.look.theme import GRID
from lightpen_app.widgets.plots import Axes, Curve, TracePlot
from lightpen_app.widgets.translated import Translated

TAIL = 0.75  # of the estimates; the first ones are far off
LEAST_HEIGHT = 10 * GRID


class SwingPlots(Translated, QWidget):
    """Misfit and tip of each image, the estimate of the tip, and its uncertainty."""

    def __init__(self) -> None:
        super().__init__()
        self._shown: dict[TracePlot, SwingState] = {}
        self._limit: float | None = None  # of U, µm

        # Widgets
        self._misfit = TracePlot(Axes(""), [Curve("misfit_px")], y_zero=True)
        self._scatter = TracePlot(
            Axes(""), [Curve("u_um", "u"), Curve("v_um", "v"), Curve("w_um", "w")]
        )
        self._estimate = TracePlot(
            Axes(""),
            [Curve("x_um", "x"), Curve("y_um", "y"), Curve("z_um", "z")],
            tail=TAIL,
        )
        self._uncertainty = TracePlot(
            Axes(""), [Curve("expanded_uncertainty_um"), Curve("floor_um")], y_log=True
        )

        # Layout
        layout = grid_layout(self)
        layout.addWidget(self._misfit, 0, 0)
        layout.addWidget(self._scatter, 0, 1)
        layout.addWidget(self._estimate, 1, 0)
        layout.addWidget(self._uncertainty, 1, 1)
        for plot in self.plots():
            plot.setMinimumHeight(LEAST_HEIGHT)

        self._turns = deque(
            zip(
                self.plots(),
                (
                    self._show_misfit,
                    self._show_scatter,
                    self._show_estimate,
                    self._show_uncertainty,
                ),
                strict=True,
            )
        )
        self._retranslate()

    def plots(self) -> tuple[TracePlot, ...]:
        """Return the plots: misfit, scatter, estimate and uncertainty."""
        return self._misfit, self._scatter, self._estimate, self._uncertainty

    def show_next(self, state: SwingState, max_uncertainty: float) -> None:
        """Update one plot, in turn; the limit of U is in mm.

        One at a time, so that the window is never held up by all of them.
        """
        plot, show = self._turns[0]
        self._turns.rotate(-1)
        if self._shown.get(plot) is not state:
            self._shown[plot] = state
            show(state, max_uncertainty)

    def _show_misfit(self, state: SwingState, _max_uncertainty: float) -> None:
        self._misfit.set_data(_numbers(state.kept), state.kept.misfits)

    def _show_scatter(self, state: SwingState, _max_uncertainty: float) -> None:
        kept = state.kept
        offsets: FloatArray = np.zeros((len(kept), 3))
        if kept.seat is not None:
            offsets = tip_offsets(kept.seat, kept.rotations, kept.translations)
        self._scatter.set_data(_numbers(kept), *(MICROMETRES * offsets.T))

    def _show_estimate(self, state: SwingState, _max_uncertainty: float) -> None:
        trace = state.trace
        changes = trace.tips - trace.tips[-1:]
        self._estimate.set_data(
            trace.n_images.astype(np.float64), *(MICROMETRES * changes.T)
        )

    def _show_uncertainty(self, state: SwingState, max_uncertainty: float) -> None:
        trace = state.trace
        if self._limit != MICROMETRES * max_uncertainty:
            self._limit = MICROMETRES * max_uncertainty
            self._show_limit()
        finite = np.where(np.isfinite(trace.uncertainties), trace.uncertainties, np.nan)
        floors = np.where(np.isfinite(finite), trace.floors, np.nan)
        self._uncertainty.set_data(
            trace.n_images.astype(np.float64),
            MICROMETRES * finite,
            MICROMETRES * floors,
        )

    def _show_limit(self) -> None:
        title = self.tr("U (k = 2) / µm")
        if self._limit is not None:
            limit = self.tr("limit {0}").format(f"{self._limit:g}")
            title = f"{title}, {limit}"
        self._uncertainty.set_limit(self._limit)
        self._uncertainty.set_axes(Axes(title))

    def _retranslate(self) -> None:
        self._misfit.set_axes(Axes(self.tr("RMS residual per image / px")))
        self._scatter.set_axes(Axes(self.tr("Tip per image / µm")))
        self._estimate.set_axes(Axes(self.tr("Tip estimate / µm")))
        self._uncertainty.set_names("U", self.tr("achievable"))
        self._show_limit()


def _numbers(kept: AcceptedImages) -> FloatArray:
    """Return the numbers (N,) of accepted images."""
    return kept.numbers.astype(np.float64)
