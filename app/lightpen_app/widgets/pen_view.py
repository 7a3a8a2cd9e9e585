"""The LEDs of a pen in a rotatable 3-D view."""

import math
from dataclasses import dataclass, field

import numpy as np
from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QPolygonF,
)
from PySide6.QtWidgets import QSizePolicy, QWidget
from typing_extensions import override

from lightpen.arrays import FloatArray
from lightpen.model.pen import MAX_COORDINATE, Pen
from lightpen_app.look.theme import GRID, Colors, TextSize, Tone, colors_of, font
from lightpen_app.look.words import set_tooltip
from lightpen_app.widgets.fields import Translated

START_YAW, START_PITCH = math.radians(-20), math.radians(16)
MAX_PITCH = math.radians(88)
KEY_STEP = math.radians(6)
DRAG_STEP = math.radians(0.5)  # for each px
CLICK_SLACK = 4  # px that a mouse may move while it clicks
CLICK_REACH = 18.0  # px from an LED
AXIS_SHARE = 0.22  # length of an axis, of the pen's radius
MARGIN = 2 * GRID
N_CORNERS = 28
LABEL_GAP = 11  # px from the rim of a disc to the middle of its number
LEAST_RADIUS = 4.0  # px of a disc
ROUND = np.linspace(0, 2 * np.pi, N_CORNERS, endpoint=False)


@dataclass(frozen=True, eq=False)
class PenPicture:
    """Displayed content of a pen."""

    pen: Pen | None = None
    tip: FloatArray | None = None  # (3,), centre of the probe tip, pen frame, mm
    # Numbers of the LEDs that something is wrong with.
    marked: frozenset[int] = field(default_factory=frozenset)


@dataclass(frozen=True, eq=False)
class _Projection:
    """From the pen frame to the widget."""

    turn: FloatArray  # (3, 3), to right, up and towards the viewer
    center: FloatArray  # (3,), mm
    radius: float  # mm
    scale: float  # px of widget per mm
    middle: QPointF
    shows_origin: bool

    def places(self, points: FloatArray) -> list[QPointF]:
        """Return the positions of points (N, 3)."""
        seen = (np.reshape(points, (-1, 3)) - self.center) @ self.turn.T
        return [
            self.middle + QPointF(x, -y) for x, y in (seen[:, :2] * self.scale).tolist()
        ]


