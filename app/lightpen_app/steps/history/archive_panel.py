"""Panels on the whole archive: check and save, and tips that are due."""

from collections.abc import Callable, Sequence
from datetime import datetime
from pathlib import Path
from typing import TypeVar

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QWidget

from lightpen.archive.checks import ArchiveCheckResult, check_archive
from lightpen.archive.history import DueTip, save_entries
from lightpen.archive.logbook import ReplicationState
from lightpen_app.look.languages import worded
from lightpen_app.look.layouts import fill, horizontal_layout, vertical_layout
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.look.words import LEAST_SHOWN, PARTED, day_text, shortened
from lightpen_app.steps.history.history_table import FilterBar
from lightpen_app.widgets.bars import JobProgress
from lightpen_app.widgets.controls import ask_file
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.state_banner import SignLabel, StatusMessage
from lightpen_app.widgets.tables import Figures, NumberTable
from lightpen_app.work.job import Job, Report
from lightpen_app.work.workbench import Workbench

MOST_SHOWN = 100  # findings; the rest is counted


class ArchivePanel(Translated, QWidget):
    """Buttons of the archive, the last check, and the replication."""

    check_requested = Signal()
    cancel_requested = Signal()
    save_requested = Signal()

    def __init__(self) -> None:
        super().__init__()
        self._checked: ArchiveCheckResult | None = None
        self._delivery: ReplicationState | None = None

        # Widgets
        self._check = self.make_button(
            self.tr("Check the archive"), self.check_requested
        )
        self._save = self.make_button(
            self.tr("Save listed entries (CSV)..."), self.save_requested
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
        self.progress.cancelled.connect(self.cancel_requested)
        self._retranslate()

    def set_working(self, working: bool) -> None:
        """Show that an operation is in progress, and disable the others."""
        self.progress.set_running(working)
        self._refresh_buttons()

    def checked(self) -> ArchiveCheckResult | None:
        """Return the result of the last check; None before the first."""
        return self._checked

    def set_checked(self, checked: ArchiveCheckResult | None) -> None:
        """Show the result of a check; None before the first."""
        self._checked = checked
        self._retranslate()

    def set_delivery(self, delivery: ReplicationState | None) -> None:
        """Show the state of the replication; None without a server."""
        self._delivery = delivery
        self._show_delivery()

    def messages(self) -> Sequence[StatusMessage]:
        """Return the texts on server and check."""
        labels = (self._delivered, self._outcome, *self._findings)
        return [label.value() for label in labels if label.value().text]

    def _retranslate(self) -> None:
        self._refresh_buttons()
        self._show_delivery()
        self._show_outcome()

    def _refresh_buttons(self) -> None:
        why_not = ""
        if self.progress.is_running:
            why_not = self.tr("Another operation is in progress.")
        tooltips = (
            self.tr("Read and compare every entry, record, result and image"),
            self.tr("For other programs"),
        )
        buttons = (self._check, self._save)
        for button, words in zip(buttons, tooltips, strict=True):
            button.set_why_not(why_not, words)

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
        checked = self._checked
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


T = TypeVar("T")
NOTICE = "history"  # cause of its notifications


class ArchiveControl(QObject):
    """Carries out requests of the archive panel, one at a time.

    The filter selects the entries that are saved.
    """

    checked = Signal()  # a check has ended

    def __init__(
        self, workbench: Workbench, panel: ArchivePanel, filter_bar: FilterBar
    ) -> None:
        super().__init__(panel)
        self._panel, self._filter = panel, filter_bar
        self._logbook, self._place = workbench.run.logbook, workbench.save_place
        self._folder, self._clock = workbench.folder, workbench.around.now
        self._notices = workbench.notifications
        self._work: Job | None = None

        # Connections
        panel.check_requested.connect(self._check)
        panel.cancel_requested.connect(self.shut_down)
        panel.save_requested.connect(self._ask_save)

    def _check(self) -> None:
        logbook, folder = self._logbook, self._folder

        def check(report: Report) -> ArchiveCheckResult:
            return check_archive(logbook.opened().database, folder, report)

        self._do(check, self._on_checked)

    def _on_checked(self, checked: ArchiveCheckResult) -> None:
        self._panel.set_checked(checked)
        self.checked.emit()

    def shut_down(self) -> None:
        """Cancel running jobs."""
        if self._work is not None:
            self._work.cancel()

    def _ask_save(self) -> None:
        path = self._place.folder() / f"lightpen-{self._clock():%Y-%m-%d}.csv"
        ask_file(self._panel, self.tr("Save entries"), path, self._save)

    def _save(self, path: Path) -> None:
        logbook, wanted = self._logbook, self._filter.value()
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
        self._panel.set_working(True)
        job.start(
            on_succeeded,
            self._on_failed,
            progressed=self._panel.progress.set_fraction,
            ended=self._on_done,
        )

    def _on_failed(self, sentence: str) -> None:
        self._notices.notify(NOTICE, sentence)

    def _on_done(self) -> None:
        self._work = None
        self._panel.set_working(False)
