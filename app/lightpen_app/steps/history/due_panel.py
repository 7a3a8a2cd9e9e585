"""Due dates of the current tips."""

from collections.abc import Callable, Sequence
from datetime import datetime

from PySide6.QtCore import QSignalBlocker, Signal
from PySide6.QtWidgets import QWidget

from lightpen.archive.history.due import DueTip
from lightpen.model.limits import MOST_DAYS, MOST_SWINGS, DueRule
from lightpen_app.look.layouts import fill, horizontal_layout, vertical_layout
from lightpen_app.look.theme import GRID, TextSize, text_label
from lightpen_app.look.tooltips import set_tooltip
from lightpen_app.look.words import LEAST_SHOWN, PARTED, day_text, shortened
from lightpen_app.widgets.number_field import NumberField
from lightpen_app.widgets.number_table import Figures, NumberTable
from lightpen_app.widgets.translated import Translated

FIELD_WIDTH = 20 * GRID


class DuePanel(Translated, QWidget):
    """Shows the current tips with their due dates, by a rule that can be changed.

    Where a password guards the limits, it is changed with them, at Start.
    """

    rule_changed = Signal(object)  # DueRule: the user chose another rule

    def __init__(self, now: Callable[[], datetime]) -> None:
        super().__init__()
        self._now = now
        self._tips: tuple[DueTip, ...] = ()
        self._is_guarded = False

        # Widgets
        self._days = NumberField("", (1, MOST_DAYS), 0)
        self._swings = NumberField("", (0, MOST_SWINGS), 0)
        self._fields = (self._days, self._swings)
        self._head = text_label(TextSize.LEAD)
        self._table = NumberTable()

        # Layout
        layout = vertical_layout(self, margins=(0, GRID, 0, 0))
        fields = horizontal_layout(layout, spacing=2 * GRID)
        days, swings = (
            self.tr("Calibration interval (days)"),
            self.tr("Max. swings of the pen"),
        )
        self.make_field(fields, self._days, days)
        self.make_field(fields, self._swings, swings, hint=self.tr("No limit"))
        fill(fields, 1)
        fill(layout, self._head, self._table, 1)

        # Connections
        for field in self._fields:
            field.setFixedWidth(FIELD_WIDTH)
            field.value_changed.connect(self._on_edited)

        self._retranslate()

    def rule(self) -> DueRule:
        """Return the rule in the fields."""
        return DueRule(round(self._days.value()), round(self._swings.value()))

    def set_rule(self, rule: DueRule, *, is_guarded: bool) -> None:
        """Show the rule, and whether only a supervisor can change it."""
        for field, number in zip(
            self._fields, (rule.max_days, rule.max_swings), strict=True
        ):
            with QSignalBlocker(field):
                field.set_value(number)
            field.setEnabled(not is_guarded)
        self._is_guarded = is_guarded
        self._refresh()

    def set_tips(self, tips: Sequence[DueTip]) -> None:
        """Show other tips."""
        self._tips = tuple(tips)
        self._refresh()

    def _on_edited(self) -> None:
        self.rule_changed.emit(self.rule())

    def _retranslate(self) -> None:
        self._refresh()

    def _refresh(self) -> None:
        laid_down = self.tr("Set by a supervisor at Start: All limits...")
        swings = self.tr("Each swing, with any tip, wears the common tip seat.")
        set_tooltip(self._days, laid_down if self._is_guarded else "")
        set_tooltip(self._swings, laid_down if self._is_guarded else swings)
        now = self._now()
        n_due = sum(tip.is_due(now) for tip in self._tips)
        self._head.setText(
            self.tr("{0} of {1} tips in use at this station are due.").format(
                n_due, len(self._tips)
            )
            if self._tips
            else self.tr("No tip is in use at this station.")
        )
        self._table.setVisible(bool(self._tips))
        columns = (
            self.tr("Calibrated"),
            self.tr("Due"),
            self.tr("Swings since"),
            self.tr("Swings left"),
            self.tr("State"),
        )
        rows = tuple(map(_name, self._tips))
        cells = tuple(self._cells(tip, now) for tip in self._tips)
        self._table.set_value(Figures(columns, rows, cells))

    def _cells(self, tip: DueTip, now: datetime) -> tuple[str, ...]:
        days = (tip.calibrated, tip.due)
        return (
            *(day_text(day) for day in days),
            f"{tip.n_swings}",
            self.tr("No limit") if tip.n_left is None else f"{max(0, tip.n_left)}",
            self.tr("DUE") if tip.is_due(now) else self.tr("valid"),
        )


def _name(tip: DueTip) -> str:
    names = tip.entry.entry.event.names
    return PARTED.join(shortened(n, LEAST_SHOWN) for n in (names.pen, names.tip))
