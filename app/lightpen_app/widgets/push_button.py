"""A button that is never narrower than its text."""

from PySide6.QtCore import QSize
from PySide6.QtWidgets import QPushButton
from typing_extensions import override

from lightpen_app.look.theme import GRID
from lightpen_app.look.tooltips import set_tooltip

LEAST_WIDTH = 8 * GRID + 34  # px; with the padding and the border


class PushButton(QPushButton):
    """A push button.

    A style sheet cannot say how narrow it may be: its min-width replaces the width that
    the words need, and a layout short of room would clip them. With short words it asks
    for ``least_width``, px.
    """

    def __init__(
        self, least_width: int = LEAST_WIDTH, *, checkable: bool = False
    ) -> None:
        super().__init__()
        self.setCheckable(checkable)
        self._least_width = least_width

    def set_why_not(self, why_not: str, tooltip: str = "") -> None:
        """Disable the button with a reason, or enable it with a tool tip."""
        self.setEnabled(not why_not)
        set_tooltip(self, why_not or tooltip)
        self.setAccessibleDescription(why_not or tooltip)

    @override
    def sizeHint(self) -> QSize:
        return super().sizeHint().expandedTo(QSize(self._least_width, 0))
