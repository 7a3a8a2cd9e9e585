"""Form of the step Start: names, probe tip and limits of a swing."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from operator import attrgetter

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QShortcut
from PySide6.QtWidgets import QGridLayout, QGroupBox, QLineEdit, QWidget

from lightpen.arrays import FloatArray
from lightpen.model.limits import LEAST_IMAGES, MOST_IMAGES, SwingLimits
from lightpen.record.library.tip_library import SWUNG, ItemKind
from lightpen.record.swings.header import Names
from lightpen.swing.preparation import MissingInput
from lightpen_app.look.layouts import grid_layout, horizontal_layout, vertical_layout
from lightpen_app.look.theme import GRID
from lightpen_app.steps.start.fields import (
    LONGEST_NAME,
    ItemButton,
    ItemChoice,
    PointField,
    StationField,
)
from lightpen_app.widgets.fields import Translated, add_labelled
from lightpen_app.widgets.number_field import NumberField

LARGEST_BALL = 100.0  # mm
EDITED = tuple(map(attrgetter, ("operator", "pen", "tip", "cone")))


class NamesForm(Translated, QWidget):
    """Station, operator and items under calibration."""

    value_edited = Signal()  # something is being typed; it may be unfinished
    value_changed = Signal()  # a field other than the station is finished
    # The name of the station is finished, or chosen from the list.
    station_changed = Signal(str)
    station_entered = Signal()  # it was finished by the Enter key
    ball_entered = Signal(float)  # mm; 0 is not specified
    nominal_tip_changed = Signal()
    # ItemKind, str: a pen, tip or cone was chosen from its list
    item_chosen = Signal(object, str)
    library_requested = Signal(object)  # ItemKind: show the tip library

    def __init__(self) -> None:
        super().__init__()

        # Widgets: the order of making them is the order of the Tab key
        self._place = self.say(QGroupBox(), self.tr("Station and operator"))
        self._station = self.say(
            StationField(),
            tip=self.tr(
                "Choose a station to restore its settings, or enter a new name."
            ),
        )
        self._operator = QLineEdit(maxLength=LONGEST_NAME)
        self._probe = self.say(QGroupBox(), self.tr("Item under calibration"))
        self._pen = QLineEdit(maxLength=LONGEST_NAME)
        self._tip = QLineEdit(maxLength=LONGEST_NAME)
        self._ball = NumberField("mm", (0.0, LARGEST_BALL), 4)
        self._cone = QLineEdit(maxLength=LONGEST_NAME)
        self._nominal_tip = PointField()
        self._lists = {kind: ItemButton() for kind in SWUNG}
        self._edits = (self._operator, self._pen, self._tip, self._cone)
        self._cone_label = self.make_label(self._cone, self.tr("Cone"))
        self._nominal_label = self.make_label(
            self._nominal_tip, self.tr("Nominal tip centre")
        )
        choose = self.tr("Choose from the tip library, or open it (arrow down)")

        # Layout
        vertical_layout(self, self._place, self._probe, spacing=2 * GRID)
        place = _panel(self._place)
        self.make_field(place, self._station, self.tr("Station"))
        self.make_field(place, self._operator, self.tr("Operator"), at=(0, 1))
        probe = _panel(self._probe)
        tip_label = self.make_label(self._tip, self.tr("Probe tip"))
        pen_label = self.make_label(self._pen, self.tr("Pen serial number"))
        pens, tips = self.tr("List of pens"), self.tr("List of tips")
        cones = self.tr("List of cones")
        for kind, label, edit, name, cell in (
            (ItemKind.PEN, pen_label, self._pen, pens, (0, 0)),
            (ItemKind.CONE, self._cone_label, self._cone, cones, (0, 1)),
            (ItemKind.TIP, tip_label, self._tip, tips, (1, 0)),
        ):
            button = self.say(self._lists[kind], name=name, tip=choose)
            column = vertical_layout(probe, label, spacing=GRID // 2, at=cell)
            horizontal_layout(column, (edit, 1), button, spacing=GRID // 2)
            button.chosen.connect(partial(self.item_chosen.emit, kind))
            button.library_requested.connect(partial(self.library_requested.emit, kind))
            down = QShortcut(Qt.Key.Key_Down, edit, button.showMenu)
            down.setContext(Qt.ShortcutContext.WidgetShortcut)
        ball, unknown = self.tr("Ball diameter"), self.tr("Not specified")
        self.make_field(probe, self._ball, ball, hint=unknown, at=(1, 1))
        add_labelled(probe, self._nominal_label, self._nominal_tip, at=(2, 0, 1, 2))

        # Connections
        self._station.value_edited.connect(self.value_edited)
        self._station.value_changed.connect(self.station_changed)
        self._station.entered.connect(self.station_entered)
        for each in self._edits:
            each.textEdited.connect(self.value_edited)
            each.editingFinished.connect(self.value_changed)
        self._ball.value_changed.connect(self.ball_entered)
        self._nominal_tip.value_changed.connect(self.nominal_tip_changed)

    def value(self) -> Names:
        """Return the names as they are typed."""
        return Names(
            station=self._station.value(),
            operator=self._operator.text().strip(),
            pen=self._pen.text().strip(),
            tip=self._tip.text().strip(),
            cone=self._cone.text().strip(),
            ball_diameter=self._ball.value() or None,
        )

    def set_value(self, names: Names, before: Names | None = None) -> None:
        """Show other names; fields of unchanged ones may be in use."""
        blocked = self.blockSignals(True)
        is_other = before is None or names.station != before.station
        if is_other and names.station != self._station.value():
            self._station.set_value(names.station)
        for edit, read in zip(self._edits, EDITED, strict=True):
            text = read(names)
            is_other = before is None or text != read(before)
            if is_other and text != edit.text().strip():
                edit.setText(text)
                edit.setCursorPosition(0)
        self._ball.set_value(names.ball_diameter or 0.0)
        self.blockSignals(blocked)

    def set_stations(self, names: Sequence[str]) -> None:
        """List the stations that are known."""
        self._station.set_known(names)

    def set_more(self, more: bool) -> None:
        """Show also what has a default: station, operator, cone, nominal centre."""
        self._place.setVisible(more)
        self._nominal_tip.setVisible(more)
        cone = self._cone, self._lists[ItemKind.CONE], self._cone_label
        for each in (*cone, self._nominal_label):
            each.setVisible(more)

    def set_choices(self, kind: ItemKind, choices: Sequence[ItemChoice]) -> None:
        """List the items of the library that can be chosen."""
        self._lists[kind].set_choices(choices)

    def nominal_tip(self) -> FloatArray | None:
        """Return the nominal centre of the tip (3,), mm; None for the LED file's."""
        return self._nominal_tip.value()

    def set_nominal_tip(self, point: FloatArray | None) -> None:
        """Show another nominal centre."""
        self._nominal_tip.set_value(point)

    def set_tip_of_file(self, point: FloatArray | None) -> None:
        """Show the nominal centre that the LED file has."""
        self._nominal_tip.set_point_of_file(point)

    def focus_missing_input(self, lack: MissingInput) -> None:
        """Put the focus on the field of a name that is missing."""
        fields: dict[MissingInput, QWidget] = {
            MissingInput.STATION: self._station,
            MissingInput.OPERATOR: self._operator,
            MissingInput.PEN: self._pen,
            MissingInput.TIP: self._tip,
            MissingInput.CONE: self._cone,
        }
        fields[lack].setFocus(Qt.FocusReason.OtherFocusReason)

    def settle(self) -> None:
        """Take over the numbers that are being typed."""
        self._ball.settle()
        self._nominal_tip.settle()


