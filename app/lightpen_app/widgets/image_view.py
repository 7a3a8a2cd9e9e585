"""The live image with rings about the LEDs."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from PySide6.QtCore import QPoint, QPointF, QRectF, QSize, QSizeF, Qt
from PySide6.QtGui import (
    QColor,
    QImage,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QWheelEvent,
)
from PySide6.QtWidgets import QSizePolicy, QWidget
from typing_extensions import override

from lightpen.arrays import Image
from lightpen_app.look.figures import pooled
from lightpen_app.look.theme import DARK, GRID, TextSize, Tone, font
from lightpen_app.widgets.fields import Translated

MAX_ZOOM = 16.0
ZOOM_STEP = 1.25
PAN_STEP = 0.1  # of what is seen
LEAST_RING = 6.0  # px, radius
# Lines drawn at once. Of more Qt has parts drawn by other threads and waits for them,
# and all other threads of Python wait, too.
STRIP = 64
LABEL_DISTANCES = (3.0, 12.0)  # px from a ring to its label
LABEL_TURNS = tuple(math.radians(15 * k) for k in sorted(range(-11, 13), key=abs))


@dataclass(frozen=True)
class Marker:
    """A ring on the image."""

    x: float  # centre, image px
    y: float
    radius: float = 8.0  # image px; it is drawn no smaller than can be seen
    label: str = ""  # beside the ring
    tone: Tone = Tone.GOOD  # its colour; `WARN` and `BAD` are also drawn dashed
    # Where beside it: clockwise from the right as one sees it, rad.
    label_angle: float = -math.pi / 4
    crossed: bool = False


class ImageView(Translated, QWidget):
    """Shows the newest image whole, or enlarged about a place.

    The wheel, or + and -, enlarge; the mouse, or the arrow keys, move; 0 shows all.
    """

    def __init__(self) -> None:
        super().__init__()
        self.say(self, self.tr("Live image"))
        self._buffer: Image | None = None  # keeps the memory of _shown alive
        self._shown = QImage()
        self._size = QSize()
        self._markers: tuple[Marker, ...] = ()
        self._message = ""
        self._zoom = 1.0
        self._center = QPointF(0.5, 0.5)  # of the image, as fractions
        self._dragged: QPointF | None = None  # where the mouse was
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        policy = QSizePolicy.Policy.Expanding
        self.setSizePolicy(policy, policy)
        self._refresh()

    def set_half(
        self, half: Image, size: QSize, markers: Sequence[Marker] = ()
    ) -> None:
        """Show an image already `pooled`; ``size`` is the size of the whole image."""
        self._show(half, size, tuple(markers))

    def clear(self) -> None:
        """Show no image."""
        self._show(None, QSize(), ())

    def set_markers(self, markers: Sequence[Marker]) -> None:
        """Draw other rings on the image that is shown."""
        self._markers = tuple(markers)
        self.update()

    def markers(self) -> tuple[Marker, ...]:
        """Return the rings that are drawn."""
        return self._markers

    def set_message(self, text: str) -> None:
        """Say why there is no image; shown in its place."""
        self._message = text
        self._refresh()
        self.update()

    def image_size(self) -> QSize:
        """Return the size of the image shown, px; empty without one."""
        return self._size

    def pixel_at(self, place: QPointF) -> QPointF:
        """Return the image point at a position of the widget."""
        target, scale = self._target()
        return (place - target.topLeft()) / scale - QPointF(0.5, 0.5)

    def place_of(self, x: float, y: float) -> QPointF:
        """Return the position of an image point on the widget."""
        target, scale = self._target()
        return target.topLeft() + QPointF(x + 0.5, y + 0.5) * scale

    def set_zoom(self, zoom: float, about: QPointF | None = None) -> None:
        """Zoom about a fixed point of the widget."""
        if self._size.isEmpty():
            return
        place = QPointF(self.rect().center()) if about is None else about
        pixel = self.pixel_at(place)
        self._zoom = min(max(zoom, 1.0), MAX_ZOOM)
        self._move(place - self.place_of(pixel.x(), pixel.y()))

    @override
    def sizeHint(self) -> QSize:
        return QSize(612, 512)

    @override
    def minimumSizeHint(self) -> QSize:
        return QSize(160, 128)

    @override
    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        self._draw(painter)
        if self.hasFocus():
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.setPen(QPen(QColor(DARK.accent), 2))
            painter.drawRect(self.rect().adjusted(1, 1, -1, -1))

    def _draw(self, painter: QPainter) -> None:
        painter.fillRect(self.rect(), QColor(DARK.window))
        if self._shown.isNull():
            painter.setPen(QColor(DARK.muted))
            painter.setFont(font(TextSize.LEAD))
            margin = 3 * GRID
            box = self.rect().adjusted(margin, margin, -margin, -margin)
            flags = int(Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap)
            painter.drawText(box, flags, self._message)
            return
        target, scale = self._target()
        self._draw_pixels(painter, target.topLeft(), 2 * scale)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        for marker in self._markers:
            self._draw_marker(painter, marker, scale)
        if labelled := [marker for marker in self._markers if marker.label]:
            taken = [self._ring_box(marker, scale) for marker in self._markers]
            for marker in labelled:  # over the rings
                self._draw_label(painter, marker, scale, taken)

    def _draw_pixels(self, painter: QPainter, corner: QPointF, scale: float) -> None:
        """Draw the image; ``scale`` is px of widget per pixel of it."""
        pixels, shown = self._buffer, self._shown
        assert pixels is not None
        while 2 * scale < 1:
            pixels, scale = pooled(pixels), 2 * scale
            shown = _as_qimage(pixels)
        smooth = scale < 1  # enlarged, the pixels themselves are of interest
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform, smooth)
        target = QRectF(corner, shown.size() * scale)
        for y in range(0, self.height(), STRIP):
            painter.setClipRect(0, y, self.width(), STRIP)
            painter.drawImage(target, shown)
        painter.setClipping(False)

    def _draw_marker(self, painter: QPainter, marker: Marker, scale: float) -> None:
        place = self.place_of(marker.x, marker.y)
        radius = max(marker.radius * scale, LEAST_RING)
        pen = QPen(DARK.tone(marker.tone), 2)
        if marker.tone in (Tone.WARN, Tone.BAD):
            pen.setCapStyle(Qt.PenCapStyle.FlatCap)
            pen.setDashPattern([3, 2])
        painter.setPen(pen)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawEllipse(place, radius, radius)
        if marker.crossed:
            arm = radius / 2**0.5
            painter.drawLine(place - QPointF(arm, arm), place + QPointF(arm, arm))
            painter.drawLine(place - QPointF(arm, -arm), place + QPointF(arm, -arm))

    def _ring_box(self, marker: Marker, scale: float) -> QRectF:
        radius = max(marker.radius * scale, LEAST_RING)
        place = self.place_of(marker.x, marker.y)
        return QRectF(place.x() - radius, place.y() - radius, 2 * radius, 2 * radius)

    def _draw_label(
        self, painter: QPainter, marker: Marker, scale: float, taken: list[QRectF]
    ) -> None:
        """Write a label where it covers no ring and no label, if there is room."""
        painter.setFont(font(TextSize.SMALL, bold=True))
        metrics = painter.fontMetrics()
        width = metrics.horizontalAdvance(marker.label) + 2.0
        height = float(metrics.capHeight())
        ring = self._ring_box(marker, scale)
        boxes = [
            _label_box(ring, marker.label_angle + turn, QSizeF(width, height), away)
            for away in LABEL_DISTANCES
            for turn in LABEL_TURNS
        ]
        free = (b for b in boxes if not any(b.intersects(each) for each in taken))
        box = next(free, boxes[0])
        taken.append(box)
        corner = box.bottomLeft()
        painter.setPen(QColor(DARK.window))
        painter.drawText(corner + QPointF(1, 1), marker.label)
        painter.setPen(DARK.tone(marker.tone))
        painter.drawText(corner, marker.label)

    @override
    def wheelEvent(self, event: QWheelEvent) -> None:
        steps = event.angleDelta().y() / 120
        self.set_zoom(self._zoom * ZOOM_STEP**steps, event.position())
        event.accept()

    @override
    def keyPressEvent(self, event: QKeyEvent) -> None:
        step = PAN_STEP * min(self.width(), self.height())
        moves = {
            Qt.Key.Key_Left: QPoint(1, 0),
            Qt.Key.Key_Right: QPoint(-1, 0),
            Qt.Key.Key_Up: QPoint(0, 1),
            Qt.Key.Key_Down: QPoint(0, -1),
        }
        key = Qt.Key(event.key())
        if key in (Qt.Key.Key_Plus, Qt.Key.Key_Equal):
            self.set_zoom(self._zoom * ZOOM_STEP)
        elif key == Qt.Key.Key_Minus:
            self.set_zoom(self._zoom / ZOOM_STEP)
        elif key == Qt.Key.Key_0:
            self.set_zoom(1.0)
        elif key in moves:
            self._move(QPointF(moves[key]) * step)
        else:
            super().keyPressEvent(event)

    @override
    def mousePressEvent(self, event: QMouseEvent) -> None:
        self._dragged = event.position()

    @override
    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self._dragged is not None:
            self._move(event.position() - self._dragged)
            self._dragged = event.position()

    @override
    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        self._dragged = None

    @override
    def _refresh(self) -> None:
        self.setAccessibleDescription(self._message if self._shown.isNull() else "")

    def _show(
        self, half: Image | None, size: QSize, markers: tuple[Marker, ...]
    ) -> None:
        was_empty = self._shown.isNull()
        self._buffer = half
        self._size = size
        self._markers = markers
        self._shown = QImage() if half is None else _as_qimage(half)
        if was_empty is not (half is None):
            self._refresh()
        self.update()

    def _target(self) -> tuple[QRectF, float]:
        """Where the whole image lies on the widget, and px of widget per image px."""
        width, height = max(self._size.width(), 1), max(self._size.height(), 1)
        scale = self._zoom * min(self.width() / width, self.height() / height)
        corner = QPointF(
            self.width() / 2 - self._center.x() * width * scale,
            self.height() / 2 - self._center.y() * height * scale,
        )
        return QRectF(corner.x(), corner.y(), width * scale, height * scale), scale

    def _move(self, by: QPointF) -> None:
        """Move the image, but not so far that it leaves the widget."""
        target, _ = self._target()
        x = self._center.x() - by.x() / target.width()
        y = self._center.y() - by.y() / target.height()
        half_x = min(self.width() / target.width() / 2, 0.5)
        half_y = min(self.height() / target.height() / 2, 0.5)
        self._center = QPointF(
            min(max(x, half_x), 1 - half_x), min(max(y, half_y), 1 - half_y)
        )
        self.update()


def _as_qimage(pixels: Image) -> QImage:
    """Return an image of pixels (H, W), whose memory must outlive it."""
    height, width = pixels.shape
    grey = QImage.Format.Format_Grayscale8
    return QImage(pixels.data, width, height, pixels.strides[0], grey)


def _label_box(ring: QRectF, angle: float, size: QSizeF, away: float) -> QRectF:
    reach, width, height = ring.width() / 2 + away, size.width(), size.height()
    x = ring.center().x() + math.cos(angle) * (reach + width / 2)
    y = ring.center().y() + math.sin(angle) * (reach + height / 2)
    return QRectF(x - width / 2, y - height / 2, width, height)
