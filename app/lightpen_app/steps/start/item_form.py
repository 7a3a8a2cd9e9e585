"""Form for an item of the tip library."""

from datetime import date

from msgspec import structs
from PySide6.QtCore import Signal
from PySide6.QtWidgets import QGridLayout, QLabel, QLineEdit, QWidget

from lightpen.local_time import local_now
from lightpen.model.artefacts import KIND_WORDS, SIDES, ArtefactKind, Side
from lightpen.model.limits import MOST_DAYS
from lightpen.record.library.tip_library import (
    LARGEST_BALL,
    LARGEST_CHANGE,
    LARGEST_REFERENCE,
    LONGEST_ID,
    AnyItem,
    ListedReference,
    ListedTip,
)
from lightpen_app.look.languages import worded
from lightpen_app.look.layouts import GridPlace, grid_layout
from lightpen_app.look.theme import GRID
from lightpen_app.steps.start.fields import PointField
from lightpen_app.widgets.fields import ChoiceField, DateField, Translated, add_labelled
from lightpen_app.widgets.number_field import NumberField

LONGEST_NOTE = 500  # characters


class ItemForm(Translated, QWidget):
    """Shows an item; the id of one that is known cannot be changed."""

    value_edited = Signal()  # something is typed

    def __init__(self) -> None:
        super().__init__()
        self._item: AnyItem = ListedTip(id="?")

        # Widgets
        self._id = QLineEdit(maxLength=LONGEST_ID)
        to_come = date(local_now().year + 1, 8, 14)
        self._due, self._certified = DateField(to_come), DateField()
        self._certificate = QLineEdit(maxLength=LONGEST_ID)
        self._value = NumberField("mm", (0.0, LARGEST_REFERENCE), 4)
        self._shape, self._side = ChoiceField(), ChoiceField()
        for shape in (None, *ArtefactKind):
            self._shape.addItem("", shape)
        for side in SIDES:
            self._side.addItem("", side)
        self._uncertainty = NumberField("mm", (0.0, 1.0), 4)
        self._ball = NumberField("mm", (0.0, LARGEST_BALL), 4)
        self._change = self.say(
            NumberField("mm", (0.0, LARGEST_CHANGE), 4),
            tip=self.tr(
                "Max. distance of the tip from its previous calibration. Beyond it, "
                "the result needs checking."
            ),
        )
        self._days = NumberField("", (0, MOST_DAYS), 0)
        self._nominal = PointField()
        self._note = QLineEdit(maxLength=LONGEST_NOTE)
        own = (self._ball, self._change, self._days)
        of_reference = self._value, self._shape, self._uncertainty, self._side
        nothing, no_limit = self.tr("Not specified"), self.tr("No limit")
        usual = self.tr("As for the station")
        texts = (
            (self._id, self.tr("ID (as on label)"), ""),
            (self._due, self.tr("Expiry date"), ""),
            (self._certificate, self.tr("Certificate number"), ""),
            (self._certified, self.tr("Date of the certificate"), ""),
            (self._value, self.tr("Certified value"), nothing),
            (self._shape, self.tr("Shape"), ""),
            (self._uncertainty, self.tr("U (k = 2) of the value"), nothing),
            (self._side, self.tr("Contact"), ""),
            (self._ball, self.tr("Ball diameter"), nothing),
            (self._change, self.tr("Max. change since last calibration"), no_limit),
            (self._days, self.tr("Calibration interval (days)"), usual),
            (self._nominal, self.tr("Nominal tip centre"), ""),
            (self._note, self.tr("Comment"), ""),
        )
        self._labels: dict[QWidget, QLabel] = {
            field: self.make_label(field, text, hint=hint)
            for field, text, hint in texts
        }
        for field in own:
            self._labels[field].setWordWrap(True)
        last_day = self.tr("Last day of use, for example {0}; empty for none")
        self.say(self._due, tip=last_day.format(to_come))

        # Layout
        grid = grid_layout(self, spacing=(2 * GRID, GRID // 2))
        self._add(grid, self._id, at=(0, 0))
        self._add(grid, self._due, at=(0, 1))
        self._add(grid, self._note, at=(0, 2, 1, 2))
        self._tip_only = QWidget()
        self._add(grid, self._certificate, at=(1, 0))
        self._add(grid, self._certified, at=(1, 1))
        self._reference_only = QWidget()
        row = grid_layout(self._reference_only, spacing=(2 * GRID, GRID // 2))
        for column, of_it in enumerate(of_reference):
            self._add(row, of_it, at=(0, column))
        grid.addWidget(self._reference_only, 3, 0, 1, 4)
        grid.addWidget(self._tip_only, 2, 0, 1, 4)
        inner = grid_layout(self._tip_only, spacing=(2 * GRID, GRID // 2))
        for column, field in enumerate(own):
            self._add(inner, field, at=(0, column))
        self._add(inner, self._nominal, at=(1, 0, 1, 4))
        for layout in (grid, inner):
            for column in range(4):
                layout.setColumnStretch(column, 1)

        # Connections
        self._id.textChanged.connect(self.value_edited)
        for day in (self._due, self._certified):
            day.textChanged.connect(self.value_edited)

        self._refresh()

    def value(self) -> AnyItem:
        """Return the item in the form."""
        for field in (self._ball, self._change, self._days):
            field.settle()
        self._nominal.settle()
        item = structs.replace(
            self._item,
            id=self._id.text().strip(),
            due=self._due.value(),
            certificate=self._certificate.text().strip(),
            certified=self._certified.value(),
            note=self._note.text().strip(),
        )
        if isinstance(item, ListedReference):
            self._value.settle()
            self._uncertainty.settle()
            shape, side = self._shape.currentData(), self._side.currentData()
            return structs.replace(
                item,
                certified_mm=self._value.value() or None,
                shape=None if shape is None else ArtefactKind(shape),
                uncertainty_mm=self._uncertainty.value(),
                side=Side(side),
            )
        if not isinstance(item, ListedTip):
            return item
        nominal = self._nominal.value()
        return structs.replace(
            item,
            ball_diameter_mm=self._ball.value() or None,
            max_change_mm=self._change.value() or None,
            max_days=round(self._days.value()) or None,
            nominal_tip_mm=None if nominal is None else tuple(nominal.tolist()),
        )

    def set_value(self, item: AnyItem, *, is_new: bool) -> None:
        """Show an item."""
        self._item = item
        self._id.setText(item.id)
        self._id.setReadOnly(not is_new)
        self._due.set_value(item.due)
        self._certificate.setText(item.certificate)
        self._certified.set_value(item.certified)
        self._reference_only.setVisible(isinstance(item, ListedReference))
        if isinstance(item, ListedReference):
            self._value.set_value(item.certified_mm or 0.0)
            self._shape.setCurrentIndex(self._shape.findData(item.shape))
            self._uncertainty.set_value(item.uncertainty_mm)
            self._side.setCurrentIndex(self._side.findData(item.side))
        self._note.setText(item.note)
        is_tip = isinstance(item, ListedTip)
        self._tip_only.setVisible(is_tip)
        if isinstance(item, ListedTip):
            self._ball.set_value(item.ball_diameter_mm or 0.0)
            self._change.set_value(item.max_change_mm or 0.0)
            self._days.set_value(item.max_days or 0)
            self._nominal.set_value(item.nominal_tip)
        self._refresh()

    def focus_first(self) -> None:
        """Put the keyboard into the first field that can be changed."""
        (self._due if self._id.isReadOnly() else self._id).setFocus()

    def has_id(self) -> bool:
        """Return whether an id is typed."""
        return bool(self._id.text().strip())

    def has_day(self) -> bool:
        """Return whether the fields of days are valid or empty."""
        days = (self._due, self._certified)
        return all(not d.text().strip() or d.value() is not None for d in days)

    def _add(self, grid: QGridLayout, field: QWidget, at: GridPlace) -> None:
        add_labelled(grid, self._labels[field], field, at=at)

    def _refresh(self) -> None:
        self._shape.setItemText(0, self.tr("Not specified"))
        for index, shape in enumerate(ArtefactKind, start=1):
            self._shape.setItemText(index, worded(KIND_WORDS[shape]))
        for index, side in enumerate(SIDES):
            self._side.setItemText(index, worded(SIDES[side]))