class LimitsForm(Translated, QGroupBox):
    """Limits that end a swing."""

    value_changed = Signal()  # the user chose other limits
    all_requested = Signal()  # show all limits of the station

    def __init__(self) -> None:
        super().__init__()
        self.say(self, self.tr("Acceptance limits"))
        self._value = SwingLimits()

        # Widgets
        self._uncertainty = NumberField("mm", (0.0001, 1.0), 4)
        self._least = NumberField("", (LEAST_IMAGES, MOST_IMAGES), 0)
        self._most = NumberField("", (LEAST_IMAGES, MOST_IMAGES), 0)
        self._all = self.make_button(
            self.tr("All limits..."),
            self.all_requested,
            tip=self.tr(
                "Acceptance limits of swings and verifications; set by a supervisor."
            ),
        )
        self._fields = (self._uncertainty, self._least, self._most)

        # Layout
        layout = _panel(self)
        layout.setColumnStretch(2, 1)
        u = self.tr("Max. expanded uncertainty U (k = 2)")
        least, most = self.tr("Min. images"), self.tr("Max. images")
        ends = self.tr(
            "The swing ends when U of the tip along its weakest direction is "
            "within this limit. Default: {0} mm."
        ).format(f"{SwingLimits.max_uncertainty:g}")
        not_fewer = self.tr(
            "The swing does not end with fewer images. Not above the maximum. "
            "Default: {0}."
        ).format(SwingLimits.min_images)
        not_more = self.tr(
            "The swing ends at this number of images. Not below the minimum. "
            "Default: {0}."
        ).format(SwingLimits.max_images)
        self.make_field(layout, self._uncertainty, u, tip=ends)
        self.make_field(layout, self._least, least, tip=not_fewer, at=(0, 1))
        self.make_field(layout, self._most, most, tip=not_more, at=(0, 2))
        layout.addWidget(self._all, 0, 3, Qt.AlignmentFlag.AlignBottom)

        # Connections
        self._uncertainty.value_changed.connect(self.value_changed)
        self._least.value_changed.connect(self._on_least_changed)
        self._most.value_changed.connect(self._on_most_changed)

        self.set_value(self._value)

    def value(self) -> SwingLimits:
        """Return the limits."""
        return replace(
            self._value,
            max_uncertainty=self._uncertainty.value(),
            min_images=round(self._least.value()),
            max_images=round(self._most.value()),
        )

    def set_value(self, limits: SwingLimits) -> None:
        """Show other limits."""
        self._value = limits
        blocked = self.blockSignals(True)
        self._uncertainty.set_value(limits.max_uncertainty)
        self._least.set_limits(LEAST_IMAGES, limits.max_images)
        self._most.set_limits(limits.min_images, MOST_IMAGES)
        self._most.set_value(limits.max_images)
        self._least.set_value(limits.min_images)
        self.blockSignals(blocked)

    def set_guarded(self, guarded: bool) -> None:
        """Lock the fields, which need a supervisor."""
        for field in self._fields:
            field.setEnabled(not guarded)

    def settle(self) -> None:
        """Take over the numbers that are being typed."""
        for field in self._fields:
            field.settle()

    def _on_least_changed(self, least: float) -> None:
        self._most.set_limits(least, MOST_IMAGES)
        self.value_changed.emit()

    def _on_most_changed(self, most: float) -> None:
        self._least.set_limits(LEAST_IMAGES, most)
        self.value_changed.emit()


def _panel(group: QGroupBox) -> QGridLayout:
    layout = grid_layout(group, spacing=(2 * GRID, 3 * GRID // 2))
    layout.setColumnStretch(0, 1)
    layout.setColumnStretch(1, 1)
    return layout
