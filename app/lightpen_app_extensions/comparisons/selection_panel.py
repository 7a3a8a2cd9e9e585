"""The selected entries of History: comparison of two, repeatability of several."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from typing_extensions import override

from lightpen.archive.chains import StoredEntry
from lightpen.archive.trends import Trend, has_tip
from lightpen.estimation.reports.verdict import Grade
from lightpen.formats.opened_files import InputFile
from lightpen.formats.own_json import file_entry
from lightpen.model.limits import VerificationLimits
from lightpen.model.names import Origin
from lightpen_app.face import SelectionTab
from lightpen_app.look.languages import worded
from lightpen_app.look.layouts import horizontal_layout, set_stacked, vertical_layout
from lightpen_app.look.phrases import GRADE_MARKS
from lightpen_app.look.theme import GRID, TextSize, text_label
from lightpen_app.look.words import AXES, mm_text, moment_text
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.fitting import ResponsiveLayout
from lightpen_app.widgets.state_banner import SignLabel, StatusMessage
from lightpen_app.widgets.tables import Figures, NumberTable
from lightpen_app.work.job import Job, Report
from lightpen_app.work.workbench import Workbench
from lightpen_extensions.comparisons.assessment import (
    attributed,
    keep_verification,
    rule_in_words,
    verification_record,
)
from lightpen_extensions.comparisons.repeatability import (
    Comparison,
    Repeatability,
    compare,
    repeatability_entries,
    repeatability_of,
)

PAIR = 2


class SelectionPanel(ResponsiveLayout, Translated, SelectionTab):
    """Compares two entries, and shows the scatter of all selected ones.

    With fewer than two selected, the scatter of the whole trend is shown.
    """

    narrow_below = 110 * GRID  # px; then the comparison is above the repeatability

    def __init__(self, workbench: Workbench) -> None:
        super().__init__()
        self._workbench = workbench
        self._selected: tuple[StoredEntry, ...] = ()
        self._trend = Trend()
        self._limits = VerificationLimits()

        # Widgets
        self._heads = tuple(text_label(TextSize.LEAD) for _ in range(2))
        self._compared, self._scattered = NumberTable(), NumberTable()
        self._change, self._verdict = SignLabel(), SignLabel()
        self._report = self.make_button(
            self.tr("Repeatability report..."), self._on_report_clicked
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

        self._refresh()

    @override
    def _use_room(self) -> None:
        set_stacked(self._sides, self._room.is_narrow)

    @override
    def title(self) -> str:
        return self.tr("Repeatability")

    @override
    def set_value(self, selected: Sequence[StoredEntry], trend: Trend) -> None:
        self._selected = tuple(filter(has_tip, selected))
        self._trend = trend
        self._limits = self._workbench.selection.limits.verification
        self._refresh()

    def comparison(self) -> Comparison | None:
        """Return the comparison; None unless two tips are selected."""
        return compare(*self._selected) if len(self._selected) == PAIR else None

    def repeatability(self) -> Repeatability | None:
        """Return the repeatability; None for fewer than two tips."""
        return repeatability_of(self._studied(), self._limits)

    def _studied(self) -> tuple[StoredEntry, ...]:
        return self._selected if len(self._selected) >= PAIR else self._trend.entries

    def _on_report_clicked(self) -> None:
        """Keep and enter the repeatability that is shown."""
        found, entries, limits = self.repeatability(), self._studied(), self._limits
        if found is None:
            return
        folder, logbook = self._workbench.folder, self._workbench.run.logbook
        operator = self._workbench.selection.preparation.names.operator

        def keep(_: Report) -> Path:
            file = keep_study(folder, found, entries, limits, operator)
            logbook.enter_owed()
            return file

        notify = self._workbench.notifications.notify
        job = Job(keep, self)
        job.start(self.verification_kept, lambda why: notify(self, why))

    def _refresh(self) -> None:
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
        needed = self.tr("Repeatability needs two calibrations of one tip.")
        self._report.set_why_not("" if found else needed)
        self._scattered.setVisible(found is not None)
        self._verdict.set_value(StatusMessage())
        if found is None:
            self._heads[1].setText(needed)
            return
        head = (
            self.tr("Repeatability of the {0} selected calibrations")
            if len(self._selected) >= PAIR
            else self.tr("Repeatability of all {0} calibrations of the trend")
        )
        self._heads[1].setText(head.format(len(found.tips)))
        columns = (
            self.tr("Mean / mm"),
            self.tr("Std. dev. / mm"),
            self.tr("Range / mm"),
            self.tr("Stated U / mm"),
        )
        stated = np.mean([tip.uncertainty for tip in found.tips], axis=0)
        scatter = found.scatter
        values = scatter.mean, scatter.deviation, scatter.range, stated
        cells = tuple(
            tuple(mm_text(float(each[axis])) for each in values) for axis in range(3)
        )
        self._scattered.set_value(Figures(columns, AXES, cells))
        assessment = found.assessment
        words = [assessment.reason, rule_in_words(self._limits)]
        if not assessment.is_accepted:
            words.insert(1, assessment.next_step)
        mark = GRADE_MARKS[Grade(assessment.grade)]
        text = " ".join(map(worded, words))
        self._verdict.set_value(StatusMessage(text, *mark))


def _compared_row(found: Comparison, axis: int) -> tuple[str, ...]:
    change = found.change
    values = []
    for each in (found.earlier, found.later):
        tip = each.entry.event.tip_pen_mm
        assert tip is not None
        values.append(tip[axis])
    values += [float(change.difference[axis]), float(change.expanded_uncertainty[axis])]
    return tuple(map(mm_text, values))


def keep_study(
    data: Path,
    found: Repeatability,
    entries: Sequence[StoredEntry],
    limits: VerificationLimits,
    operator: str,
) -> Path:
    """Keep a study of tips as a verification of a data folder, and return its file."""
    events = [each.entry.event for each in entries]
    results = [each.result for each in events if each.result is not None]
    record = verification_record(
        "repeatability",
        repeatability_entries(found),
        found.assessment,
        {"repeatability": limits.repeatability},
        {"files": [file_entry(InputFile(Path(r.place), r.sha256)) for r in results]},
        rule_in_words(limits),
    )
    is_simulated = any(each.is_simulated for each in events)
    origin = Origin.SIMULATED if is_simulated else events[-1].origin
    names = replace(events[-1].names, operator=operator)
    record = attributed(record, names, origin)
    return keep_verification(data, record, is_simulated=is_simulated)
