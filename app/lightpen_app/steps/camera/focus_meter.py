"""Edge width of the LEDs as a large number, with the last seconds."""

from collections.abc import Sequence

import numpy as np
from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QSizePolicy, QWidget
from typing_extensions import override

from lightpen.detection.inspection import SHARP_EDGE, is_sharp
from lightpen_app.look.signs import Sign, draw_sign
from lightpen_app.look.theme import (
    CAP_HEIGHT,
    GRID,
    Colors,
    TextSize,
    Tone,
    colors_of,
    font,
)
from lightpen_app.widgets.translated import Translated

LEAST_TRACE = 5 * GRID  # px of width; less shows nothing
N_TRACED = 120  # images: six seconds
LEAST_TOP = 1.5 * SHARP_EDGE  # px, of the trace


class FocusMeter(Translated, QWidget):
    """Edge width, px: the smaller, the sharper."""

    def __init__(self) -> None:
        super().__init__()
        self.say(self, self.tr("Edge width of the LEDs"))
        self._value: tuple[float, ...] = ()
        self._is_saturated = False
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self._retranslate()

    def value(self) -> tuple[float, ...]:
        """Return the widths shown, px, the present one last."""
        return self._value

    def set_value(self, value: Sequence[float], *, is_saturated: bool = False) -> None:
        """Show other widths, px, the present one last; NaN where no LED was seen.

        Those of saturated LEDs are too narrow to tell anything of the focus.
        """
        self._value = tuple(value)[-N_TRACED:]
        self._is_saturated = is_saturated
        self._retranslate()

    def verdict(self) -> str:
        """Return the text."""
        if not np.isfinite(self._present):
            return self.tr("No LED detected")
        if self._is_saturated:
            return self.tr("Saturated")
        return (
            self.tr("In focus") if is_sharp(self._present) else self.tr("Out of focus")
        )

    def number(self) -> str:
        """Return the present edge width with its unit."""
        if not np.isfinite(self._present):
            return ""
        return self.tr("{0} px").format(f"{self._present:.1f}")

    @override
    def sizeHint(self) -> QSize:
        return QSize(240, 9 * GRID)

    @override
    def minimumSizeHint(self) -> QSize:
        return QSize(160, 9 * GRID)

    @override
    def paintEvent(self, event: QPaintEvent) -> None:
        colors = colors_of(self.palette())
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        sign, tone = self._mark()
        draw_sign(painter, QRectF(0, 4, 2 * GRID, 2 * GRID), sign, colors.tone(tone))
        painter.setPen(colors.tone(tone))
        painter.setFont(font(TextSize.BODY, bold=True))
        head = QRectF(3 * GRID, 0, self.width() - 3 * GRID, 3 * GRID)
        painter.drawText(head, Qt.AlignmentFlag.AlignVCenter, self.verdict())
        if not np.isfinite(self._value).any():
            return
        left = self._draw_number(painter, colors) + 2 * GRID
        box = QRectF(left, 3 * GRID + 4, self.width() - left, 5 * GRID)
        if box.width() >= LEAST_TRACE:
            self._draw_trace(painter, box, colors)

    @property
    def _present(self) -> float:
        return self._value[-1] if self._value else float("nan")

    def _mark(self) -> tuple[Sign, Tone]:
        if not np.isfinite(self._present):
            return Sign.EYE, Tone.QUIET
        if is_sharp(self._present) and not self._is_saturated:
            return Sign.CHECK, Tone.GOOD
        return Sign.WARNING, Tone.WARN

    def _draw_number(self, painter: QPainter, colors: Colors) -> float:
        """Draw the present edge width and return its right end."""
        baseline = self.height() - GRID
        digits, _, unit = self.number().partition(" ")
        painter.setPen(QColor(colors.text))
        painter.setFont(font(TextSize.DISPLAY, bold=True))
        painter.drawText(QPointF(0, baseline), digits)
        after = painter.fontMetrics().horizontalAdvance(digits) + GRID / 2
        painter.setPen(QColor(colors.muted))
        painter.setFont(font(TextSize.LEAD))
        painter.drawText(QPointF(after, baseline), unit)
        return after + painter.fontMetrics().horizontalAdvance(unit)

    def _draw_trace(self, painter: QPainter, box: QRectF, colors: Colors) -> None:
        widths = np.array(self._value)
        top = max(LEAST_TOP, float(np.nanmax(widths)))
        limit_y = box.bottom() - box.height() * SHARP_EDGE / top
        pen = QPen(QColor(colors.muted), 1, Qt.PenStyle.DashLine)
        painter.setPen(pen)
        painter.drawLine(QPointF(box.left(), limit_y), QPointF(box.right(), limit_y))
        painter.setFont(font(TextSize.SMALL))
        label = self.tr("limit {0}").format(f"{SHARP_EDGE:.1f}")
        width = painter.fontMetrics().horizontalAdvance(label)
        above = limit_y - 3
        if above - CAP_HEIGHT * TextSize.SMALL < box.top():
            above = limit_y + TextSize.SMALL + 2
        painter.drawText(QPointF(box.right() - width, above), label)
        ages = np.arange(len(widths))[::-1]
        x = box.right() - box.width() * ages / (N_TRACED - 1)
        y = box.bottom() - box.height() * widths / top
        painter.setPen(QPen(QColor(colors.accent), 1.5))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        shown = np.isfinite(widths)
        for run in np.split(np.arange(len(widths)), np.flatnonzero(~shown)):
            kept = run[shown[run]]
            line = [QPointF(x[i], y[i]) for i in kept]
            painter.drawPolyline(QPolygonF(line))

    @override
    def _retranslate(self) -> None:
        self.update()
        self.setAccessibleDescription(f"{self.verdict()} {self.number()}".strip())
