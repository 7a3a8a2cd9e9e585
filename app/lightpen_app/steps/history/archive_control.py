"""Actions on the whole archive: check and save."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TypeVar

from PySide6.QtCore import QObject, Signal

from lightpen.archive.checks.check import ArchiveCheckResult, check_archive
from lightpen.archive.history.entries_file import export_entries
from lightpen.archive.history.listing import save_entries
from lightpen_app.steps.history.archive_panel import ArchivePanel, SaveFormat
from lightpen_app.steps.history.filter_bar import FilterBar
from lightpen_app.widgets.save_dialog import ask_file
from lightpen_app.work.job import Job, Report
from lightpen_app.work.workbench import Workbench

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

    def _ask_save(self, saving: SaveFormat) -> None:
        name = f"lightpen-{self._clock():%Y-%m-%d}{saving.suffix}"
        path = self._place.folder() / name
        title = self.tr("Save entries")
        ask_file(self._panel, title, path, partial(self._save, saving))

    def _save(self, saving: SaveFormat, path: Path) -> None:
        logbook, wanted = self._logbook, self._filter.value()
        self._place.remember(path.parent)

        def save(_: Report) -> int:
            database = logbook.opened().database
            if saving is SaveFormat.WHOLE:
                return export_entries(database, path)
            return save_entries(database, wanted, path)

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
