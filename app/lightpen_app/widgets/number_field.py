"""A field for a number with its unit."""

from PySide6.QtCore import QLocale, Qt
from PySide6.QtGui import QKeyEvent, QValidator, QWheelEvent
from PySide6.QtWidgets import QDoubleSpinBox, QWidget
from typing_extensions import override

from lightpen_app.look.theme import GRID

INSET = 13  # px; a style sheet cannot pad the text of a spin box
PAGE_KEYS = (Qt.Key.Key_PageUp, Qt.Key.Key_PageDown)


class NumberField(QDoubleSpinBox):
    """A spin box whose text is set in as in other fields, with a decimal point.

    A decimal comma that is typed becomes a point; it would be passed over otherwise,
    and "3,5" be taken for 35.

    Parameters
    ----------
    unit : str
        Shown after the number.
    limits : (least, greatest)
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
        self.setMaximumHeight(5 * GRID)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)

    @override
    def validate(self, text: str, position: int) -> tuple[QValidator.State, str, int]:
        state, *_ = super().validate(text.replace(",", "."), position)
        return state, text.replace(",", "."), position

    @override
    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Leave the page keys, which a presenter's remote sends, to the window."""
        if event.key() in PAGE_KEYS:
            event.ignore()
        else:
            super().keyPressEvent(event)

    @override
    def wheelEvent(self, event: QWheelEvent) -> None:
        """Turn the number only where the user works, not while the page scrolls."""
        if self.hasFocus():
            super().wheelEvent(event)
        else:
            event.ignore()
