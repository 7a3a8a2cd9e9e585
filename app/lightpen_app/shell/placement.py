"""Where a window may be on a screen."""

from PySide6.QtCore import QPoint, QRect, QSize

from lightpen_app.look.theme import GRID

FRAME = QSize(GRID, 5 * GRID)  # of a window, at most; not known before it is shown


def fitted_place(place: QRect, available: QRect) -> QRect:
    """Return the place of a window without its frame, within what a screen has."""
    size = place.size().boundedTo(available.size() - FRAME)
    last = available.bottomRight() - QPoint(size.width() - 1, size.height() - 1)
    left = max(available.left(), min(place.left(), last.x()))
    top = max(available.top(), min(place.top(), last.y()))
    return QRect(QPoint(left, top), size)
