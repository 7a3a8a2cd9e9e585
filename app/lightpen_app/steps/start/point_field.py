"""A point of the pen: that of the LED file, or another one that is typed."""

import numpy as np
from PySide6.QtCore import Signal
from PySide6.QtWidgets import QCheckBox, QHBoxLayout, QLabel, QVBoxLayout, QWidget

from lightpen.arrays import FloatArray
from lightpen_app.look.theme import GRID
from lightpen_app.widgets.number_field import NumberField
from lightpen_app.widgets.translated import Translated

REACH = 1000.0  # mm from the origin of the pen; no pen is longer
AXES = ("x", "y", "z")


class PointField(Translated, QWidget):
    """A box to check for the point of the LED file, else three coordinates in mm.

    Signals
    -------
    value_changed()
        The user chose another point.
    """

    value_changed = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._of_file: FloatArray | None = None

        # Widgets
        self._from_file = QCheckBox()
        self._from_file.setChecked(True)
        self._coordinates = QWidget()
        self._fields = tuple(NumberField("mm", (-REACH, REACH), 4) for _ in AXES)
        labels = tuple(QLabel(axis) for axis in AXES)

        # Layout
        row = QHBoxLayout(self._coordinates)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(GRID)
        for label, field in zip(labels, self._fields, strict=True):
            field.setKeyboardTracking(False)
            field.setMinimumWidth(16 * GRID)
            label.setBuddy(field)
            row.addWidget(label)
            row.addWidget(field, 1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(GRID // 2)
        layout.addWidget(self._from_file)
        layout.addWidget(self._coordinates)

        # Connections
        self._from_file.toggled.connect(self._on_toggled)
        for field in self._fields:
            field.valueChanged.connect(self.value_changed)

        self._coordinates.hide()
        self._retranslate()

    def value(self) -> FloatArray | None:
        """Return the point (3,), mm; None for that of the LED file."""
        if self._from_file.isChecked():
            return None
        return np.array([field.value() for field in self._fields])

    def set_value(self, value: FloatArray | None) -> None:
        """Show another point."""
        blocked = self.blockSignals(True)
        self._from_file.setChecked(value is None)
        if value is not None:
            self._show(value)
        self.blockSignals(blocked)

    def set_point_of_file(self, point: FloatArray | None) -> None:
        """Show what the LED file has; None if it has no such point."""
        self._of_file = point
        self._retranslate()

    def settle(self) -> None:
        """Take over what is being typed."""
        for field in self._fields:
            field.interpretText()

    def _show(self, point: FloatArray) -> None:
        for field, coordinate in zip(self._fields, point.tolist(), strict=True):
            field.setValue(coordinate)

    def _on_toggled(self, from_file: bool) -> None:
        self._coordinates.setVisible(not from_file)
        if not from_file:  # the user begins with what was in force
            blocked = self.blockSignals(True)
            self._show(np.zeros(3) if self._of_file is None else self._of_file)
            self.blockSignals(blocked)
        self.value_changed.emit()

    def _retranslate(self) -> None:
        if self._of_file is None:
            text = self.tr("As in the LED file")
        else:
            numbers = "  ".join(f"{each:.3f}" for each in self._of_file)
            text = self.tr("As in the LED file: {0} mm").format(numbers)
        self._from_file.setText(text)
        for axis, field in zip(AXES, self._fields, strict=True):
            name = self.tr("Nominal centre of the tip, {0}").format(axis)
            field.setAccessibleName(name)
