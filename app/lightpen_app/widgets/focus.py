"""Moving the focus by the program."""

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QWidget


def give_focus(widget: QWidget) -> None:
    """Focus a widget and make it visible.

    Qt itself would also focus widgets on hidden pages, and take the focus from a field
    in use.
    """
    if widget.isVisible():
        widget.setFocus(Qt.FocusReason.OtherFocusReason)
