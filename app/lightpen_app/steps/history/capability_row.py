"""A type-1 gauge study of the listed tips: input and result."""

import numpy as np
from PySide6.QtCore import Signal
from PySide6.QtWidgets import QCheckBox, QWidget
from typing_extensions import override

from lightpen.arrays import FloatArray
from lightpen.comparisons.repeatability import CAPABLE, STUDY, Capability
from lightpen_app.look.layouts import fill, horizontal_layout, vertical_layout
from lightpen_app.look.quantities import AXES, number_text
from lightpen_app.look.theme import GRID, TextSize, text_label
from lightpen_app.widgets.number_field import NumberField
from lightpen_app.widgets.sign_label import SignLabel, StatusMessage
from lightpen_app.widgets.translated import Translated

WIDEST, REACH = 10.0, 1000.0  # mm


class CapabilityRow(Translated, QWidget):
    """Takes a tolerance and the tip by a better instrument; shows Cg and Cgk."""

    value_changed = Signal()  # the user chose otherwise

    def __init__(self) -> None:
        super().__init__()
        self._shown: tuple[Capability | None, int] = (None, 0)

        # Widgets
        self._label = text_label(TextSize.BODY)
        self._tolerance = NumberField("mm", (0.0, WIDEST), 4)
        self._label.setBuddy(self._tolerance)
        self._has_reference = QCheckBox()
        self._reference = tuple(NumberField("mm", (-REACH, REACH), 4) for _ in AXES)
        self._message = SignLabel()

        # Layout
        layout = vertical_layout(self, spacing=GRID // 2)
        horizontal_layout(layout, self._label, self._tolerance, self._has_reference, 1)
        horizontal_layout(layout, *self._reference, 1)
        fill(layout, self._message)

        # Connections
        self._has_reference.toggled.connect(self._on_changed)
        for field in (self._tolerance, *self._reference):
            field.value_changed.connect(self._on_changed)

        self._retranslate()

    def tolerance(self) -> float | None:
        """Return the tolerance, mm; None without a study."""
        return self._tolerance.value() or None

    def reference(self) -> FloatArray | None:
        """Return the tip by a better instrument, (3,), mm, if it is known."""
        if not self._has_reference.isChecked():
            return None
        return np.array([field.value() for field in self._reference])

    def set_value(self, found: Capability | None, n_tips: int) -> None:
        """Show the result of a study, or none."""
        self._shown = found, n_tips
        self._refresh()

    def _on_changed(self) -> None:
        self._refresh()
        self.value_changed.emit()

    @override
    def _retranslate(self) -> None:
        self._label.setText(self.tr("Capability: tolerance"))
        self._tolerance.setAccessibleName(self.tr("Tolerance of a coordinate"))
        self._tolerance.set_empty_text(self.tr("No study"))
        self._has_reference.setText(
            self.tr("Reference tip (from a more accurate instrument)")
        )
        for axis, field in zip(AXES, self._reference, strict=True):
            field.setAccessibleName(self.tr("{0} of the reference").format(axis))
        self._refresh()

    def _refresh(self) -> None:
        for field in self._reference:
            field.setVisible(self._has_reference.isChecked())
        self._has_reference.setVisible(self.tolerance() is not None)
        found, n_tips = self._shown
        if found is None:
            self._message.set_value(StatusMessage())
            return
        words = [self._of_each("Cg", found.cg)]
        if found.cgk is not None:
            words.append(self._of_each("Cgk", found.cgk))
        least = number_text(CAPABLE, 2)
        words.append(
            self.tr("Capable: all values are {0} or more.").format(least)
            if found.is_capable
            else self.tr("Not capable: {0} is required.").format(least)
        )
        if n_tips < STUDY:
            text = self.tr("A study needs {0} to 50 repeats; {1} are available.")
            words.append(text.format(STUDY, n_tips))
        marked = StatusMessage.good if found.is_capable else StatusMessage.warning
        self._message.set_value(marked(" ".join(words)))

    def _of_each(self, name: str, values: FloatArray) -> str:
        each = zip(AXES, values.tolist(), strict=True)
        numbers = ", ".join(f"{axis} {number_text(value, 2)}" for axis, value in each)
        return f"{name}: {numbers}."
