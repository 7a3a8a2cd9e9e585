"""Text scaled to its place, up to the size for the viewing distance."""

from functools import lru_cache
from math import ceil

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QFontMetricsF, QPainter, QPaintEvent, QResizeEvent
from PySide6.QtWidgets import QSizePolicy, QWidget
from typing_extensions import override

from lightpen_app.look.theme import GRID, Tone, colors_of, font

WRAPPED = int(Qt.TextFlag.TextWordWrap)


class FittedText(QWidget):
    """Text that shrinks only where it would not fit.

    Parameters
    ----------
    largest : float
        Size of the letters where there is room, px.
    n_lines : int
        Lines of that size for which the widget asks.
    least : float
        Size of the letters, px, in which all words always have room.
    wraps : bool
        Whether the words may take several lines.
    """

    def __init__(
        self,
        largest: float,
        n_lines: int = 1,
        least: float = 0.0,
        *,
        wraps: bool = True,
    ) -> None:
        super().__init__()
        self._least = least
        self._largest = largest
        self._n_lines = n_lines
        self._flags = int(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
        self._flags |= WRAPPED if wraps else 0
        self._text = ""
        self._tone = Tone.PLAIN
        self._bold = True
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)

    def text(self) -> str:
        """Return the words."""
        return self._text

    def set_text(
        self, text: str, tone: Tone = Tone.PLAIN, *, bold: bool = True
    ) -> None:
        """Show other words."""
        if (text, tone, bold) == (self._text, self._tone, self._bold):
            return
        self._text, self._tone, self._bold = text, tone, bold
        self.setAccessibleName(text)
        self._ask_room()
        self.update()

    def set_largest(self, largest: float) -> None:
        """Change the size of the letters where there is room, px."""
        if largest != self._largest:
            self._largest = largest
            self.updateGeometry()
            self.update()

    def size_px(self) -> float:
        """Return the size at which the words are drawn now, px."""
        return fitted_size(
            self._text,
            QRectF(self.rect()),
            self._largest,
            bold=self._bold,
            flags=self._flags,
        )

    @override
    def sizeHint(self) -> QSize:
        height = QFontMetricsF(font(self._largest)).height() * self._n_lines
        return QSize(120, round(height))

    @override
    def minimumSizeHint(self) -> QSize:
        return QSize(40, 3 * GRID)

    @override
    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._ask_room()

    def _ask_room(self) -> None:
        """Request the height of the minimum font size."""
        if not self._least or not self.width():
            return
        metrics = QFontMetricsF(font(self._least, bold=self._bold))
        box = QRectF(0, 0, self.width(), 1e6)
        needed = ceil(metrics.boundingRect(box, self._flags, self._text).height())
        self.setMinimumHeight(max(needed, self.minimumSizeHint().height()))

    @override
    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setFont(font(self.size_px(), bold=self._bold))
        painter.setPen(colors_of(self.palette()).tone(self._tone))
        painter.drawText(QRectF(self.rect()), self._flags, self._text)


def fitted_size(
    text: str, box: QRectF, largest: float, *, bold: bool, flags: int = WRAPPED
) -> float:
    """Return the largest font size up to a limit at which text fits a box, px."""
    return _fitted(text, box.width(), box.height(), round(largest), bold, flags)


@lru_cache(maxsize=256)  # the same words are painted again with every image
def _fitted(
    text: str, width: float, height: float, largest: int, bold: bool, flags: int
) -> int:
    low, high = 6, max(6, largest)
    while low < high:
        middle = (low + high + 1) // 2
        metrics = QFontMetricsF(font(middle, bold=bold))
        if _fits(text, metrics, width, height, flags):
            low = middle
        else:
            high = middle - 1
    return low


def _fits(
    text: str, metrics: QFontMetricsF, width: float, height: float, flags: int
) -> bool:
    widest_word = max(map(metrics.horizontalAdvance, text.split()), default=0)
    if widest_word > width and flags & WRAPPED and text.isascii():
        return False
    needed = metrics.boundingRect(QRectF(0, 0, width, 1e6), flags, text)
    return needed.height() <= height and needed.width() <= width + 1
