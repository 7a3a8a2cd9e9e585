"""Panels on the whole archive: check and save, and tips that are due."""

from collections.abc import Callable
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import TypeVar

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QWidget
from typing_extensions import override

from lightpen.archive.checks import ArchiveCheckResult, check_archive
from lightpen.archive.history import DueTip, EntryFilter, due_tips, save_entries
from lightpen.archive.logbook import ReplicationState
from lightpen.model.limits import DueRule
from lightpen_app.look.languages import worded
from lightpen_app.look.layouts import fill, horizontal_layout, vertical_layout
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.look.words import LEAST_SHOWN, PARTED, day_text, shortened
from lightpen_app.steps.history.entry_panel import NOTICE
from lightpen_app.widgets.bars import JobProgress
from lightpen_app.widgets.controls import ask_file
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.state_banner import SignLabel, StatusMessage
from lightpen_app.widgets.tables import Figures, NumberTable
from lightpen_app.work.job import Job, LatestJob, Report
from lightpen_app.work.workbench import Workbench

T = TypeVar("T")
MOST_SHOWN = 100  # findings; the rest is counted


class ArchivePanel(Translated, QWidget):
    """Checks and saves the archive, one at a time, and shows its replication.

    ``wanted`` returns the filter of the entries that are saved.
    """

    checked = Signal()  # a check has ended

    def __init__(self, workbench: Workbench, wanted: Callable[[], EntryFilter]) -> None:
        super().__init__()
        self._logbook, self._place = workbench.run.logbook, workbench.save_place
        self._folder, self._clock = workbench.folder, workbench.around.now
        self._notices, self._wanted = workbench.notifications, wanted
        self._work: Job | None = None
        self.found: ArchiveCheckResult | None = None  # None before the first check
        self._delivery: ReplicationState | None = None

        # Widgets
        self._check = self.make_button(self.tr("Check the archive"), self._on_check)
        self._save = self.make_button(
            self.tr("Save listed entries (CSV)..."), self._ask_save
        )
        self.progress = JobProgress()
        self._delivered = SignLabel()
        self._outcome = SignLabel()
        self._findings: list[SignLabel] = []

        # Layout
        self._layout = layout = vertical_layout(self, margins=(0, GRID, 0, 0))
        horizontal_layout(layout, self._check, self._save, 1)
        fill(layout, self.progress, self._delivered, self._outcome, 1)

        # Connections
        self.progress.cancelled.connect(self.shut_down)

        self._refresh()

    def set_delivery(self, delivery: ReplicationState | None) -> None:
        """Show the state of the replication; None without a server."""
        self._delivery = delivery
        self._show_delivery()

    def shut_down(self) -> None:
        """Cancel running jobs."""
        if self._work is not None:
            self._work.cancel()

    def _on_check(self) -> None:
        logbook, folder = self._logbook, self._folder

        def check(report: Report) -> ArchiveCheckResult:
            return check_archive(logbook.opened().database, folder, report)

        self._do(check, self._on_checked)

    def _on_checked(self, found: ArchiveCheckResult) -> None:
        self.found = found
        self._show_outcome()
        self.checked.emit()

    def _ask_save(self) -> None:
        path = self._place.folder() / f"lightpen-{self._clock():%Y-%m-%d}.csv"
        ask_file(self, self.tr("Save entries"), path, self._save_entries)

    def _save_entries(self, path: Path) -> None:
        logbook, wanted = self._logbook, self._wanted()
        self._place.remember(path.parent)

        def save(report: Report) -> int:
            return save_entries(logbook.opened().database, wanted, path, report)

        text = self.tr("{0} entries saved in {1}")
        self._do(
            save, lambda n_saved: self._notices.show_status(text.format(n_saved, path))
        )

    def _do(
        self, function: Callable[[Report], T], on_succeeded: Callable[[T], object]
    ) -> None:
        if self._work is not None:
            return
        self._work = job = Job(function, self)
        self._show_working()
        job.start(
            on_succeeded,
            partial(self._notices.notify, NOTICE),
            progressed=self.progress.set_fraction,
            ended=self._on_done,
        )

    def _on_done(self) -> None:
        self._work = None
        self._show_working()

    @override
    def _refresh(self) -> None:
        self._show_working()
        self._show_delivery()
        self._show_outcome()

    def _show_working(self) -> None:
        """Disable the buttons while something is in progress."""
        self.progress.set_running(self._work is not None)
        why_not = ""
        if self._work is not None:
            why_not = self.tr("Another operation is in progress.")
        self._check.set_why_not(
            why_not, self.tr("Read and compare every entry, record, result and image")
        )
        self._save.set_why_not(why_not, self.tr("For other programs"))

    def _show_delivery(self) -> None:
        delivery = self._delivery
        remark = StatusMessage("") if delivery is None else self._message_on(delivery)
        self._delivered.set_value(remark)

    def _message_on(self, delivery: ReplicationState) -> StatusMessage:
        n_waiting, fault = delivery.n_waiting, delivery.fault
        if fault is not None:
            text = self.tr(
                "Entries not yet on the server; they are stored here and delivered "
                "when it responds. {0}"
            )
            return StatusMessage.warning(text.format(worded(fault)))
        if n_waiting == 0:
            return StatusMessage.good(self.tr("The server has all entries."))
        return StatusMessage(self.tr("Delivering entries to the server"))

    def _show_outcome(self) -> None:
        checked = self.found
        findings = () if checked is None else checked.findings
        notes = () if checked is None else checked.notes
        messages = [StatusMessage.fault(worded(each)) for each in findings[:MOST_SHOWN]]
        if len(findings) > MOST_SHOWN:
            n_more = len(findings) - MOST_SHOWN
            text = self.tr("{0} more findings").format(n_more)
            messages.append(StatusMessage.fault(text))
        messages += [
            StatusMessage(worded(each), Sign.WARNING, Tone.QUIET)
            for each in notes[:MOST_SHOWN]
        ]
        while len(self._findings) < len(messages):
            label = SignLabel()
            self._findings.append(label)
            self._layout.insertWidget(self._layout.count() - 1, label)
        for i, label in enumerate(self._findings):
            label.set_value(messages[i] if i < len(messages) else StatusMessage(""))
        self._outcome.set_value(self._outcome_of(checked))

    def _outcome_of(self, checked: ArchiveCheckResult | None) -> StatusMessage:
        if checked is None:
            words = self.tr("Not checked since program start")
            return StatusMessage(words, Sign.RING, Tone.QUIET)
        counts = (checked.n_entries, checked.n_files)
        if checked.findings:
            text = self.tr("Changes detected. {0} entries and {1} files checked.")
            return StatusMessage.warning(text.format(*counts))
        text = self.tr("No changes in {0} entries and {1} files")
        return StatusMessage.good(text.format(*counts))


