"""The logbook of a station, opened at its first use."""

from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING

from lightpen.messages import Message

if TYPE_CHECKING:
    from lightpen.archive.logbook import Logbook, Replicate
    from lightpen.record.results.acceptance import SwingAssessment
    from lightpen.record.swings.solving import Solution


class LazyLogbook:
    """Logbook that is opened at its first use, so that the program starts sooner."""

    def __init__(self, data: Path, replicate: "Replicate | None" = None) -> None:
        self._data, self._replicate = data, replicate
        self._lock = Lock()
        self._opened: Logbook | None = None
        self._is_closed = False

    @classmethod
    def none(cls) -> "LazyLogbook":
        """Return a closed logbook, in which nothing is entered."""
        logbook = cls(Path())
        logbook._is_closed = True
        return logbook

    def replicate_by(self, replicate: "Replicate") -> None:
        """Have entries replicated, if it is not open yet."""
        self._replicate = replicate

    def enter_owed(
        self, report: Callable[[float], None] = lambda fraction: None
    ) -> tuple[Message, ...]:
        """Enter events from files; see `lightpen.archive.logbook.Logbook`."""
        logbook = self._open()
        return () if logbook is None else logbook.enter_owed(report)

    def enter_unused(
        self,
        solution: "Solution | None",
        assessment: "SwingAssessment | None",
        at: datetime,
    ) -> None:
        """Enter that a swing was abandoned, with the tip that was not accepted."""
        logbook = self._open()
        if logbook is None:
            return
        if solution is not None and assessment is not None:
            logbook.enter_refused(solution, assessment, at)
        else:
            logbook.enter_owed()

    def opened(self) -> "Logbook":
        """Return the logbook, opened by now."""
        logbook = self._open()
        if logbook is None:
            from lightpen.archive.store import closed

            raise closed()
        return logbook

    def close(self) -> None:
        """Close the archive; later entries are refused."""
        with self._lock:
            logbook, self._opened, self._is_closed = self._opened, None, True
        if logbook is not None:
            logbook.close()

    def _open(self) -> "Logbook | None":
        with self._lock:
            if self._opened is None and not self._is_closed:
                # It takes long to be imported.
                from lightpen.archive.logbook import Logbook

                self._opened = Logbook(self._data, self._replicate)
            return self._opened
