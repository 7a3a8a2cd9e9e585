"""The LEDs as a table with what belongs to them: discs and nominal tip."""

from collections.abc import Mapping
from dataclasses import replace
from enum import Enum, auto

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QCheckBox, QGroupBox, QLabel, QLineEdit, QWidget

from lightpen.model.pen import MAX_LEDS, MIN_LEDS
from lightpen.pen_check.draft import PenDraft
from lightpen_app.look.layouts import grid_layout, vertical_layout
from lightpen_app.look.quantities import AXES
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import TextSize, Tone, text_label
from lightpen_app.look.tooltips import set_tooltip
from lightpen_app.steps.leds.led_table import LedTable
from lightpen_app.widgets.path_field import EnterEdit
from lightpen_app.widgets.sign_label import SignLabel, StatusMessage
from lightpen_app.widgets.translated import Translated


class Changes(Enum):
    """Difference of the table from the file in use."""

    NONE = auto()
    FOREIGN = auto()  # it shows another file, which cannot be used
    EDITED = auto()


class LedTablePanel(Translated, QGroupBox):
    """Shows and edits a draft."""

    value_changed = Signal(object)  # PenDraft: the user changed it
    discard_requested = Signal()
    led_chosen = Signal(int)  # number of the current LED, 0 for none

    def __init__(self, undo: QWidget) -> None:
        super().__init__()
        self._value = PenDraft()
        self._changes = Changes.NONE
        self._override = ""

        # Widgets
        self._table = LedTable()
        self._flaw = SignLabel()
        self._add = self.make_button(
            self.tr("Add"), self._on_add_clicked, least_width=0
        )
        self._remove = self.make_button(
            self.tr("Remove"), self._on_remove_clicked, least_width=0
        )
        self._discard = self.make_button(
            self.tr("Discard"), self.discard_requested, least_width=0
        )
        self._normals = self.say(QCheckBox(), self.tr("Show normals"))
        self._diameter_label = self.say(QLabel(), self.tr("&Disc \u00d8, mm"))
        self._diameter = self.say(EnterEdit(), self.tr("Diameter of the LED discs, mm"))
        self._diameter_label.setBuddy(self._diameter)
        self._tip_label = self.say(QLabel(), self.tr("&Tip x y z, mm"))
        self._tip = tuple(EnterEdit() for _ in AXES)
        self._tip_label.setBuddy(self._tip[0])
        self._override_label = text_label(TextSize.SMALL, Tone.QUIET)

        # Layout
        layout = vertical_layout(self, (self._table, 1), self._flaw)
        buttons = grid_layout(layout)
        buttons.addWidget(self._add, 0, 0)
        buttons.addWidget(self._remove, 0, 1)
        buttons.addWidget(self._discard, 0, 2)
        buttons.addWidget(undo, 1, 0, 1, 3)
        for column in range(3):
            buttons.setColumnStretch(column, 1)
        fields = grid_layout(layout)
        fields.addWidget(self._diameter_label, 0, 0)
        fields.addWidget(self._diameter, 0, 1)
        fields.addWidget(self._normals, 0, 2, 1, 2)
        fields.addWidget(self._tip_label, 1, 0)
        for column, edit in enumerate(self._tip, 1):
            fields.addWidget(edit, 1, column)
            fields.setColumnStretch(column, 1)
        layout.addWidget(self._override_label)

        # Connections
        self._table.value_changed.connect(self._take)
        self._table.led_chosen.connect(self._on_led_chosen)
        self._normals.toggled.connect(self._table.show_normals)
        self._diameter.textEdited.connect(self._on_diameter_edited)
        for edit in self._tip:
            edit.textEdited.connect(self._on_tip_edited)

        self._retranslate()

    def set_value(self, value: PenDraft, changes: Changes) -> None:
        """Show another draft; one that differs from the file can be discarded."""
        self._value = value
        self._changes = changes
        self._table.set_value(value)
        if value.has_normals:
            self._normals.setChecked(True)
        _show(self._diameter, value.diameter)
        for edit, text in zip(self._tip, value.tip, strict=True):
            _show(edit, text)
        self._refresh()

    def set_flaw(self, sentence: str) -> None:
        """Show which cell is wrong; empty if none is."""
        self._flaw.set_value(StatusMessage(sentence, Sign.WARNING, Tone.BAD))

    def flaw(self) -> str:
        """Return the message on the cells."""
        return self._flaw.value().text

    def set_overriding_tip(self, point: str) -> None:
        """Show that another nominal tip is in use; hide it with an empty text."""
        self._override = point
        self._refresh()

    def set_misfits(self, misfits: Mapping[int, float]) -> None:
        """Show the errors of LEDs in the image, by number, px."""
        self._table.set_misfits(misfits)

    def set_marked(self, reasons: Mapping[int, str]) -> None:
        """Mark LEDs by number, with the reason."""
        self._table.set_marked(reasons)

    def focus_cells(self) -> None:
        """Move the focus from a vanishing button to the cells."""
        self._table.setFocus(Qt.FocusReason.OtherFocusReason)

    def set_chosen(self, led: int) -> None:
        """Make the row of another LED current."""
        self._table.set_chosen(led)

    def _take(self, draft: PenDraft) -> None:
        self.value_changed.emit(draft)

    def _on_led_chosen(self, led: int) -> None:
        self._refresh()
        self.led_chosen.emit(led)

    def _on_add_clicked(self) -> None:
        self._take(self._value.with_led())
        self._table.set_chosen(self._value.n_leds)
        self._table.setFocus()

    def _on_remove_clicked(self) -> None:
        self._take(self._value.without_led(self._table.chosen() - 1))

    def _on_diameter_edited(self, text: str) -> None:
        self._take(replace(self._value, diameter=text.strip()))

    def _on_tip_edited(self) -> None:
        tip = tuple(edit.text().strip() for edit in self._tip)
        self._take(replace(self._value, tip=tip))

    def _refresh(self) -> None:
        self.setTitle(
            self.tr("LED coordinates (modified)")
            if self._changes is Changes.EDITED
            else self.tr("LED coordinates")
        )
        n_leds, chosen = self._value.n_leds, self._table.chosen()
        self._add.setEnabled(n_leds < MAX_LEDS)
        set_tooltip(self._add, self.tr("Add an LED at the end"))
        if not chosen:
            why_not = self.tr("Select an LED in the table.")
        elif n_leds <= MIN_LEDS:
            why_not = self.tr("A pen needs at least {0} LEDs.").format(MIN_LEDS)
        else:
            why_not = ""
        tooltip = self.tr("Remove LED {0}; the following LEDs are renumbered.").format(
            chosen
        )
        self._remove.set_why_not(why_not, tooltip)
        unchanged = self._changes is Changes.NONE
        why_not = self.tr("No changes") if unchanged else ""
        tooltip = (
            self.tr("Restore the coordinates of the file")
            if self._changes is Changes.EDITED
            else self.tr("Restore the file in use")
        )
        self._discard.set_why_not(why_not, tooltip)
        text = self.tr("Nominal tip in use (step Start): {0} mm")
        self._override_label.setText(text.format(self._override))
        self._override_label.setVisible(bool(self._override))

    def _retranslate(self) -> None:
        for axis, edit in zip(AXES, self._tip, strict=True):
            name = self.tr("Nominal tip centre, {0}, mm").format(axis)
            edit.setAccessibleName(name)
            set_tooltip(edit, name)
            edit.setPlaceholderText(axis)
        set_tooltip(self._diameter, self._diameter.accessibleName())
        self._refresh()


def _show(edit: QLineEdit, text: str) -> None:
    """Show a text unless the user is editing it."""
    if edit.text().strip() != text:
        edit.setText(text)
