"""Widgets with texts in the selected language."""

from typing import TYPE_CHECKING

from PySide6.QtCore import QEvent
from PySide6.QtWidgets import QWidget
from typing_extensions import override

if TYPE_CHECKING:
    WidgetMixin = QWidget
else:  # a class of Qt's cannot be a base twice
    WidgetMixin = object


class Translated(WidgetMixin):
    """Mixin before the base of a widget: updates its texts with the language.

    The constructor of the widget arranges it once.
    """

    def _retranslate(self) -> None:
        """Set all texts in the current language."""
        raise NotImplementedError

    @override
    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.LanguageChange:
            self._retranslate()
