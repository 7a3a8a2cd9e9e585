"""Base of the buttons for the simulated operator."""

from collections.abc import Callable

from PySide6.QtWidgets import QAbstractButton, QFrame, QWidget

from lightpen.live.sources import Operator
from lightpen_app.look.words import set_tooltip
from lightpen_app.widgets.fields import Translated
from lightpen_app.work.live_view import LiveView


class SimulatorControls(Translated, QFrame):
    """Base of the controls of the simulated operator; hidden with a real pen.

    A subclass calls `_follow_connection` once it has its buttons.
    """

    def __init__(self, live: LiveView, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._live = live
        live.connection_changed.connect(self._follow_connection)

    def _follow_connection(self) -> None:
        """Show the controls for a simulated operator; each camera has its own."""
        self.setVisible(self._live.operator is not None)

    def _command(self, act: Callable[[Operator], object]) -> None:
        """Have the operator do something, if there is one."""
        if operator := self._live.operator:
            act(operator)


def set_words(button: QAbstractButton, text: str, tooltip: str) -> None:
    """Set the text of a button and its tool tip."""
    button.setText(text)
    set_tooltip(button, tooltip)
    button.setAccessibleDescription(tooltip)
