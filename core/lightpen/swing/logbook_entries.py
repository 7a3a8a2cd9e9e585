"""What the course of a swing enters in the logbook, where there is one."""

from collections.abc import Callable
from datetime import datetime

from lightpen.archive.late_logbook import LateLogbook
from lightpen.sentences import Sentence
from lightpen.swing.serial_queue import Start, Task
from lightpen.swing.status import SwingStatus


class LogbookEntries:
    """Enters what becomes of swings; without a logbook, files alone tell of it."""

    def __init__(
        self,
        logbook: LateLogbook | None,
        start: Start,
        tell_trouble: Callable[[Sentence], None],
    ) -> None:
        self._logbook = logbook
        self._start = start
        self._tell_trouble = tell_trouble
        self._catching_up: Task | None = None

    def catch_up(self) -> None:
        """Enter what the files tell of, beside the images: it may take long."""
        if self._logbook is not None:
            self._catching_up = self._start(
                *(self._logbook.enter_owed, self._on_caught_up, self._tell_trouble),
                *(lambda: None, lambda fraction: None),
            )

    def _on_caught_up(self, troubles: tuple[Sentence, ...]) -> None:
        for trouble in troubles:
            self._tell_trouble(trouble)

    def enter_owed(self) -> None:
        """Enter what the files tell of."""
        if self._logbook is not None:
            self._logbook.enter_owed()

    def enter_set_aside(self, swing: SwingStatus, now: datetime) -> None:
        """Enter a swing that was left for good."""
        if self._logbook is not None:
            self._logbook.enter_set_aside(swing.solution, swing.assessment, now)

    def stop(self) -> None:
        """Stop catching up."""
        if self._catching_up is not None:
            self._catching_up.cancel()

    def close(self) -> None:
        """Let go of the logbook."""
        if self._logbook is not None:
            self._logbook.close()
