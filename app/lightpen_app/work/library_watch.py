"""The tip library and the status of tips, read and changed in the background."""

from collections import deque
from collections.abc import Callable
from contextlib import suppress
from datetime import datetime
from pathlib import Path

from PySide6.QtCore import QObject, QTimer, Signal

from lightpen.archive.logbook.lazy_logbook import LazyLogbook
from lightpen.errors import ArchiveError
from lightpen.model.limits import DueRule
from lightpen.record.library.calibration_status import StationStatus
from lightpen.record.library.tip_library import Library, read_library
from lightpen.record.results.result_folder import FolderArchive
from lightpen_app.work.job import Job, LatestJob, Report
from lightpen_app.work.notifications import Notifications

AGAIN_MS = 15 * 60 * 1000  # interval of checking for overdue tips

Change = Callable[[], Library]


class LibraryWatch(QObject):
    """Watches the library of a data folder and signals changes.

    ``rule`` is for tips without a rule of their own.
    """

    changed = Signal()  # `statuses` are different
    change_kept = Signal(object)  # the change
    # What was requested, and the sentence why it was not kept.
    change_failed = Signal(object, str)

    def __init__(
        self,
        folder: Path,
        logbook: LazyLogbook,
        rule: DueRule,
        now: Callable[[], datetime],
        notifications: Notifications,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._folder = folder
        self._logbook = logbook
        self._rule = rule
        self._now = now
        self._statuses = StationStatus()
        self._notifications = notifications
        self._reading = LatestJob(self)
        self._asked: deque[tuple[object, Change]] = deque()
        self._changing: Job | None = None
        self._is_over = False
        self._timer = QTimer(self, interval=AGAIN_MS)

        # Connections
        self._timer.timeout.connect(self.refresh)

    @property
    def statuses(self) -> StationStatus:
        """Status of all tips, with the library, as last read."""
        return self._statuses

    @property
    def library(self) -> Library:
        """The library as last read."""
        return self._statuses.library

    def set_rule(self, rule: DueRule) -> None:
        """Set the calibration interval."""
        if rule != self._rule:
            self._rule = rule
            self.refresh()

    def refresh(self) -> None:
        """Read it again; only the last request is answered."""
        if self._is_over:
            return
        self._timer.start()
        folder, logbook, rule, now = (
            self._folder,
            self._logbook,
            self._rule,
            self._now,
        )

        def read(_: Report) -> StationStatus:
            library = read_library(folder)
            if not FolderArchive(folder).all_files():  # without any accepted result
                return StationStatus(library, now=now())
            with suppress(ArchiveError):  # the runner reports it
                opened = logbook.opened()
                opened.enter_owed()
                # Imported here: it takes 0.2 s.
                from lightpen.archive.logbook.tip_status import statuses

                return statuses(opened.database, opened.chain, rule, library, now())
            return StationStatus(library)

        self._reading.start(read, self._on_read, self._on_read_failed)

    def change(self, asked: object, change: Change) -> None:
        """Queue a change of the library, and enter it in the archive.

        ``asked`` identifies the request in the signals about its outcome.
        """
        self._asked.append((asked, change))
        if self._changing is None:
            self._change_next()

    def _change_next(self) -> None:
        asked, change = self._asked.popleft()
        logbook = self._logbook

        def make(_: Report) -> None:
            change()
            with suppress(ArchiveError):  # it stays owed
                logbook.opened().enter_owed()

        self._changing = job = Job(make, self)
        job.start(
            lambda _: self._on_changed(asked),
            lambda why: self.change_failed.emit(asked, why),
            crashed=lambda: self.change_failed.emit(asked, ""),
            ended=self._on_change_ended,
        )

    def shut_down(self) -> None:
        """Cancel reading."""
        self._is_over = True
        self._timer.stop()
        self._reading.cancel()

    def _on_changed(self, asked: object) -> None:
        self.change_kept.emit(asked)
        self.refresh()

    def _on_change_ended(self) -> None:
        self._changing = None
        if self._asked:
            self._change_next()

    def _on_read(self, found: StationStatus) -> None:
        self._notifications.withdraw(self)
        self._statuses = found
        self.changed.emit()

    def _on_read_failed(self, why: str) -> None:
        if why != self._notifications.text(self):
            self._notifications.notify(self, why)
        self._statuses = StationStatus()
        self.changed.emit()
