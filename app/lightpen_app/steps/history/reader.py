"""Reads the archive for the step History, off the GUI thread."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

from PySide6.QtCore import QObject, Signal

from lightpen.archive.chains import StoredEntry
from lightpen.archive.history import (
    DueTip,
    EntryFilter,
    KnownNames,
    Line,
    due_tips,
    known_names,
    lines,
    messages_on,
    n_wanted,
)
from lightpen.archive.lazy_logbook import LazyLogbook
from lightpen.archive.logbook import ReplicationState
from lightpen.archive.trends import trend_of
from lightpen.model.limits import DueRule
from lightpen.record.library.tip_library import Library
from lightpen_app.work.job import Job, Report

T = TypeVar("T")
BLOCK = 200  # lines that are read at one time


@dataclass(frozen=True)
class FirstEntries:
    """The first data read for a filter."""

    wanted: EntryFilter
    n_lines: int
    first: tuple[Line, ...]  # the newest
    names: KnownNames
    # Replication to the server; None without a server.
    delivery: ReplicationState | None = None


class HistoryReader(QObject):
    """Reads entries by filter; results for an earlier filter are discarded."""

    opened = Signal(object)  # Opening
    more_read = Signal(int, object)  # number of the lines before, and the lines
    trend_read = Signal(object)  # Trend
    messages_read = Signal(object)  # entries that concern the one asked about
    due_read = Signal(object)  # the current tips, each a `DueTip`
    failed = Signal(str)  # text for the user

    def __init__(self, logbook: LazyLogbook, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._logbook = logbook
        self._wanted = EntryFilter()
        self._jobs: dict[str, Job] = {}

    def open(self, wanted: EntryFilter) -> None:
        """Read the number of entries and the newest ones."""
        self._wanted = wanted
        for what in ("more", "trend", "remarks"):
            self._drop(what)
        logbook = self._logbook

        def read(_: Report) -> FirstEntries:
            opened = logbook.opened()
            database = opened.database
            return FirstEntries(
                wanted,
                n_wanted(database, wanted),
                lines(database, wanted, 0, BLOCK),
                known_names(database),
                opened.delivery(),
            )

        self._start("open", read, self.opened.emit)

    def read_more(self, first: int) -> None:
        """Read the lines after as many others."""
        logbook, wanted = self._logbook, self._wanted
        self._start(
            "more",
            lambda _: lines(logbook.opened().database, wanted, first, BLOCK),
            partial(self.more_read.emit, first),
        )

    def read_trend(self, wanted: EntryFilter) -> None:
        """Read the calibrations of a pen and tip."""
        logbook = self._logbook
        self._start(
            "trend",
            lambda _: trend_of(logbook.opened().database, wanted),
            self.trend_read.emit,
        )

    def read_messages(self, entry: StoredEntry) -> None:
        """Read the messages on an entry."""
        logbook = self._logbook
        self._start(
            "remarks",
            lambda _: messages_on(logbook.opened().database, entry),
            self.messages_read.emit,
        )

    def read_due(self, rule: DueRule, library: Library) -> None:
        """Read when the current tips at this station are due."""
        logbook = self._logbook

        def read(_: Report) -> tuple[DueTip, ...]:
            opened = logbook.opened()
            return due_tips(opened.database, opened.chain, rule, library)

        self._start("due", read, self.due_read.emit)

    def shut_down(self) -> None:
        """Cancel running jobs."""
        for what in tuple(self._jobs):
            self._drop(what)

    def _start(
        self,
        what: str,
        function: Callable[[Report], T],
        on_succeeded: Callable[[T], object],
    ) -> None:
        self._drop(what)
        self._jobs[what] = job = Job(function, self)
        job.start(on_succeeded, self.failed, ended=partial(self._on_ended, what, job))

    def _on_ended(self, what: str, job: Job) -> None:
        if self._jobs.get(what) is job:
            del self._jobs[what]

    def _drop(self, what: str) -> None:
        job = self._jobs.pop(what, None)
        if job is not None:
            job.cancel()
