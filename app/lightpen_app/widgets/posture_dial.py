"""The postures of a swing, seen from above, and the next one."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPainterPath, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy, QWidget
from typing_extensions import override

from lightpen.arrays import IntArray
from lightpen.model.coverage import N_DIRECTIONS, TILT_RINGS
from lightpen.model.rigid import Posture
from lightpen_app.look.signs import Sign, draw_arrow, draw_sign
from lightpen_app.look.theme import Colors, TextSize, colors_of, font
from lightpen_app.look.words import set_tooltip
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.fitting import fitted_size

MAX_TILT = math.radians(36)  # drawn at the rim
TILTS = (0.0, *TILT_RINGS, MAX_TILT)
MAX_TURN = math.radians(75)  # drawn at the ends of the bar
GAP = math.radians(1.6)  # half the gap between sectors
RING_EDGES = (0.24, 0.62, 1.0)  # of upright, leaning, leaning far; rim = 1
RIM_SHARE = 0.435  # of the side, from the middle to the rim
BAR_SHARE = 0.12  # of the side, for the bar of the turn
LEAST_BAR = 2.8  # of the least letters
NUMBER_SHARE = 0.19  # of the rim, for letters
CAMERA_DISTANCE = 1.085  # from the middle of the dial; rim = 1
NUMBERS = 1.4  # times the least letters, where they fit
SECTOR = 2 * math.pi / N_DIRECTIONS


def _zeros() -> IntArray:
    return np.zeros((2, N_DIRECTIONS), dtype=np.int64)


@dataclass(frozen=True, eq=False)
class DialValue:
    """Content of a dial."""

    # (2, 8), images kept and wanted, leaning and leaning far, by direction
    counts: IntArray = field(default_factory=_zeros)
    needed: IntArray = field(default_factory=_zeros)
    n_upright: int = 0  # the same for the upright pen
    n_upright_needed: int = 0
    posture: Posture | None = None  # of the pen at present
    target: Posture | None = None  # of the next image
    turns: tuple[float, float] | None = None  # least and greatest turn kept, rad
    turns_needed: tuple[float, float] | None = None  # required turns, rad
    # By how much the drawing is turned, counter-clockwise, so that the operator finds
    # left and right as his own: 0 behind the camera, pi facing it; rad.
    heading: float = 0.0

    @property
    def n_fields(self) -> int:
        """Number of fields in which images are required."""
        return int(np.sum(self.needed > 0)) + (self.n_upright_needed > 0)

    @property
    def n_full(self) -> int:
        """Of these, the fields that have all."""
        full = (self.needed > 0) & (self.counts >= self.needed)
        upright = 0 < self.n_upright_needed <= self.n_upright
        return int(np.sum(full)) + upright


@dataclass(frozen=True)
class _Field:
    """One field of the dial: its ring (0 upright) and its sector."""

    ring: int
    sector: int


def field_of(posture: Posture) -> tuple[int, int]:
    """Return ring (0 upright, 2 leaning far) and sector of a posture."""
    ring = int(np.digitize(posture.tilt, TILT_RINGS))
    sector = round(posture.direction / SECTOR) % N_DIRECTIONS if ring else 0
    return ring, sector


def place_of(posture: Posture, heading: float) -> tuple[float, float]:
    """Return the position of a posture: right and up of the centre, rim = 1."""
    radius = float(np.interp(posture.tilt, TILTS, (0.0, *RING_EDGES)))
    angle = posture.direction + heading
    return radius * math.cos(angle), radius * math.sin(angle)


class PostureDial(Translated, QWidget):
    """Two rings of eight directions, a middle, and a bar for the turn."""

    def __init__(self) -> None:
        super().__init__()
        self._value = DialValue()
        self._least_letters: float = TextSize.SMALL
        policy = QSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        policy.setHeightForWidth(True)
        self.setSizePolicy(policy)
        self._describe()

    def value(self) -> DialValue:
        """Return the value."""
        return self._value

    def set_value(self, value: DialValue) -> None:
        """Show other postures."""
        self._value = value
        self._describe()

    def set_least_letters(self, size: float) -> None:
        """Set the least font size of the legends, px."""
        self._least_letters = size
        self.updateGeometry()
        self.update()

    @override
    def sizeHint(self) -> QSize:
        return QSize(480, self.heightForWidth(480))

    @override
    def minimumSizeHint(self) -> QSize:
        return QSize(176, round(176 + LEAST_BAR * TextSize.SMALL))

    @override
    def heightForWidth(self, width: int) -> int:
        return round(width + self._bar_height(width))

    @override
    def _refresh(self) -> None:
        self._describe()

    def _describe(self) -> None:
        self.update()
        self.setAccessibleName(self.tr("Postures"))
        set_tooltip(self, self.tr("Images needed in each posture, seen from above"))
        text = self.tr("{0} of {1} postures complete")
        self.setAccessibleDescription(
            text.format(self._value.n_full, self._value.n_fields)
        )

    @override
    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        colors = colors_of(self.palette())
        middle, rim, bar = self._places()
        self._draw_camera(painter, middle, rim, QColor(colors.muted))
        for place in _fields():
            self._draw_field(painter, middle, rim, place, colors)
        target = self._value.target
        marked = _Field(*field_of(target)) if target else None
        if marked:
            outline = _outline(middle, rim, marked, self._value.heading)
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.setPen(QPen(QColor(colors.pointer), 0.02 * rim + 2))
            painter.drawPath(outline)
        self._draw_posture(painter, middle, rim, colors)
        self._draw_turn(painter, bar, colors)
        if self.hasFocus():
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.setPen(QPen(QColor(colors.accent), 2))
            painter.drawEllipse(middle, 1.02 * rim, 1.02 * rim)

    def _draw_camera(
        self, painter: QPainter, middle: QPointF, rim: float, color: QColor
    ) -> None:
        """Draw a camera outside the rim that faces the dial."""
        body = 0.055 * rim
        painter.save()
        painter.translate(middle)
        painter.rotate(math.degrees(-self._value.heading))
        painter.translate(0, CAMERA_DISTANCE * rim)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(color)
        case = QRectF(-1.5 * body, -0.5 * body, 3 * body, 1.6 * body)
        painter.drawRoundedRect(case, 3, 3)
        painter.drawRect(QRectF(-0.6 * body, -1.1 * body, 1.2 * body, 0.7 * body))
        painter.restore()

    def _places(self) -> tuple[QPointF, float, QRectF]:
        """Return the middle of the dial, its radius, and the bar of the turn, px."""
        width, height = self.width(), self.height()
        side = max(
            min(width, height / (1 + BAR_SHARE), height - self._bar_height(0.0)), 0.0
        )
        bar_height = self._bar_height(side)
        left = (width - side) / 2
        top = (height - side - bar_height) / 2
        middle = QPointF(left + side / 2, top + side / 2)
        rim = RIM_SHARE * side
        bar = QRectF(middle.x() - rim, top + side, 2 * rim, bar_height)
        return middle, rim, bar

    def _bar_height(self, side: float) -> float:
        """Return the height of the bar of the turn below a dial, px."""
        return max(BAR_SHARE * side, LEAST_BAR * self._least_letters)

    def _images(self, place: _Field) -> tuple[int, int]:
        value = self._value
        if place.ring == 0:
            return value.n_upright, value.n_upright_needed
        index = place.ring - 1, place.sector
        return int(value.counts[index]), int(value.needed[index])

    def _draw_field(
        self,
        painter: QPainter,
        middle: QPointF,
        rim: float,
        place: _Field,
        colors: Colors,
    ) -> None:
        kept, needed = self._images(place)
        done = kept >= needed > 0
        outline = _outline(middle, rim, place, self._value.heading)
        painter.setPen(QPen(QColor(colors.line), 1))
        painter.setBrush(QColor(colors.good if done else colors.raised))
        painter.drawPath(outline)
        if 0 < kept < needed:
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(colors.partial))
            share = kept / needed
            filled = _outline(middle, rim, place, self._value.heading, share)
            painter.drawPath(filled)
        x, y = _center(place, self._value.heading)
        center = middle + QPointF(x, -y) * rim
        size = (0.13 if place.ring else 0.15) * rim
        size = max(size, min(NUMBERS * self._least_letters, NUMBER_SHARE * rim))
        box = QRectF(center.x() - size, center.y() - size, 2 * size, 2 * size)
        if done:
            inset = 0.45 * size
            sign_box = box.adjusted(inset, inset, -inset, -inset)
            draw_sign(painter, sign_box, Sign.CHECK, QColor(colors.on_good))
        elif needed > 0:
            painter.setPen(QColor(colors.text))
            painter.setFont(font(size, bold=True))
            center_flag = Qt.AlignmentFlag.AlignCenter
            painter.drawText(box, center_flag, str(needed - kept))

    def _draw_posture(
        self, painter: QPainter, middle: QPointF, rim: float, colors: Colors
    ) -> None:
        value = self._value
        if value.posture is None:
            return
        x, y = place_of(value.posture, value.heading)
        here = middle + QPointF(x, -y) * rim
        halo = QColor(colors.window)
        if value.target is not None:
            x, y = place_of(value.target, value.heading)
            way = middle + QPointF(x, -y) * rim - here
            length = math.hypot(way.x(), way.y())
            if length > 0.3 * rim:
                # It ends before the number of the field to which it points.
                there = here + way * (1 - 0.14 * rim / length)
                width = 0.055 * rim
                draw_arrow(painter, here, there, width, QColor(colors.pointer), halo)
        painter.setPen(QPen(halo, 0.03 * rim))
        painter.setBrush(QColor(colors.text))
        painter.drawEllipse(here, 0.06 * rim, 0.06 * rim)

    def _draw_turn(self, painter: QPainter, box: QRectF, colors: Colors) -> None:
        value = self._value
        if value.turns is None and value.turns_needed is None:
            return
        size = max(0.24 * box.height(), self._least_letters)
        x_of = partial(_turn_x, box)
        line = QRectF(0, box.top() + 0.12 * box.height(), 0, 0.26 * box.height())
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(colors.raised))
        track = QRectF(box.left(), line.top(), box.width(), line.height())
        painter.drawRoundedRect(track, line.height() / 2, line.height() / 2)
        done = _reaches(value.turns, value.turns_needed)
        if value.turns is not None:
            low, high = map(x_of, value.turns)
            painter.setBrush(QColor(colors.good if done else colors.partial))
            kept = QRectF(low, line.top(), max(high - low, 2), line.height())
            painter.drawRoundedRect(kept, line.height() / 2, line.height() / 2)
        painter.setPen(QPen(QColor(colors.text), 2))
        for turn in value.turns_needed or ():
            top = QPointF(x_of(turn), line.top() - 0.06 * box.height())
            painter.drawLine(top, top + QPointF(0, 0.38 * box.height()))
        self._draw_turn_aim(painter, track, x_of, colors)
        words = self.tr("turn about the pen's own axis")
        painter.setPen(QColor(colors.muted))
        below = QRectF(0, line.bottom() + 0.1 * box.height(), self.width(), 2 * size)
        painter.setFont(font(fitted_size(words, below, size, bold=False)))
        flags = Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignTop
        painter.drawText(below, flags, words)

    def _draw_turn_aim(
        self, painter: QPainter, track: QRectF, x_of: "partial[float]", colors: Colors
    ) -> None:
        value = self._value
        if value.posture is None:
            return
        halo = QColor(colors.window)
        here = QPointF(x_of(value.posture.turn), track.center().y())
        if value.target is not None:
            there = QPointF(x_of(value.target.turn), track.center().y())
            if abs(there.x() - here.x()) > 1.2 * track.height():
                width = 0.4 * track.height()
                draw_arrow(painter, here, there, width, QColor(colors.pointer), halo)
        painter.setPen(QPen(halo, 0.2 * track.height()))
        painter.setBrush(QColor(colors.text))
        painter.drawEllipse(here, 0.55 * track.height(), 0.55 * track.height())


def _fields() -> Iterator[_Field]:
    yield _Field(0, 0)
    for ring in (1, 2):
        for sector in range(N_DIRECTIONS):
            yield _Field(ring, sector)


def _center(place: _Field, heading: float) -> tuple[float, float]:
    """Return the middle of a field, right and up of the dial's, rim = 1."""
    if place.ring == 0:
        return 0.0, 0.0
    radius = (RING_EDGES[place.ring - 1] + RING_EDGES[place.ring]) / 2
    angle = place.sector * SECTOR + heading
    return radius * math.cos(angle), radius * math.sin(angle)


