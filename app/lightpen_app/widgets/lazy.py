"""A widget that is created when it is first shown."""

from collections.abc import Callable
from typing import Generic, TypeVar

from PySide6.QtCore import Signal
from PySide6.QtGui import QShowEvent
from PySide6.QtWidgets import QWidget
from typing_extensions import override

from lightpen_app.look.layouts import vertical_layout

W = TypeVar("W", bound=QWidget)


class LazyWidget(QWidget, Generic[W]):
    """Holds the place of a widget that may never be seen."""

    made = Signal(object)  # QWidget

    def __init__(self, make: Callable[[], W]) -> None:
        super().__init__()
        self._make = make
        self._content: W | None = None

        # Layout
        self._layout = vertical_layout(self)

    def content(self) -> W:
        """Return the widget, made now if it has not been."""
        if self._content is None:
            self._content = self._make()
            self._layout.addWidget(self._content)
            self._content.show()  # as it is added while this is being shown
            self.made.emit(self._content)
        return self._content

    def content_so_far(self) -> W | None:
        """Return the widget if it is made."""
        return self._content

    @override
    def showEvent(self, event: QShowEvent) -> None:
        self.content()
        super().showEvent(event)
