"""Keys that several widgets handle."""

from PySide6.QtCore import Qt

ENTER_KEYS = (Qt.Key.Key_Return, Qt.Key.Key_Enter)
PAGE_KEYS = (Qt.Key.Key_PageUp, Qt.Key.Key_PageDown)