class DuePanel(Translated, QWidget):
    """Shows the current tips with their due dates."""

    def __init__(self, workbench: Workbench) -> None:
        super().__init__()
        self._run, self._library = workbench.run, workbench.library
        self._selection, self._now = workbench.selection, workbench.around.now
        self._notices = workbench.notifications
        self._rule: DueRule | None = None  # by which they were read last
        self._reading = LatestJob(self)
        self._tips: tuple[DueTip, ...] = ()

        # Widgets
        self._head = text_label(TextSize.LEAD)
        self._table = NumberTable()

        # Layout
        vertical_layout(self, self._head, self._table, 1, margins=(0, GRID, 0, 0))

        # Connections
        self._selection.changed.connect(self._on_selected)

        self._refresh()

    def read(self) -> None:
        """Read when the current tips at this station are due."""
        logbook, library = self._run.logbook, self._library.library
        self._rule = rule = self._selection.limits.due

        def read(_: Report) -> tuple[DueTip, ...]:
            opened = logbook.opened()
            return due_tips(opened.database, opened.chain, rule, library)

        self._reading.start(read, self._on_read, partial(self._notices.notify, NOTICE))

    def shut_down(self) -> None:
        """Cancel reading."""
        self._reading.cancel()

    def _on_read(self, tips: tuple[DueTip, ...]) -> None:
        self._tips = tips
        self._refresh()

    def _on_selected(self) -> None:
        if self._rule not in (None, self._selection.limits.due):
            self.read()

    def _refresh(self) -> None:
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
        columns = (self.tr("Calibrated"), self.tr("Due"), self.tr("State"))
        rows = tuple(map(_name, self._tips))
        cells = tuple(self._cells(tip, now) for tip in self._tips)
        self._table.set_value(Figures(columns, rows, cells))

    def _cells(self, tip: DueTip, now: datetime) -> tuple[str, ...]:
        days = (tip.calibrated, tip.due)
        return (
            *(day_text(day) for day in days),
            self.tr("DUE") if tip.is_due(now) else self.tr("valid"),
        )


def _name(tip: DueTip) -> str:
    names = tip.entry.entry.event.names
    return PARTED.join(shortened(n, LEAST_SHOWN) for n in (names.pen, names.tip))
