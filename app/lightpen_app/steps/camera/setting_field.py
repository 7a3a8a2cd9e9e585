"""A setting of a camera as a number."""

from PySide6.QtCore import QSignalBlocker
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QAbstractSpinBox
from typing_extensions import override

from lightpen.cameras.protocol import Range
from lightpen_app.look.theme import GRID
from lightpen_app.widgets.keys import ENTER_KEYS
from lightpen_app.widgets.number_field import NumberField

FIELD_WIDTH = 13 * GRID  # px, at least: of "30.00 ms"


class SettingField(NumberField):
    """A number that takes effect when it is stepped, or typed and Enter pressed."""

    def __init__(self, unit: str, limits: tuple[float, float], n_decimals: int) -> None:
        super().__init__(unit, limits, n_decimals)
        self.setKeyboardTracking(False)
        self.setMinimumWidth(FIELD_WIDTH)
        self.setStepType(QAbstractSpinBox.StepType.AdaptiveDecimalStepType)

    @override
    def keyPressEvent(self, event: QKeyEvent) -> None:
        super().keyPressEvent(event)
        if event.key() in ENTER_KEYS:
            event.accept()  # else the window would press its main button

    def set_offered(self, offered: Range, value: float) -> None:
        """Show range and value of the camera in the unit of the field."""
        with QSignalBlocker(self):
            self.setRange(offered.low, offered.high)
            self.setValue(value)
