"""Symbols for states, distinguished by shape and drawn without a font."""

from enum import Enum, auto

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPainterPath, QPen, QPolygonF


class Sign(Enum):
    """Symbol to draw."""

    NONE = auto()
    CHECK = auto()
    CROSS = auto()
    WARNING = auto()
    PLAY = auto()
    PAUSE = auto()
    RECORD = auto()
    WAIT = auto()
    EYE = auto()
    LOCK = auto()
    RING = auto()


def draw_sign(painter: QPainter, box: QRectF, sign: Sign, color: QColor) -> None:
    """Draw a sign as large as the smaller side of a box allows, in its middle."""
    side = min(box.width(), box.height())
    if sign is Sign.NONE or side <= 0:
        return
    painter.save()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.translate(box.center())
    painter.scale(side / 24, side / 24)
    if sign in _OUTLINES:
        painter.setPen(_pen(color, 3))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawPath(_OUTLINES[sign]())
    else:
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(color)
        painter.drawPath(_SOLIDS[sign]())
    painter.restore()


def draw_arrow(
    painter: QPainter,
    start: QPointF,
    end: QPointF,
    width: float,
    color: QColor,
    halo: QColor,
) -> None:
    """Draw an arrow with a halo that separates it from the background."""
    path = _arrow(start, end, width)
    painter.setPen(
        QPen(
            halo,
            width / 2,
            Qt.PenStyle.SolidLine,
            Qt.PenCapStyle.RoundCap,
            Qt.PenJoinStyle.RoundJoin,
        )
    )
    painter.setBrush(color)
    painter.drawPath(path)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.drawPath(path)


def _arrow(start: QPointF, end: QPointF, width: float) -> QPainterPath:
    along = end - start
    length = max((along.x() ** 2 + along.y() ** 2) ** 0.5, 1e-6)
    ahead = along / length
    aside = QPointF(-ahead.y(), ahead.x())
    neck = end - ahead * min(1.8 * width, length)
    path = QPainterPath()
    path.addPolygon(
        QPolygonF(
            [
                start + aside * width / 2,
                neck + aside * width / 2,
                neck + aside * width * 1.25,
                end,
                neck - aside * width * 1.25,
                neck - aside * width / 2,
                start - aside * width / 2,
            ]
        )
    )
    path.closeSubpath()
    return path


def _pen(color: QColor, width: float) -> QPen:
    return QPen(
        color,
        width,
        Qt.PenStyle.SolidLine,
        Qt.PenCapStyle.RoundCap,
        Qt.PenJoinStyle.RoundJoin,
    )


def _lines(*strokes: tuple[tuple[float, float], ...]) -> QPainterPath:
    path = QPainterPath()
    for first, *others in strokes:
        path.moveTo(*first)
        for point in others:
            path.lineTo(*point)
    return path


def _check() -> QPainterPath:
    return _lines(((-8, 0.5), (-2.5, 6), (8, -6)))


def _cross() -> QPainterPath:
    return _lines(((-6.5, -6.5), (6.5, 6.5)), ((6.5, -6.5), (-6.5, 6.5)))


def _warning() -> QPainterPath:
    path = _lines(((0, -9), (10, 8.5), (-10, 8.5), (0, -9), (10, 8.5)))
    path.addPath(_lines(((0, -2.5), (0, 2.2)), ((0, 5.4), (0, 5.5))))
    return path


def _eye() -> QPainterPath:
    path = QPainterPath(QPointF(-10, 0))
    path.cubicTo(-5, -8.5, 5, -8.5, 10, 0)
    path.cubicTo(5, 8.5, -5, 8.5, -10, 0)
    path.addEllipse(QPointF(0, 0), 2.2, 2.2)
    return path


def _wait() -> QPainterPath:
    path = QPainterPath()
    path.addEllipse(QPointF(0, 0), 9.5, 9.5)
    path.addPath(_lines(((0, -5), (0, 0), (4, 2.6))))
    return path


def _ring() -> QPainterPath:
    path = QPainterPath()
    path.addEllipse(QPointF(0, 0), 6.5, 6.5)
    return path


def _play() -> QPainterPath:
    path = _lines(((-6.5, -9), (9, 0), (-6.5, 9)))
    path.closeSubpath()
    return path


def _pause() -> QPainterPath:
    path = QPainterPath()
    path.addRoundedRect(QRectF(-8, -9, 5.6, 18), 1, 1)
    path.addRoundedRect(QRectF(2.4, -9, 5.6, 18), 1, 1)
    return path


def _record() -> QPainterPath:
    path = QPainterPath()
    path.addEllipse(QPointF(0, 0), 8.5, 8.5)
    return path


def _lock() -> QPainterPath:
    path = QPainterPath()
    path.addRoundedRect(QRectF(-7.5, -2, 15, 11.5), 2, 2)
    shackle = QPainterPath(QPointF(-5.5, -1))
    shackle.lineTo(-5.5, -4.5)
    shackle.arcTo(QRectF(-5.5, -10, 11, 11), 180, -180)
    shackle.lineTo(5.5, -1)
    shackle.lineTo(3, -1)
    shackle.lineTo(3, -4.5)
    shackle.arcTo(QRectF(-3, -7.5, 6, 6), 0, 180)
    shackle.lineTo(-3, -1)
    shackle.closeSubpath()
    path.addPath(shackle)
    path.setFillRule(Qt.FillRule.WindingFill)
    return path


_OUTLINES = {
    Sign.CHECK: _check,
    Sign.CROSS: _cross,
    Sign.WARNING: _warning,
    Sign.EYE: _eye,
    Sign.WAIT: _wait,
    Sign.RING: _ring,
}
_SOLIDS = {Sign.PLAY: _play, Sign.PAUSE: _pause, Sign.RECORD: _record, Sign.LOCK: _lock}
