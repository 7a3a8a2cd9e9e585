"""What the step History shows: the entries of the archive, and what they come to."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QFileDialog, QTabWidget, QVBoxLayout, QWidget

from lightpen.archive.chains import Copied
from lightpen.archive.check import Checked, check_archive
from lightpen.archive.entries import Written
from lightpen.archive.exchange import export_entries, import_entries
from lightpen.archive.history import Line
from lightpen.archive.listing import save_entries
from lightpen.archive.queries import Wanted
from lightpen.model.due_rule import DueRule
from lightpen.record.results import Result
from lightpen.verification.trend import Trend
from lightpen_app.look.theme import GRID
from lightpen_app.look.words import shortened
from lightpen_app.paper.showing import PaperShowing
from lightpen_app.steps.history.archive_panel import ArchivePanel, Saving
from lightpen_app.steps.history.due_panel import DuePanel
from lightpen_app.steps.history.entry_panel import EntryPanel
from lightpen_app.steps.history.filter_bar import FilterBar
from lightpen_app.steps.history.history_table import HistoryTable
from lightpen_app.steps.history.reader import HistoryReader, Opening
from lightpen_app.steps.history.selection_panel import SelectionPanel
from lightpen_app.widgets.page_scroll import PageScroll, Squeezed
from lightpen_app.widgets.translated import Translated
from lightpen_app.widgets.trend_panel import TrendPanel
from lightpen_app.work.job import Job, Report
from lightpen_app.work.save_place import SavePlace
from lightpen_app.work.workbench import Workbench

T = TypeVar("T")
TABLE_SHARE, TABS_SHARE = 3, 4  # of the height
LEAST_TABS = 28 * GRID  # px


class HistoryContent(Translated, QWidget):
    """Shows the entries that are looked for, and what they come to.

    Signals
    -------
    checked(Checked)
        What a check of the archive came to.
    status_changed(str), notice_raised(str)
        As of a page.
    """

    checked = Signal(object)
    status_changed = Signal(str)
    notice_raised = Signal(str)

    def __init__(self, workbench: Workbench, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._workbench = workbench
        self._logbook = workbench.run.logbook
        self._reader = HistoryReader(self._logbook, self)
        self._place = SavePlace(workbench)
        self._paper = PaperShowing(self._place, self)
        self._trend = Trend()
        self._followed: Wanted | None = None  # whose trend it is
        self._work: Job | None = None

        # Widgets: the order of making them is the order of the Tab key
        self._filter = FilterBar()
        self._table = HistoryTable()
        self._tabs = QTabWidget()
        self._entry = EntryPanel()
        self._trend_panel = TrendPanel()
        self._selection = SelectionPanel()
        self._due = DuePanel(workbench.around.now)
        self._archive = ArchivePanel()
        for panel in self._panels():
            tab = PageScroll()
            is_squeezed = panel is self._trend_panel  # the others have words that wrap
            tab.setWidget(Squeezed(panel) if is_squeezed else panel)
            self._tabs.addTab(tab, "")
        self._tabs.setMinimumHeight(LEAST_TABS)

        # Layout
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(GRID)
        layout.addWidget(self._filter)
        layout.addWidget(self._table, TABLE_SHARE)
        layout.addWidget(self._tabs, TABS_SHARE)

        # Connections
        reader = self._reader
        reader.failed.connect(self.notice_raised)
        reader.opened.connect(self._on_opened)
        reader.block_read.connect(self._table.put_block)
        reader.block_passed.connect(self._table.forget_block)
        reader.trend_read.connect(self._on_trend_read)
        reader.remarks_read.connect(self._entry.set_remarks)
        reader.due_read.connect(self._due.set_tips)
        self._filter.value_changed.connect(self.read_anew)
        self._table.block_wanted.connect(reader.read_block)
        self._table.selection_changed.connect(self._on_selection_changed)
        self._entry.note_given.connect(self._enter_note)
        self._entry.restore_requested.connect(self._restore)
        self._entry.paper_requested.connect(self._show_paper)
        self._paper.saved.connect(self._on_paper_saved)
        self._paper.failed.connect(self.notice_raised)
        self._due.rule_changed.connect(self._on_rule_changed)
        self._archive.check_requested.connect(self._check)
        self._archive.cancel_requested.connect(self._cancel)
        self._archive.import_requested.connect(self._ask_import)
        self._archive.save_requested.connect(self._ask_save)

        workbench.changed.connect(self._on_workbench_changed)

        self._show_rule()
        self._retranslate()

    def table(self) -> HistoryTable:
        """Return the table of the entries."""
        return self._table

    def read_anew(self) -> None:
        """Read what is looked for, as it is now."""
        self._reader.open(self._filter.value())

    def shut_down(self) -> None:
        """Cancel what is under way."""
        self._reader.shut_down()
        self._paper.shut_down()
        self._cancel()

    def _panels(self) -> tuple[QWidget, ...]:
        return (
            *(self._trend_panel, self._entry, self._selection),
            *(self._due, self._archive),
        )

    def _retranslate(self) -> None:
        names = (
            *(self.tr("Trend"), self.tr("Entry"), self.tr("Repeatability")),
            *(self.tr("Due"), self.tr("Archive")),
        )
        for i, name in enumerate(names):
            self._tabs.setTabText(i, name)

    # What is shown

    def _on_opened(self, opening: Opening) -> None:
        self._filter.set_known(opening.names)
        self._trend, self._followed = Trend(), None
        self._entry.set_value(None)
        self._entry.set_home(opening.home)
        self._archive.set_delivery(opening.delivery)
        self._table.set_stations(opening.names.stations)
        self._table.set_lines(opening.n_lines, opening.first)
        if self._followed is None:
            self._on_trend_read(Trend())
        self.status_changed.emit(self.tr("{0} entries").format(opening.n_lines))
        # Later than what is seen at once.
        self._reader.read_due(self._due.rule(), self._workbench.library.library)

    def _on_selection_changed(self) -> None:
        line = self._table.current()
        if line != self._entry.value():
            self._entry.set_value(line)
            if line is not None and line.entry is not None:
                self._reader.read_remarks(line.entry)
                self._follow(line.entry)
        self._trend_panel.mark(_hash_of(line))
        self._show_selection()

    def _follow(self, entry: Written) -> None:
        """Show the trend of the pen and tip of an entry, within what is looked for."""
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
        self._trend_panel.mark(_hash_of(self._table.current()))
        self._show_selection()

    def _show_selection(self) -> None:
        entries = [line.entry for line in self._table.selected()]
        selected = [entry for entry in entries if entry is not None]
        self._selection.set_limits(self._workbench.choices.limits)
        self._selection.set_value(selected, self._trend)

    def _show_rule(self) -> None:
        is_guarded = self._workbench.supervision.is_guarded
        self._due.set_rule(self._workbench.due_rule(), is_guarded=is_guarded)

    def _on_workbench_changed(self) -> None:
        before = self._due.rule()
        self._show_rule()
        if self._due.rule() != before:
            self._reader.read_due(self._due.rule(), self._workbench.library.library)

    def _on_rule_changed(self, rule: DueRule) -> None:
        self._workbench.set_due_rule(rule)
        self._reader.read_due(rule, self._workbench.library.library)

    # What is entered

    def _enter_note(self, about: Written, text: str) -> None:
        logbook, operator = self._logbook, self._workbench.preparation.names.operator
        self._enter(
            lambda _: logbook.opened().enter_note(about, text, operator),
            lambda _: self.read_anew(),
        )

    def _restore(self, entry: Written, reason: str) -> None:
        logbook, names = self._logbook, self._workbench.preparation.names
        self._enter(
            lambda _: logbook.opened().restore(entry, names, reason), self._on_restored
        )

    def _enter(
        self, function: Callable[[Report], T], on_succeeded: Callable[[T], object]
    ) -> None:
        """Enter something, whatever is done to the archive as a whole meanwhile."""
        job = Job(function, self)

        # Connections
        job.succeeded.connect(on_succeeded)
        job.failed.connect(self.notice_raised)
        job.start()

    def _on_restored(self, result: Result) -> None:
        self.read_anew()
        self._workbench.library.refresh()
        self._workbench.streaming.read_tip()
        told = self.tr("Tip {0} of pen {1} is in force as it was calibrated then.")
        names = result.names
        words = (shortened(names.tip), shortened(names.pen))
        self.status_changed.emit(told.format(*words))

    # What is printed

    def _show_paper(self, entry: Written) -> None:
        result, folder = entry.entry.event.result, self._workbench.folder
        if result is not None:
            self._paper.show(lambda: folder / result.place)

    def _on_paper_saved(self, path: Path) -> None:
        self.status_changed.emit(self.tr("Saved in {0}").format(path.parent))

    # The archive as a whole

    def _check(self) -> None:
        logbook, folder = self._logbook, self._workbench.folder
        self._do(
            lambda report: check_archive(logbook.opened().database, folder, report),
            self._on_checked,
        )

    def _on_checked(self, checked: Checked) -> None:
        self._archive.set_checked(checked)
        self.checked.emit(checked)

    def _cancel(self) -> None:
        if self._work is not None:
            self._work.cancel()

    def _ask_import(self) -> None:
        dialog = self._dialog(self.tr("Entries of another station"), Saving.WHOLE)
        dialog.setFileMode(QFileDialog.FileMode.ExistingFile)
        dialog.fileSelected.connect(lambda path: self._import(Path(path)))
        dialog.open()

    def _import(self, path: Path) -> None:
        logbook = self._logbook
        self._place.remember(path.parent)
        self._do(
            lambda _: import_entries(logbook.opened().database, path),
            self._on_imported,
        )

    def _on_imported(self, copied: Copied) -> None:
        self.read_anew()
        told = self.tr("{0} entries are new, {1} were there already.")
        self.status_changed.emit(told.format(copied.n_new, copied.n_known))

    def _ask_save(self, saving: Saving) -> None:
        dialog = self._dialog(self.tr("Save entries"), saving)
        dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
        dialog.setDefaultSuffix(saving.suffix[1:])
        day = self._workbench.around.now()
        dialog.selectFile(f"lightpen-{day:%Y-%m-%d}{saving.suffix}")
        dialog.fileSelected.connect(lambda path: self._save(saving, Path(path)))
        dialog.open()

    def _save(self, saving: Saving, path: Path) -> None:
        logbook, wanted = self._logbook, self._filter.value()
        self._place.remember(path.parent)

        def save(_: Report) -> int:
            database = logbook.opened().database
            if saving is Saving.WHOLE:
                return export_entries(database, path)
            return save_entries(database, wanted, path)

        told = self.tr("{0} entries are saved in {1}")
        self._do(
            save, lambda n_saved: self.status_changed.emit(told.format(n_saved, path))
        )

    def _dialog(self, title: str, saving: Saving) -> QFileDialog:
        dialog = QFileDialog(self, title)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.setNameFilter(f"{saving.suffix[1:].upper()} (*{saving.suffix})")
        dialog.setDirectory(str(self._place.folder()))
        return dialog

    def _do(
        self, function: Callable[[Report], T], on_succeeded: Callable[[T], object]
    ) -> None:
        """Do one thing at a time to the archive as a whole, beside the window."""
        if self._work is not None:
            return
        self._work = job = Job(function, self)
        self._archive.set_working(True)

        # Connections
        job.progressed.connect(self._archive.set_progress)
        job.succeeded.connect(on_succeeded)
        job.failed.connect(self.notice_raised)
        job.ended.connect(self._on_done)
        job.start()

    def _on_done(self) -> None:
        self._work = None
        self._archive.set_working(False)


def _hash_of(line: Line | None) -> str:
    return "" if line is None or line.entry is None else line.entry.sha256
