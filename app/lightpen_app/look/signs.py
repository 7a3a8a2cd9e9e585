"""Symbols for states, distinguished by shape and drawn without a font."""

from enum import Enum, auto
from functools import lru_cache

from PySide6.QtCore import QByteArray, QPointF, QRectF, Qt
from PySide6.QtGui import (
    QColor,
    QIcon,
    QPainter,
    QPainterPath,
    QPen,
    QPixmap,
    QPolygonF,
)
from PySide6.QtSvg import QSvgRenderer
from PySide6.QtWidgets import QApplication, QWidget

from lightpen_app.look.theme import GRID, Tone, colors_of


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


SIDE = 2 * GRID  # px, of an icon
# Paths of SVG about the middle of a square of 24, as lines or filled.
_LINES = {
    Sign.CHECK: "M-8,0.5 L-2.5,6 L8,-6",
    Sign.CROSS: "M-6.5,-6.5 L6.5,6.5 M6.5,-6.5 L-6.5,6.5",
    Sign.WARNING: "M0,-9 L10,8.5 L-10,8.5 Z M0,-2.5 V2.2 M0,5.4 V5.5",
    Sign.EYE: "M-10,0 C-5,-8.5 5,-8.5 10,0 C5,8.5 -5,8.5 -10,0 "
    "M-2.2,0 a2.2,2.2 0 1 0 4.4,0 a2.2,2.2 0 1 0 -4.4,0",
    Sign.WAIT: "M-9.5,0 a9.5,9.5 0 1 0 19,0 a9.5,9.5 0 1 0 -19,0 M0,-5 V0 L4,2.6",
    Sign.RING: "M-6.5,0 a6.5,6.5 0 1 0 13,0 a6.5,6.5 0 1 0 -13,0",
}
_SOLIDS = {
    Sign.PLAY: "M-6.5,-9 L9,0 L-6.5,9 Z",
    Sign.PAUSE: "M-8,-9 h5.6 v18 h-5.6 z M2.4,-9 h5.6 v18 h-5.6 z",
    Sign.RECORD: "M-8.5,0 a8.5,8.5 0 1 0 17,0 a8.5,8.5 0 1 0 -17,0",
    Sign.LOCK: "M-7.5,-2 h15 v11.5 h-15 z "
    "M-5.5,-1 v-3.5 a5.5,5.5 0 0 1 11,0 v3.5 h-2.5 v-3.5 a3,3 0 0 0 -6,0 v3.5 z",
}
_SVG = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="-12 -12 24 24">'
    '<path d="{}" {} stroke-linecap="round" stroke-linejoin="round"/></svg>'
)


def draw_sign(painter: QPainter, box: QRectF, sign: Sign, color: QColor) -> None:
    """Draw a sign as large as the smaller side of a box allows, in its middle."""
    if sign in _LINES:
        look = f'fill="none" stroke-width="3" stroke="{color.name()}"'
        draw_svg(painter, box, _SVG.format(_LINES[sign], look))
    elif sign in _SOLIDS:
        look = f'fill="{color.name()}"'
        draw_svg(painter, box, _SVG.format(_SOLIDS[sign], look))


def draw_svg(painter: QPainter, box: QRectF, svg: str) -> None:
    """Draw a picture in the middle of a box, as large as it fits."""
    if not box.isEmpty():
        painter.save()
        _renderer(svg).render(painter, box)
        painter.restore()


@lru_cache(maxsize=64)  # the same are drawn again with every image
def _renderer(svg: str) -> QSvgRenderer:
    renderer = QSvgRenderer(QByteArray(svg.encode()))
    renderer.setAspectRatioMode(Qt.AspectRatioMode.KeepAspectRatio)
    return renderer


def sign_icon(widget: QWidget, sign: Sign, tone: Tone) -> QIcon:
    """Return a sign as an icon for a widget.

    In the colours of the application, which a theme sets first: a style sheet reaches
    the widgets in no certain order.
    """
    scale = widget.devicePixelRatioF()
    picture = QPixmap(round(SIDE * scale), round(SIDE * scale))
    picture.setDevicePixelRatio(scale)
    picture.fill(Qt.GlobalColor.transparent)
    color = colors_of(QApplication.palette()).tone(tone)
    with QPainter(picture) as painter:
        draw_sign(painter, QRectF(0, 0, SIDE, SIDE), sign, color)
    return QIcon(picture)


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
    aside = QPointF(-ahead.y(), ahead.x()) * width
    neck = end - ahead * min(1.8 * width, length)
    shaft = (start + aside / 2, neck + aside / 2, neck + aside * 1.25, end)
    other = (neck - aside * 1.25, neck - aside / 2, start - aside / 2)
    path = QPainterPath()
    path.addPolygon(QPolygonF([*shaft, *other]))
    path.closeSubpath()
    return path
