"""The fields of the step Start: a station, a point, and an item of the library."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QCheckBox, QLabel, QMenu, QWidget
from typing_extensions import override

from lightpen.arrays import FloatArray
from lightpen_app.look.layouts import fill, horizontal_layout, vertical_layout
from lightpen_app.look.signs import sign_icon
from lightpen_app.look.theme import GRID
from lightpen_app.look.words import shortened
from lightpen_app.widgets.controls import PushButton
from lightpen_app.widgets.fields import ChoiceField, EnterEdit, Translated
from lightpen_app.widgets.number_field import NumberField
from lightpen_app.widgets.state_banner import StatusMessage

NO_REMARK = StatusMessage()


@dataclass(frozen=True)
class ItemChoice:
    """A selectable item with its status."""

    name: str
    remark: StatusMessage = NO_REMARK


class ItemButton(Translated, PushButton):
    """Opens the list; it ends with the way to the library."""

    chosen = Signal(str)  # the id of an item
    library_requested = Signal()

    def __init__(self) -> None:
        super().__init__(0)
        self.say(self, self.tr("Choose..."))
        self._choices: tuple[ItemChoice, ...] = ()
        self._menu = QMenu(self)
        self.setMenu(self._menu)

        # Connections
        self._menu.aboutToShow.connect(self._fill)

        self._refresh()

    def set_choices(self, choices: Sequence[ItemChoice]) -> None:
        """Set the selectable items; an open list is kept."""
        self._choices = tuple(choices)
        if not self._menu.isVisible():
            self._fill()

    def _fill(self) -> None:
        menu = self._menu
        menu.clear()
        for choice in self._choices:
            text = shortened(choice.name).replace("&", "&&")
            word = choice.remark.text
            action = menu.addAction(f"{text}\t{word}" if word else text)
            action.setIcon(sign_icon(self, choice.remark.sign, choice.remark.tone))
            action.triggered.connect(
                lambda _=False, name=choice.name: self.chosen.emit(name)
            )
        if self._choices:
            menu.addSeparator()
        menu.addAction(self.tr("Tip library...")).triggered.connect(
            lambda _=False: self.library_requested.emit()
        )

    def _refresh(self) -> None:
        self._fill()


LONGEST_NAME = 200
ARROWS = (Qt.Key.Key_Up, Qt.Key.Key_Down)


class StationField(ChoiceField):
    """A list of the known stations in which another name can be typed."""

    value_edited = Signal(str)  # text of the field, possibly unfinished
    value_changed = Signal(str)  # the name is finished, or chosen from the list
    entered = Signal()  # it was finished by the Enter key

    def __init__(self) -> None:
        super().__init__()
        self._value = ""
        self._edit = EnterEdit()
        self._edit.setMaxLength(LONGEST_NAME)
        self.setLineEdit(self._edit)
        self.setInsertPolicy(ChoiceField.InsertPolicy.NoInsert)
        # "Hall" must not become "Hall 2" because that is known; Qt takes None for no
        # completer, its stub does not.
        self.setCompleter(None)  # type: ignore[arg-type]
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        # No wider than its neighbours, however long the name.
        self.setSizeAdjustPolicy(
            ChoiceField.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon
        )

        # Connections
        self._edit.textEdited.connect(self.value_edited)
        self._edit.editingFinished.connect(self._on_finished)
        self._edit.entered.connect(self.entered)
        self.activated.connect(self._on_finished)

    def value(self) -> str:
        """Return the name in the field."""
        return self.currentText().strip()

    def set_value(self, name: str) -> None:
        """Show another name."""
        self._value = name
        self.setEditText(name)
        self._edit.setCursorPosition(0)

    def set_known(self, names: Sequence[str]) -> None:
        """List these stations."""
        shown = self.currentText()
        self.clear()
        self.addItems(list(names))
        self.setEditText(shown)
        self._edit.setCursorPosition(0)

    @override
    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Open the list by an arrow."""
        if event.key() in ARROWS:
            self.showPopup()
        else:
            super().keyPressEvent(event)

    def _on_finished(self) -> None:
        name, before = self.value(), self._value
        self.set_value(name)
        if name != before:
            self.value_changed.emit(name)


REACH = 1000.0  # mm from the origin of the pen; no pen is longer
AXES = ("x", "y", "z")


class PointField(Translated, QWidget):
    """A box to check for the point of the LED file, else three coordinates in mm."""

    value_changed = Signal()  # the user chose another point

    def __init__(self) -> None:
        super().__init__()
        self._of_file: FloatArray | None = None

        # Widgets
        self._from_file = QCheckBox()
        self._from_file.setChecked(True)
        self._coordinates = QWidget()
        self._fields = tuple(NumberField("mm", (-REACH, REACH), 4) for _ in AXES)
        labels = tuple(QLabel(axis) for axis in AXES)

        # Layout
        vertical_layout(self, self._from_file, self._coordinates, spacing=GRID // 2)
        row = horizontal_layout(self._coordinates)
        for label, field in zip(labels, self._fields, strict=True):
            field.setMinimumWidth(16 * GRID)
            label.setBuddy(field)
            fill(row, label, (field, 1))

        # Connections
        self._from_file.toggled.connect(self._on_toggled)
        for field in self._fields:
            field.value_changed.connect(self.value_changed)

        self._coordinates.hide()
        self._refresh()

    def value(self) -> FloatArray | None:
        """Return the point (3,), mm; None for the point of the LED file."""
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
        """Show the point of the LED file; None without one."""
        self._of_file = point
        self._refresh()

    def settle(self) -> None:
        """Apply pending input."""
        for field in self._fields:
            field.settle()

    def _show(self, point: FloatArray) -> None:
        for field, coordinate in zip(self._fields, point.tolist(), strict=True):
            field.set_value(coordinate)

    def _on_toggled(self, from_file: bool) -> None:
        self._coordinates.setVisible(not from_file)
        if not from_file:  # the user begins with the previous values
            blocked = self.blockSignals(True)
            self._show(np.zeros(3) if self._of_file is None else self._of_file)
            self.blockSignals(blocked)
        self.value_changed.emit()

    def _refresh(self) -> None:
        if self._of_file is None:
            text = self.tr("As in the LED file")
        else:
            numbers = "  ".join(f"{each:.3f}" for each in self._of_file)
            text = self.tr("As in the LED file: {0} mm").format(numbers)
        self._from_file.setText(text)
        for axis, field in zip(AXES, self._fields, strict=True):
            name = self.tr("Nominal tip centre, {0}").format(axis)
            field.setAccessibleName(name)
