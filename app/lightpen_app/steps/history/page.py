"""The step History: the complete history of pens and tips."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TypeVar

from PySide6.QtWidgets import QTabWidget, QWidget
from typing_extensions import override

from lightpen.archive.chains import Event, StoredEntry
from lightpen.archive.history import EntryFilter, Line, lines
from lightpen.archive.logbook import Logbook
from lightpen.archive.trends import Trend, trend_of
from lightpen_app.face import Services, first_of, report_printer
from lightpen_app.look.layouts import vertical_layout
from lightpen_app.look.theme import GRID
from lightpen_app.steps.history.archive_panel import ArchivePanel, DuePanel
from lightpen_app.steps.history.entry_panel import NOTICE, EntryPanel
from lightpen_app.steps.history.history_table import (
    BLOCK,
    FilterBar,
    FirstEntries,
    HistoryTable,
    first_entries,
)
from lightpen_app.widgets.fields import Text
from lightpen_app.widgets.fitting import PageScroll, ShrinkingScrollContent
from lightpen_app.widgets.page import MainAction, Page
from lightpen_app.widgets.trend_panel import TrendPanel
from lightpen_app.work.job import LatestJob
from lightpen_app.work.workbench import Workbench

T = TypeVar("T")
TABLE_SHARE, TABS_SHARE = 3, 4  # of the height
LEAST_TABS = 16 * GRID  # px


class HistoryPage(Page):
    """Shows the entries found, and statistics of their tips."""

    key = "history"

    def __init__(self, workbench: Workbench, services: Services = ()) -> None:
        super().__init__()

        def kind_of(event: Event) -> str:
            """Return the kind of an entry of an extension; empty for one of main."""
            return first_of(services, lambda each: each.event_text(event)) or ""

        self._run = workbench.run
        self._settings = workbench.settings
        self._notices = workbench.notifications
        self._print_report = report_printer(services, workbench.save_place, self)
        self._trend = Trend()
        self._wanted = EntryFilter()
        self._followed: EntryFilter | None = None  # whose trend it is
        self._entries, self._more = LatestJob(self), LatestJob(self)
        self._trends = LatestJob(self)

        # Widgets: the order of making them is the order of the Tab key
        self._filter = FilterBar()
        self._table = HistoryTable(kind_of)
        self._tabs = QTabWidget()
        self._entry = EntryPanel(workbench, self._print_report, kind_of)
        self._trend_panel = TrendPanel()
        made = (each.selection_tab() for each in services)
        self._of_services = tuple(filter(None, made))
        self._due = DuePanel(workbench)
        self._archive = ArchivePanel(workbench, self._filter.value)
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
        content, scroll = ShrinkingScrollContent(), PageScroll()
        shares = (self._table, TABLE_SHARE), (self._tabs, TABS_SHARE)
        vertical_layout(content, self._filter, *shares)
        scroll.setWidget(content)
        vertical_layout(self, scroll)

        # Connections
        self._filter.value_changed.connect(self._read_anew)
        self._table.more_wanted.connect(self._read_more)
        self._table.columns_changed.connect(self._on_columns_changed)
        self._table.selection_changed.connect(self._on_selection_changed)
        self._entry.note_entered.connect(self._read_anew)
        self._print_report.saved.connect(self._on_report_saved)
        self._print_report.failed.connect(self._show_fault)
        for each in self._of_services:
            each.verification_kept.connect(self._on_verification_kept)
        self._archive.checked.connect(self.changed)

        self._table.set_hidden_columns(self._settings.last().hidden_columns)

    @override
    def lead(self) -> str:
        return self.tr("Complete, tamper-evident history of every tip")

    @override
    def is_complete(self) -> bool:
        """Return whether the present swing is in the archive, or that was checked."""
        return self._run.status.result is not None or self._archive.found is not None

    @override
    def is_doubtful(self) -> bool:
        found = self._archive.found
        return found is not None and bool(found.findings)

    @override
    def main_action(self) -> MainAction:
        return MainAction(self.tr("Next calibration"))

    @override
    def run_main_action(self) -> None:
        self.step_requested.emit("start")

    @override
    def first_control(self) -> QWidget:
        return self._table

    @override
    def entered(self) -> None:
        self._read_anew()

    @override
    def shut_down(self) -> None:
        self._print_report.shut_down()
        self._archive.shut_down()
        for each in (self._entry, self._due):
            each.shut_down()
        for job in (self._entries, self._more, self._trends):
            job.cancel()

    @override
    def _refresh(self) -> None:
        self.changed.emit()

    # What is read

    def _read(
        self, job: LatestJob, query: Callable[[Logbook], T], show: Callable[[T], object]
    ) -> None:
        logbook = self._run.logbook
        job.start(lambda _: query(logbook.opened()), show, self._show_fault)

    def _read_anew(self) -> None:
        """Read the number of entries of the filter, and the newest ones."""
        self._wanted = wanted = self._filter.value()
        for job in (self._more, self._trends):
            job.cancel()

        self._read(self._entries, partial(first_entries, wanted), self._on_read)

    def _read_more(self, first: int) -> None:
        """Read the lines after as many others."""
        wanted = self._wanted
        self._read(
            self._more,
            lambda logbook: lines(logbook.database, wanted, first, BLOCK),
            partial(self._table.add_lines, first),
        )

    # What is shown

    def _show_fault(self, sentence: str) -> None:
        self._notices.notify(NOTICE, sentence)

    def _on_read(self, found: FirstEntries) -> None:
        self._filter.set_known(found.names)
        self._trend, self._followed = Trend(), None
        self._entry.set_value(None)
        self._archive.set_delivery(found.delivery)
        self._table.set_stations(found.names.stations)
        self._table.set_lines(found.n_lines, found.first)
        if self._followed is None:
            self._on_trend_read(Trend())
        n_lines = found.n_lines
        words = self.tr("1 entry") if n_lines == 1 else self.tr("{0} entries")
        self._notices.show_status(words.format(n_lines))
        # Deferred until the visible parts are shown.
        self._due.read()

    def _on_columns_changed(self) -> None:
        self._settings.set_last(hidden_columns=self._table.hidden_columns())

    def _on_selection_changed(self) -> None:
        line = self._table.current()
        entry = None if line is None else line.entry
        if line != self._entry.value():
            self._entry.set_value(line)
            if entry is not None:
                self._follow(entry)
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
            self._read(
                self._trends,
                lambda logbook: trend_of(logbook.database, wanted),
                self._on_trend_read,
            )

    def _on_trend_read(self, trend: Trend) -> None:
        self._trend = trend
        self._trend_panel.set_value(trend)
        self._trend_panel.mark(_hash_of(self._table.current()))
        self._show_selection()

    def _show_selection(self) -> None:
        entries = [line.entry for line in self._table.selected()]
        selected = [entry for entry in entries if entry is not None]
        for each in self._of_services:
            each.set_value(selected, self._trend)

    def _on_verification_kept(self, file: Path) -> None:
        self._read_anew()
        self._print_report.show_verification(file)

    def _on_report_saved(self, path: Path) -> None:
        self._notices.show_status(self.tr("Saved in {0}").format(path.parent))


def _hash_of(line: Line | None) -> str:
    return "" if line is None or line.entry is None else line.entry.sha256
