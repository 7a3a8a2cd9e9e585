"""Tool tips as plain text.

Qt takes a text with tags as rich text and opens its images: a name in a record could
open any path, also one of another computer.
"""

from html import escape

from PySide6.QtGui import QAction, QStandardItem
from PySide6.QtWidgets import QWidget


def set_tooltip(of: QWidget | QAction | QStandardItem, text: str) -> None:
    """Set the tool tip of a widget, an action or an item."""
    of.setToolTip(plain_tooltip(text))


def plain_tooltip(text: str) -> str:
    """Return a text that a tool tip shows literally."""
    if "<" not in text:
        return text
    return f'<span style="white-space: pre-wrap">{escape(text)}</span>'
