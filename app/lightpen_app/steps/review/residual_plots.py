"""Residuals by image, and over an image."""

from dataclasses import dataclass

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QLineF, QPoint, QPointF, QRectF, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen, QResizeEvent
from PySide6.QtWidgets import QWidget
from typing_extensions import override

from lightpen.arrays import BoolArray, FloatArray, IntArray
from lightpen_app.look.figures import arrow_lines
from lightpen_app.look.theme import DARK, GRID, TextSize, colors_of, font
from lightpen_app.look.words import number_text
from lightpen_app.widgets.figure import Axes
from lightpen_app.widgets.image_view import ImageView
from lightpen_app.widgets.plots import Plot

LIMIT_REST = 1.1  # times the largest misfit, where nothing is above the line
LIMIT_GRIP = 0.94
LIMIT_LABEL = {"position": 0.5, "anchors": [(0.5, 1.0), (0.5, 1.0)]}  # above the line
LEAST_WORDED = 22 * GRID  # px of height, from which the words fit above the line
HEADROOM = 1.6  # times the largest misfit of a used image; worse ones are at the edge


class MisfitPlot(Plot):
    """The misfit of each image over its number; a click chooses an image.

    Images that do not take part are crosses. Where they are far off, they are drawn at
    the upper edge, so that the others can still be distinguished. A line above the used
    images can be dragged down to exclude up to the worse half of them.
    """

    number_chosen = Signal(int)  # of the image that was clicked
    # list of int: numbers of the images above which the line was left
    limit_set = Signal(list)

    def __init__(self, axes: Axes) -> None:
        self._used: pg.ScatterPlotItem | None = None
        super().__init__(axes)
        self._places: dict[int, tuple[float, float]] = {}
        self._number: int | None = None
        self._in_use: dict[int, tuple[float, float]] = {}
        self._limit_words = ("", "")

        # Widgets
        self._used = pg.ScatterPlotItem(pxMode=True, size=5)
        self._out = pg.ScatterPlotItem(pxMode=True, size=9, symbol="x")
        self._chosen = pg.ScatterPlotItem(pxMode=True, size=15, symbol="o")
        self._above = pg.ScatterPlotItem(pxMode=True, size=9, symbol="x")
        self._limit = pg.InfiniteLine(
            angle=0, movable=True, label="", labelOpts=LIMIT_LABEL
        )
        self._limit.label.setFont(font(TextSize.SMALL))
        self._limit.addMarker("<|>", LIMIT_GRIP, 2 * GRID)
        self._limit.hide()
        for item in (self._chosen, self._used, self._out, self._above, self._limit):
            self._item.addItem(item)

        # Connections
        self._limit.sigPositionChanged.connect(self._on_limit_moved)
        self._limit.sigPositionChangeFinished.connect(self._on_limit_left)
        self._used.sigClicked.connect(self._on_clicked)
        self._out.sigClicked.connect(self._on_clicked)

        self._restyle()

    def set_data(self, numbers: IntArray, misfits: FloatArray, used: BoolArray) -> None:
        """Show misfits (N,), px, of images by number (N,), and which take part (N,)."""
        assert self._used is not None
        top = HEADROOM * float(np.max(misfits[used], initial=0.0)) or 1.0
        shown = np.isfinite(misfits)
        heights = np.minimum(np.where(shown, misfits, top), top)
        x = numbers.astype(np.float64)
        self._used.setData(x[used], heights[used], data=numbers[used])
        self._out.setData(x[~used], heights[~used], data=numbers[~used])
        places = zip(x.tolist(), heights.tolist(), strict=True)
        self._places = dict(zip(numbers.tolist(), places, strict=True))
        self._columns = {
            "image": x,
            "misfit_px": misfits,
            "used": used.astype(np.float64),
        }
        self._in_use = {n: self._places[n] for n in numbers[used].tolist()}
        self._fit(x, np.append(heights, 1.2 * heights.max(initial=0.0)), y_zero=True)
        self.set_number(self._number)
        self._rest_limit(heights[used])

    def number(self) -> int | None:
        """Return the number of the image that is marked."""
        return self._number

    def set_number(self, number: int | None) -> None:
        """Mark an image by its number, or none."""
        self._number = number
        place = None if number is None else self._places.get(number)
        points = [] if place is None else [place]
        self._chosen.setData(pos=np.array(points).reshape(-1, 2))

    def set_limit_words(self, at_rest: str, above: str) -> None:
        """Set the text of the line; ``above`` has fields for a count and for px."""
        self._limit_words = at_rest, above
        self._on_limit_moved()

    def set_limit_movable(self, movable: bool) -> None:
        """Let images be excluded by the line, or not."""
        self._limit.setMovable(movable)
        self._limit.setVisible(movable and bool(self._in_use))

    @override
    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._on_limit_moved()

    def limit_pixel(self) -> QPoint:
        """Return the handle of the line, in px of `canvas`."""
        left, right = self.ranges()[0]
        return self._pixel(left + LIMIT_GRIP * (right - left), self._limit.value())

    def place_of(self, number: int) -> tuple[float, float]:
        """Return x and y at which an image is drawn."""
        return self._places[number]

    def pixel_of(self, number: int) -> QPoint:
        """Return the position of an image, in px of `canvas`."""
        return self._pixel(*self._places[number])

    def canvas(self) -> QWidget:
        """Return the widget on which dots are clicked."""
        canvas: QWidget = self._graphics.viewport()
        return canvas

    @override
    def png(self, mark: str = "") -> bytes:
        was_visible = self._limit.isVisible()
        self._limit.hide()  # only the curve is drawn
        picture = super().png(mark)
        self._limit.setVisible(was_visible)
        return picture

    @override
    def _restyle(self) -> None:
        super()._restyle()
        if self._used is None:
            return
        colors = colors_of(self.palette())
        self._used.setPen(pg.mkPen(None))
        self._used.setBrush(pg.mkBrush(colors.accent))
        self._out.setPen(pg.mkPen(colors.warn, width=2))
        self._out.setBrush(pg.mkBrush(None))
        self._chosen.setPen(pg.mkPen(colors.text, width=2))
        self._chosen.setBrush(pg.mkBrush(None))
        self._above.setPen(pg.mkPen(colors.warn, width=2))
        self._limit.setPen(pg.mkPen(colors.warn, width=2))
        self._limit.setHoverPen(pg.mkPen(colors.text, width=2))
        self._limit.label.setColor(colors.warn)
        self._limit.label.fill = pg.mkBrush(colors.panel)  # over the dots

    def _pixel(self, x: float, y: float) -> QPoint:
        self._graphics.fit()
        scene = self._item.vb.mapViewToScene(QPointF(x, y))
        return QPoint(self._graphics.mapFromScene(scene))

    def _rest_limit(self, heights: FloatArray) -> None:
        """Place the line above residuals (N,), where it is visible."""
        if len(heights):
            rest = LIMIT_REST * float(heights.max())
            self._limit.setBounds((float(np.median(heights)), rest))
            self._limit.setValue(rest)
        self.set_limit_movable(self._limit.movable)
        self._on_limit_moved()

    def _numbers_above(self) -> list[int]:
        limit = self._limit.value()
        return [number for number, (_, y) in self._in_use.items() if y > limit]

    def _on_limit_moved(self, _line: object = None) -> None:
        numbers = self._numbers_above()
        places = [self._in_use[number] for number in numbers]
        self._above.setData(pos=np.array(places).reshape(-1, 2))
        at_rest, above = self._limit_words
        words = above.format(len(numbers), number_text(self._limit.value(), 3))
        self._limit.label.setFormat(words if numbers else at_rest)
        # At rest the line is at the top, where a low plot has no room for words.
        self._limit.label.setVisible(bool(numbers) or self.height() >= LEAST_WORDED)

    def _on_limit_left(self, _line: object = None) -> None:
        numbers = self._numbers_above()
        if numbers:
            self.limit_set.emit(numbers)

    def _on_clicked(
        self, _plot: object, points: "list[pg.SpotItem]", _event: object
    ) -> None:
        if len(points):
            self.number_chosen.emit(int(points[0].data()))


