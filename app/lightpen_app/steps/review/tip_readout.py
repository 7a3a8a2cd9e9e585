"""The tip of a review: value and U, a row for each axis."""

from dataclasses import dataclass

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QWidget

from lightpen_app.look.layouts import grid_layout
from lightpen_app.look.quantities import AXES, mm_text
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label


@dataclass(frozen=True)
class TipValue:
    """A point with uncertainty, and its reference value."""

    tip: tuple[float, float, float]  # mm
    uncertainty: tuple[float, float, float]  # U (k = 2) along x, y and z, mm
    previous: tuple[str, ...] = ()  # result, mm; empty without one
    change: tuple[str, ...] = ()  # of the tip since then, with its U (k = 2), mm
    nominal: tuple[str, ...] = ()  # centre by design, mm; empty without one
    deviation: tuple[str, ...] = ()  # of the tip from it, mm
    since: str = ""  # date of the previous result

    def comparisons(self) -> tuple[tuple[str, ...], ...]:
        """Return the columns beside tip and U."""
        return self.previous, self.change, self.nominal, self.deviation


class TipReadout(QWidget):
    """Shows a tip to the digit that its uncertainty warrants, a row for each axis."""

    def __init__(self) -> None:
        super().__init__()
        self._value: TipValue | None = None

        # Widgets
        self._names = [text_label(TextSize.BODY, Tone.QUIET) for _ in AXES]
        self._numbers = [_number_label(TextSize.BODY) for _ in AXES]
        self._uncertainties = [_number_label(TextSize.SMALL, Tone.QUIET) for _ in AXES]

        # Layout
        layout = grid_layout(self, spacing=(2 * GRID, 0))
        right = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignBaseline
        columns = self._names, self._numbers, self._uncertainties
        for column, labels in enumerate(columns):
            for row, label in enumerate(labels):
                layout.addWidget(label, row, column, right)
        layout.setColumnStretch(len(columns), 1)
        for name, axis in zip(self._names, AXES, strict=True):
            name.setText(axis)

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
            number.setText(mm_text(value.tip[row]))
            within = mm_text(value.uncertainty[row])
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
