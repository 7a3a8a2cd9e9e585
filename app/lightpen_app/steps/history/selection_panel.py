"""The selected entries: comparison of two, repeatability of several."""

from collections.abc import Callable, Sequence
from datetime import datetime

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QWidget
from typing_extensions import override

from lightpen.archive.chains import StoredEntry
from lightpen.archive.history import DueTip
from lightpen.comparisons.repeatability import (
    Comparison,
    Repeatability,
    Trend,
    compare,
    has_tip,
    repeatability_of,
)
from lightpen.estimation.reports.verdict import Grade
from lightpen.model.limits import VerificationLimits, rule_in_words
from lightpen_app.look.languages import worded
from lightpen_app.look.layouts import horizontal_layout, set_stacked, vertical_layout
from lightpen_app.look.phrases import GRADE_MARKS
from lightpen_app.look.theme import GRID, TextSize, text_label
from lightpen_app.look.words import (
    AXES,
    LEAST_SHOWN,
    PARTED,
    day_text,
    mm_text,
    moment_text,
    shortened,
)
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.fitting import ResponsiveLayout
from lightpen_app.widgets.state_banner import SignLabel, StatusMessage
from lightpen_app.widgets.tables import Figures, NumberTable

PAIR = 2


class SelectionPanel(ResponsiveLayout, Translated, QWidget):
    """Compares two entries, and shows the scatter of all selected ones.

    With fewer than two selected, the scatter of the whole trend is shown.
    """

    narrow_below = 110 * GRID  # px; then the comparison is above the repeatability
    report_requested = Signal()  # show the repeatability report

    def __init__(self) -> None:
        super().__init__()
        self._selected: tuple[StoredEntry, ...] = ()
        self._trend = Trend()

        # Widgets
        self._heads = tuple(text_label(TextSize.LEAD) for _ in range(2))
        self._compared, self._scattered = NumberTable(), NumberTable()
        self._change, self._verdict = SignLabel(), SignLabel()
        self._limits = VerificationLimits()
        self._report = self.make_button(
            self.tr("Repeatability report..."), self.report_requested
        )

        # Layout
        layout = vertical_layout(self, margins=(0, GRID, 0, 0))
        self._sides = horizontal_layout(layout)
        sides = zip(
            self._heads,
            (self._compared, self._scattered),
            (self._change, self._verdict),
            strict=True,
        )
        for side in sides:
            vertical_layout(self._sides, *side, 1, spacing=GRID // 2, stretch=1)
        horizontal_layout(layout, self._report, 1)
        layout.addStretch(1)

        self._retranslate()

    @override
    def _use_room(self) -> None:
        set_stacked(self._sides, self._room.is_narrow)

    def set_limits(self, limits: VerificationLimits) -> None:
        """Judge by other limits."""
        if limits != self._limits:
            self._limits = limits
            self._retranslate()

    def limits(self) -> VerificationLimits:
        """Return the limits of the verdicts."""
        return self._limits

    def set_value(self, selected: Sequence[StoredEntry], trend: Trend) -> None:
        """Show the selected entries and the entries of the trend."""
        self._selected = tuple(filter(has_tip, selected))
        self._trend = trend
        self._retranslate()

    def comparison(self) -> Comparison | None:
        """Return the comparison; None unless two tips are selected."""
        return compare(*self._selected) if len(self._selected) == PAIR else None

    def repeatability(self) -> Repeatability | None:
        """Return the repeatability; None for fewer than two tips."""
        return repeatability_of(self.studied(), self._limits)

    def studied(self) -> tuple[StoredEntry, ...]:
        """Return the entries of the repeatability."""
        return self._selected if len(self._selected) >= PAIR else self._trend.entries

    def _retranslate(self) -> None:
        needed = self.tr("Repeatability needs two calibrations of one tip.")
        self._report.set_why_not("" if self.repeatability() else needed)
        self._show_comparison(self.comparison())
        self._show_repeatability(self.repeatability())

    def _show_comparison(self, found: Comparison | None) -> None:
        self._compared.setVisible(found is not None)
        self._change.set_value(StatusMessage())
        if found is None:
            self._heads[0].setText(
                self.tr("Select two entries with a tip to compare them.")
            )
            return
        dates = [
            moment_text(each.entry.event.at) for each in (found.earlier, found.later)
        ]
        self._heads[0].setText(self.tr("{0} and {1}").format(*dates))
        columns = (
            self.tr("Earlier / mm"),
            self.tr("Later / mm"),
            self.tr("Change / mm"),
            self.tr("U (k = 2) / mm"),
        )
        cells = tuple(_compared_row(found, axis) for axis in range(3))
        self._compared.set_value(Figures(columns, AXES, cells))
        if not found.is_same_tip:
            text = self.tr("The entries belong to different pens or tips.")
            self._change.set_value(StatusMessage.warning(text))
        elif found.change.is_unexplained:
            text = worded(found.change.remark(dates[0].partition(" ")[0]))
            self._change.set_value(StatusMessage.warning(text))
        else:
            text = self.tr("The change is within the combined uncertainty.")
            self._change.set_value(StatusMessage.good(text))

    def _show_repeatability(self, found: Repeatability | None) -> None:
        self._scattered.setVisible(found is not None)
        self._verdict.set_value(StatusMessage())
        if found is None:
            self._heads[1].setText(
                self.tr("Repeatability needs two calibrations of one tip.")
            )
            return
        n_tips = len(found.tips)
        is_selected = len(self._selected) >= PAIR
        self._heads[1].setText(
            self.tr("Repeatability of the {0} selected calibrations").format(n_tips)
            if is_selected
            else self.tr("Repeatability of all {0} calibrations of the trend").format(
                n_tips
            )
        )
        columns = (
            self.tr("Mean / mm"),
            self.tr("Std. dev. / mm"),
            self.tr("Range / mm"),
            self.tr("Stated U / mm"),
        )
        cells = tuple(_scattered_row(found, axis) for axis in range(3))
        self._scattered.set_value(Figures(columns, AXES, cells))
        assessment = found.assessment
        text = worded(assessment.reason)
        if not assessment.is_accepted:
            text += " " + worded(assessment.next_step)
        text += " " + worded(rule_in_words(self._limits))
        mark = GRADE_MARKS[Grade(assessment.grade)]
        self._verdict.set_value(StatusMessage(text, *mark))


def _compared_row(found: Comparison, axis: int) -> tuple[str, ...]:
    change = found.change
    uncertainty = float(change.expanded_uncertainty[axis])
    values = []
    for each in (found.earlier, found.later):
        tip = each.entry.event.tip_pen_mm
        assert tip is not None
        values.append(tip[axis])
    values += [float(change.difference[axis]), uncertainty]
    return tuple(map(mm_text, values))


def _scattered_row(found: Repeatability, axis: int) -> tuple[str, ...]:
    points = found.scatter.points[:, axis]
    deviation = float(found.scatter.deviation[axis])
    stated = sum(float(tip.uncertainty[axis]) for tip in found.tips) / len(found.tips)
    values = (float(points.mean()), deviation, float(points.max() - points.min()))
    return tuple(map(mm_text, (*values, stated)))


class DuePanel(Translated, QWidget):
    """Shows the current tips with their due dates."""

    def __init__(self, now: Callable[[], datetime]) -> None:
        super().__init__()
        self._now = now
        self._tips: tuple[DueTip, ...] = ()

        # Widgets
        self._head = text_label(TextSize.LEAD)
        self._table = NumberTable()

        # Layout
        vertical_layout(self, self._head, self._table, 1, margins=(0, GRID, 0, 0))

        self._retranslate()

    def set_tips(self, tips: Sequence[DueTip]) -> None:
        """Show other tips."""
        self._tips = tuple(tips)
        self._retranslate()

    def _retranslate(self) -> None:
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
