"""A recorded image with its detections and residual arrows."""

from dataclasses import dataclass

import numpy as np
from PySide6.QtCore import QLineF, QPointF, QRectF
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen
from typing_extensions import override

from lightpen.arrays import FloatArray
from lightpen_app.look.arrows import arrow_lines
from lightpen_app.look.theme import DARK
from lightpen_app.widgets.image_view import ImageView

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
