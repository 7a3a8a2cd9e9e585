"""The runner of a swing as a Qt object with signals."""

from collections.abc import Callable
from datetime import datetime
from pathlib import Path

from PySide6.QtCore import QObject, Signal
from typing_extensions import override

from lightpen.archive.logbook.lazy_logbook import LazyLogbook
from lightpen.live.sources import Follower
from lightpen.record.results.result_folder import RECORDS, FolderArchive
from lightpen.swing.capture.state import SwingEvent
from lightpen.swing.runner import SwingRunner
from lightpen.swing.status import SwingStatus
from lightpen_app.work.notifications import Notifications
from lightpen_app.work.run_view import RunView


class SwingRun(RunView[SwingStatus, SwingEvent]):
    """Status and events of a swing as Qt signals; commands go to its `runner`.

    `progressed` reports solving; the verdict is also an event.
    """

    # A result was accepted or revoked: another tip may be current.
    result_changed = Signal()
    # Path that leads to a recorded swing to open
    open_requested = Signal(object)

    def __init__(
        self,
        folder: Path,
        now: Callable[[], datetime],
        notifications: Notifications,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(SwingStatus(), notifications, parent)
        self._folder = folder
        self.logbook = LazyLogbook(folder)  # any thread may use it
        self.archive = FolderArchive(folder)
        self.follower: Follower | None = None  # leads a simulated hand
        self.runner = SwingRunner(
            self.records_folder, self.archive, self, now, self.logbook
        )

    @property
    def records_folder(self) -> Path:
        """Folder of the recorded swings."""
        return self._folder / RECORDS

    def on_swing(self, status: SwingStatus, events: tuple[SwingEvent, ...]) -> None:
        """Forward the newest status and every event, on a thread of the runner."""
        follower = self.follower
        if follower is not None and status.state is not None:
            follower.follow(status.state)
        self.post(status, events)

    @override
    def _compare(self, before: SwingStatus, now: SwingStatus) -> None:
        if before.result is not now.result or before.revoked is not now.revoked:
            self.result_changed.emit()
