"""What fits the room there is: elided texts, windows, layouts and scrolling pages."""

from dataclasses import dataclass
from functools import lru_cache
from math import ceil

from PySide6.QtCore import QPoint, QRect, QRectF, QSize, Qt, QTimer, Signal
from PySide6.QtGui import (
    QFontMetricsF,
    QGuiApplication,
    QKeyEvent,
    QPainter,
    QPaintEvent,
    QResizeEvent,
    QShowEvent,
)
from PySide6.QtWidgets import QScrollArea, QSizePolicy, QWidget
from typing_extensions import override

from lightpen_app.look.layouts import vertical_layout
from lightpen_app.look.theme import GRID, Tone, colors_of, font
from lightpen_app.widgets.controls import WidgetMixin

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


# Of a window, at most; not known before it is shown.
SIDE, TITLE_BAR = GRID // 2, 4 * GRID
FRAME = QSize(2 * SIDE, TITLE_BAR + 2 * SIDE)


def fitted_place(place: QRect, available: QRect) -> QRect:
    """Return the place of a window without its frame, within what a screen has."""
    inner = available.adjusted(SIDE, TITLE_BAR, -SIDE, -2 * SIDE)
    size = place.size().boundedTo(inner.size())
    last = inner.bottomRight() - QPoint(size.width() - 1, size.height() - 1)
    left = max(inner.left(), min(place.left(), last.x()))
    top = max(inner.top(), min(place.top(), last.y()))
    return QRect(QPoint(left, top), size)


def fit_screen(window: QWidget) -> None:
    """Keep a window within its screen."""
    if window.isMaximized() or window.isFullScreen():
        return
    place = window.geometry()
    screen = QGuiApplication.screenAt(place.center()) or window.screen()
    fitted = fitted_place(place, screen.availableGeometry())
    if fitted != place:
        window.setGeometry(fitted)


MOVED = Qt.WidgetAttribute.WA_Moved  # it has been placed before


class FittedWindow(WidgetMixin):
    """Mixin before the base of a window: opens over its parent, within the screen."""

    # Keys that close the window, for a dialog in addition to Qt's.
    CLOSING_KEYS: tuple[Qt.Key, ...] = ()

    @override
    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        if event.spontaneous():
            return
        parent = self.parentWidget()
        if parent is not None and not self.testAttribute(MOVED):
            place = self.geometry()
            place.moveCenter(parent.window().geometry().center())
            self.setGeometry(place)
        fit_screen(self)

    @override
    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in self.CLOSING_KEYS:
            self.close()
        else:
            super().keyPressEvent(event)


@dataclass(frozen=True)
class SizeClass:
    """Whether a widget is short of room, in width and in height."""

    is_narrow: bool = False
    is_low: bool = False

    @property
    def margin(self) -> int:
        """Margin at the left and right of a page, px."""
        return 2 * GRID if self.is_narrow else 4 * GRID


NO_ROOM = SizeClass(is_narrow=True, is_low=True)


class ResponsiveLayout(WidgetMixin):
    """Mixin before the base of a widget: rearranges it when its size changes.

    The constructor of the widget arranges it once.
    """

    # px; with less width or height it is short of room.
    narrow_below = 0
    low_below = 0
    _room = SizeClass()

    def _use_room(self) -> None:
        """Arrange the content for the size class."""
        raise NotImplementedError

    @override
    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        size = event.size()
        room = SizeClass(
            is_narrow=size.width() < self.narrow_below,
            is_low=size.height() < self.low_below,
        )
        if room != self._room:
            self._room = room
            self._use_room()


class PageScroll(QScrollArea):
    """Scrolls to the control that has the focus, and takes no key for itself.

    The page keys, which a presenter's remote sends, are left to the window.
    """

    height_changed = Signal(int)  # of the visible part, px

    def __init__(self) -> None:
        super().__init__()
        self.setWidgetResizable(True)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)

    @override
    def setWidget(self, widget: QWidget) -> None:
        """Set the content, with the background of the parent."""
        super().setWidget(widget)
        widget.setAutoFillBackground(False)
        self.viewport().setAutoFillBackground(False)

    @override
    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.height_changed.emit(event.size().height())

    @override
    def keyPressEvent(self, event: QKeyEvent) -> None:
        event.ignore()


class DialogScroll(PageScroll):
    """The fields of a dialog, scrolled only if the screen is too small.

    Qt opens a dialog with two thirds of the screen at most.
    """

    @override
    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        if not event.spontaneous():
            size = self.window().size()
            QTimer.singleShot(0, self, lambda: self._grow(size))

    def _grow(self, size: QSize) -> None:
        window, bar = self.window(), self.verticalScrollBar()
        while bar.maximum() and window.size() == size:
            window.resize(size.width(), size.height() + bar.maximum())
            fit_screen(window)
            if window.height() <= size.height():
                return
            size = window.size()

    @override
    def sizeHint(self) -> QSize:
        content = self.widget()
        return super().sizeHint() if content is None else content.sizeHint()


class ShrinkingScrollContent(QWidget):
    """Content that scrolls only once it cannot be made smaller.

    Other content with words that wrap, and this where it is not to be squeezed, scrolls
    as soon as it has less than the height for which it asks. Without ``content``, the
    caller lays it out.
    """

    def __init__(self, content: QWidget | None = None) -> None:
        super().__init__()
        self._is_squeezed = True
        if content is not None:
            vertical_layout(self, content)

    def set_squeezed(self, squeezed: bool) -> None:
        """Allow the minimum size, or give the size hint."""
        self._is_squeezed = squeezed
        self.updateGeometry()

    @override
    def heightForWidth(self, width: int) -> int:
        if self._is_squeezed:
            return self.minimumSizeHint().height()
        return super().heightForWidth(width)
