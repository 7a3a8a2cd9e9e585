"""A drop-down list for one choice."""

from PySide6.QtGui import QWheelEvent
from PySide6.QtWidgets import QComboBox
from typing_extensions import override

from lightpen_app.widgets.keys import LeavesPageKeys


class ChoiceField(LeavesPageKeys, QComboBox):
    """A choice that neither the wheel nor the keys of the steps change."""

    @override
    def wheelEvent(self, event: QWheelEvent) -> None:
        event.ignore()
