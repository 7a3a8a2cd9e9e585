"""What the user used last: the mouse or the keyboard."""

from PySide6.QtCore import QEvent, QObject
from PySide6.QtGui import QWindow
from typing_extensions import override

DEVICES = {
    QEvent.Type.MouseButtonPress: True,
    QEvent.Type.TouchBegin: True,
    QEvent.Type.KeyPress: False,
}


class LastInput(QObject):
    """Tells whether the last input of a window came from mouse or touch screen."""

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self.is_pointer = False

    def follow(self, window: QWindow) -> None:
        """Follow the input of a window."""
        window.installEventFilter(self)

    @override
    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        self.is_pointer = DEVICES.get(event.type(), self.is_pointer)
        return False
