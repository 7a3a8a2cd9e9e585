"""A ring that fills by angle as it is probed."""

import math
from dataclasses import dataclass

from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy, QWidget
from typing_extensions import override

from lightpen_app.look.theme import GRID, TextSize, colors_of, font
from lightpen_app.widgets.fitted_text import fitted_size
from lightpen_app.widgets.translated import Translated

RING_SHARE = 0.42  # of the side, from the middle to the ring
BAND = 0.09  # of the side: how wide the ring is drawn
DOT = 0.028  # of the side
INNER = 0.5  # of the side, for the words in the middle
TURN = 16 * 360  # of a circle, as Qt counts


@dataclass(frozen=True)
class RingValue:
    """Touches of a ring."""

    # Of the touches: from the right against the clock as the camera sees them, rad.
    angles: tuple[float, ...] = ()
    # Degrees: all but the largest gap, and how much of it is requested.
    covered: float = 0.0
    needed: float = 270.0

    @property
    def start(self) -> float:
        """Start of the covered angle, after the largest gap, rad."""
        ordered = sorted(angle % (2 * math.pi) for angle in self.angles)
        if not ordered:
            return 0.0
        next_ones = [*ordered[1:], ordered[0] + 2 * math.pi]
        gaps = [b - a for a, b in zip(ordered, next_ones, strict=True)]
        widest = gaps.index(max(gaps))
        return ordered[(widest + 1) % len(ordered)]


class RingView(Translated, QWidget):
    """Draws probed points on a ring and the covered angle."""

    def __init__(self) -> None:
        super().__init__()
        self._value = RingValue()
        policy = QSizePolicy.Policy.Expanding
        self.setSizePolicy(policy, policy)
        self._retranslate()

    def set_value(self, value: RingValue) -> None:
        """Show other touches."""
        if value != self._value:
            self._value = value
            self._retranslate()
            self.update()

    @override
    def sizeHint(self) -> QSize:
        return QSize(38 * GRID, 38 * GRID)

    @override
    def minimumSizeHint(self) -> QSize:
        return QSize(20 * GRID, 20 * GRID)

    @override
    def paintEvent(self, event: QPaintEvent) -> None:
        colors = colors_of(self.palette())
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        side = min(self.width(), self.height())
        middle = QPointF(self.width() / 2, self.height() / 2)
        radius = RING_SHARE * side
        ring = QRectF(middle.x() - radius, middle.y() - radius, 2 * radius, 2 * radius)
        band = QPen(QColor(colors.raised), BAND * side)
        band.setCapStyle(Qt.PenCapStyle.FlatCap)
        painter.setPen(band)
        painter.drawEllipse(ring)
        is_enough = self._value.covered >= self._value.needed
        if self._value.covered > 0:
            band.setColor(QColor(colors.good if is_enough else colors.partial))
            painter.setPen(band)
            start = round(TURN * self._value.start / (2 * math.pi))
            painter.drawArc(ring, start, round(TURN * self._value.covered / 360))
        painter.setPen(QPen(QColor(colors.window), 2))
        painter.setBrush(QColor(colors.text))
        for angle in self._value.angles:
            across, up = math.cos(angle), math.sin(angle)
            place = middle + QPointF(radius * across, -radius * up)
            painter.drawEllipse(place, DOT * side, DOT * side)
        self._draw_words(painter, middle, INNER * side)

    def _draw_words(self, painter: QPainter, middle: QPointF, side: float) -> None:
        colors = colors_of(self.palette())
        box = QRectF(middle.x() - side / 2, middle.y() - side / 2, side, 0.6 * side)
        flags = int(Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextSingleLine)
        words = f"{math.floor(self._value.covered)}\N{DEGREE SIGN}"
        size = fitted_size(words, box, TextSize.HUGE, bold=True, flags=flags)
        painter.setPen(QColor(colors.text))
        painter.setFont(font(size, bold=True))
        painter.drawText(box, flags, words)
        below = QRectF(box.left(), box.bottom(), side, 0.3 * side)
        words = self.tr("of {0}\xb0").format(round(self._value.needed))
        size = fitted_size(words, below, TextSize.TITLE, bold=False, flags=flags)
        painter.setPen(QColor(colors.muted))
        painter.setFont(font(size))
        painter.drawText(below, flags, words)

    @override
    def _retranslate(self) -> None:
        words = self.tr("Ring: {0} of {1} degrees, points: {2}")
        self.setAccessibleName(
            words.format(
                math.floor(self._value.covered),
                round(self._value.needed),
                len(self._value.angles),
            )
        )
