"""The tip in large figures, each with its uncertainty."""

from dataclasses import dataclass

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QGridLayout, QLabel, QWidget

from lightpen_app.look.quantities import AXES, decimals_for, number_text
from lightpen_app.look.theme import GRID, TextSize, Tone, set_size, text_label


@dataclass(frozen=True)
class TipValue:
    """A point and its uncertainty.

    Attributes
    ----------
    tip : tuple of three floats
        mm.
    uncertainty : tuple of three floats
        U (k = 2) along x, y and z, mm.
    """

    tip: tuple[float, float, float]
    uncertainty: tuple[float, float, float]


class TipReadout(QWidget):
    """Shows a tip to the digit that its uncertainty warrants; can be copied."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._value: TipValue | None = None

        # Widgets
        self._numbers = [_number_label(TextSize.TITLE) for _ in AXES]
        self._uncertainties = [_number_label(TextSize.LEAD, Tone.QUIET) for _ in AXES]

        # Layout
        layout = QGridLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setHorizontalSpacing(GRID)
        layout.setVerticalSpacing(0)
        right = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignBaseline
        self._names = [text_label(TextSize.LEAD, Tone.QUIET) for _ in AXES]
        for row, axis in enumerate(AXES):
            name = self._names[row]
            name.setText(axis)
            layout.addWidget(name, row, 0, Qt.AlignmentFlag.AlignBaseline)
            layout.addWidget(self._numbers[row], row, 1, right)
            layout.addWidget(self._uncertainties[row], row, 2, right)
        layout.setColumnStretch(1, 1)

    def set_large(self, large: bool) -> None:
        """Show the figures larger, where there is the room, or no longer."""
        for label in self._numbers:
            set_size(label, TextSize.DISPLAY if large else TextSize.TITLE)
        for label in (*self._names, *self._uncertainties):
            set_size(label, TextSize.TITLE if large else TextSize.LEAD)

    def value(self) -> TipValue | None:
        """Return the tip that is shown."""
        return self._value

    def set_value(self, value: TipValue | None) -> None:
        """Show another tip, or none."""
        self._value = value
        for row, axis in enumerate(AXES):
            number, uncertainty = self._numbers[row], self._uncertainties[row]
            if value is None:
                number.clear()
                uncertainty.clear()
                continue
            decimals = decimals_for(value.uncertainty[row])
            number.setText(number_text(value.tip[row], decimals))
            within = number_text(value.uncertainty[row], decimals)
            uncertainty.setText(f"\N{PLUS-MINUS SIGN} {within}")
            number.setAccessibleName(f"{axis} = {number.text()} mm")
            uncertainty.setAccessibleName(f"{uncertainty.text()} mm")

    def texts(self) -> tuple[str, ...]:
        """Return the numbers of x, y and z and their uncertainties, as shown."""
        labels = zip(self._numbers, self._uncertainties, strict=True)
        return tuple(f"{number.text()} {u.text()}" for number, u in labels)


def _number_label(size: TextSize, tone: Tone = Tone.PLAIN) -> QLabel:
    label = text_label(size, tone)
    label.setWordWrap(False)
    label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
    label.setAlignment(Qt.AlignmentFlag.AlignRight)
    return label
