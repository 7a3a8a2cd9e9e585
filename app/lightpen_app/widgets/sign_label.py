"""A symbol with its text."""

from dataclasses import dataclass
from typing import Self

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QPainter, QPaintEvent
from PySide6.QtWidgets import QSizePolicy, QWidget
from typing_extensions import override

from lightpen_app.look.layouts import horizontal_layout
from lightpen_app.look.signs import Sign, draw_sign
from lightpen_app.look.theme import (
    GRID,
    TextSize,
    Tone,
    colors_of,
    set_tone,
    text_label,
)
from lightpen_app.look.words import breakable

SIDE = 2 * GRID


@dataclass(frozen=True)
class StatusMessage:
    """Message with its sign and tone."""

    text: str = ""  # empty for nothing to remark
    sign: Sign = Sign.NONE
    tone: Tone = Tone.PLAIN

    @classmethod
    def good(cls, text: str) -> Self:
        """Return a message on what is as it should be."""
        return cls(text, Sign.CHECK, Tone.GOOD)

    @classmethod
    def warning(cls, text: str) -> Self:
        """Return a message on what needs attention."""
        return cls(text, Sign.WARNING, Tone.WARN)

    @classmethod
    def fault(cls, text: str) -> Self:
        """Return a message on what failed."""
        return cls(text, Sign.CROSS, Tone.BAD)


class SignLabel(QWidget):
    """Shows a status message, in several lines if it wraps; hidden without one."""

    def __init__(self, *, wraps: bool = True) -> None:
        super().__init__()
        self._value = StatusMessage()

        # Widgets
        self._mark = _SignMark()
        self._words = text_label(TextSize.BODY)
        self._words.setWordWrap(wraps)

        # Layout
        horizontal_layout(
            self, (self._mark, 0, Qt.AlignmentFlag.AlignTop), (self._words, 1)
        )

        self.hide()

    def value(self) -> StatusMessage:
        """Return the value."""
        return self._value

    def set_value(self, value: StatusMessage) -> None:
        """Show another remark."""
        if value == self._value:
            return
        self._value = value
        self._mark.set_value(value)
        self._words.setText(breakable(value.text))
        set_tone(self._words, value.tone)
        self.setAccessibleName(value.text)
        self.setVisible(bool(value.text))


class _SignMark(QWidget):
    """The sign alone, as high as the first line of the words."""

    def __init__(self) -> None:
        super().__init__()
        self._value = StatusMessage()
        fixed = QSizePolicy.Policy.Fixed
        self.setSizePolicy(fixed, fixed)

    def set_value(self, value: StatusMessage) -> None:
        self._value = value
        self.update()

    @override
    def sizeHint(self) -> QSize:
        return QSize(SIDE, self.fontMetrics().height())

    @override
    def paintEvent(self, event: QPaintEvent) -> None:
        color = colors_of(self.palette()).tone(self._value.tone)
        painter = QPainter(self)
        draw_sign(painter, QRectF(self.rect()), self._value.sign, color)
