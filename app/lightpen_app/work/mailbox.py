"""A slot for the newest value that a thread has; what nobody took is replaced."""

from threading import Lock

from PySide6.QtCore import QObject, Signal


class Mailbox(QObject):
    """One slot between a producing thread and the GUI.

    A queued signal with every image would fill the memory whenever the GUI is busy;
    here only the newest waits, with one pending `ready`.

    Signals
    -------
    ready()
        A value waits; emitted once until it is taken.
    """

    ready = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._lock = Lock()
        self._value: object | None = None

    def put(self, value: object) -> None:
        """Leave a value, from any thread, instead of the one that waits."""
        with self._lock:
            waited = self._value is not None
            self._value = value
        if not waited:
            self.ready.emit()

    def take(self) -> object | None:
        """Return the newest value, or None if it was taken already."""
        with self._lock:
            value, self._value = self._value, None
        return value
