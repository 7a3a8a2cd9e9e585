"""Keys that several widgets handle."""

from PySide6.QtCore import Qt
from PySide6.QtGui import QKeyEvent
from typing_extensions import override

from lightpen_app.widgets.translated import WidgetMixin

ENTER_KEYS = (Qt.Key.Key_Return, Qt.Key.Key_Enter)
PAGE_KEYS = (Qt.Key.Key_PageUp, Qt.Key.Key_PageDown)


class LeavesPageKeys(WidgetMixin):
    """Put before the base of a widget, it leaves the window the keys of the steps."""

    @override
    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in PAGE_KEYS:
            event.ignore()
        else:
            super().keyPressEvent(event)
