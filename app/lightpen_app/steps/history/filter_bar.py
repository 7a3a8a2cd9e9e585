"""Filter of the history: pen, tip, station, time."""

from collections.abc import Sequence
from datetime import date, datetime, time, timedelta

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QWidget

from lightpen.archive.chains.entries import Kind
from lightpen.archive.history.history import KnownNames
from lightpen.archive.history.queries import EntryFilter
from lightpen.local_time import local_time
from lightpen_app.look.layouts import horizontal_layout
from lightpen_app.look.theme import GRID
from lightpen_app.look.words import shortened
from lightpen_app.steps.history.texts import kind_text
from lightpen_app.widgets.choice_field import ChoiceField
from lightpen_app.widgets.date_field import DateField
from lightpen_app.widgets.translated import Translated

LEAST_DATE, DATE_WIDTH = 14 * GRID, 17 * GRID
LEAST_CHOICE = 11 * GRID  # px; six fields fit a window of 800 px


class FilterBar(Translated, QWidget):
    """Four lists and two days."""

    value_changed = Signal()

    def __init__(self) -> None:
        super().__init__()
        self._known = KnownNames()

        # Widgets: the order of making them is the order of the Tab key
        self._pen, self._tip, self._station = _choice(), _choice(), _choice()
        self._kind = _choice()
        for kind in Kind:
            self._kind.addItem("", kind)
        self._choices = (self._pen, self._tip, self._station, self._kind)
        self._begin, self._end = DateField(), DateField()
        fields = (*self._choices, self._begin, self._end)
        texts = (
            self.tr("Pen"),
            self.tr("Tip"),
            self.tr("Station"),
            self.tr("Entry type"),
            self.tr("From"),
            self.tr("To"),
        )

        # Layout
        layout = horizontal_layout(self)
        hints = 4 * ("",) + 2 * (self.tr("any day"),)
        for field, text, hint in zip(fields, texts, hints, strict=True):
            self.make_field(layout, field, text, hint=hint, stretch=1)
        for choice in self._choices:
            self.say_items(choice, (self.tr("All"),))
        for day in (self._begin, self._end):
            day.setMinimumWidth(LEAST_DATE)
            day.setMaximumWidth(DATE_WIDTH)

        # Connections
        self._pen.currentIndexChanged.connect(self._on_pen_changed)
        for choice in (self._tip, self._station, self._kind):
            choice.currentIndexChanged.connect(self.value_changed)
        for day in (self._begin, self._end):
            day.value_changed.connect(self.value_changed)

        self._retranslate()

    def value(self) -> EntryFilter:
        """Return the filter; the last day is included."""
        end = self._end.value()
        named = (self._pen, self._tip, self._station)
        pen, tip, station = (choice.currentData() or "" for choice in named)
        kind = self._kind.currentData()
        return EntryFilter(
            pen,
            tip,
            station,
            kinds=(Kind(kind),) if kind else (),
            begin=_midnight(self._begin.value()),
            end=_midnight(None if end is None else end + timedelta(days=1)),
        )

    def set_known(self, known: KnownNames) -> None:
        """Set the known names; the selection is kept."""
        if known == self._known:
            return
        self._known = known
        _list(self._pen, known.pens)
        _list(self._station, known.stations)
        self._list_tips()

    def _list_tips(self) -> None:
        _list(self._tip, self._known.tips_of(self._pen.currentData() or ""))

    def _on_pen_changed(self) -> None:
        self._list_tips()
        self.value_changed.emit()

    def _retranslate(self) -> None:
        for i, kind in enumerate(Kind, start=1):
            self._kind.setItemText(i, kind_text(kind))


def _choice() -> ChoiceField:
    choice = ChoiceField()
    choice.addItem("", "")
    policy = ChoiceField.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon
    choice.setSizeAdjustPolicy(policy)
    choice.setMinimumWidth(LEAST_CHOICE)
    return choice


def _list(choice: ChoiceField, names: Sequence[str]) -> None:
    """List names after the choice *all*; the selected one stays selected."""
    chosen = choice.currentData()
    blocked = choice.blockSignals(True)
    while choice.count() > 1:
        choice.removeItem(1)
    for name in filter(None, names):
        choice.addItem(shortened(name), name)
    choice.setCurrentIndex(max(0, choice.findData(chosen)))
    choice.blockSignals(blocked)


def _midnight(day: date | None) -> datetime | None:
    return None if day is None else local_time(datetime.combine(day, time()))