class PenView(Translated, QWidget):
    """Draws a pen; the mouse or the arrow keys turn it, 0 puts it back."""

    led_chosen = Signal(int)  # the LED of this number was clicked

    def __init__(self) -> None:
        super().__init__()
        self.say(self, self.tr("The LEDs in space"))
        self._value = PenPicture()
        self._chosen = 0
        self._yaw, self._pitch = START_YAW, START_PITCH
        self._pressed: QPointF | None = None
        self._dragged = QPointF()
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        policy = QSizePolicy.Policy.Expanding
        self.setSizePolicy(policy, policy)
        self._refresh()

    def value(self) -> PenPicture:
        """Return the value."""
        return self._value

    def set_value(self, value: PenPicture) -> None:
        """Show another pen, from where the one before was seen.

        Coordinates that no pen can have are not drawn.
        """
        pen = value.pen
        if pen is not None and np.abs(pen.leds).max(initial=0.0) > MAX_COORDINATE:
            value = PenPicture()
        self._value = value
        self._refresh()

    def set_chosen(self, led: int) -> None:
        """Pick out another LED."""
        if led != self._chosen:
            self._chosen = led
            self.update()

    def place_of(self, led: int) -> QPointF:
        """Return the position of the LED of a number."""
        pen = self._value.pen
        if pen is None:
            raise ValueError("`place_of` needs a pen.")
        return self._sight(pen).places(pen.leds[led - 1])[0]

    @override
    def sizeHint(self) -> QSize:
        return QSize(40 * GRID, 40 * GRID)

    @override
    def minimumSizeHint(self) -> QSize:
        return QSize(22 * GRID, 22 * GRID)

    @override
    def keyPressEvent(self, event: QKeyEvent) -> None:
        turns = {
            Qt.Key.Key_Left: (-KEY_STEP, 0.0),
            Qt.Key.Key_Right: (KEY_STEP, 0.0),
            Qt.Key.Key_Up: (0.0, -KEY_STEP),
            Qt.Key.Key_Down: (0.0, KEY_STEP),
        }
        key = Qt.Key(event.key())
        if key in turns:
            self._turn(*turns[key])
        elif key == Qt.Key.Key_0:
            self._yaw, self._pitch = START_YAW, START_PITCH
            self.update()
        else:
            super().keyPressEvent(event)

    @override
    def mousePressEvent(self, event: QMouseEvent) -> None:
        self._pressed = self._dragged = event.position()

    @override
    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self._pressed is not None:
            moved = event.position() - self._dragged
            self._dragged = event.position()
            self._turn(DRAG_STEP * moved.x(), DRAG_STEP * moved.y())

    @override
    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        pressed, self._pressed = self._pressed, None
        pen = self._value.pen
        if pressed is None or pen is None:
            return
        if (event.position() - pressed).manhattanLength() > CLICK_SLACK:
            return
        places = self._sight(pen).places(pen.leds)
        gaps = [_gap(place, pressed) for place in places]
        nearest = int(np.argmin(gaps))
        if gaps[nearest] < CLICK_REACH:
            self.led_chosen.emit(nearest + 1)

    @override
    def paintEvent(self, event: QPaintEvent) -> None:
        with QPainter(self) as painter:
            self._draw(painter, colors_of(self.palette()))

    def _draw(self, painter: QPainter, colors: Colors) -> None:
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        focused = self.hasFocus()
        edge = QPen(
            QColor(colors.accent if focused else colors.line), 2 if focused else 1
        )
        painter.setPen(edge)
        painter.setBrush(QColor(colors.window))
        painter.drawRoundedRect(QRectF(self.rect()).adjusted(1, 1, -1, -1), 6, 6)
        pen = self._value.pen
        if pen is None:
            painter.setPen(QColor(colors.muted))
            painter.setFont(font(TextSize.BODY))
            box = self.rect().adjusted(MARGIN, MARGIN, -MARGIN, -MARGIN)
            flags = int(Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap)
            painter.drawText(box, flags, self.tr("LED layout"))
            return
        sight = self._sight(pen)
        self._draw_axes(painter, sight, colors)
        if self._value.tip is not None:
            self._draw_tip(painter, sight, self._value.tip, colors)
        places = sight.places(pen.leds)
        order = np.argsort(pen.leds @ sight.turn[2], kind="stable").tolist()
        for row in order:
            self._draw_led(painter, sight, pen, row, colors)
        offset = sight.scale * pen.diameter / 2 + LABEL_GAP
        axes = np.vstack([np.zeros(3), *(share * np.eye(3) for share in (0.5, 1.0))])
        on_axes = sight.places(AXIS_SHARE * sight.radius * axes)
        for row in order:
            others = [*places[:row], *places[row + 1 :], *on_axes]
            self._draw_number(painter, places[row], others, row, offset, colors)

    def _draw_axes(self, painter: QPainter, sight: _Projection, colors: Colors) -> None:
        """Draw the axes at the origin, or in the corner if that is far away."""
        painter.setFont(font(TextSize.SMALL, bold=True))
        start = np.zeros(3) if sight.shows_origin else sight.center
        ends = AXIS_SHARE * sight.radius * np.eye(3)
        places = sight.places(start + np.vstack([np.zeros(3), ends, 1.35 * ends]))
        if not sight.shows_origin:
            corner = QPointF(6 * GRID, self.height() - 6 * GRID)
            places = [place - sight.middle + corner for place in places]
        color = colors.tone(Tone.ACTIVE)
        for name, end, beyond in zip("xyz", places[1:4], places[4:], strict=True):
            painter.setPen(QPen(color, 2))
            painter.drawLine(places[0], end)
            painter.drawText(_box(beyond), Qt.AlignmentFlag.AlignCenter, name)

    def _draw_tip(
        self, painter: QPainter, sight: _Projection, tip: FloatArray, colors: Colors
    ) -> None:
        place = sight.places(tip)[0]
        painter.setPen(QPen(QColor(colors.text), 2))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawEllipse(place, 4, 4)
        for arm in (QPointF(9, 0), QPointF(0, 9)):
            painter.drawLine(place - arm, place + arm)
        painter.setFont(font(TextSize.SMALL))
        box = _box(place + QPointF(2 * GRID, 0), aside=True)
        painter.drawText(box, Qt.AlignmentFlag.AlignVCenter, self.tr("tip"))

    def _draw_led(
        self, painter: QPainter, sight: _Projection, pen: Pen, row: int, colors: Colors
    ) -> None:
        led, normal = pen.leds[row], pen.normals[row]
        tone = self._tone(row)
        color = colors.tone(tone)
        place = sight.places(led)[0]
        rim = sight.places(_rim(led, normal, max(pen.diameter / 2, self._least(sight))))
        painter.setPen(QPen(color, 1.5))
        faces = float(normal @ sight.turn[2]) > 0
        painter.setBrush(color if faces else Qt.BrushStyle.NoBrush)
        painter.drawPolygon(QPolygonF(rim))
        if tone is not Tone.PLAIN:
            painter.setBrush(Qt.BrushStyle.NoBrush)
            dashed = tone is Tone.WARN
            style = Qt.PenStyle.DashLine if dashed else Qt.PenStyle.SolidLine
            painter.setPen(QPen(colors.tone(tone), 2, style))
            reach = sight.scale * pen.diameter / 2 + 6
            painter.drawEllipse(place, reach, reach)

    def _draw_number(
        self,
        painter: QPainter,
        place: QPointF,
        others: list[QPointF],
        row: int,
        offset: float,
        colors: Colors,
    ) -> None:
        """Draw the number of an LED on the side that is farther from all others."""
        sides = [place + QPointF(side * offset, 0) for side in (1, -1)]
        free = [min(_gap(side, other) for other in others) for side in sides]
        tone = self._tone(row)
        painter.setFont(font(TextSize.SMALL, bold=tone is not Tone.PLAIN))
        painter.setPen(colors.tone(tone))
        side = sides[0] if free[0] >= free[1] else sides[1]
        painter.drawText(_box(side), Qt.AlignmentFlag.AlignCenter, str(row + 1))

    def _tone(self, row: int) -> Tone:
        if row + 1 in self._value.marked:
            return Tone.WARN
        return Tone.ACTIVE if row + 1 == self._chosen else Tone.PLAIN

    def _least(self, sight: _Projection) -> float:
        return LEAST_RADIUS / sight.scale

    def _sight(self, pen: Pen) -> _Projection:
        every = pen.leds
        extent = float(np.ptp(pen.leds, axis=0).max())
        shows_origin = float(np.abs(pen.leds).min(axis=0).max()) < extent
        for point in (np.zeros(3) if shows_origin else None, self._value.tip):
            if point is not None:
                every = np.vstack([every, point])
        center = (every.min(axis=0) + every.max(axis=0)) / 2
        off = every - center
        radius = max(float(np.linalg.norm(off, axis=1).max()), 1.0)
        aside = float(np.hypot(off[:, 0], off[:, 2]).max()) + pen.diameter
        width, height = self.width() - 2 * MARGIN, self.height() - 2 * MARGIN
        scale = min(width / 2 / aside, height / 2 / radius)
        middle = QPointF(self.width() / 2, self.height() / 2)
        turn = _turn_matrix(self._yaw, self._pitch)
        return _Projection(turn, center, radius, max(scale, 0.01), middle, shows_origin)

    def _turn(self, yaw: float, pitch: float) -> None:
        self._yaw = math.remainder(self._yaw + yaw, 2 * math.pi)
        self._pitch = min(max(self._pitch + pitch, -MAX_PITCH), MAX_PITCH)
        self.update()

    @override
    def _refresh(self) -> None:
        self.update()
        pen = self._value.pen
        n_leds = 0 if pen is None else pen.n_leds
        self.setAccessibleDescription(self.tr("{0} LEDs").format(n_leds))
        set_tooltip(
            self, self.tr("Drag or press the arrow keys to rotate, 0 to reset.")
        )


