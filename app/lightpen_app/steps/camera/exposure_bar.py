"""Exposure of the LEDs: too dark, good, or saturated."""

from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy, QWidget
from typing_extensions import override

from lightpen.detection.inspection import DARK_PEAK, Exposure
from lightpen.detection.spots import SATURATED_LEVEL
from lightpen_app.look.sentences import listed
from lightpen_app.look.signs import Sign, draw_sign
from lightpen_app.look.theme import GRID, TextSize, Tone, colors_of, font
from lightpen_app.look.tooltips import set_tooltip
from lightpen_app.widgets.translated import Translated

BAR_HEIGHT = 2 * GRID
MOST_NAMED = 6  # LEDs in one line


class ExposureBar(Translated, QWidget):
    """A scale with one tick per LED, and the verdict as text."""

    def __init__(self) -> None:
        super().__init__()
        self.say(self, self.tr("LED exposure"))
        self._value = Exposure()
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self._retranslate()

    def value(self) -> Exposure:
        """Return the value."""
        return self._value

    def set_value(self, value: Exposure) -> None:
        """Show another image's LEDs."""
        self._value = value
        self._retranslate()

    def verdict(self) -> str:
        """Return the text of the bar."""
        value = self._value
        if not value.peaks:
            return self.tr("No LED detected")
        of_leds = value.are_leds
        if value.n_saturated:
            n_meant, meant = value.n_saturated, value.saturated_leds
            words = (
                self.tr("Saturated: {0} of {1} LEDs")
                if of_leds
                else self.tr("Saturated: {0} of {1} spots")
            )
        elif value.n_dark:
            n_meant, meant = value.n_dark, value.dark_leds
            words = (
                self.tr("Too dark: {0} of {1} LEDs")
                if of_leds
                else self.tr("Too dark: {0} of {1} spots")
            )
        else:
            n_meant, meant = value.n_good, ()
            words = self.tr("OK: {0} LEDs") if of_leds else self.tr("OK: {0} spots")
        text = words.format(n_meant, len(value.peaks))
        if not meant or len(meant) == len(value.peaks):
            return text
        named = listed(map(str, meant[:MOST_NAMED]))
        more = "\u2026" if len(meant) > MOST_NAMED else ""
        return f"{text}: {named}{more}"

    def levels(self) -> str:
        """Return the level of each LED, as text."""
        value = self._value
        return "\n".join(
            self.tr("LED {0}: {1} %").format(led, f"{100 * peak:.0f}")
            for led, peak in zip(value.leds, value.peaks, strict=False)
        )

    @override
    def sizeHint(self) -> QSize:
        return QSize(320, 9 * GRID)

    @override
    def minimumSizeHint(self) -> QSize:
        return QSize(160, 9 * GRID)

    @override
    def paintEvent(self, event: QPaintEvent) -> None:
        value = self._value
        colors = colors_of(self.palette())
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        sign, tone = self._mark()
        head = QRectF(0, 0, self.width(), 3 * GRID)
        draw_sign(painter, QRectF(0, 4, 2 * GRID, 2 * GRID), sign, colors.tone(tone))
        painter.setPen(colors.tone(tone))
        painter.setFont(font(TextSize.BODY, bold=True))
        words = head.adjusted(3 * GRID, 0, 0, 0)
        painter.drawText(words, Qt.AlignmentFlag.AlignVCenter, self.verdict())

        bar = QRectF(1, 4 * GRID, self.width() - 2, BAR_HEIGHT)
        painter.setPen(QPen(QColor(colors.line), 1))
        painter.setBrush(QColor(colors.raised))
        painter.drawRect(bar)
        good = bar.adjusted(
            bar.width() * DARK_PEAK, 0, -bar.width() * (1 - SATURATED_LEVEL), 0
        )
        painter.setBrush(QColor(colors.partial))
        painter.drawRect(good)
        painter.setPen(QPen(QColor(colors.text), 2))
        for peak in value.peaks:
            x = bar.left() + bar.width() * min(max(peak, 0.0), 1.0)
            painter.drawLine(QPointF(x, bar.top() - 3), QPointF(x, bar.bottom() + 3))
        self._draw_scale(painter, bar, QColor(colors.muted))

    @override
    def _retranslate(self) -> None:
        self.update()
        self.setAccessibleDescription(self.verdict())
        set_tooltip(self, self.levels())

    def _draw_scale(self, painter: QPainter, bar: QRectF, color: QColor) -> None:
        painter.setPen(color)
        painter.setFont(font(TextSize.SMALL))
        top = bar.bottom() + 4
        height = self.height() - top
        whole = QRectF(bar.left(), top, bar.width(), height)
        good_left = whole.adjusted(bar.width() * DARK_PEAK, 0, 0, 0)
        left, right = Qt.AlignmentFlag.AlignLeft, Qt.AlignmentFlag.AlignRight
        painter.drawText(whole, left, self.tr("dark"))
        painter.drawText(good_left, left, self.tr("OK"))
        painter.drawText(whole, right, self.tr("saturated"))

    def _mark(self) -> tuple[Sign, Tone]:
        value = self._value
        if not value.peaks:
            return Sign.EYE, Tone.QUIET
        if value.n_saturated or value.n_dark:
            return Sign.WARNING, Tone.WARN
        return Sign.CHECK, Tone.GOOD
