"""Signals of a runner's threads, forwarded to the GUI thread."""

from threading import Lock
from typing import Generic, TypeVar

from PySide6.QtCore import QObject, Qt, Signal

from lightpen.messages import Message
from lightpen_app.look.sentences import worded
from lightpen_app.work.notifications import Notifications

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
