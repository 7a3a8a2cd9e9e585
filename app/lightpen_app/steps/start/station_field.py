"""A field for the name of a station, known or new."""

from collections.abc import Sequence

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QLineEdit, QWidget
from typing_extensions import override

from lightpen_app.widgets.choice_field import ChoiceField
from lightpen_app.widgets.keys import ENTER_KEYS, PAGE_KEYS

LONGEST_NAME = 200
ARROWS = (Qt.Key.Key_Up, Qt.Key.Key_Down)


class StationField(ChoiceField):
    """A list of the known stations in which another name can be typed.

    Signals
    -------
    value_edited(str)
        The name that is being typed; it may be unfinished.
    value_changed(str)
        The name is finished, or chosen from the list.
    entered()
        It was finished by the Enter key.
    """

    value_edited = Signal(str)
    value_changed = Signal(str)
    entered = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._value = ""
        self._edit = _NameEdit()
        self._edit.setMaxLength(LONGEST_NAME)
        self.setLineEdit(self._edit)
        self.setInsertPolicy(ChoiceField.InsertPolicy.NoInsert)
        # "Hall" must not become "Hall 2" because that is known; Qt takes None for no
        # completer, its stub does not.
        self.setCompleter(None)  # type: ignore[arg-type]
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)

        # Connections
        self._edit.textEdited.connect(self.value_edited)
        self._edit.editingFinished.connect(self._on_finished)
        self._edit.entered.connect(self.entered)
        self.activated.connect(self._on_finished)

    def value(self) -> str:
        """Return the name as it is typed."""
        return self.currentText().strip()

    def set_value(self, name: str) -> None:
        """Show another name."""
        self._value = name
        self.setEditText(name)
        self._edit.setCursorPosition(0)

    def set_known(self, names: Sequence[str]) -> None:
        """List these stations."""
        shown = self.currentText()
        self.clear()
        self.addItems(list(names))
        self.setEditText(shown)
        self._edit.setCursorPosition(0)

    @override
    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Open the list by an arrow; the page keys lead through the steps."""
        if event.key() in ARROWS:
            self.showPopup()
        elif event.key() in PAGE_KEYS:
            event.ignore()
        else:
            super().keyPressEvent(event)

    def _on_finished(self) -> None:
        name, before = self.value(), self._value
        self.set_value(name)
        if name != before:
            self.value_changed.emit(name)


class _NameEdit(QLineEdit):
    """A line whose Enter key takes over what was typed, and else does nothing."""

    entered = Signal()

    @override
    def keyPressEvent(self, event: QKeyEvent) -> None:
        is_typed = self.isModified()
        super().keyPressEvent(event)
        if is_typed and event.key() in ENTER_KEYS:
            event.accept()  # the window would press its main button, too soon
            self.entered.emit()
