"""The tip library and how all tips stand, read and changed beside the window."""

from collections import deque
from collections.abc import Callable
from contextlib import suppress
from datetime import datetime
from pathlib import Path

from PySide6.QtCore import QObject, QTimer, Signal

from lightpen.archive.late_logbook import LateLogbook
from lightpen.errors import ArchiveError
from lightpen.model.due_rule import DueRule
from lightpen.record.folder_archive import FolderArchive
from lightpen.record.standing import Standings
from lightpen.record.tip_library import Library, read_library
from lightpen_app.work.job import Job, Report

AGAIN_MS = 15 * 60 * 1000  # after which a tip may be overdue that was not

Change = Callable[[], Library]


class LibraryWatch(QObject):
    """Knows the library of a data folder, and tells when it is another one.

    Parameters
    ----------
    folder : Path
        The data folder.
    logbook : LateLogbook
        Of that folder.
    rule : DueRule
        How long a tip may be in force that has no rule of its own.
    now : callable
        Returns the date and time by which tips are due.

    Signals
    -------
    changed()
        `standings` are different.
    change_kept(object)
        What was asked for.
    change_failed(object, str)
        What was asked for, and the sentence why it was not kept.
    troubled(str), relieved(str)
        A sentence to be read, and that its cause is gone.
    """

    changed = Signal()
    change_kept = Signal(object)
    change_failed = Signal(object, str)
    troubled = Signal(str)
    relieved = Signal(str)

    def __init__(
        self,
        folder: Path,
        logbook: LateLogbook,
        rule: DueRule,
        now: Callable[[], datetime],
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._folder = folder
        self._logbook = logbook
        self._rule = rule
        self._now = now
        self._standings = Standings()
        self._trouble = ""
        self._reading: Job | None = None
        self._asked: deque[tuple[object, Change]] = deque()
        self._changing: Job | None = None
        self._is_over = False
        self._timer = QTimer(self)
        self._timer.setInterval(AGAIN_MS)

        # Connections
        self._timer.timeout.connect(self.refresh)

    @property
    def standings(self) -> Standings:
        """How all tips stand, with the library, as they were read last."""
        return self._standings

    @property
    def library(self) -> Library:
        """The library as it was read last."""
        return self._standings.library

    def set_rule(self, rule: DueRule) -> None:
        """Let tips be due by another rule."""
        if rule != self._rule:
            self._rule = rule
            self.refresh()

    def refresh(self) -> None:
        """Read it anew; the last to ask is told."""
        if self._is_over:
            return
        if self._reading is not None:
            self._reading.cancel()
        self._timer.start()
        folder, logbook, rule, now = (
            self._folder,
            self._logbook,
            self._rule,
            self._now,
        )

        def read(_: Report) -> Standings:
            library = read_library(folder)
            if not FolderArchive(folder).all_files():  # nothing was ever in force
                return Standings(library, now=now())
            with suppress(ArchiveError):  # which the runner tells of
                opened = logbook.opened()
                opened.enter_owed()
                # A fifth of a second, which the start need not take.
                from lightpen.archive.standing import standings

                return standings(opened.database, opened.chain, rule, library, now())
            return Standings(library)

        self._reading = job = Job(read, self)

        # Connections
        job.succeeded.connect(self._on_read)
        job.failed.connect(self._on_read_failed)
        job.start()

    def change(self, asked: object, change: Change) -> None:
        """Make a change of the library in its turn, and enter it in the archive.

        Parameters
        ----------
        asked : object
            What is told of when it is kept, or is not.
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

        # Connections
        job.succeeded.connect(lambda _: self._on_changed(asked))
        job.failed.connect(lambda why: self.change_failed.emit(asked, why))
        job.crashed.connect(lambda: self.change_failed.emit(asked, ""))
        job.ended.connect(self._on_change_ended)
        job.start()

    def shut_down(self) -> None:
        """Read nothing more."""
        self._is_over = True
        self._timer.stop()
        if self._reading is not None:
            self._reading.cancel()

    def _on_changed(self, asked: object) -> None:
        self.change_kept.emit(asked)
        self.refresh()

    def _on_change_ended(self) -> None:
        self._changing = None
        if self._asked:
            self._change_next()

    def _on_read(self, found: Standings) -> None:
        self._reading = None
        self._relieve()
        self._standings = found
        self.changed.emit()

    def _on_read_failed(self, why: str) -> None:
        self._reading = None
        if why != self._trouble:
            self._relieve()
            self._trouble = why
            self.troubled.emit(why)
        self._standings = Standings()
        self.changed.emit()

    def _relieve(self) -> None:
        trouble, self._trouble = self._trouble, ""
        if trouble:
            self.relieved.emit(trouble)
