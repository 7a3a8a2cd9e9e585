"""Windows and dialogs that fit their screen."""

from PySide6.QtCore import QPoint, QRect, QSize, Qt
from PySide6.QtGui import QGuiApplication, QKeyEvent, QShowEvent
from PySide6.QtWidgets import QWidget
from typing_extensions import override

from lightpen_app.look.theme import GRID
from lightpen_app.widgets.translated import WidgetMixin

FRAME = QSize(GRID, 5 * GRID)  # of a window, at most; not known before it is shown


def fitted_place(place: QRect, available: QRect) -> QRect:
    """Return the place of a window without its frame, within what a screen has."""
    size = place.size().boundedTo(available.size() - FRAME)
    last = available.bottomRight() - QPoint(size.width() - 1, size.height() - 1)
    left = max(available.left(), min(place.left(), last.x()))
    top = max(available.top(), min(place.top(), last.y()))
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


class FittedWindow(WidgetMixin):
    """Mixin before the base of a window: keeps it within the screen when shown."""

    # Keys that close the window, for a dialog in addition to Qt's.
    CLOSING_KEYS: tuple[Qt.Key, ...] = ()

    @override
    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        if not event.spontaneous():
            fit_screen(self)

    @override
    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in self.CLOSING_KEYS:
            self.close()
        else:
            super().keyPressEvent(event)