ROOM = 1.5  # times the extent of the pen, that is shown at first


@dataclass(frozen=True, eq=False)
class Arrows:
    """Residuals of an image."""

    # (N, 2), px
    points: FloatArray
    residuals: FloatArray
    scale: float = 1.0  # magnification of the residuals


NO_ARROWS = Arrows(np.zeros((0, 2)), np.zeros((0, 2)))


class ResidualView(ImageView):
    """Shows a recorded image with markers and arrows."""

    def __init__(self) -> None:
        self._arrows = NO_ARROWS
        super().__init__()

    def arrows(self) -> Arrows:
        """Return the arrows that are drawn."""
        return self._arrows

    def set_arrows(self, arrows: Arrows) -> None:
        """Draw other arrows on the image that is shown."""
        self._arrows = arrows
        self.update()

    def show_around(self, points: FloatArray) -> None:
        """Enlarge the image so that points (N, 2), px, fill the view."""
        self.set_zoom(1.0)
        if not len(points) or self.image_size().isEmpty():
            return
        corners = [
            self.place_of(*at) for at in (points.min(axis=0), points.max(axis=0))
        ]
        box = QRectF(*corners)
        across = self.width() / max(box.width(), 1.0)
        down = self.height() / max(box.height(), 1.0)
        zoom = max(min(across, down) / ROOM, 1.0)
        if zoom > 1:
            middle = QPointF(self.rect().center())
            # The fixed point of the zoom, chosen to centre the box.
            self.set_zoom(zoom, (middle - box.center() * zoom) / (1 - zoom))

    @override
    def paintEvent(self, event: QPaintEvent) -> None:
        super().paintEvent(event)
        if self.image_size().isEmpty():
            return
        arrows = self._arrows
        x, y = arrow_lines(arrows.points, arrows.residuals * arrows.scale)
        ends = [self.place_of(*at) for at in zip(x.tolist(), y.tolist(), strict=True)]
        lines = [QLineF(*pair) for pair in zip(ends[::2], ends[1::2], strict=True)]
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QPen(QColor(DARK.pointer), 2))
        painter.drawLines(lines)

    @override
    def _retranslate(self) -> None:
        super()._retranslate()
        self.setAccessibleName(self.tr("Recorded image"))
