"""The list of checks or features, ticked off as they are done, each with its value."""

from dataclasses import dataclass
from math import isfinite

from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QFrame, QListWidget, QSizePolicy, QWidget
from typing_extensions import override

from lightpen_app.look.languages import worded
from lightpen_app.look.phrases import DECISION_MARKS
from lightpen_app.look.signs import Sign, draw_sign, sign_icon
from lightpen_app.look.theme import GRID, TextSize, Tone, colors_of, font
from lightpen_app.look.words import decimals_for, number_text
from lightpen_app.widgets.state_banner import StatusMessage
from lightpen_extensions.measure.tasks.task import Band

ROW = Qt.ItemDataRole.UserRole  # a `CheckRow`
WIDTH = 38 * GRID  # px
QWIDGETSIZE_MAX = 16_777_215  # px, as PySide does not name it


@dataclass(frozen=True)
class CheckRow:
    """A check, or a value of a part, and how far it is."""

    name: str
    value: str = ""  # with U, once known
    sign: Sign = Sign.NONE
    tone: Tone = Tone.PLAIN
    verdict: str = ""  # a word, where only the sign shows it

    @property
    def words(self) -> str:
        """All of it, for a screen reader."""
        value = " ".join(filter(None, (self.value, self.verdict)))
        return f"{self.name}: {value}" if value else self.name


class CheckList(QListWidget):
    """Shows the checks; the row that is current is marked."""

    chosen = Signal(int)  # row: the user selected another one

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("task_list")
        self.setWordWrap(True)
        self.setResizeMode(QListWidget.ResizeMode.Adjust)
        self.setSpacing(1)
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)

        # Connections
        self.currentRowChanged.connect(self.chosen)

    def set_wide(self, is_wide: bool) -> None:
        """Take all the room, or as much as the rows need."""
        self.setMinimumWidth(0 if is_wide else WIDTH)
        self.setMaximumWidth(QWIDGETSIZE_MAX if is_wide else WIDTH)

    def set_rows(self, rows: tuple[CheckRow, ...]) -> None:
        """Show other rows; the selection stays."""
        self.blockSignals(True)
        while self.count() > len(rows):
            self.takeItem(self.count() - 1)
        while self.count() < len(rows):
            self.addItem("")
        for i, row in enumerate(rows):
            item = self.item(i)
            item.setData(ROW, row)
            item.setText(row.words)
            sign = StatusMessage("", row.sign, row.tone)
            item.setIcon(sign_icon(self, sign.sign, sign.tone))
        self.blockSignals(False)

    def show_row(self, index: int) -> None:
        """Select a row without a signal."""
        if index != self.currentRow():
            self.blockSignals(True)
            self.setCurrentRow(index)
            self.blockSignals(False)
            self.scrollToItem(self.item(min(index + 1, self.count() - 1)))


LEAST_ROW, TALL_ROW, TALLEST_ROW = 5 * GRID // 2, 5 * GRID, 7 * GRID  # px
LIMIT_HEIGHT = 2 * GRID  # px, of a written limit
NAME_SHARE, BAR_SHARE = 0.3, 0.33  # of the width; the rest is for the value
MARGIN = 0.12  # of the range of limits and values
WIDEST = 3.0  # times the limits, that are drawn
MOST_DECIMALS = 4


@dataclass(frozen=True)
class _Range:
    """Deviations from the left end of a bar to its right end."""

    low: float
    high: float

    def at(self, deviation: float, box: QRectF) -> float:
        share = (deviation - self.low) / (self.high - self.low)
        return box.left() + box.width() * min(max(share, 0.0), 1.0)


def value_text(band: Band) -> str:
    """Return a value with its U."""
    decimals = min(decimals_for(band.uncertainty), MOST_DECIMALS)
    numbers = (number_text(x, decimals) for x in (band.value, band.uncertainty))
    return " \N{PLUS-MINUS SIGN} ".join(numbers)


def value_with_unit(band: Band) -> str:
    """Return a value with its U and unit."""
    degrees = "\N{DEGREE SIGN}"
    return value_text(band) + (degrees if band.is_angle else " mm")


