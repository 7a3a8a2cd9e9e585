"""Plots that are made once and then given new data; each saves itself as PNG and CSV.

Making a plot anew costs fifty times more than `setData` on one that is there.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QBuffer, QByteArray, QEvent, QPoint, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QImage, QPainter, QPen
from PySide6.QtWidgets import QGraphicsRectItem, QSizePolicy, QVBoxLayout, QWidget
from typing_extensions import override

from lightpen.arrays import FloatArray
from lightpen.files import write_whole
from lightpen_app.theme import TextSize, Tone, colors_of, font

PNG_SCALE = 2
MARGIN = 0.06  # of the range, left free around the data
TONES = (Tone.ACTIVE, Tone.WARN, Tone.GOOD, Tone.BAD, Tone.PLAIN)


@dataclass(frozen=True)
class Axes:
    """Words of a plot.

    Attributes
    ----------
    title : str
        What is shown, with its unit.
    x, y : str
        Names of the axes; empty to leave one out.
    """

    title: str
    x: str = ""
    y: str = ""


class Plot(QWidget):
    """Base of the plots: its frame, its colours, and how it is saved.

    The mouse moves nothing: a plot always shows all of its data.
    """

    def __init__(self, axes: Axes, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._columns: dict[str, FloatArray] = {}
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)

        # Widgets
        self._graphics = pg.PlotWidget(parent=self)
        self._item = self._graphics.getPlotItem()
        self._item.setMenuEnabled(False)
        self._item.hideButtons()
        self._item.setMouseEnabled(x=False, y=False)
        self._graphics.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._graphics.setFrameShape(pg.PlotWidget.Shape.NoFrame)
        for side in ("left", "bottom"):
            axis = self._item.getAxis(side)
            axis.enableAutoSIPrefix(False)
            axis.setStyle(tickLength=-4, autoExpandTextSpace=True)

        # Layout
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self._graphics)

        self.set_axes(axes)

    def set_axes(self, axes: Axes) -> None:
        """Change the words, as when the language changes."""
        self._axes = axes
        self.setAccessibleName(axes.title)
        self._restyle()

    def save_png(self, path: Path) -> None:
        """Write the plot as a picture, at twice the size on the screen.

        Raises
        ------
        FileError
            The file cannot be written.
        """
        image = QImage(self.size() * PNG_SCALE, QImage.Format.Format_RGB32)
        image.setDevicePixelRatio(PNG_SCALE)
        painter = QPainter(image)
        self.render(painter, QPoint())
        painter.end()
        data = QByteArray()
        buffer = QBuffer(data)
        buffer.open(QBuffer.OpenModeFlag.WriteOnly)
        image.save(buffer, "PNG")  # type: ignore[call-overload]
        write_whole(path, bytes(data.data()))

    def save_csv(self, path: Path) -> None:
        """Write the numbers behind the plot, one column each.

        Raises
        ------
        FileError
            The file cannot be written.
        """
        n_rows = max((len(column) for column in self._columns.values()), default=0)
        lines = [",".join(self._columns)]
        for row in range(n_rows):
            values = (
                f"{column[row]:.9g}" if row < len(column) else ""
                for column in self._columns.values()
            )
            lines.append(",".join(values))
        write_whole(path, ("\n".join(lines) + "\n").encode())

    def columns(self) -> Mapping[str, FloatArray]:
        """Return the numbers shown, by the name of their column in the CSV file."""
        return self._columns

    def ranges(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return least and greatest x, and least and greatest y, that are shown."""
        (left, right), (low, high) = self._item.viewRange()
        return (left, right), (low, high)

    def n_items(self) -> int:
        """Return of how many items the plot is made."""
        return len(self._item.items)

    @override
    def sizeHint(self) -> QSize:
        return QSize(360, 200)

    @override
    def minimumSizeHint(self) -> QSize:
        return QSize(160, 120)

    @override
    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange:
            self._restyle()

    def _restyle(self) -> None:
        """Colour what is there already; a subclass colours its curves besides."""
        colors = colors_of(self.palette())
        self._graphics.setBackground(colors.panel)
        title = {"color": colors.text, "size": f"{TextSize.SMALL}px"}
        self._item.setTitle(self._axes.title, **title)
        for side, words in (("left", self._axes.y), ("bottom", self._axes.x)):
            axis = self._item.getAxis(side)
            axis.setPen(pg.mkPen(colors.line))
            axis.setTextPen(pg.mkPen(colors.muted))
            axis.setTickFont(font(TextSize.SMALL))
            label = {"color": colors.muted, "font-size": f"{TextSize.SMALL}px"}
            if words:
                axis.setLabel(words, **label)
            else:
                axis.showLabel(False)

    def _fit(self, x: FloatArray, y: FloatArray, *, y_zero: bool = False) -> None:
        """Show all of the data, and the zero of y if it is asked for."""
        x, y = x[np.isfinite(x)], y[np.isfinite(y)]
        if not (len(x) and len(y)):
            return
        low, high = float(y.min()), float(y.max())
        if y_zero:
            low, high = min(low, 0.0), max(high, 0.0)
        margin = MARGIN * (high - low) or 0.5 * abs(high) or 1.0
        bottom = low if y_zero and low == 0 else low - margin
        left, right = float(x.min()), float(x.max())
        self._item.setRange(
            xRange=(left, max(right, left + 1e-9)),
            yRange=(bottom, high + margin),
            padding=0.01,
        )


