"""A field for a number with its unit."""

import re

from PySide6.QtCore import QLocale, Qt
from PySide6.QtGui import QValidator, QWheelEvent
from PySide6.QtWidgets import QDoubleSpinBox
from typing_extensions import override

from lightpen_app.look.theme import GRID
from lightpen_app.widgets.keys import LeavesPageKeys

LONGEST = 9  # digits before the point
NUMBER = re.compile(rf"[+-]?\d{{1,{LONGEST}}}(\.\d*)?")
INSET = 13  # px; a style sheet cannot pad the text of a spin box


class NumberField(LeavesPageKeys, QDoubleSpinBox):
    """A spin box with a decimal point and the margins of other fields.

    A decimal comma that is typed becomes a point; it would be passed over otherwise,
    and "3,5" be taken for 35. A number beyond the limits becomes the nearest limit once
    it is typed; else its last digit would be passed over, and "400" be taken for 40.
    """

    def __init__(self, unit: str, limits: tuple[float, float], n_decimals: int) -> None:
        super().__init__()
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
        text = text.replace(",", ".")
        state, *_ = super().validate(text, position)
        is_invalid = state is QValidator.State.Invalid
        if is_invalid and self._nearest(text) is not None:
            state = QValidator.State.Intermediate
        return state, text, position

    @override
    def fixup(self, text: str) -> str:
        nearest = self._nearest(text)
        return super().fixup(text) if nearest is None else self.textFromValue(nearest)

    def _nearest(self, text: str) -> float | None:
        """Return the limit that a typed number exceeds; None if within."""
        digits = text.strip().removesuffix(self.suffix().strip()).strip()
        if not NUMBER.fullmatch(digits):
            return None
        _, point, decimals = digits.partition(".")
        if len(decimals) > self.decimals() or (point and not self.decimals()):
            return None
        number = float(digits)
        nearest = min(max(number, self.minimum()), self.maximum())
        return None if nearest == number else nearest

    @override
    def setValue(self, value: float) -> None:
        """Set the number; an unchanged one keeps the text being typed."""
        bounded = min(max(value, self.minimum()), self.maximum())
        is_same = self.textFromValue(bounded) == self.textFromValue(self.value())
        if not (is_same and self.hasFocus()):
            super().setValue(value)

    @override
    def setSuffix(self, suffix: str) -> None:
        """Set the unit; an unchanged one keeps the text being typed."""
        if suffix != self.suffix():
            super().setSuffix(suffix)

    @override
    def wheelEvent(self, event: QWheelEvent) -> None:
        """Change the number only with the focus, not while the page scrolls."""
        if self.hasFocus():
            super().wheelEvent(event)
        else:
            event.ignore()
