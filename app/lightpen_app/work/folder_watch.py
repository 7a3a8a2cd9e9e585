"""Access to the data folder, and the number of windows that use it."""

from pathlib import Path

from PySide6.QtCore import QObject, QThreadPool, QTimer, Signal

from lightpen.record.folder.data_folder import Presence, check_writable
from lightpen_app.work.job import Job

LOOKING_MS = 5000  # from one look to the next


class FolderWatch(QObject):
    """Checks the data folder periodically and announces this window."""

    # Number of other windows of the program that use it, when it changes.
    counted = Signal(int)
    fault_changed = Signal(str)  # why the folder cannot be written; empty if it can

    def __init__(self, folder: Path, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._folder = folder
        self._presence = Presence(folder)
        self._n_others = 0
        self._fault = ""
        self._counter: Job | None = None
        self._timer = QTimer(self, interval=LOOKING_MS)

        # Connections
        self._timer.timeout.connect(self._look)

    def start(self) -> None:
        """Check now and periodically."""
        self._check()
        self._count()
        self._timer.start()

    def stop(self) -> None:
        """Stop."""
        self._timer.stop()

    def leave(self) -> None:
        """Remove the announcement of this window, on a thread of the pool."""
        QThreadPool.globalInstance().start(self._presence.leave)

    def _look(self) -> None:
        if self._counter is not None:  # a disk that does not answer is asked once
            return
        if self._fault:
            self._check()
        self._count()

    def _check(self) -> None:
        folder = self._folder
        job = Job(lambda _: check_writable(folder), self)
        job.start(self._on_writable, self._set_fault)

    def _on_writable(self, _: None) -> None:
        self._set_fault("")

    def _set_fault(self, fault: str) -> None:
        if fault != self._fault:
            self._fault = fault
            self.fault_changed.emit(fault)

    def _count(self) -> None:
        presence = self._presence
        self._counter = job = Job(lambda _: presence.count_others(), self)
        job.start(self._on_counted)

    def _on_counted(self, n_others: int) -> None:
        self._counter = None
        if n_others != self._n_others:
            self._n_others = n_others
            self.counted.emit(n_others)
