"""Residuals by image, and over an image."""

from dataclasses import dataclass

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QLineF, QPointF, QRectF, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen
from typing_extensions import override

from lightpen.arrays import BoolArray, FloatArray, IntArray
from lightpen_app.look.figures import arrow_lines
from lightpen_app.look.theme import DARK, colors_of
from lightpen_app.widgets.figure import Axes
from lightpen_app.widgets.image_view import ImageView
from lightpen_app.widgets.plots import Plot

HEADROOM = 1.6  # times the largest misfit of a used image; worse ones are at the edge


class MisfitPlot(Plot):
    """The misfit of each image over its number; a click chooses an image.

    Images that do not take part are crosses. Where they are far off, they are drawn at
    the upper edge, so that the others can still be distinguished.
    """

    number_chosen = Signal(int)  # of the image that was clicked

    def __init__(self, axes: Axes) -> None:
        self._used: pg.ScatterPlotItem | None = None
        super().__init__(axes)
        self._places: dict[int, tuple[float, float]] = {}
        self._number: int | None = None

        # Widgets
        self._used = pg.ScatterPlotItem(pxMode=True, size=5)
        self._out = pg.ScatterPlotItem(pxMode=True, size=9, symbol="x")
        self._chosen = pg.ScatterPlotItem(pxMode=True, size=15, symbol="o")
        for item in (self._chosen, self._used, self._out):
            self._item.addItem(item)

        # Connections
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
        self._fit(x, np.append(heights, 1.2 * heights.max(initial=0.0)), y_zero=True)
        self.set_number(self._number)

    def set_number(self, number: int | None) -> None:
        """Mark an image by its number, or none."""
        self._number = number
        place = None if number is None else self._places.get(number)
        points = [] if place is None else [place]
        self._chosen.setData(pos=np.array(points).reshape(-1, 2))

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
    def _refresh(self) -> None:
        super()._refresh()
        self.setAccessibleName(self.tr("Recorded image"))
