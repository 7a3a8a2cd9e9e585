"""Notifications: published once, shown by all subscribers."""

from collections.abc import Hashable

from PySide6.QtCore import QObject, Signal

from lightpen_app.look.theme import Tone


class Notifications(QObject):
    """The active notifications, each until its cause has ended."""

    raised = Signal(str, object)  # str, Tone: text for the user
    # A sentence of `raised` whose cause is gone, in the language it was raised in.
    withdrawn = Signal(str)
    status_changed = Signal(str)  # a sentence for the status line

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._texts: dict[Hashable, str] = {}

    def text(self, cause: Hashable) -> str:
        """Return the text of a cause; empty without one."""
        return self._texts.get(cause, "")

    def notify(self, cause: Hashable, text: str, tone: Tone = Tone.BAD) -> None:
        """Publish a sentence, instead of an earlier one of its cause."""
        if self.text(cause) != text:
            self.withdraw(cause)
        self._texts[cause] = text
        self.raised.emit(text, tone)

    def show_status(self, text: str) -> None:
        """Publish a sentence for the status line; an empty one clears it."""
        self.status_changed.emit(text)

    def withdraw(self, *causes: Hashable) -> None:
        """Withdraw the notifications of causes that have ended."""
        for cause in causes:
            text = self._texts.pop(cause, "")
            if text:
                self.withdrawn.emit(text)
