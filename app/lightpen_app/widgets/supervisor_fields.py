"""The fields in which a supervisor signs."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QLineEdit, QWidget
from typing_extensions import override

from lightpen.record.library.supervision import Signature
from lightpen_app.look.layouts import horizontal_layout
from lightpen_app.widgets.focus import give_focus
from lightpen_app.widgets.path_field import EnterEdit
from lightpen_app.widgets.translated import Translated

LONGEST = 100  # characters


class SupervisorFields(Translated, QWidget):
    """Name and password."""

    value_edited = Signal()  # something is being typed
    entered = Signal()  # the Enter key was pressed in the password

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)

        # Widgets
        self._name = EnterEdit()
        self._password = EnterEdit()
        self._password.setEchoMode(QLineEdit.EchoMode.Password)

        # Layout
        horizontal_layout(self, (self._name, 1), (self._password, 1))

        # Connections
        for edit in (self._name, self._password):
            edit.setMaxLength(LONGEST)
            edit.textChanged.connect(self.value_edited)
        self._password.returnPressed.connect(self.entered)

        self._retranslate()

    def value(self) -> Signature:
        """Return the signature."""
        return Signature(self._name.text().strip(), self._password.text())

    def is_filled(self) -> bool:
        """Return whether both are typed."""
        return bool(self.value().name and self.value().password)

    def clear(self) -> None:
        """Clear the fields."""
        self._name.clear()
        self._password.clear()

    def clear_password(self) -> None:
        """Have the password typed again."""
        self._password.clear()
        give_focus(self._password)

    @override
    def _retranslate(self) -> None:
        for edit, words in (
            (self._name, self.tr("Supervisor")),
            (self._password, self.tr("Supervisor password")),
        ):
            edit.setPlaceholderText(words)
            edit.setAccessibleName(words)
