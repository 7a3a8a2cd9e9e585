"""The mark for the camera's position at a dial."""

import math
from dataclasses import dataclass

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QTransform

from lightpen_app.look.theme import GRID, font

TURNS = (-10.0, 10.0, -20.0, 20.0)  # of the words against the circle, degrees
FLAGS = int(Qt.AlignmentFlag.AlignVCenter | Qt.TextFlag.TextDontClip)
DISTANCE = 1.085  # from the centre of the dial to the mark's; radius = 1


@dataclass(frozen=True, eq=False)
class CameraPosition:
    """Position of a camera."""

    middle: QPointF  # of the dial, px
    radius: float  # radius of the dial, px
    # In which direction from the middle, counter-clockwise from the right, rad.
    angle: float

    @property
    def place(self) -> QPointF:
        """Middle of the mark, px."""
        towards = QPointF(math.cos(self.angle), -math.sin(self.angle))
        return self.middle + towards * (self.radius * DISTANCE)


def draw_camera(
    painter: QPainter,
    room: QRectF,
    stand: CameraPosition,
    words: str,
    size: float,
    color: QColor,
) -> None:
    """Draw a camera that faces a dial, with a label inside a rectangle.

    The font size is in px.
    """
    radius = stand.radius
    body = 0.055 * radius
    painter.save()
    painter.translate(stand.place)
    painter.rotate(math.degrees(-stand.angle) + 90)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(color)
    painter.drawRoundedRect(
        QRectF(-1.5 * body, -0.5 * body, 3 * body, 1.6 * body), 3, 3
    )
    painter.drawRect(QRectF(-0.6 * body, -1.1 * body, 1.2 * body, 0.7 * body))
    painter.restore()

    painter.save()
    painter.setPen(color)
    painter.setFont(font(size))
    length = QFontMetricsF(painter.font()).horizontalAdvance(words) + 1
    away = 2 * body + GRID / 2
    right = QRectF(away, -size / 2, length, size)
    left = right.translated(-2 * away - length, 0)
    along = 90 - math.degrees(stand.angle % math.pi)  # the circle; never upside down
    turns = (0.0, along, *(along + each for each in TURNS))
    turn, box = min(
        ((turn, box) for turn in turns for box in (right, left)),
        key=lambda each: _shortage(each[0], each[1], room, stand),
    )
    painter.translate(stand.place)
    painter.rotate(turn)
    painter.drawText(box, FLAGS, words)
    painter.restore()


def _shortage(turn: float, box: QRectF, room: QRectF, stand: CameraPosition) -> float:
    """Return by how much a label leaves its rectangle or covers the dial, px.

    Their box is about the mark and is turned by an angle in degrees, clockwise.
    """
    place = QTransform.fromTranslate(stand.place.x(), stand.place.y()).rotate(turn)
    both = place.mapRect(box).united(room)
    outside = both.width() - room.width() + both.height() - room.height()
    back, _ = place.inverted()
    middle = back.map(stand.middle)
    x = min(max(middle.x(), box.left()), box.right())
    y = min(max(middle.y(), box.top()), box.bottom())
    covered = stand.radius - math.hypot(x - middle.x(), y - middle.y())
    return outside + max(covered, 0.0)
