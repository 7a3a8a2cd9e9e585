"""Plots of a result, alike on the screen and on paper: residuals, series, postures."""

from collections.abc import Sequence

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QRectF
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QGraphicsEllipseItem, QGraphicsRectItem
from typing_extensions import override

from lightpen.arrays import FloatArray
from lightpen.model.coverage import N_DIRECTIONS, TILT_RINGS
from lightpen_app.look.figures import (
    MANY,
    BudgetFigure,
    arrow_lines,
    arrow_scale,
    cell_means,
    paint_budget,
)
from lightpen_app.look.theme import GRID, TextSize, colors_of, font
from lightpen_app.widgets.figure import Axes, Figure
from lightpen_app.widgets.plots import TONES, Plot

HEAD = 4 * GRID  # px, above the bars of a budget
GROUP = 0.8  # of the room for a label, that its bars fill
FARTHEST = 36.0  # degrees of tilt that are always shown


class SquarePlot(Plot):
    """A plot with equal units of x and y that keeps a range visible."""

    def __init__(self, axes: Axes) -> None:
        super().__init__(axes)
        self._range = QRectF(0, 0, 1, 1)
        self._labels: list[pg.TextItem] = []
        self._item.setAspectLocked(True)

        # Connections
        self._item.vb.sigResized.connect(self._show_range)

    def set_range(self, shown: QRectF) -> None:
        """Keep a range in sight, whatever the size of the plot."""
        self._range = shown
        self._show_range()

    def set_labels(self, places: FloatArray, texts: Sequence[str]) -> None:
        """Write texts at places (N, 2)."""
        for label in self._labels:
            self._item.removeItem(label)
        color = colors_of(self.palette()).text
        self._labels = [pg.TextItem(text, color, anchor=(0.5, 0.5)) for text in texts]
        for label, place in zip(self._labels, places.tolist(), strict=True):
            label.setFont(font(TextSize.SMALL, bold=True))
            label.setPos(*place)
            self._item.addItem(label)

    def _show_range(self, _view: object = None) -> None:
        self._item.setRange(self._range, padding=0.02)


class ArrowPlot(SquarePlot):
    """Residuals as enlarged arrows over the image, where they should look random.

    Of many arrows, the means in cells of the image are drawn: a pattern stands out of
    the noise then.
    """

    def __init__(self, axes: Axes) -> None:
        self._shafts: pg.PlotCurveItem | None = None
        super().__init__(axes)
        self._scale = 1.0
        self._item.invertY(True)
        self._frame = QGraphicsRectItem()
        self._shafts = pg.PlotCurveItem(connect="pairs")
        self._item.addItem(self._frame, ignoreBounds=True)
        self._item.addItem(self._shafts)
        self._restyle()

    def scale(self) -> float:
        """Return the magnification of the arrows."""
        return self._scale

    def set_data(
        self,
        image_size: tuple[int, int] | None,
        points: FloatArray,
        residuals: FloatArray,
    ) -> None:
        """Show residuals (N, 2) at points (N, 2), px.

        The frame of the image (width, height) is drawn where it is known.
        """
        assert self._shafts is not None
        frame = QRectF(-0.5, -0.5, *(image_size or (0, 0)))
        self._frame.setVisible(image_size is not None)
        shown = _around(points) if len(points) else frame
        starts, vectors = points, residuals
        if len(points) > MANY:
            starts, vectors = cell_means(points, residuals)
        self._scale = arrow_scale(vectors, shown.width())
        self._shafts.setData(*arrow_lines(starts, vectors * self._scale))
        self._frame.setRect(frame)
        self.set_range(shown)

    def mark(self, points: FloatArray) -> None:
        """Show dots at points (N, 2)."""
        brush = colors_of(self.palette()).text
        self._item.addItem(
            pg.ScatterPlotItem(pos=points, size=6, pen=None, brush=brush)
        )

    @override
    def _restyle(self) -> None:
        super()._restyle()
        if self._shafts is not None:
            colors = colors_of(self.palette())
            self._shafts.setPen(pg.mkPen(colors.accent, width=1))
            border = QPen(QColor(colors.edge))
            border.setCosmetic(True)
            self._frame.setPen(border)


def _around(points: FloatArray) -> QRectF:
    """Return the rectangle around points (N, 2), with room for arrows."""
    low, high = points.min(axis=0), points.max(axis=0)
    room = 0.06 * max(float(np.max(high - low)), 1.0)
    width, height = (high - low + 2 * room).tolist()
    return QRectF(float(low[0]) - room, float(low[1]) - room, width, height)


