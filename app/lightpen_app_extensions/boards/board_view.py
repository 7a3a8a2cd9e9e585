"""The live image during a camera calibration, with the board and its next pose."""

from dataclasses import dataclass

import numpy as np
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QImage, QPainter, QPen, QPolygonF
from typing_extensions import override

from lightpen.arrays import FloatArray
from lightpen.model.uncertainty_map import UncertaintyMap
from lightpen_app.look.theme import DARK, TextSize, Tone, font
from lightpen_app.widgets.image_view import ImageView

POINT = 2.5  # px of the screen, radius
FOOT = 1.5  # px of the screen, radius of an arrow's foot
LONGEST_ARROW = 40.0  # px of the screen
# From no uncertainty to the largest: red, green, blue, opacity.
_BEST, _WORST = np.array([16, 60, 96, 230]), np.array([214, 104, 24, 230])


@dataclass(frozen=True, eq=False)
class BoardOverlay:
    """Overlay of the image."""

    points: FloatArray | None = None  # (N, 2), of the board, px; NaN where not seen
    # (4, 2), where the board is wanted, px, from its first corner on
    outline: FloatArray | None = None
    # (M, 4), residuals: place and value, px; drawn enlarged
    arrows: FloatArray | None = None
    uncertainty: UncertaintyMap | None = None


class BoardView(ImageView):
    """Shows the newest image with the detected board."""

    def __init__(self) -> None:
        super().__init__()
        self._overlay = BoardOverlay()

    def overlay(self) -> BoardOverlay:
        """Return the overlay of the image."""
        return self._overlay

    def set_overlay(self, overlay: BoardOverlay) -> None:
        """Draw something else on the image."""
        self._overlay = overlay
        self.update()

    @override
    def _draw(self, painter: QPainter) -> None:
        super()._draw(painter)
        if self.image_size().isEmpty():
            return
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        shown = self._overlay
        if shown.uncertainty is not None:
            self._draw_uncertainty(painter, shown.uncertainty)
        if shown.outline is not None:
            self._draw_outline(painter, shown.outline)
        if shown.points is not None:
            self._draw_points(painter, shown.points)
        if shown.arrows is not None:
            self._draw_arrows(painter, shown.arrows)

    def _draw_uncertainty(self, painter: QPainter, uncertainty: UncertaintyMap) -> None:
        """Colour the image by how uncertain a projection is, with numbers, px."""
        sigmas, size = uncertainty.sigmas, self.image_size()
        rows, columns = sigmas.shape
        colors = np.stack([_BEST, _WORST]).astype(float)
        shares = (sigmas / max(uncertainty.worst, 1e-12))[..., None]
        pixels = np.ascontiguousarray(colors[0] + shares * (colors[1] - colors[0]))
        picture = QImage(
            pixels.astype(np.uint8).tobytes(),
            columns,
            rows,
            4 * columns,
            QImage.Format.Format_RGBA8888,
        )
        # The samples lie on the border of the image, the pixels of a picture within.
        x, y = size.width() / (columns - 1) / 2, size.height() / (rows - 1) / 2
        right, bottom = float(size.width()), float(size.height())
        whole = self.place_of(-x, -y), self.place_of(right + x, bottom + y)
        inside = self.place_of(-0.5, -0.5), self.place_of(right - 0.5, bottom - 0.5)
        painter.save()
        painter.setClipRect(QRectF(*inside))
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        painter.drawImage(QRectF(*whole), picture)
        painter.restore()
        painter.setPen(QColor(DARK.text))
        painter.setFont(font(TextSize.SMALL))
        for row, column in np.ndindex(rows, columns):
            if row % 2 and column % 2:
                place = self.place_of(*uncertainty.pixels[row, column].tolist())
                words = f"{sigmas[row, column]:.3f}"
                box = QRectF(place.x() - 40, place.y() - 12, 80, 24)
                painter.drawText(box, Qt.AlignmentFlag.AlignCenter, words)

    def _draw_outline(self, painter: QPainter, outline: FloatArray) -> None:
        places = [self.place_of(x, y) for x, y in outline.tolist()]
        pen = QPen(QColor(DARK.pointer), 3)
        pen.setDashPattern([4, 3])
        painter.setPen(pen)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawPolygon(QPolygonF(places))

    def _draw_points(self, painter: QPainter, points: FloatArray) -> None:
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(DARK.tone(Tone.GOOD))
        for x, y in points[np.isfinite(points[:, 0])].tolist():
            painter.drawEllipse(self.place_of(x, y), POINT, POINT)

    def _draw_arrows(self, painter: QPainter, arrows: FloatArray) -> None:
        longest = float(np.linalg.norm(arrows[:, 2:], axis=1).max(initial=0.0))
        if longest == 0:
            return
        scale = LONGEST_ARROW / longest
        painter.setPen(QPen(DARK.tone(Tone.WARN), 1.5))
        for x, y, u, v in arrows.tolist():
            foot = self.place_of(x, y)
            painter.drawLine(QLineF(foot, foot + QPointF(scale * u, scale * v)))
            painter.drawEllipse(foot, FOOT, FOOT)
