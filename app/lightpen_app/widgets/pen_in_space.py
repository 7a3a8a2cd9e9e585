"""Current and target posture of the pen, seen from behind the operator."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from PySide6.QtCore import QPointF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QSizePolicy, QWidget
from typing_extensions import override

from lightpen.arrays import FloatArray
from lightpen.model.pen import Pen
from lightpen.model.rigid import Posture, rotations_of
from lightpen_app.look.signs import draw_arrow
from lightpen_app.look.theme import Colors, colors_of
from lightpen_app.look.words import set_tooltip
from lightpen_app.widgets.fields import Translated

RAISED = math.radians(24)  # of the eye above the plane of the cone
WIDTH, HEIGHT = 1.15, 1.3  # of the drawing, in lengths of the pen
GROUND = 0.42  # radius of the ring about the cone, in lengths of the pen
CONE = 0.05  # radius of the cone, likewise
AWAY = 0.08  # lengths of the pen from where it should be, to be worth an arrow
SHARE_BELOW = 0.16  # of the height, below the cone


@dataclass(frozen=True, eq=False)
class DisplayedPosture:
    """Posture of a pen in its cone."""

    pen: Pen  # its LEDs are drawn
    tip_pen: FloatArray  # (3,), where its tip is, mm
    posture: Posture | None = None  # at present
    target: Posture | None = None  # of the next image
    # Rotation from the camera's view to the operator's, as in `DialValue`.
    heading: float = 0.0


class PenInSpace(Translated, QWidget):
    """Draws a pen in its cone and the outline of the target posture."""

    def __init__(self) -> None:
        super().__init__()
        self.say(self, self.tr("The pen in space"))
        self._value: DisplayedPosture | None = None
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Ignored)
        self._retranslate()

    def value(self) -> DisplayedPosture | None:
        """Return the value."""
        return self._value

    def set_value(self, value: DisplayedPosture | None) -> None:
        """Draw another pen, or none."""
        self._value = value
        self.update()

    @override
    def sizeHint(self) -> QSize:
        return QSize(160, 200)

    @override
    def minimumSizeHint(self) -> QSize:
        return QSize(80, 100)

    @override
    def paintEvent(self, event: QPaintEvent) -> None:
        stand = self._value
        if stand is None:
            return
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        colors = colors_of(self.palette())
        length = float(np.linalg.norm(stand.pen.leds - stand.tip_pen, axis=1).max())
        scale = min(self.width() / WIDTH, self.height() / HEIGHT) / length
        seat = QPointF(self.width() / 2, self.height() * (1 - SHARE_BELOW))
        _draw_ground(painter, seat, scale * length, colors)
        drawn = [
            np.array(seat.toTuple()) + seen_from_behind(stand, each) * (scale, -scale)
            for each in (stand.posture, stand.target)
            if each is not None
        ]
        if stand.posture is not None:
            _draw_pen(painter, seat, drawn[0], colors)
        if stand.target is not None:
            _draw_outline(painter, seat, drawn[-1], QColor(colors.pointer))
        if len(drawn) == 2:
            top, goal = (QPointF(*each.mean(axis=0)) for each in drawn)
            if math.dist(top.toTuple(), goal.toTuple()) > AWAY * scale * length:
                width, halo = 0.035 * scale * length, QColor(colors.window)
                draw_arrow(painter, top, goal, width, QColor(colors.pointer), halo)

    @override
    def _retranslate(self) -> None:
        set_tooltip(
            self, self.tr("Current tilt of the pen and outline of the target posture")
        )


def seen_from_behind(stand: DisplayedPosture, posture: Posture) -> FloatArray:
    """Return the LEDs as seen from the tip, right and up, (L, 2), mm."""
    numbers = posture.tilt, posture.direction, posture.turn
    rotation = rotations_of(stand.pen, *(np.array([each]) for each in numbers))[0]
    right, down, away = ((stand.pen.leds - stand.tip_pen) @ rotation.T).T
    cosine, sine = math.cos(stand.heading), math.sin(stand.heading)
    own_right = cosine * right - sine * away
    own_away = sine * right + cosine * away
    up = -down * math.cos(RAISED) + own_away * math.sin(RAISED)
    return np.stack([own_right, up], axis=1)


def _draw_ground(
    painter: QPainter, seat: QPointF, length: float, colors: Colors
) -> None:
    """Draw the cone, a ring about it, and where upright is."""
    flat = math.sin(RAISED)
    painter.setPen(QPen(QColor(colors.line), 1))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.drawEllipse(seat, GROUND * length, GROUND * length * flat)
    painter.setPen(QPen(QColor(colors.edge), 1, Qt.PenStyle.DashLine))
    painter.drawLine(seat, seat - QPointF(0, length * math.cos(RAISED)))
    painter.setPen(QPen(QColor(colors.edge), 1))
    painter.setBrush(QColor(colors.raised))
    painter.drawEllipse(seat, CONE * length, CONE * length * flat)


def _draw_pen(
    painter: QPainter, seat: QPointF, leds: FloatArray, colors: Colors
) -> None:
    """Draw the stem, the body about the LEDs (L, 2), px, and each of them."""
    size = float(np.ptp(leds, axis=0).max())
    thick = QPen(QColor(colors.muted), max(0.07 * size, 3.0))
    thick.setCapStyle(Qt.PenCapStyle.RoundCap)
    thick.setJoinStyle(Qt.PenJoinStyle.RoundJoin)
    painter.setPen(thick)
    painter.drawLine(seat, QPointF(*leds.mean(axis=0)))
    painter.setBrush(QColor(colors.muted))
    painter.drawPolygon(body_outline(leds))
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(colors.window))
    radius = max(0.03 * size, 2.0)
    for place in leds.tolist():
        painter.drawEllipse(QPointF(*place), radius, radius)
    painter.setBrush(QColor(colors.text))
    painter.drawEllipse(seat, 1.3 * radius, 1.3 * radius)


def _draw_outline(
    painter: QPainter, seat: QPointF, leds: FloatArray, color: QColor
) -> None:
    painter.setPen(QPen(color, 2, Qt.PenStyle.DashLine))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.drawLine(seat, QPointF(*leds.mean(axis=0)))
    painter.drawPolygon(body_outline(leds))


def body_outline(leds: FloatArray) -> QPolygonF:
    """Return the outline of what holds the LEDs (L, 2)."""
    corners = cv2.convexHull(leds.astype(np.float32))[:, 0]
    return QPolygonF([QPointF(x, y) for x, y in corners.tolist()])
