"""A drop-down list for one choice."""

from PySide6.QtGui import QWheelEvent
from PySide6.QtWidgets import QComboBox
from typing_extensions import override


class ChoiceField(QComboBox):
    """A choice that the wheel does not change while the page scrolls."""

    @override
    def wheelEvent(self, event: QWheelEvent) -> None:
        event.ignore()
