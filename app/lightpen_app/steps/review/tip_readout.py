"""The tip of a review: value, U, previous and nominal tip, a row for each axis."""

from dataclasses import dataclass
from itertools import chain

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QWidget
from typing_extensions import override

from lightpen_app.look.layouts import grid_layout
from lightpen_app.look.quantities import AXES, mm_text
from lightpen_app.look.theme import GRID, TextSize, Tone, set_size, text_label
from lightpen_app.look.tooltips import set_tooltip
from lightpen_app.widgets.translated import Translated

BLANK = ("", "", "")


@dataclass(frozen=True)
class TipValue:
    """A point with uncertainty, and its reference value."""

    tip: tuple[float, float, float]  # mm
    uncertainty: tuple[float, float, float]  # U (k = 2) along x, y and z, mm
    previous: tuple[str, ...] = ()  # result, mm; empty without one
    change: tuple[str, ...] = ()  # of the tip since then, with its U (k = 2), um
    nominal: tuple[str, ...] = ()  # centre by design, mm; empty without one
    deviation: tuple[str, ...] = ()  # of the tip from it, mm
    since: str = ""  # date of the previous result

    def comparisons(self) -> tuple[tuple[str, ...], ...]:
        """Return the columns beside tip and U."""
        return self.previous, self.change, self.nominal, self.deviation


class TipReadout(Translated, QWidget):
    """Shows a tip to the digit that its uncertainty warrants, a row for each axis."""

    def __init__(self) -> None:
        super().__init__()
        self._value: TipValue | None = None

        # Widgets
        self._names = [text_label(TextSize.BODY, Tone.QUIET) for _ in AXES]
        self._numbers = [_number_label(TextSize.BODY) for _ in AXES]
        self._uncertainties = [_number_label(TextSize.SMALL, Tone.QUIET) for _ in AXES]
        self._compared = [
            [_number_label(TextSize.SMALL) for _ in AXES] for _ in range(4)
        ]
        self._heads = [_number_label(TextSize.SMALL, Tone.QUIET) for _ in range(6)]

        # Layout
        self._layout = layout = grid_layout(self, spacing=(3 * GRID // 4, 0))
        right = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignBaseline
        columns = self._numbers, self._uncertainties, *self._compared
        for column, (head, labels) in enumerate(
            zip(self._heads, columns, strict=True), 1
        ):
            layout.addWidget(head, 0, column)
            layout.setColumnStretch(column, 1)
            for row, label in enumerate(labels, 1):
                layout.addWidget(label, row, column, right)
        for row, (name, axis) in enumerate(zip(self._names, AXES, strict=True), 1):
            name.setText(axis)
            layout.addWidget(name, row, 0, Qt.AlignmentFlag.AlignBaseline)

        self._retranslate()

    def set_large(self, large: bool) -> None:
        """Show the figures larger, for a large window, or as usual."""
        for label in (*self._names, *self._numbers):
            set_size(label, TextSize.TITLE if large else TextSize.BODY)
        for label in self._uncertainties:
            set_size(label, TextSize.LEAD if large else TextSize.SMALL)
        for label in chain(self._heads, *self._compared):
            set_size(label, TextSize.BODY if large else TextSize.SMALL)

    def value(self) -> TipValue | None:
        """Return the tip that is shown."""
        return self._value

    def set_value(self, value: TipValue | None) -> None:
        """Show another tip, or none."""
        self._value = value
        self._retranslate()
        columns = ((),) * 4 if value is None else value.comparisons()
        labels = self._heads[2:], self._compared, columns
        for column, (head, cells, texts) in enumerate(zip(*labels, strict=True), 3):
            head.setVisible(bool(texts))
            self._layout.setColumnStretch(
                column, int(bool(texts))
            )  # else it keeps a gap
            for cell, text in zip(cells, texts or BLANK, strict=True):
                cell.setText(text)
                cell.setVisible(bool(texts))
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

    @override
    def _retranslate(self) -> None:
        words = (
            self.tr("Value\nmm"),
            self.tr("U\nmm"),
            self.tr("Previous\nmm"),
            self.tr("Change\n\xb5m"),
            self.tr("Nominal\nmm"),
            self.tr("Deviation\nmm"),
        )
        for head, text in zip(self._heads, words, strict=True):
            head.setText(text)
        set_tooltip(self._heads[2], "" if self._value is None else self._value.since)


def _number_label(size: TextSize, tone: Tone = Tone.PLAIN) -> QLabel:
    label = text_label(size, tone)
    label.setWordWrap(False)
    label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
    label.setAlignment(Qt.AlignmentFlag.AlignRight)
    return label
