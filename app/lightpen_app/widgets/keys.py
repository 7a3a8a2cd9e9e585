"""Keys that several widgets handle."""

from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QWidget
from typing_extensions import override

if TYPE_CHECKING:
    WidgetMixin = QWidget
else:  # a class of Qt's cannot be a base twice
    WidgetMixin = object

ENTER_KEYS = (Qt.Key.Key_Return, Qt.Key.Key_Enter)
PAGE_KEYS = (Qt.Key.Key_PageUp, Qt.Key.Key_PageDown)


class LeavesPageKeys(WidgetMixin):
    """Mixin before the base of a widget: leaves the step keys to the window."""

    @override
    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in PAGE_KEYS:
            event.ignore()
        else:
            super().keyPressEvent(event)