class BandChart(QWidget):
    """Draws values between their limits."""

    def __init__(self) -> None:
        super().__init__()
        self._bands: tuple[Band, ...] = ()
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)

    def set_bands(self, bands: tuple[Band, ...]) -> None:
        """Show other values."""
        if bands == self._bands:
            return
        self._bands = bands
        words = (f"{worded(each.name)} {value_text(each)}" for each in bands)
        self.setAccessibleName("; ".join(words))
        self.setVisible(bool(bands))
        self.updateGeometry()
        self.update()

    @override
    def sizeHint(self) -> QSize:
        return QSize(60 * GRID, len(self._bands) * 4 * GRID)

    @override
    def minimumSizeHint(self) -> QSize:
        return QSize(40 * GRID, len(self._bands) * LEAST_ROW)

    @override
    def paintEvent(self, event: QPaintEvent) -> None:
        if not self._bands:
            return
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        height = min(self.height() / len(self._bands), TALLEST_ROW)
        large = TextSize.LEAD if height > TALL_ROW else TextSize.BODY
        for i, band in enumerate(self._bands):
            box = QRectF(0, i * height, self.width(), height)
            painter.setFont(font(large))
            self._draw_row(painter, box, band)

    def _draw_row(self, painter: QPainter, box: QRectF, band: Band) -> None:
        colors = colors_of(self.palette())
        sign, tone = DECISION_MARKS[band.decision]
        left, middle = Qt.AlignmentFlag.AlignLeft, Qt.AlignmentFlag.AlignVCenter
        name = QRectF(box)
        name.setWidth(NAME_SHARE * box.width())
        painter.setPen(QColor(colors.text))
        words = painter.fontMetrics().elidedText(
            worded(band.name), Qt.TextElideMode.ElideRight, round(name.width())
        )
        painter.drawText(name, left | middle, words)
        bar = QRectF(name.right() + GRID, box.top(), 0, box.height())
        bar.setWidth(BAR_SHARE * box.width())
        self._draw_bar(painter, bar, band, colors.tone(tone))
        mark = QRectF(bar.right() + GRID, box.top(), 2 * GRID, box.height())
        draw_sign(painter, mark, sign, colors.tone(tone))
        value = QRectF(box)
        value.setLeft(mark.right() + GRID)
        painter.setPen(colors.tone(tone))
        painter.drawText(value, left | middle, value_with_unit(band))

    def _write_limit(self, painter: QPainter, place: QPointF, limit: float) -> None:
        """Write a limit below its line."""
        painter.save()
        painter.setFont(font(TextSize.SMALL))
        below = QRectF(place.x() - 5 * GRID, place.y(), 10 * GRID, LIMIT_HEIGHT)
        center = Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignTop
        painter.drawText(below, center, f"{round(limit, MOST_DECIMALS):.7g}")
        painter.restore()

    def _draw_bar(
        self, painter: QPainter, box: QRectF, band: Band, tone: QColor
    ) -> None:
        """Draw the limits, the deviation, and its U as a whisker."""
        colors = colors_of(self.palette())
        limits = [x - band.nominal for x in (band.lower, band.upper) if isfinite(x)]
        if not limits:
            return
        off, u = band.value - band.nominal, band.uncertainty
        reach, least = WIDEST * max(map(abs, limits)), off - u
        if len(limits) == 1:  # no deviation is below 0
            least = max(least, 0.0)
        low = max(min(*limits, 0.0, least), -reach)
        high = min(max(*limits, 0.0, off + u), reach)
        room = MARGIN * (high - low)
        span = _Range(low - room, high + room)
        y, thick = box.center().y(), min(box.height() / 3, 1.5 * GRID)
        if box.height() > TALL_ROW:  # the limits are written below
            thick = min(thick, (box.height() - LIMIT_HEIGHT) / 2 - 2)
            y = min(y, box.bottom() - thick - LIMIT_HEIGHT)
        within = min(limits) if len(limits) > 1 else 0.0, max(limits)
        zone = QRectF(span.at(within[0], box), y - thick, 0, 2 * thick)
        zone.setRight(span.at(within[1], box))
        painter.fillRect(zone, QColor(colors.raised))
        painter.setPen(QPen(QColor(colors.edge), 2))
        for limit in limits:
            x = span.at(limit, box)
            painter.drawLine(QPointF(x, y - thick), QPointF(x, y + thick))
            if box.height() > TALL_ROW:
                self._write_limit(painter, QPointF(x, y + thick), limit + band.nominal)
        zero, end = span.at(0.0, box), span.at(off, box)
        painter.setPen(QPen(QColor(colors.edge), 1))
        painter.drawLine(QPointF(zero, y - thick), QPointF(zero, y + thick))
        value = QRectF(min(zero, end), y - thick / 2, abs(end - zero), thick)
        painter.fillRect(value, tone)
        painter.setPen(QPen(QColor(colors.text), 2))
        first, last = span.at(least, box), span.at(off + u, box)
        painter.drawLine(QPointF(first, y), QPointF(last, y))
        for x in (first, last):
            painter.drawLine(QPointF(x, y - thick / 2), QPointF(x, y + thick / 2))
