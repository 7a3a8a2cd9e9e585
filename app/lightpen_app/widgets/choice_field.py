"""A drop-down list for one choice."""

from PySide6.QtGui import QKeyEvent, QWheelEvent
from PySide6.QtWidgets import QComboBox
from typing_extensions import override

from lightpen_app.widgets.keys import PAGE_KEYS


class ChoiceField(QComboBox):
    """A choice that neither the wheel nor the keys of the steps change.

    The wheel scrolls the page, PageUp and PageDown lead from step to step.
    """

    @override
    def wheelEvent(self, event: QWheelEvent) -> None:
        event.ignore()

    @override
    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in PAGE_KEYS:
            event.ignore()
        else:
            super().keyPressEvent(event)