@dataclass(frozen=True)
class Curve:
    """A curve: its column in the CSV file, and its name in the legend."""

    column: str
    name: str = ""


class TracePlot(Plot):
    """Values over the number of the image, with a limit to compare them with.

    Parameters
    ----------
    curves : sequence of Curve
        More than one get a legend.
    y_zero : bool
        Always show the zero.
    """

    def __init__(
        self,
        axes: Axes,
        curves: Sequence[Curve],
        *,
        y_zero: bool = False,
        parent: QWidget | None = None,
    ) -> None:
        self._curves: list[pg.PlotCurveItem] = []
        self._limit: pg.InfiniteLine | None = None
        super().__init__(axes, parent)
        self._names = tuple(curve.column for curve in curves)
        self._y_zero = y_zero
        self._limit_at: float | None = None
        if len(curves) > 1:
            self._legend = self._item.addLegend(
                offset=(-4, 1),
                colCount=len(curves),
                labelTextSize=f"{TextSize.SMALL}px",
            )
        for each in curves:
            curve = pg.PlotCurveItem(name=each.name)
            curve.setSegmentedLineMode("on")
            self._item.addItem(curve)
            self._curves.append(curve)
        above = {"position": 0.8, "anchors": [(0.5, 1), (0.5, 1)]}
        self._limit = pg.InfiniteLine(angle=0, movable=False, label="", labelOpts=above)
        self._limit.hide()
        self._item.addItem(self._limit)
        self._restyle()

    def set_data(self, x: FloatArray, *values: FloatArray) -> None:
        """Show values (N,) of each curve over x (N,); NaN leaves a gap."""
        for curve, value in zip(self._curves, values, strict=True):
            curve.setData(x, value, connect="finite")
        self._columns = {"image": x, **dict(zip(self._names, values, strict=True))}
        if len(x):
            stacked = np.concatenate(values)
            at = () if self._limit_at is None else (self._limit_at,)
            self._fit(x, np.append(stacked, at), y_zero=self._y_zero)

    def set_limit(self, value: float | None, text: str = "") -> None:
        """Draw a limit line with words on it, or none."""
        assert self._limit is not None
        self._limit_at = value
        self._limit.setVisible(value is not None)
        if value is not None:
            self._limit.setValue(value)
            self._limit.label.setFormat(text)

    @override
    def _restyle(self) -> None:
        super()._restyle()
        colors = colors_of(self.palette())
        for curve, tone in zip(self._curves, TONES, strict=False):
            curve.setPen(pg.mkPen(colors.tone(tone), width=1))
        if self._limit is not None:
            pen = pg.mkPen(colors.muted, width=1, style=Qt.PenStyle.DashLine)
            self._limit.setPen(pen)
            self._limit.label.setColor(QColor(colors.muted))
        if len(self._curves) > 1:
            ground = QColor(colors.panel)
            ground.setAlphaF(0.85)
            self._legend.setBrush(pg.mkBrush(ground))
            for _, label in self._legend.items:
                label.setText(label.text, color=colors.text)


class DotPlot(Plot):
    """Dots of (x, y), such as residuals along the axes of the image.

    Parameters
    ----------
    names : pair of str
        Columns of the CSV file.
    square : bool
        Show a unit of x as long as one of y.
    """

    def __init__(
        self,
        axes: Axes,
        names: tuple[str, str],
        *,
        square: bool = False,
        parent: QWidget | None = None,
    ) -> None:
        self._dots: pg.ScatterPlotItem | None = None
        super().__init__(axes, parent)
        self._names = names
        self._item.setAspectLocked(square)
        self._dots = pg.ScatterPlotItem(pxMode=True, size=5)
        self._item.addItem(self._dots)
        self._restyle()

    def set_data(self, x: FloatArray, y: FloatArray) -> None:
        """Show dots at x (N,), y (N,)."""
        assert self._dots is not None
        self._dots.setData(x, y)
        self._columns = dict(zip(self._names, (x, y), strict=True))
        self._fit(x, y)

    @override
    def _restyle(self) -> None:
        super()._restyle()
        if self._dots is not None:
            color = QColor(colors_of(self.palette()).accent)
            color.setAlphaF(0.6)
            self._dots.setPen(pg.mkPen(None))
            self._dots.setBrush(pg.mkBrush(color))


