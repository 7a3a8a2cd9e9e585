"""The focus, moved by the program."""

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QWidget


def give_focus(widget: QWidget) -> None:
    """Focus a widget and make it visible.

    Qt gives it to those on hidden pages, too, and takes it from who is typing.
    """
    if widget.isVisible():
        widget.setFocus(Qt.FocusReason.OtherFocusReason)