def _outline(
    middle: QPointF, rim: float, place: _Field, heading: float, share: float = 1.0
) -> QPainterPath:
    """Return the border of the inner share of a field."""
    path = QPainterPath()
    gap = 0.012 * rim
    if place.ring == 0:
        radius = (RING_EDGES[0] * rim - gap) * math.sqrt(share)
        path.addEllipse(middle, radius, radius)
        return path
    inner = RING_EDGES[place.ring - 1] * rim + gap
    outer = inner + share * (RING_EDGES[place.ring] * rim - gap - inner)
    start = place.sector * SECTOR + heading - SECTOR / 2 + GAP
    span = math.degrees(SECTOR - 2 * GAP)
    first = math.degrees(start)
    path.arcMoveTo(_square(middle, inner), first)
    path.arcTo(_square(middle, outer), first, span)
    path.arcTo(_square(middle, inner), first + span, -span)
    path.closeSubpath()
    return path


def _square(middle: QPointF, radius: float) -> QRectF:
    return QRectF(middle.x() - radius, middle.y() - radius, 2 * radius, 2 * radius)


def _turn_x(box: QRectF, turn: float) -> float:
    """Return the position of a turn (rad) on the bar, px."""
    share = float(np.clip(turn / MAX_TURN, -1, 1))
    return box.center().x() + share * box.width() / 2


def _reaches(
    kept: tuple[float, float] | None, needed: tuple[float, float] | None
) -> bool:
    if kept is None or needed is None:
        return False
    return kept[0] <= needed[0] and kept[1] >= needed[1]
