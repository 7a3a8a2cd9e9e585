"""Content of the step History: the entries of the archive and their evaluation."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TypeVar

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QTabWidget, QWidget

from lightpen.archive.chains import Kind, StoredEntry
from lightpen.archive.checks import ArchiveCheckResult
from lightpen.archive.history import EntryFilter, Line
from lightpen.archive.trends import Trend
from lightpen.model.limits import DueRule
from lightpen_app.face import Services, event_text, report_printer
from lightpen_app.look.layouts import vertical_layout
from lightpen_app.look.theme import GRID
from lightpen_app.steps.history.archive_panel import (
    NOTICE,
    ArchiveControl,
    ArchivePanel,
    DuePanel,
)
from lightpen_app.steps.history.entry_panel import EntryPanel
from lightpen_app.steps.history.history_table import FilterBar, HistoryTable
from lightpen_app.steps.history.reader import FirstEntries, HistoryReader
from lightpen_app.widgets.fields import Text, Translated
from lightpen_app.widgets.fitting import PageScroll, ShrinkingScrollContent
from lightpen_app.widgets.trend_panel import TrendPanel
from lightpen_app.work.job import Job, Report
from lightpen_app.work.workbench import Workbench

T = TypeVar("T")
TABLE_SHARE, TABS_SHARE = 3, 4  # of the height
LEAST_TABS = 16 * GRID  # px


class HistoryContent(Translated, QWidget):
    """Shows the entries found, and statistics of their tips."""

    checked = Signal()  # the archive was checked

    def __init__(self, workbench: Workbench, services: Services) -> None:
        super().__init__()
        kind_of = partial(event_text, services)
        self._chosen, self._tips = workbench.selection, workbench.library
        self._settings = workbench.settings
        self._notices = workbench.notifications
        self._folder, self._now = workbench.folder, workbench.around.now
        self._logbook = workbench.run.logbook
        self._reader = HistoryReader(self._logbook, self)
        self._print_report = report_printer(services, workbench.save_place, self)
        self._trend = Trend()
        self._rule = DueRule()
        self._followed: EntryFilter | None = None  # whose trend it is

        # Widgets: the order of making them is the order of the Tab key
        self._filter = FilterBar()
        self.table = HistoryTable(kind_of)
        self._tabs = QTabWidget()
        self._entry = EntryPanel(kind_of)
        self._trend_panel = TrendPanel()
        made = (each.selection_tab() for each in services)
        self._of_services = tuple(filter(None, made))
        self._due = DuePanel(workbench.around.now)
        self._archive = ArchivePanel()
        self._whole = ArchiveControl(workbench, self._archive, self._filter)
        tabs = (
            (self._trend_panel, self.tr("Trend")),
            (self._entry, self.tr("Entry")),
            *((each, Text(each.title)) for each in self._of_services),
            (self._due, self.tr("Due")),
            (self._archive, self.tr("Archive")),
        )
        for panel, _ in tabs:
            tab = PageScroll()
            is_squeezed = panel is self._trend_panel  # the others have wrapping text
            tab.setWidget(ShrinkingScrollContent(panel) if is_squeezed else panel)
            self._tabs.addTab(tab, "")
        self.say_items(self._tabs, (name for _, name in tabs))
        self._tabs.setMinimumHeight(LEAST_TABS)

        # Layout
        shares = (self.table, TABLE_SHARE), (self._tabs, TABS_SHARE)
        vertical_layout(self, self._filter, *shares)

        # Connections
        reader = self._reader
        reader.failed.connect(self._show_fault)
        reader.opened.connect(self._on_opened)
        reader.more_read.connect(self.table.add_lines)
        reader.trend_read.connect(self._on_trend_read)
        reader.messages_read.connect(self._entry.set_messages)
        reader.due_read.connect(self._due.set_tips)
        self._filter.value_changed.connect(self.read_anew)
        self.table.more_wanted.connect(reader.read_more)
        self.table.columns_changed.connect(self._on_columns_changed)
        self.table.selection_changed.connect(self._on_selection_changed)
        self._entry.note_given.connect(self._enter_note)
        self._entry.report_requested.connect(self._show_report)
        self._entry.set_has_report(self._print_report.is_here)
        self._print_report.saved.connect(self._on_report_saved)
        self._print_report.failed.connect(self._show_fault)
        for each in self._of_services:
            each.verification_kept.connect(self._on_verification_kept)
        self._whole.checked.connect(self.checked)

        workbench.selection.changed.connect(self._on_workbench_changed)

        self.table.set_hidden_columns(self._settings.last().hidden_columns)

    def check_result(self) -> ArchiveCheckResult | None:
        """Return the result of the last archive check."""
        return self._archive.checked()

    def read_anew(self) -> None:
        """Read the filtered entries again."""
        self._reader.open(self._filter.value())

    def shut_down(self) -> None:
        """Cancel running jobs."""
        self._reader.shut_down()
        self._print_report.shut_down()
        self._whole.shut_down()

    def _show_fault(self, sentence: str) -> None:
        self._notices.notify(NOTICE, sentence)

    # What is shown

    def _on_opened(self, opening: FirstEntries) -> None:
        self._filter.set_known(opening.names)
        self._trend, self._followed = Trend(), None
        self._entry.set_value(None)
        self._archive.set_delivery(opening.delivery)
        self.table.set_stations(opening.names.stations)
        self.table.set_lines(opening.n_lines, opening.first)
        if self._followed is None:
            self._on_trend_read(Trend())
        n_lines = opening.n_lines
        words = self.tr("1 entry") if n_lines == 1 else self.tr("{0} entries")
        self._notices.show_status(words.format(n_lines))
        # Deferred until the visible parts are shown.
        self._read_due()

    def _on_columns_changed(self) -> None:
        self._settings.set_last(hidden_columns=self.table.hidden_columns())

    def _on_selection_changed(self) -> None:
        line = self.table.current()
        if line != self._entry.value():
            self._entry.set_value(line)
            if line is not None and line.entry is not None:
                self._reader.read_messages(line.entry)
                self._follow(line.entry)
        self._trend_panel.mark(_hash_of(line))
        self._show_selection()

    def _follow(self, entry: StoredEntry) -> None:
        """Show the trend of an entry's pen and tip, within the filter."""
        event = entry.entry.event
        wanted = replace(
            self._filter.value(),
            pen=event.names.pen,
            tip=event.names.tip,
            is_simulated=event.is_simulated,
        )
        if wanted.pen and wanted.tip and wanted != self._followed:
            self._followed = wanted
            self._reader.read_trend(wanted)

    def _on_trend_read(self, trend: Trend) -> None:
        self._trend = trend
        self._trend_panel.set_value(trend)
        self._trend_panel.mark(_hash_of(self.table.current()))
        self._show_selection()

    def _show_selection(self) -> None:
        entries = [line.entry for line in self.table.selected()]
        selected = [entry for entry in entries if entry is not None]
        for each in self._of_services:
            each.set_value(selected, self._trend)

    def _read_due(self) -> None:
        self._rule = self._chosen.limits.due
        self._reader.read_due(self._rule, self._tips.library)

    def _on_workbench_changed(self) -> None:
        if self._chosen.limits.due != self._rule:
            self._read_due()

    # What is entered

    def _enter_note(self, about: StoredEntry, text: str) -> None:
        logbook, operator = self._logbook, self._chosen.preparation.names.operator
        self._enter(
            lambda _: logbook.opened().enter_note(about, text, operator),
            lambda _: self.read_anew(),
        )

    def _enter(
        self, function: Callable[[Report], T], on_succeeded: Callable[[T], object]
    ) -> None:
        """Enter something, also during operations on the whole archive."""
        job = Job(function, self)
        job.start(on_succeeded, self._show_fault)

    # What is printed

    def _show_report(self, entry: StoredEntry) -> None:
        result, folder = entry.entry.event.result, self._folder
        if result is None:
            return
        if entry.entry.event.kind is Kind.VERIFICATION:
            self._print_report.show_verification(folder / result.place)
        else:
            self._print_report.show(lambda: folder / result.place)

    def _on_verification_kept(self, file: Path) -> None:
        self.read_anew()
        self._print_report.show_verification(file)

    def _on_report_saved(self, path: Path) -> None:
        self._notices.show_status(self.tr("Saved in {0}").format(path.parent))


def _hash_of(line: Line | None) -> str:
    return "" if line is None or line.entry is None else line.entry.sha256
