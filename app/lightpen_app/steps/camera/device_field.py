"""A field for a camera: from the search, or a serial number or address."""

from PySide6.QtCore import QSignalBlocker, Signal
from PySide6.QtWidgets import QSizePolicy

from lightpen.cameras.source import FoundDevice
from lightpen_app.look.theme import Tone, set_tone
from lightpen_app.widgets.choice_field import ChoiceField
from lightpen_app.widgets.path_field import EnterEdit


class DeviceField(ChoiceField):
    """A camera, taken over when it is chosen, or typed and Enter pressed."""

    # Another camera was given, or the same one again by Enter.
    value_changed = Signal(str)

    def __init__(self) -> None:
        super().__init__()
        self._value = ""
        self.setEditable(True)
        self.setInsertPolicy(ChoiceField.InsertPolicy.NoInsert)
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        self._edit = edit = EnterEdit()
        self.setLineEdit(edit)
        self.setCompleter(None)  # type: ignore[arg-type] # Qt takes it away by this

        # Connections
        self.activated.connect(self._on_activated)
        edit.returnPressed.connect(self._on_return_pressed)

    def set_value(self, value: str) -> None:
        """Show another camera."""
        self._value = value
        index = self.findData(value)
        with QSignalBlocker(self):
            self.setCurrentIndex(index)
            self.setEditText(value if index < 0 else self.itemText(index))

    def set_found(self, found: tuple[FoundDevice, ...]) -> None:
        """Offer other cameras."""
        with QSignalBlocker(self):
            self.clear()
            for device in found:
                self.addItem(device.label, device.place)
        self.set_value(self._value)

    def set_name(self, name: str) -> None:
        """Set the label of the field."""
        self.setAccessibleName(name)
        self._edit.setAccessibleName(name)
        self._edit.setPlaceholderText(name)

    def set_faulty(self, faulty: bool) -> None:
        """Mark the camera as one that cannot be opened."""
        set_tone(self._edit, Tone.BAD if faulty else Tone.PLAIN)

    def _on_activated(self, index: int) -> None:
        self._take(str(self.itemData(index)))

    def _on_return_pressed(self) -> None:
        text = self.currentText().strip()
        index = self.findText(text)
        self._take(text if index < 0 else str(self.itemData(index)))

    def _take(self, value: str) -> None:
        self.set_value(value)
        self.value_changed.emit(value)
