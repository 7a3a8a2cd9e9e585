"""Drag and drop of files and folders."""

from PySide6.QtCore import QEvent, QMimeData, QObject, Signal
from PySide6.QtGui import QDropEvent
from PySide6.QtWidgets import QLineEdit, QWidget
from typing_extensions import override


class FileDrops(QObject):
    """Accepts one local file or folder dropped on a widget.

    The widget becomes its parent; a drop on one of the widget's children counts as
    well.
    """

    dropped = Signal(str)  # the path

    def __init__(self, place: QWidget) -> None:
        super().__init__(place)
        place.setAcceptDrops(True)
        for edit in place.findChildren(QLineEdit):
            edit.setAcceptDrops(False)  # it would take the text of an address
        place.installEventFilter(self)

    @override
    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if not isinstance(event, QDropEvent):  # also entering and moving
            return False
        path = _path_of(event.mimeData())
        if not path:
            return False
        event.acceptProposedAction()
        if event.type() == QEvent.Type.Drop:
            self.dropped.emit(path)
        return True


def _path_of(data: QMimeData) -> str:
    """Return the path of the only file that is held, or nothing."""
    urls = data.urls()
    return urls[0].toLocalFile() if len(urls) == 1 and urls[0].isLocalFile() else ""
