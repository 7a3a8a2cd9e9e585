"""Plots with replaceable data.

Making a plot again costs fifty times more than `setData` on one that is there.
"""

import math
from collections.abc import Sequence
from html import escape
from typing import TypeAlias

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QEvent, QRectF, Qt
from PySide6.QtGui import QFontMetricsF, QPainter, QPaintEvent, QResizeEvent
from typing_extensions import override

from lightpen.arrays import FloatArray
from lightpen_app.look.layouts import vertical_layout
from lightpen_app.look.theme import (
    GRID,
    Colors,
    TextSize,
    Tone,
    colors_of,
    font,
    scaled,
)
from lightpen_app.look.words import number_text
from lightpen_app.widgets.figure import Axes, Figure

LABELLED = (1, 2, 5)  # of each decade
LEAST_LABELLED = 2  # else all are

# As pyqtgraph hands them to `drawPicture`: line, ticks, and place, flags and text.
TextSpec: TypeAlias = tuple[QRectF, Qt.AlignmentFlag, str]
DrawSpecs: TypeAlias = tuple[tuple[object, ...], list[object], list[TextSpec]]


class ReadableAxis(pg.AxisItem):  # type: ignore[misc]  # pyqtgraph has no types
    """An axis with decades as 10, 20, 50, 100 instead of 1e+02.

    Of numbers that would overlap only as many are drawn as there is room for, those of
    a linear axis with the same number of decimals.
    """

    @override
    def generateDrawSpecs(self, p: QPainter) -> DrawSpecs | None:
        specs: DrawSpecs | None = super().generateDrawSpecs(p)
        if specs is None:
            return None
        line, ticks, words = specs
        if self.logMode:
            # Powers of ten are drawn first.
            words = sorted(words, key=lambda spec: spec[2].strip("0.") != "1")
        free: list[TextSpec] = []
        for each in words:
            if each[2] and not any(each[0].intersects(other[0]) for other in free):
                free.append(each)
        return line, ticks, free if self.logMode else _with_equal_decimals(free)

    @override
    def logTickStrings(
        self, values: Sequence[float], scale: float, spacing: float
    ) -> list[str]:
        numbers = (10 ** float(value) for value in values)
        leading = ((number, float(f"{number:e}"[:3])) for number in numbers)
        words = [(f"{number:g}", digit in LABELLED) for number, digit in leading]
        are_few = sum(is_labelled for _, is_labelled in words) < LEAST_LABELLED
        return [word if is_labelled or are_few else "" for word, is_labelled in words]


def _with_equal_decimals(words: list[TextSpec]) -> list[TextSpec]:
    """Return numbers as texts with equal decimals, the most that any needs."""
    if any("e" in text for _, _, text in words):
        return words
    n = max((len(text.partition(".")[2]) for _, _, text in words), default=0)
    return [(place, flags, number_text(float(text), n)) for place, flags, text in words]


class Canvas(pg.PlotWidget):  # type: ignore[misc]  # pyqtgraph has no types
    """Drawing area that is laid out once it is painted.

    A page is resized several times before it is seen, and its axes cost as much each.
    """

    _is_resized = False

    @override
    def resizeEvent(self, event: QResizeEvent | None) -> None:
        self._is_resized = True

    @override
    def paintEvent(self, event: QPaintEvent) -> None:
        self.fit()
        super().paintEvent(event)

    def fit(self) -> None:
        """Lay out for the present size."""
        if self._is_resized:
            self._is_resized = False
            super().resizeEvent(None)


