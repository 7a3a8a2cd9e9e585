"""The part of a page that scrolls when the window is small."""

from PySide6.QtCore import Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QScrollArea, QWidget
from typing_extensions import override


class PageScroll(QScrollArea):
    """Scrolls to the control that has the focus, and takes no key for itself.

    The page keys, which a presenter's remote sends, are left to the window.
    """

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWidgetResizable(True)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)

    @override
    def setWidget(self, widget: QWidget) -> None:
        """Show another content, on the ground of what is behind."""
        super().setWidget(widget)
        widget.setAutoFillBackground(False)
        self.viewport().setAutoFillBackground(False)

    @override
    def keyPressEvent(self, event: QKeyEvent) -> None:
        event.ignore()
