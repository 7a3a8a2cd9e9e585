"""Trend of a tip: x, y, z and U over its calibrations, with limits."""

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QWidget
from typing_extensions import override

from lightpen.archive.trends import Trend
from lightpen.arrays import FloatArray
from lightpen_app.look.layouts import grid_layout, vertical_layout
from lightpen_app.look.theme import GRID, TextSize, Tone, colors_of, text_label
from lightpen_app.look.words import AXES, day_text, shortened
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.figure import Axes
from lightpen_app.widgets.fitting import ResponsiveLayout
from lightpen_app.widgets.plots import Plot

DOT, RING = 6, 13  # px
N_LINES = 3
LEAST_HEIGHT = 18 * GRID


class TrendPlot(Plot):
    """A value with its uncertainty over calibrations, between limits."""

    def __init__(self, axes: Axes) -> None:
        self._dots: pg.ScatterPlotItem | None = None
        self._values: FloatArray = np.zeros(0)
        super().__init__(axes)
        self._bars = pg.ErrorBarItem(x=np.zeros(0), y=np.zeros(0), height=np.zeros(0))
        self._line = pg.PlotCurveItem()
        self._dots = pg.ScatterPlotItem(size=DOT)
        self._ring = pg.ScatterPlotItem(size=RING)
        self._limits = [pg.InfiniteLine(angle=0) for _ in range(N_LINES)]
        for item in (*self._limits, self._bars, self._line, self._dots, self._ring):
            self._item.addItem(item)
        self._restyle()

    def set_data(
        self, values: FloatArray, uncertainty: FloatArray | None, limits: FloatArray
    ) -> None:
        """Show values (N,) with their U (N,), and up to three limits, lowest first."""
        x = np.arange(1.0, len(values) + 1)
        bars = np.zeros(len(values)) if uncertainty is None else uncertainty
        self._bars.setData(x=x, y=values, height=2 * bars)
        self._line.setData(x, values)
        assert self._dots is not None
        self._dots.setData(x, values)
        self._ring.setData([], [])
        for i, line in enumerate(self._limits):
            line.setVisible(i < len(limits))
            if i < len(limits):
                line.setValue(float(limits[i]))
        self._values = values
        seen = np.concatenate((values - bars, values + bars, limits))
        self._fit_numbered(len(x), seen)

    def mark(self, number: int | None) -> None:
        """Put a ring about the dot of a calibration, counted from 1, or about none."""
        values = self._values
        if number is None or not 1 <= number <= len(values):
            self._ring.setData([], [])
        else:
            self._ring.setData([float(number)], [float(values[number - 1])])

    @override
    def _restyle(self) -> None:
        super()._restyle()
        if self._dots is None:
            return
        colors = colors_of(self.palette())
        self._bars.setOpts(pen=pg.mkPen(colors.edge, width=1))
        self._line.setPen(pg.mkPen(colors.accent, width=1))
        self._dots.setPen(pg.mkPen(None))
        self._dots.setBrush(pg.mkBrush(colors.accent))
        self._ring.setPen(pg.mkPen(colors.tone(Tone.WARN), width=2))
        self._ring.setBrush(pg.mkBrush(None))
        middle = len(self._limits) // 2
        for i, line in enumerate(self._limits):
            style = Qt.PenStyle.DotLine if i == middle else Qt.PenStyle.DashLine
            line.setPen(pg.mkPen(colors.muted, width=1, style=style))


class TrendPanel(ResponsiveLayout, Translated, QWidget):
    """Shows the trend of a pen and tip: four plots, in a row where there is room.

    The plots take long to be made, and are when there is something to show.
    """

    narrow_below = 110 * GRID  # px

    def __init__(self) -> None:
        super().__init__()
        self._value = Trend()

        # Widgets
        self._text = text_label(TextSize.SMALL, Tone.QUIET)
        self._plots: tuple[TrendPlot, ...] = ()

        # Layout
        layout = vertical_layout(
            self, self._text, spacing=GRID // 2, margins=(0, GRID, 0, 0)
        )
        self._grid = grid_layout(layout, stretch=1)

        self._refresh()

    def plots(self) -> tuple[TrendPlot, ...]:
        """Return the plots of x, y, z and U; empty without a trend."""
        return self._plots

    def value(self) -> Trend:
        """Return the trend that is shown."""
        return self._value

    def set_value(self, trend: Trend) -> None:
        """Show another trend."""
        self._value = trend
        if trend.entries and not self._plots:
            self._make_plots()
        if self._plots:
            self._show(trend)
        self._text.setText(self._text_of(trend))

    def _make_plots(self) -> None:
        of_axis = self.tr("{0} / mm with U (k = 2)")
        titles = *map(of_axis.format, AXES), self.tr("Largest U (k = 2) / mm")
        number = self.tr("calibration no.")
        self._plots = tuple(TrendPlot(Axes(title, number)) for title in titles)
        for plot in self._plots:
            plot.setMinimumHeight(LEAST_HEIGHT)
        self._use_room()

    def _show(self, trend: Trend) -> None:
        tips = np.array([tip.tip_pen for tip in trend.tips]).reshape(-1, 3)
        spread = np.array([tip.uncertainty for tip in trend.tips]).reshape(-1, 3)
        control = trend.control
        for axis in range(3):
            limits = np.zeros(0)
            if control is not None:
                edges = (control.lower, control.center, control.upper)
                limits = np.array([edge[axis] for edge in edges])
            self._plots[axis].set_data(tips[:, axis], spread[:, axis], limits)
        limit = [] if trend.max_uncertainty is None else [trend.max_uncertainty]
        self._plots[3].set_data(spread.max(axis=1, initial=0.0), None, np.array(limit))

    def mark(self, sha256: str) -> None:
        """Mark the calibration of an entry."""
        found = [i for i, e in enumerate(self._value.entries, 1) if e.sha256 == sha256]
        for plot in self._plots:
            plot.mark(found[0] if found else None)

    def words(self) -> str:
        """Return the text above the plots."""
        return self._text.text()

    @override
    def _use_room(self) -> None:
        n_columns = 2 if self._room.is_narrow else 4
        for i, plot in enumerate(self._plots):
            self._grid.addWidget(plot, *divmod(i, n_columns))

    def _refresh(self) -> None:
        self._text.setText(self._text_of(self._value))

    def _text_of(self, trend: Trend) -> str:
        if not trend.entries:
            return self.tr("Select an entry with a tip to see its trend.")
        days = (trend.entries[0].entry.event.at, trend.entries[-1].entry.event.at)
        first, last = (day_text(day) for day in days)
        names = shortened(trend.pen), shortened(trend.tip)
        if len(trend.entries) == 1:
            return self.tr(
                "Pen {0}, tip {1}: one calibration, {2}. Dashed: the limit of U."
            ).format(*names, first)
        if trend.control is None:
            return self.tr(
                "Pen {0}, tip {1}: {2} calibrations, {3} to {4}. Dashed: the limit of "
                "U. Ten calibrations give control limits."
            ).format(*names, len(trend.entries), first, last)
        return self.tr(
            "Pen {0}, tip {1}: {2} calibrations, {3} to {4}. Dashed: mean ± three "
            "standard deviations, and the limit of U."
        ).format(*names, len(trend.entries), first, last)
