"""Selects which of two cameras is shown and adjusted."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QButtonGroup, QWidget

from lightpen_app.look.layouts import horizontal_layout
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.translated import Translated

N_CAMERAS = 2


class CameraSwitch(Translated, QWidget):
    """A button for each camera; one is pressed."""

    value_changed = Signal(int)  # index of the camera to show

    def __init__(self) -> None:
        super().__init__()

        # Widgets
        self._buttons = [PushButton() for _ in range(N_CAMERAS)]
        self._group = QButtonGroup(self)
        for c, button in enumerate(self._buttons):
            button.setCheckable(True)
            self._group.addButton(button, c)
        self._buttons[0].setChecked(True)

        # Layout
        horizontal_layout(self, *self._buttons)

        # Connections
        self._group.idClicked.connect(self.value_changed)

        self._retranslate()

    def value(self) -> int:
        """Return the number of the camera that is shown, from 0."""
        return self._group.checkedId()

    def set_value(self, camera: int) -> None:
        """Show another camera as chosen."""
        self._buttons[camera].setChecked(True)

    def _retranslate(self) -> None:
        for number, button in enumerate(self._buttons, start=1):
            button.setText(self.tr("Camera {0}").format(number))
