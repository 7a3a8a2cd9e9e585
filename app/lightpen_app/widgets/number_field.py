"""A field for a number with its unit."""

from PySide6.QtCore import QLocale
from PySide6.QtWidgets import QDoubleSpinBox, QWidget

INSET = 10  # px; a style sheet cannot pad the text of a spin box


class NumberField(QDoubleSpinBox):
    """A spin box whose text is set in as in other fields, with a decimal point.

    Parameters
    ----------
    unit : str
        Shown after the number.
    limits : (least, greatest)
    n_decimals : int
    """

    def __init__(
        self,
        unit: str,
        limits: tuple[float, float],
        n_decimals: int,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.setLocale(QLocale.c())
        self.setDecimals(n_decimals)
        self.setRange(*limits)
        if unit:
            self.setSuffix(f" {unit}")
        self.lineEdit().setTextMargins(INSET, 0, 0, 0)