LEFT_WIDTH = 9 * GRID  # px, the same for all traces so that they line up
TITLE_MARGIN = 6 * GRID  # px that a title leaves free, as for a button
LEAST_TITLE = 9  # px
BESIDE_LABEL = 8 * GRID  # px of height for the title, numbers and label of x
SIDE = 0.045  # of many numbered items, beside the first and the last
N_LEAST = 10  # a trace has room for whole multiples, so that its numbers are whole
MARGIN = 0.06  # of the range, left free around the data
LEAST_FILL = 0.6  # of a steady range that the data must take
TONES = (Tone.ACTIVE, Tone.WARN, Tone.GOOD, Tone.BAD, Tone.PLAIN)
LINE = 2  # px
# Curves differ by these besides their colour, which not everybody tells apart.
DASHES = (Qt.PenStyle.SolidLine, Qt.PenStyle.DashLine, Qt.PenStyle.DotLine)
SYMBOLS = {
    "o": "\N{BLACK CIRCLE}",
    "s": "\N{BLACK SQUARE}",
    "t1": "\N{BLACK UP-POINTING TRIANGLE}",
}
SYMBOL = 7  # px
N_MARKED = 12  # points of a curve
FENCE = 1.5  # quartile distances, beyond which a value is an outlier (Tukey)
NEWEST = 0.25  # of the values, which are in sight whatever they are

pg.setConfigOptions(antialias=True)


class Plot(Figure):
    """Base of the plots: its frame and its colours.

    The mouse moves nothing: a plot always shows all of its data.
    """

    has_symbols = False  # whether its curves have the `SYMBOLS`

    def __init__(self, axes: Axes) -> None:
        super().__init__()
        self._fitted = (0, True)  # px of the title, whether y is named
        self._y_range = (0.0, 0.0)  # shown by `_fit`

        # Widgets
        axes_of_sides = {"left": ReadableAxis("left"), "bottom": pg.AxisItem("bottom")}
        self._graphics = Canvas(parent=self, axisItems=axes_of_sides, enableMenu=False)
        self._item = self._graphics.getPlotItem()
        self._item.hideButtons()
        title = self._item.titleLabel  # also above the left axis, for more room
        self._item.layout.removeItem(title)
        self._item.layout.addItem(title, 0, 0, 1, 3)
        self._item.setMouseEnabled(x=False, y=False)
        self._graphics.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._graphics.viewport().setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._graphics.setFrameShape(pg.PlotWidget.Shape.NoFrame)
        for side in ("left", "bottom"):
            axis = self._item.getAxis(side)
            axis.enableAutoSIPrefix(False)
            axis.setStyle(tickLength=-4, autoExpandTextSpace=True)

        # Layout
        vertical_layout(self, self._graphics)

        self.set_axes(axes)

    @override
    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange:
            self._restyle()

    @override
    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        if (self._fitted_title_px(), self._has_room_for_y()) != self._fitted:
            self._restyle()

    def _named_curves(self) -> tuple[str, ...]:
        return ()

    def _signed_names(self) -> tuple[str, ...]:
        """Return the names of the curves with their symbols, if they have any."""
        names = self._named_curves()
        if not self.has_symbols:
            return names
        return tuple(map(" ".join, zip(SYMBOLS.values(), names, strict=False)))

    def _fitted_title_px(self) -> int:
        """Return the font size that shows the whole title, px."""
        largest = scaled(TextSize.SMALL)
        words = "   ".join((self._axes.title, *self._signed_names()))
        needed = QFontMetricsF(font(largest, bold=True)).horizontalAdvance(words)
        room = max(self.width() - TITLE_MARGIN, 1)
        return max(min(int(largest * room / max(needed, 1.0)), largest), LEAST_TITLE)

    def _has_room_for_y(self) -> bool:
        """Return whether the name of y fits beside its axis."""
        words = QFontMetricsF(font(TextSize.SMALL)).horizontalAdvance(self._axes.y)
        return words <= self.height() - BESIDE_LABEL

    def _restyle(self) -> None:
        """Update the colours; subclasses add their curves."""
        colors = colors_of(self.palette())
        self._graphics.setBackground(colors.panel)
        self._fitted = title_px, is_y_named = (
            self._fitted_title_px(),
            self._has_room_for_y(),
        )
        size = f"{title_px}px"
        title = {"color": colors.text, "size": size, "justify": "left"}
        self._item.setTitle(escape(self._axes.title), **title)
        if names := self._signed_names():  # beside the title they hide nothing
            words = title_with_names(self._axes.title, names, colors)
            self._item.titleLabel.setText(words)
        y = self._axes.y if is_y_named else ""
        for side, words in (("left", y), ("bottom", self._axes.x)):
            axis = self._item.getAxis(side)
            axis.setPen(pg.mkPen(colors.line))
            axis.setTextPen(pg.mkPen(colors.muted))
            axis.setTickFont(font(TextSize.SMALL))
            label = {"color": colors.muted, "font-size": f"{scaled(TextSize.SMALL)}px"}
            if words:
                axis.setLabel(escape(words), **label)
            else:
                axis.showLabel(False)

    def _fit(
        self,
        x: FloatArray,
        y: FloatArray,
        *,
        y_zero: bool = False,
        is_steady: bool = False,
    ) -> None:
        """Show all of the data, and the zero of y if it is requested.

        A steady range of y stays as it is while the data lie in it and fill it: to draw
        axes anew takes most of the time of a plot.
        """
        x, y = x[np.isfinite(x)], y[np.isfinite(y)]
        if not (len(x) and len(y)):
            return
        low, high = float(y.min()), float(y.max())
        if y_zero:
            low, high = min(low, 0.0), max(high, 0.0)
        margin = MARGIN * (high - low) or 0.5 * abs(high) or 1.0
        bottom = low if y_zero and low == 0 else low - margin
        top = high + margin
        before, after = self._y_range
        is_filled = high - low > LEAST_FILL * (after - before)
        if is_steady and before <= low and high <= after and is_filled:
            bottom, top = before, after
        self._y_range = bottom, top
        left, right = float(x.min()), float(x.max())
        self._item.setRange(
            xRange=(left, max(right, left + 1e-9)), yRange=(bottom, top), padding=0.01
        )

    def _fit_numbered(self, n: int, y: FloatArray) -> None:
        """Fit the range to items numbered 1 to n, and to their marks."""
        n = max(n, N_LEAST)
        side = max(0.5, SIDE * n)
        self._fit(np.array([1 - side, n + side]), y)


