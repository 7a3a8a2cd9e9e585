"""The runner of a swing as an object of Qt: what it tells, as signals."""

from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from threading import Lock

from PySide6.QtCore import QObject, Qt, Signal

from lightpen.record.folder_archive import RECORDS, FolderArchive
from lightpen.sentences import Sentence
from lightpen.simulator.follower import Follower
from lightpen.swing.runner import SwingRunner
from lightpen.swing.state import SwingEvent
from lightpen.swing.status import SwingStatus
from lightpen_app.look.sentences import worded


class SwingRun(QObject):
    """Shows the GUI what its `runner` does; commands are given to that directly.

    Parameters
    ----------
    folder : Path
        Records and results are kept in it.
    now : callable
        Returns date and time with the time zone.

    Attributes
    ----------
    follower : Follower or None
        Leads the hand of a simulated operator, if one is to do what is asked for.

    Signals
    -------
    changed()
        `status` is different.
    happened(SwingEvent)
        Each event of the swing, in order and before `changed`; the verdict is one, too.
    progressed(float)
        Of solving, 0 to 1.
    troubled(str)
        A sentence to be read: nothing is lost.
    relieved(str)
        The sentence of `troubled` whose cause is gone.
    """

    changed = Signal()
    happened = Signal(object)
    progressed = Signal(float)
    troubled = Signal(str)
    relieved = Signal(str)
    _told = Signal()
    _progress_told = Signal(float)
    _trouble_told = Signal(object)
    _relief_told = Signal()

    def __init__(
        self,
        folder: Path,
        now: Callable[[], datetime],
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._folder = folder
        self._archive = FolderArchive(folder)
        self._status = SwingStatus()
        self._lock = Lock()
        self._newest: SwingStatus | None = None  # what the GUI has not seen yet
        self._events: tuple[SwingEvent, ...] = ()
        self.follower: Follower | None = None
        self._trouble = ""

        # Connections
        queued = Qt.ConnectionType.QueuedConnection
        self._told.connect(self._on_told, queued)
        self._progress_told.connect(self.progressed, queued)
        self._trouble_told.connect(self._on_trouble_told, queued)
        self._relief_told.connect(self._on_relief_told, queued)

        self.runner = SwingRunner(self.records_folder, self.archive, self, now)

    @property
    def status(self) -> SwingStatus:
        """The swing as the GUI knows it."""
        return self._status

    @property
    def archive(self) -> FolderArchive:
        """Where accepted results are kept."""
        return self._archive

    @property
    def records_folder(self) -> Path:
        """Where swings are recorded."""
        return self._folder / RECORDS

    # On the threads of the runner

    def on_swing(self, status: SwingStatus, events: tuple[SwingEvent, ...]) -> None:
        """Leave the newest status for the GUI, and every event."""
        follower = self.follower
        if follower is not None and status.state is not None:
            follower.follow(status.state)
        with self._lock:
            is_first = self._newest is None
            self._newest, self._events = status, (*self._events, *events)
        if is_first:
            self._told.emit()

    def on_progress(self, fraction: float) -> None:
        """Hand on how far the tip is computed."""
        self._progress_told.emit(fraction)

    def on_trouble(self, sentence: Sentence) -> None:
        """Hand on what could not be done."""
        self._trouble_told.emit(sentence)

    def on_relief(self, sentence: Sentence) -> None:
        """Hand on that the cause of the last trouble is gone."""
        self._relief_told.emit()

    # On the thread of the GUI

    def _on_told(self) -> None:
        with self._lock:
            newest, self._newest = self._newest, None
            events, self._events = self._events, ()
        if newest is None:
            return
        self._status = newest
        for event in events:
            self.happened.emit(event)
        self.changed.emit()

    def _on_trouble_told(self, sentence: Sentence) -> None:
        self._trouble = worded(sentence)
        self.troubled.emit(self._trouble)

    def _on_relief_told(self) -> None:
        self.relieved.emit(self._trouble)  # as it was told, in whatever language
