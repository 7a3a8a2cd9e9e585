"""Printed plots: axes with numbers, dots, lines, bars and arrows.

What shows series apart is their form besides their colour, as paper is often grey.
Nothing is see-through: PDF/A-1 has no transparency.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum, auto

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPen, QPolygonF

from lightpen.arrays import FloatArray
from lightpen_app.look.theme import LIGHT
from lightpen_app.look.words import number_text
from lightpen_app.print_report.blocks import (
    CENTER,
    HAIRLINE,
    RIGHT,
    WIDTH,
    Block,
    PrintSize,
    draw_text,
    line_pen,
    text_width,
)

SERIES = (LIGHT.accent, LIGHT.pointer, LIGHT.good)
DASHES = (Qt.PenStyle.SolidLine, Qt.PenStyle.DashLine, Qt.PenStyle.DotLine)
DOT = 16.0  # across
TITLE_ROOM = 1.9 * PrintSize.BODY
LABEL_ROOM = 3.4 * PrintSize.SMALL  # below the axes: numbers and labels
N_TICKS = 5
GAP = 160.0  # between plots side by side
LETTERS = PrintSize.SMALL


@dataclass(frozen=True)
class PlotRange:
    """Range of a plot."""

    x_low: float
    x_high: float
    y_low: float
    y_high: float


@dataclass(frozen=True)
class Plane:
    """Scale of numbers on paper."""

    area: QRectF
    shown: PlotRange

    def points(self, x: FloatArray, y: FloatArray) -> list[QPointF]:
        """Return the places of x (N,) and y (N,), dots, limited to the range."""
        shown, area = self.shown, self.area
        right = (np.clip(x, shown.x_low, shown.x_high) - shown.x_low) / (
            shown.x_high - shown.x_low
        )
        up = (np.clip(y, shown.y_low, shown.y_high) - shown.y_low) / (
            shown.y_high - shown.y_low
        )
        places = zip(
            (area.left() + right * area.width()).tolist(),
            (area.bottom() - up * area.height()).tolist(),
            strict=True,
        )
        return [QPointF(*place) for place in places]

    def point(self, x: float, y: float) -> QPointF:
        """Return the position of one point, dots."""
        return self.points(np.array([x]), np.array([y]))[0]


class Mark(Enum):
    """Style of the series of a plot."""

    LINE = auto()
    DOT = auto()
    BAR = auto()


@dataclass(frozen=True)
class Chart:
    """A plot: its title, its names of series, and what draws it into an area."""

    title: str
    paint: Callable[[QPainter, QRectF], None]
    # Names of the series in their order, shown beside the title.
    names: tuple[str, ...] = ()
    mark: Mark = Mark.LINE  # symbol before the names


@dataclass(frozen=True)
class AxisWords:
    """Labels of the axes."""

    x: str = ""
    # Labels below the axis at 0, 1, 2 ... instead of numbers.
    labels: tuple[str, ...] = ()


def row_of_charts(charts: Sequence[Chart], height: float) -> Block:
    """Return plots side by side."""
    width = (WIDTH - (len(charts) - 1) * GAP) / len(charts)

    def paint(painter: QPainter) -> None:
        for i, chart in enumerate(charts):
            left = i * (width + GAP)
            names_left = _paint_names(painter, chart, left + width)
            size = fitting_size(chart.title, names_left - left)
            title = QRectF(left, 0, width, PrintSize.BODY)
            draw_text(painter, title, chart.title, size, bold=True)
            room = height - TITLE_ROOM
            chart.paint(painter, QRectF(left, TITLE_ROOM, width, room))

    return Block(paint, height, space=90)


def fitting_size(title: str, room: float) -> float:
    """Return the size of letters in which a title fits into a room, dots."""
    needed = text_width(title, PrintSize.BODY, bold=True)
    return PrintSize.BODY * min(1.0, room / needed)


def padded_range(x: FloatArray, y: FloatArray, *, from_zero: bool = False) -> PlotRange:
    """Return the range of all finite values, with a margin."""
    x_low, x_high = _reach(x)
    y_low, y_high = _reach(y)
    if from_zero:
        y_low = min(y_low, 0.0)
    room = 0.06 * (y_high - y_low)
    is_at_zero = from_zero and y_low == 0
    y_low = 0.0 if is_at_zero else y_low - room
    return PlotRange(x_low, x_high, y_low, y_high + room)


def paint_axes(
    painter: QPainter, area: QRectF, shown: PlotRange, words: AxisWords
) -> Plane:
    """Draw axes with numbers and lines, and return where to draw."""
    heights = _ticks(shown.y_low, shown.y_high)
    texts = _tick_texts(heights)
    room = max(text_width(text, LETTERS) for text in texts) + 30
    inner = QRectF(
        area.left() + room, area.top(), area.width() - room, area.height() - LABEL_ROOM
    )
    plane = Plane(inner, shown)
    for height, text in zip(heights, texts, strict=True):
        y = plane.point(shown.x_low, height).y()
        painter.setPen(line_pen(LIGHT.line))
        painter.drawLine(QPointF(inner.left(), y), QPointF(inner.right(), y))
        place = QRectF(area.left(), y - 0.68 * LETTERS, room - 20, LETTERS)
        draw_text(painter, place, text, LETTERS, LIGHT.muted, RIGHT)
    _paint_below(painter, plane, words)
    painter.setPen(line_pen(LIGHT.edge))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.drawRect(inner)
    return plane


def paint_dots(
    painter: QPainter, plane: Plane, x: FloatArray, y: FloatArray, series: int = 0
) -> None:
    """Draw dots, squares or triangles at x (N,), y (N,) that are numbers."""
    known = np.isfinite(y)
    for point in plane.points(x[known], y[known]):
        _paint_dot(painter, point, series)


def paint_crosses(
    painter: QPainter, plane: Plane, x: FloatArray, y: FloatArray
) -> None:
    """Draw crosses at x (N,), y (N,)."""
    painter.setPen(line_pen(LIGHT.bad, 7))
    arm, other = QPointF(DOT, DOT), QPointF(DOT, -DOT)
    for point in plane.points(x, y):
        painter.drawLine(point - arm, point + arm)
        painter.drawLine(point - other, point + other)


def paint_line(
    painter: QPainter,
    plane: Plane,
    x: FloatArray,
    y: FloatArray,
    series: int = 0,
    color: str = "",
) -> None:
    """Draw a line through x (N,), y (N,), full, dashed or dotted."""
    painter.save()
    painter.setClipRect(plane.area)
    painter.setPen(_series_pen(series, color))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.drawPolyline(QPolygonF(plane.points(x, y)))
    painter.restore()


def paint_bars(painter: QPainter, plane: Plane, values: Sequence[FloatArray]) -> None:
    """Draw groups of bars at 0, 1, 2 and so on, one a series; NaN leaves a gap."""
    width = 0.8 / len(values)
    for series, heights in enumerate(values):
        painter.setPen(line_pen(SERIES[series], HAIRLINE))
        painter.setBrush(_filling(series))
        for place, height in enumerate(heights.tolist()):
            if not math.isfinite(height):
                continue
            left = place - 0.4 + series * width
            corners = plane.points(
                np.array([left, left + 0.92 * width]), np.array([0.0, height])
            )
            painter.drawRect(QRectF(*corners).normalized())
    painter.setBrush(Qt.BrushStyle.NoBrush)


def _series_pen(series: int, color: str = "") -> QPen:
    pen = line_pen(color or SERIES[series], 9)
    pen.setStyle(DASHES[series])
    return pen


def _paint_dot(painter: QPainter, point: QPointF, series: int) -> None:
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(SERIES[series]))
    half = DOT / 2
    if series == 0:
        painter.drawEllipse(point, half, half)
    elif series == 1:
        painter.drawRect(QRectF(point.x() - half, point.y() - half, DOT, DOT))
    else:
        up, side = QPointF(0, -1.2 * half), QPointF(1.2 * half, 0.9 * half)
        other = QPointF(-side.x(), side.y())
        painter.drawPolygon(QPolygonF([point + up, point + side, point + other]))
    painter.setBrush(Qt.BrushStyle.NoBrush)


def _filling(series: int) -> QColor:
    """Return a fill colour that differs in brightness from the others."""
    return QColor((LIGHT.accent, LIGHT.partial, LIGHT.panel)[series])


def _paint_names(painter: QPainter, chart: Chart, right: float) -> float:
    """Draw the names of series with their marks, from the right; return their left."""
    middle = 0.72 * LETTERS
    for series, name in reversed(list(enumerate(chart.names))):
        width = text_width(name, LETTERS)
        right -= width
        area = QRectF(right, 0, width + 10, LETTERS)
        draw_text(painter, area, name, LETTERS)
        if chart.mark is Mark.LINE:
            painter.setPen(_series_pen(series))
            painter.drawLine(QPointF(right - 150, middle), QPointF(right - 20, middle))
        elif chart.mark is Mark.DOT:
            _paint_dot(painter, QPointF(right - 35, middle), series)
        else:
            painter.setPen(line_pen(SERIES[series], HAIRLINE))
            painter.setBrush(_filling(series))
            painter.drawRect(QRectF(right - 75, middle - 25, 50, 50))
            painter.setBrush(Qt.BrushStyle.NoBrush)
        right -= 190
    return right


def _paint_below(painter: QPainter, plane: Plane, words: AxisWords) -> None:
    shown, area = plane.shown, plane.area
    if words.labels:
        places, texts = list(map(float, range(len(words.labels)))), list(words.labels)
    else:
        places = _ticks(shown.x_low, shown.x_high)
        texts = _tick_texts(places)
    width = area.width() / max(len(places), 1)
    for place, text in zip(places, texts, strict=True):
        x = plane.point(place, shown.y_low).x()
        painter.setPen(line_pen(LIGHT.edge))
        painter.drawLine(QPointF(x, area.bottom()), QPointF(x, area.bottom() + 15))
        label = QRectF(x - width / 2, area.bottom() + 18, width, LETTERS)
        draw_text(painter, label, text, LETTERS, LIGHT.muted, CENTER)
    place_of_words = QRectF(
        area.left(), area.bottom() + 1.75 * LETTERS, area.width(), LETTERS
    )
    draw_text(painter, place_of_words, words.x, LETTERS, LIGHT.muted, CENTER)


def _reach(values: FloatArray) -> tuple[float, float]:
    """Return minimum and maximum of the finite values, never equal."""
    known = values[np.isfinite(values)]
    if not len(known):
        return 0.0, 1.0
    low, high = float(known.min()), float(known.max())
    return (low, high) if high > low else (low - 0.5, high + 0.5)


def _ticks(low: float, high: float) -> list[float]:
    """Return round numbers in a range."""
    rough = (high - low) / N_TICKS
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(m * power for m in (1, 2, 2.5, 5, 10) if m * power >= 0.999 * rough)
    first = math.ceil(low / step - 1e-9)
    last = math.floor(high / step + 1e-9)
    return [each * step for each in range(first, last + 1)]


def _tick_texts(ticks: Sequence[float]) -> list[str]:
    """Return numbers with enough decimals to differ."""
    step = ticks[1] - ticks[0] if len(ticks) > 1 else abs(ticks[0]) or 1.0
    decimals = next(d for d in range(12) if round(step, d) == round(step, 12))
    return [number_text(tick, decimals) for tick in ticks]