class ArrowPlot(Plot):
    """Residuals as enlarged arrows over the image, where they should look random.

    Parameters
    ----------
    image_size : (width, height)
        px.
    """

    def __init__(
        self,
        axes: Axes,
        image_size: tuple[int, int],
        parent: QWidget | None = None,
    ) -> None:
        self._shafts: pg.PlotCurveItem | None = None
        super().__init__(axes, parent)
        self._image_size = image_size
        self._item.setAspectLocked(True)
        self._item.invertY(True)
        self._frame = QGraphicsRectItem(0, 0, *image_size)
        self._shafts = pg.PlotCurveItem(connect="pairs")
        self._item.addItem(self._frame)
        self._item.addItem(self._shafts)
        width, height = image_size
        self._item.setRange(QRectF(0, 0, width, height), padding=0.02)
        self._restyle()

    def set_data(self, points: FloatArray, residuals: FloatArray, scale: float) -> None:
        """Show residuals (N, 2) at points (N, 2), px, enlarged by a scale."""
        assert self._shafts is not None
        x, y = _arrow_lines(points, residuals * scale)
        self._shafts.setData(x, y, connect="pairs")
        self._columns = {
            "x_px": points[:, 0],
            "y_px": points[:, 1],
            "residual_x_px": residuals[:, 0],
            "residual_y_px": residuals[:, 1],
        }

    def lines(self) -> tuple[FloatArray, FloatArray]:
        """Return the ends x (6 N,), y (6 N,) of shafts and heads, in pairs."""
        assert self._shafts is not None
        x, y = self._shafts.getData()
        return x, y

    @override
    def _restyle(self) -> None:
        super()._restyle()
        if self._shafts is not None:
            colors = colors_of(self.palette())
            self._shafts.setPen(pg.mkPen(colors.accent, width=1))
            border = QPen(QColor(colors.edge))
            border.setCosmetic(True)
            self._frame.setPen(border)


class Histogram(Plot):
    """How often residuals occur, beside the normal curve of the same spread.

    Parameters
    ----------
    name : str
        Column of the CSV file that holds the middles of the bins.
    """

    def __init__(self, axes: Axes, name: str, parent: QWidget | None = None) -> None:
        self._bars: pg.BarGraphItem | None = None
        super().__init__(axes, parent)
        self._name = name
        self._bars = pg.BarGraphItem(x=[0.0], height=[0.0], width=1.0)
        self._normal = pg.PlotCurveItem()
        self._item.addItem(self._bars)
        self._item.addItem(self._normal)
        self._restyle()

    def set_data(self, values: FloatArray, n_bins: int = 41) -> None:
        """Show how values (N,) are distributed."""
        assert self._bars is not None
        if not len(values):
            return
        reach = float(np.abs(values).max()) or 1.0
        heights, edges = np.histogram(values, n_bins, (-reach, reach))
        middles = (edges[1:] + edges[:-1]) / 2
        step = edges[1] - edges[0]
        self._bars.setOpts(x=middles, height=heights, width=0.9 * step)
        fine = np.linspace(-reach, reach, 200)
        sigma = float(np.sqrt(np.mean(values**2))) or 1.0
        density = np.exp(-0.5 * (fine / sigma) ** 2) / (sigma * np.sqrt(2 * np.pi))
        expected = len(values) * step * density
        self._normal.setData(fine, expected)
        self._columns = {self._name: middles, "count": heights.astype(np.float64)}
        self._fit(edges, np.concatenate([heights, expected]), y_zero=True)

    @override
    def _restyle(self) -> None:
        super()._restyle()
        if self._bars is not None:
            colors = colors_of(self.palette())
            self._bars.setOpts(pen=pg.mkPen(None), brush=QColor(colors.partial))
            self._normal.setPen(pg.mkPen(colors.text, width=1))


def _arrow_lines(
    points: FloatArray, vectors: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the ends of shafts and heads as pairs, for one curve of them all."""
    tips = points + vectors
    ahead = vectors * 0.3
    aside = np.column_stack([-ahead[:, 1], ahead[:, 0]]) * 0.5
    strokes = (points, tips, tips, tips - ahead + aside, tips, tips - ahead - aside)
    lines = np.stack(strokes, axis=1).reshape(-1, 2)
    return lines[:, 0], lines[:, 1]
