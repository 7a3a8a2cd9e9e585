"""Windows and dialogs that fit their screen."""

from PySide6.QtCore import QPoint, QRect, QSize, Qt
from PySide6.QtGui import QGuiApplication, QKeyEvent, QShowEvent
from PySide6.QtWidgets import QWidget
from typing_extensions import override

from lightpen_app.look.theme import GRID
from lightpen_app.widgets.keys import WidgetMixin

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
