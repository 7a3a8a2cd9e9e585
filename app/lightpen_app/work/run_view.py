"""What a runner tells on its threads, as signals of Qt on the thread of the GUI."""

from threading import Lock
from typing import Generic, TypeVar

from PySide6.QtCore import QObject, Qt, Signal

from lightpen.sentences import Sentence
from lightpen_app.look.sentences import worded

S = TypeVar("S")
E = TypeVar("E")


class RunView(QObject, Generic[S, E]):
    """Shows the GUI what a runner does; commands are given to that directly.

    Parameters
    ----------
    status : S
        Before anything was told.

    Signals
    -------
    changed()
        `status` is different.
    happened(E)
        Each event, in order and before `changed`.
    progressed(float)
        Of what takes long, 0 to 1.
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

    def __init__(self, status: S, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._status = status
        self._lock = Lock()
        self._newest: S | None = None  # what the GUI has not seen yet
        self._events: tuple[E, ...] = ()
        self._trouble = ""

        # Connections
        queued = Qt.ConnectionType.QueuedConnection
        self._told.connect(self._on_told, queued)
        self._progress_told.connect(self.progressed, queued)
        self._trouble_told.connect(self._on_trouble_told, queued)
        self._relief_told.connect(self._on_relief_told, queued)

    @property
    def status(self) -> S:
        """What the runner told last, as the GUI knows it."""
        return self._status

    # On the threads of the runner

    def tell(self, status: S, events: tuple[E, ...]) -> None:
        """Leave the newest status for the GUI, and every event."""
        with self._lock:
            is_first = self._newest is None
            self._newest, self._events = status, (*self._events, *events)
        if is_first:
            self._told.emit()

    def on_progress(self, fraction: float) -> None:
        """Hand on how far it is."""
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
