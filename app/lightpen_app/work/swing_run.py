"""The runner of a swing as a Qt object with signals."""

from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from threading import Lock
from typing import Generic, TypeVar

from PySide6.QtCore import QObject, Qt, Signal
from typing_extensions import override

from lightpen.archive.lazy_logbook import LazyLogbook
from lightpen.live.sources import Follower
from lightpen.messages import Message
from lightpen.record.results.result_folder import RECORDS, FolderArchive
from lightpen.swing.capture.state import SwingEvent
from lightpen.swing.runner import SwingRunner
from lightpen.swing.status import SwingStatus
from lightpen_app.look.languages import worded
from lightpen_app.work.job import Notifications

S = TypeVar("S")
E = TypeVar("E")


class RunView(QObject, Generic[S, E]):
    """Forwards the status of a runner to the GUI; commands go to the runner."""

    changed = Signal()  # `status` is different
    happened = Signal(object)  # E: each event, in order and before `changed`
    progressed = Signal(float)  # completed fraction of a long operation
    refused = Signal()  # something could not be done; nothing is lost
    _status_posted = Signal()
    _progress_posted = Signal(float)
    _fault_posted = Signal(object)
    _fault_cleared_posted = Signal()

    def __init__(
        self, status: S, notifications: Notifications, parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._notifications = notifications
        self._status = status
        self._lock = Lock()
        self._newest: S | None = None  # what the GUI has not seen yet
        self._events: tuple[E, ...] = ()
        self._progress = 0.0

        # Connections
        queued = Qt.ConnectionType.QueuedConnection
        self._status_posted.connect(self._on_status_posted, queued)
        self._progress_posted.connect(self._on_progress_posted, queued)
        self._fault_posted.connect(self._on_fault_posted, queued)
        self._fault_cleared_posted.connect(self._on_fault_cleared_posted, queued)

    @property
    def status(self) -> S:
        """The last status received."""
        return self._status

    @property
    def progress(self) -> float:
        """Completed fraction of the current or last long operation, 0 to 1."""
        return self._progress

    # On the threads of the runner

    def post(self, status: S, events: tuple[E, ...]) -> None:
        """Store the newest status and every event for the GUI."""
        with self._lock:
            is_first = self._newest is None
            self._newest, self._events = status, (*self._events, *events)
        if is_first:
            self._status_posted.emit()

    def on_progress(self, fraction: float) -> None:
        """Forward the progress."""
        self._progress_posted.emit(fraction)

    def on_fault(self, message: Message) -> None:
        """Forward a fault."""
        self._fault_posted.emit(message)

    def on_fault_cleared(self, message: Message) -> None:
        """Forward that the last fault is cleared."""
        self._fault_cleared_posted.emit()

    # On the thread of the GUI

    def _on_status_posted(self) -> None:
        with self._lock:
            newest, self._newest = self._newest, None
            events, self._events = self._events, ()
        if newest is None:
            return
        before, self._status = self._status, newest
        for event in events:
            self.happened.emit(event)
        self.changed.emit()
        self._compare(before, newest)

    def _compare(self, before: S, now: S) -> None:
        """Emit signals for differences beyond `changed`; none by default."""

    def _on_progress_posted(self, fraction: float) -> None:
        self._progress = fraction
        self.progressed.emit(fraction)

    def _on_fault_posted(self, message: Message) -> None:
        self._notifications.notify(self, worded(message))
        self.refused.emit()

    def _on_fault_cleared_posted(self) -> None:
        self._notifications.withdraw(self)


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
