"""Form for an item of the tip library."""

from datetime import date
from typing import Any

from msgspec import structs
from PySide6.QtCore import Signal
from PySide6.QtWidgets import QLineEdit, QWidget
from typing_extensions import override

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
    """Shows an item; the id of one that is known cannot be changed.

    Fields are named as those of the item.
    """

    value_edited = Signal()  # something is typed

    def __init__(self) -> None:
        super().__init__()
        self._item: AnyItem = ListedTip(id="?")

        # Widgets
        self._words = {
            "id": QLineEdit(maxLength=LONGEST_ID),
            "certificate": QLineEdit(maxLength=LONGEST_ID),
            "note": QLineEdit(maxLength=LONGEST_NOTE),
        }
        to_come = date(local_now().year + 1, 8, 14)
        self._days = {"due": DateField(to_come), "certified": DateField()}
        self._numbers = {
            "certified_mm": NumberField("mm", (0.0, LARGEST_REFERENCE), 4),
            "uncertainty_mm": NumberField("mm", (0.0, 1.0), 4),
            "ball_diameter_mm": NumberField("mm", (0.0, LARGEST_BALL), 4),
            "max_change_mm": NumberField("mm", (0.0, LARGEST_CHANGE), 4),
            "max_days": NumberField("", (0, MOST_DAYS), 0),
        }
        self._choices = {"shape": ChoiceField(), "side": ChoiceField()}
        for choice, values in (("shape", (None, *ArtefactKind)), ("side", SIDES)):
            for each in values:
                self._choices[choice].addItem("", each)
        self._nominal = PointField()
        self._tip_only, self._reference_only = QWidget(), QWidget()
        change = self.tr(
            "Max. distance of the tip from its previous calibration. Beyond it, "
            "the result needs checking."
        )
        self.say(self._numbers["max_change_mm"], tip=change)
        last_day = self.tr("Last day of use, for example {0}; empty for none")
        self.say(self._days["due"], tip=last_day.format(to_come))

        # Layout
        spacing = 2 * GRID, GRID // 2
        grid = grid_layout(self, spacing=spacing)
        of_tip = grid_layout(self._tip_only, spacing=spacing)
        of_reference = grid_layout(self._reference_only, spacing=spacing)
        grid.addWidget(self._tip_only, 2, 0, 1, 4)
        grid.addWidget(self._reference_only, 3, 0, 1, 4)
        nothing, no_limit = self.tr("Not specified"), self.tr("No limit")
        usual = self.tr("As for the station")
        texts = {
            "id": (self.tr("ID (as on label)"), ""),
            "due": (self.tr("Expiry date"), ""),
            "note": (self.tr("Comment"), ""),
            "certificate": (self.tr("Certificate number"), ""),
            "certified": (self.tr("Date of the certificate"), ""),
            "certified_mm": (self.tr("Certified value"), nothing),
            "shape": (self.tr("Shape"), ""),
            "uncertainty_mm": (self.tr("U (k = 2) of the value"), nothing),
            "side": (self.tr("Contact"), ""),
            "ball_diameter_mm": (self.tr("Ball diameter"), nothing),
            "max_change_mm": (self.tr("Max. change since last calibration"), no_limit),
            "max_days": (self.tr("Calibration interval (days)"), usual),
        }
        fields = {**self._words, **self._days, **self._numbers, **self._choices}
        of_all: tuple[GridPlace, ...] = (0, 0), (0, 1), (0, 2, 1, 2), (1, 0), (1, 1)
        places = [(grid, at) for at in of_all]
        places += [(of_reference, (0, column)) for column in range(4)]
        places += [(of_tip, (0, column)) for column in range(3)]
        for (name, (text, hint)), (layout, at) in zip(
            texts.items(), places, strict=True
        ):
            label = self.make_label(fields[name], text, hint=hint)
            label.setWordWrap(layout is of_tip)
            add_labelled(layout, label, fields[name], at=at)
        nominal = self.tr("Nominal tip centre")
        self.make_field(of_tip, self._nominal, nominal, at=(1, 0, 1, 4))
        for layout in (grid, of_tip):
            for column in range(4):
                layout.setColumnStretch(column, 1)

        # Connections
        for edit in (self._words["id"], *self._days.values()):
            edit.textChanged.connect(self.value_edited)

        self._refresh()

    def value(self) -> AnyItem:
        """Return the item in the form."""
        for field in self._numbers.values():
            field.settle()
        self._nominal.settle()
        nominal, shape = self._nominal.value(), self._choices["shape"].currentData()
        typed: dict[str, Any] = {
            **{name: edit.text().strip() for name, edit in self._words.items()},
            **{name: day.value() for name, day in self._days.items()},
            **{name: field.value() or None for name, field in self._numbers.items()},
            "uncertainty_mm": self._numbers["uncertainty_mm"].value(),
            "max_days": round(self._numbers["max_days"].value()) or None,
            "shape": None if shape is None else ArtefactKind(shape),
            "side": Side(self._choices["side"].currentData()),
            "nominal_tip_mm": None if nominal is None else tuple(nominal.tolist()),
        }
        own = type(self._item).__struct_fields__
        return structs.replace(
            self._item, **{name: typed[name] for name in own if name in typed}
        )

    def set_value(self, item: AnyItem, *, is_new: bool) -> None:
        """Show an item."""
        self._item = item
        self._words["id"].setReadOnly(not is_new)
        self._tip_only.setVisible(isinstance(item, ListedTip))
        self._reference_only.setVisible(isinstance(item, ListedReference))
        known = structs.asdict(item)
        for name, edit in self._words.items():
            edit.setText(known[name])
        for name, day in self._days.items():
            day.set_value(known[name])
        for name, field in self._numbers.items():
            field.set_value(known.get(name) or 0.0)
        for name, choice in self._choices.items():
            if name in known:
                choice.setCurrentIndex(choice.findData(known[name]))
        if isinstance(item, ListedTip):
            self._nominal.set_value(item.nominal_tip)

    def focus_first(self) -> None:
        """Put the keyboard into the first field that can be changed."""
        name = self._words["id"]
        (self._days["due"] if name.isReadOnly() else name).setFocus()

    def has_id(self) -> bool:
        """Return whether an id is typed."""
        return bool(self._words["id"].text().strip())

    def has_day(self) -> bool:
        """Return whether the fields of days are valid or empty."""
        return all(
            not day.text().strip() or day.value() is not None
            for day in self._days.values()
        )

    @override
    def _refresh(self) -> None:
        shape, side = self._choices["shape"], self._choices["side"]
        shape.setItemText(0, self.tr("Not specified"))
        for index, kind in enumerate(ArtefactKind, start=1):
            shape.setItemText(index, worded(KIND_WORDS[kind]))
        for index, words in enumerate(SIDES.values()):
            side.setItemText(index, worded(words))
