"""How many other windows of the program use the same data folder."""

from pathlib import Path

from PySide6.QtCore import QObject, QTimer, Signal

from lightpen.record.presence import Presence
from lightpen_app.work.job import Job

COUNTING_MS = 5000  # from one look for other windows to the next


class OtherWindows(QObject):
    """Looks for them now and then, and lets them know of this one.

    Parameters
    ----------
    folder : Path
        The data folder.

    Signals
    -------
    counted(int)
        So many there are, told when it changes.
    """

    counted = Signal(int)

    def __init__(self, folder: Path, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._presence = Presence(folder)
        self._n_others = 0
        self._look: Job | None = None
        self._timer = QTimer(self)
        self._timer.setInterval(COUNTING_MS)

        # Connections
        self._timer.timeout.connect(self._count)

    def start(self) -> None:
        """Look now, and from now on."""
        self._count()
        self._timer.start()

    def stop(self) -> None:
        """Look no more."""
        self._timer.stop()

    def leave(self) -> None:
        """Let the others know that this window is gone."""
        self._presence.leave()

    def _count(self) -> None:
        if self._look is not None:  # a disk that does not answer is asked once
            return
        presence = self._presence
        self._look = job = Job(lambda _: presence.count_others(), self)

        # Connections
        job.succeeded.connect(self._on_counted)
        job.start()

    def _on_counted(self, n_others: int) -> None:
        self._look = None
        if n_others != self._n_others:
            self._n_others = n_others
            self.counted.emit(n_others)