def _turn_matrix(yaw: float, pitch: float) -> FloatArray:
    """Return the rotation to right, up and viewer: about y, then about the right."""
    cy, sy, cp, sp = math.cos(yaw), math.sin(yaw), math.cos(pitch), math.sin(pitch)
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_right = np.array([[1, 0, 0], [0, cp, -sp], [0, sp, cp]])
    return np.asarray(about_right @ about_y)


def _rim(center: FloatArray, normal: FloatArray, radius: float) -> FloatArray:
    """Return points (N_CORNERS, 3) on the rim of a disc."""
    helper = np.eye(3)[int(np.argmin(np.abs(normal)))]
    u = np.cross(normal, helper)
    u /= np.linalg.norm(u)
    v = np.cross(normal, u)
    around = np.cos(ROUND)[:, None] * u + np.sin(ROUND)[:, None] * v
    return np.asarray(center + radius * around)


def _gap(one: QPointF, other: QPointF) -> float:
    return math.hypot(one.x() - other.x(), one.y() - other.y())


def _box(place: QPointF, *, aside: bool = False) -> QRectF:
    """Return the box of a short text in the middle of a place, or beginning there."""
    left = place.x() if aside else place.x() - 2 * GRID
    return QRectF(left, place.y() - GRID, (12 if aside else 4) * GRID, 2 * GRID)