class BarPlot(Plot):
    """A group of bars for each label, one bar a series, in their order.

    Several series are named beside the title.
    """

    def __init__(self, axes: Axes, names: Sequence[str]) -> None:
        self._names = tuple(names)
        self._bars: list[pg.BarGraphItem] = []
        super().__init__(axes)
        for _ in names:
            bars = pg.BarGraphItem(x=[0.0], height=[0.0], width=1.0)
            self._item.addItem(bars)
            self._bars.append(bars)

        self._restyle()

    def names(self) -> tuple[str, ...]:
        """Return the names of the series."""
        return self._names

    def set_names(self, names: Sequence[str]) -> None:
        """Name the series in another language."""
        self._names = tuple(names)
        self._restyle()

    @override
    def _named_curves(self) -> tuple[str, ...]:
        return self._names if len(self._names) > 1 else ()

    def set_data(self, labels: Sequence[str], *values: FloatArray) -> None:
        """Show values (N,) of each series for N labels; NaN leaves a gap."""
        places = np.arange(len(labels), dtype=np.float64)
        width = GROUP / len(self._bars)
        for i, (bars, value) in enumerate(zip(self._bars, values, strict=True)):
            offset = (i - (len(self._bars) - 1) / 2) * width
            bars.setOpts(
                x=places + offset, height=np.nan_to_num(value), width=0.9 * width
            )
        self._item.getAxis("bottom").setTicks([list(enumerate(labels))])
        edges = np.array([-0.5, len(labels) - 0.5])
        self._fit(edges, np.concatenate(values), y_zero=True)

    @override
    def _restyle(self) -> None:
        super()._restyle()
        colors = colors_of(self.palette())
        for bars, tone in zip(self._bars, TONES, strict=False):
            bars.setOpts(pen=pg.mkPen(None), brush=pg.mkBrush(colors.tone(tone)))


class PosturePlot(SquarePlot):
    """Tilt of the pen in each image, seen from above with the camera below."""

    def __init__(self, axes: Axes) -> None:
        self._dots: pg.ScatterPlotItem | None = None
        super().__init__(axes)
        self._rings = []
        for tilt in (*np.degrees(TILT_RINGS), FARTHEST):
            ring = QGraphicsEllipseItem(-tilt, -tilt, 2 * tilt, 2 * tilt)
            self._item.addItem(ring)
            self._rings.append(ring)
        self._spokes = pg.PlotCurveItem(*_spokes(), connect="pairs")
        self._item.addItem(self._spokes)
        self._dots = pg.ScatterPlotItem(pxMode=True, size=6)
        self._item.addItem(self._dots)
        self._restyle()

    def set_data(self, tilts: FloatArray, directions: FloatArray) -> None:
        """Show postures by tilt (N,) and direction (N,), rad."""
        assert self._dots is not None
        degrees = np.degrees(tilts)
        right, away = degrees * np.cos(directions), degrees * np.sin(directions)
        self._dots.setData(right, away)
        reach = float(np.max(degrees, initial=FARTHEST))
        self.set_range(QRectF(-reach, -reach, 2 * reach, 2 * reach))

    @override
    def _restyle(self) -> None:
        super()._restyle()
        if self._dots is None:
            return
        colors = colors_of(self.palette())
        line = pg.mkPen(colors.edge, width=1)
        line.setCosmetic(True)
        for ring in self._rings:
            ring.setPen(line)
        self._spokes.setPen(line)
        self._dots.setPen(pg.mkPen(None))
        self._dots.setBrush(pg.mkBrush(colors.accent))


def _spokes() -> tuple[FloatArray, FloatArray]:
    """Return the borders of the eight directions, as pairs of ends."""
    sector = 2 * np.pi / N_DIRECTIONS
    angles = np.repeat((np.arange(N_DIRECTIONS) + 0.5) * sector, 2)
    radii = np.tile([np.degrees(TILT_RINGS[0]), FARTHEST], N_DIRECTIONS)
    return radii * np.cos(angles), radii * np.sin(angles)


class BudgetPlot(Figure):
    """Shows the parts of U as horizontal bars, with its limit."""

    def __init__(self, axes: Axes) -> None:
        super().__init__()
        self._value = BudgetFigure()
        self.set_axes(axes)

    def value(self) -> BudgetFigure:
        """Return the figure that is shown."""
        return self._value

    def set_value(self, value: BudgetFigure) -> None:
        """Show another figure."""
        self._value = value
        line = QFontMetricsF(font(TextSize.SMALL)).height()
        self.setMinimumHeight(HEAD + round((len(value.bars) + 1) * line) + 2 * GRID)
        self.update()

    @override
    def paintEvent(self, event: QPaintEvent) -> None:
        colors, small = colors_of(self.palette()), font(TextSize.SMALL)
        with QPainter(self) as painter:
            painter.fillRect(self.rect(), QColor(colors.panel))
            painter.setPen(QColor(colors.text))
            painter.setFont(small)
            area = QRectF(self.rect()).adjusted(GRID // 2, GRID // 2, -GRID, -GRID)
            painter.drawText(area, self._axes.title)
            area.setTop(area.top() + HEAD)
            if self._value.bars:
                paint_budget(painter, area, self._value, colors)

    @override
    def _restyle(self) -> None:
        self.update()