def title_with_names(title: str, names: Sequence[str], colors: Colors) -> str:
    """Return a title as rich text, with the names of curves in their colours."""
    words = (
        f'<b><span style="color: {colors.tone(tone).name()}">{escape(name)}</span></b>'
        for name, tone in zip(names, TONES, strict=False)
    )
    return "&nbsp; ".join((escape(title), *words))


class TracePlot(Plot):
    """Values over the number of the image, with a limit to compare them with.

    Parameters
    ----------
    names : sequence of str
        Names of the curves, shown in their colours if there are several.
    y_zero : bool
        Always show the zero.
    y_log : bool
        Show values over decades; those that are not above zero leave a gap.
    is_robust : bool
        Cut off outliers among the earlier values.
    """

    def __init__(
        self,
        axes: Axes,
        names: Sequence[str] = ("",),
        *,
        y_zero: bool = False,
        y_log: bool = False,
        is_robust: bool = False,
    ) -> None:
        self.has_symbols = len(names) == len(SYMBOLS)
        self._curves: list[pg.PlotCurveItem] = []
        self._marks: list[pg.ScatterPlotItem] = []
        self._legend: tuple[str, ...] = ()
        self._limit: pg.InfiniteLine | None = None
        super().__init__(axes)
        self._x: FloatArray = np.zeros(0)
        self._values: tuple[FloatArray, ...] = ()
        self._y_zero = y_zero
        self._y_log = y_log
        self._is_robust = is_robust
        self._limit_at: float | None = None
        self._legend = tuple(names)
        left = self._item.getAxis("left")
        left.setLogMode(y_log)
        left.setWidth(LEFT_WIDTH)
        self._item.layout.setContentsMargins(0, 0, 2 * GRID, 0)
        self._show_nothing()
        for _ in names:
            self._curves.append(pg.PlotCurveItem())
        if self.has_symbols:
            self._marks = [
                pg.ScatterPlotItem(symbol=each, size=SYMBOL) for each in SYMBOLS
            ]
        for item in (*self._curves, *self._marks):
            self._item.addItem(item)
        # Below a line in the upper half: within the plot
        place = {"position": 0.02, "anchors": [(0.0, 0.0), (0.0, 1.0)]}
        self._limit = pg.InfiniteLine(angle=0, movable=False, label="", labelOpts=place)
        self._limit.hide()
        self._item.addItem(self._limit)
        self._restyle()

    def set_names(self, *names: str) -> None:
        """Change the names of the curves, as when the language changes."""
        self._legend = names
        self._restyle()

    def set_data(self, x: FloatArray, *values: FloatArray) -> None:
        """Show values (N,) of each curve over x (N,); NaN leaves a gap."""
        self._x, self._values = x, values
        heights = [self._height(value) for value in values]
        for curve, height in zip(self._curves, heights, strict=True):
            curve.setData(x, height, connect="finite")
        every = slice(None, None, max(len(x) // N_MARKED, 1))
        for marks, height in zip(self._marks, heights, strict=False):
            marks.setData(x[every], height[every])
        self._show_range()

    def set_limit(self, value: float | None, name: str = "") -> None:
        """Draw a limit line with a name, or none."""
        assert self._limit is not None
        self._limit.label.setFormat(name)
        self._limit_at = value
        self._limit.setVisible(value is not None)
        if value is not None:
            self._limit.setValue(float(self._height(np.array([value]))[0]))
        if not len(self._x):
            self._show_nothing()

    def _show_range(self) -> None:
        """Set the range to show all that is required."""
        x = self._x
        if not len(x):
            self._show_nothing()
            return
        self._show_numbers(True)
        in_sight = [self._height(value) for value in self._values]
        if self._is_robust:
            in_sight = list(map(_without_outliers, in_sight))
        if self._limit_at is not None:
            in_sight.append(self._height(np.array([self._limit_at])))
        n_steps = max(math.ceil((x.max() - x.min() + 1) / N_LEAST), 1)
        room = np.append(x, x.min() + n_steps * N_LEAST - 1)
        self._fit(room, np.concatenate(in_sight), y_zero=self._y_zero, is_steady=True)

    def _show_nothing(self) -> None:
        """Show the axes without numbers, and the limit."""
        top = np.ones(1)
        if self._limit_at is not None and self._y_log:
            top = np.maximum(top, self._height(np.array([self._limit_at])))
        y_range = (0.0, float(top[0]))
        self._show_numbers(False)
        self._item.setRange(xRange=(1, N_LEAST), yRange=y_range, padding=0.01)

    def _show_numbers(self, shown: bool) -> None:
        for side in ("left", "bottom"):
            axis = self._item.getAxis(side)
            if axis.style["showValues"] is not shown:  # it redraws the axis
                axis.setStyle(showValues=shown)

    def _height(self, values: FloatArray) -> FloatArray:
        """Return the drawn values (N,)."""
        if not self._y_log:
            return values
        positive = np.where(values > 0, values, np.nan)
        return np.asarray(np.log10(positive))

    @override
    def _restyle(self) -> None:
        super()._restyle()
        colors = colors_of(self.palette())
        for curve, tone, dash in zip(self._curves, TONES, DASHES, strict=False):
            curve.setPen(pg.mkPen(colors.tone(tone), width=LINE, style=dash))
        for marks, tone in zip(self._marks, TONES, strict=False):
            marks.setPen(pg.mkPen(None))
            marks.setBrush(pg.mkBrush(colors.tone(tone)))
        if self._limit is not None:
            self._limit.setPen(pg.mkPen(colors.muted, width=1))
            self._limit.label.setColor(colors.muted)
            self._limit.label.textItem.setFont(font(TextSize.SMALL))

    @override
    def _named_curves(self) -> tuple[str, ...]:
        return self._legend if len(self._curves) > 1 else ()


def _without_outliers(values: FloatArray) -> FloatArray:
    """Return those of values (N,) that a plot must show: all but old outliers."""
    if not np.isfinite(values).any():
        return values
    low, high = np.nanquantile(values, (0.25, 0.75))
    reach = FENCE * (high - low)
    is_usual = (low - reach <= values) & (values <= high + reach)
    is_usual[int((1 - NEWEST) * len(values)) :] = True
    return np.asarray(values[is_usual])
