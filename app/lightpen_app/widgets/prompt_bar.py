"""Base of the bars with a question in the page."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QFrame, QWidget
from shiboken6 import isValid
from typing_extensions import override

from lightpen_app.look.theme import Tone, set_tone


class AskingBar(QFrame):
    """A bar for a question, hidden without one; it returns the focus.

    Otherwise Qt would focus the next widget, such as a button that Enter then presses.
    """

    asking_changed = Signal()  # it asks, or no longer

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._had_focus: QWidget | None = None
        self.setProperty("area", "notice")
        set_tone(self, Tone.WARN)

    @override
    def setVisible(self, visible: bool) -> None:
        focused, before = self.window().focusWidget(), self._had_focus
        is_inside = focused is not None and self.isAncestorOf(focused)
        if visible and not is_inside:
            self._had_focus = focused
        elif not visible and is_inside and before is not None and isValid(before):
            before.setFocus()
        was_hidden = self.isHidden()
        super().setVisible(visible)
        if self.isHidden() is not was_hidden:
            self.asking_changed.emit()
