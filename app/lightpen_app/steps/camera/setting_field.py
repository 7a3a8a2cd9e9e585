"""A setting of a camera as a number."""

from PySide6.QtCore import QSignalBlocker

from lightpen.cameras.protocol import Range
from lightpen_app.look.theme import GRID
from lightpen_app.widgets.number_field import NumberField

FIELD_WIDTH = 13 * GRID  # px, at least: of "30.00 ms"


class SettingField(NumberField):
    """A number that takes effect when it is stepped, or typed and Enter pressed."""

    def __init__(self, unit: str, limits: tuple[float, float], n_decimals: int) -> None:
        super().__init__(unit, limits, n_decimals)
        self.setMinimumWidth(FIELD_WIDTH)

    def set_offered(self, offered: Range, value: float) -> None:
        """Show range and value of the camera in the unit of the field."""
        with QSignalBlocker(self):
            self.set_limits(offered.low, offered.high)
            self.set_value(value)
