"""Run one computation of the core off the GUI thread."""

from collections.abc import Callable
from threading import Event
from typing import TypeAlias

from PySide6.QtCore import QObject, QThreadPool, Signal

from lightpen.errors import Cancelled, LightpenError

Report: TypeAlias = Callable[[float], None]


class Job(QObject):
    """One run of a core function on the thread pool.

    The function gets one argument, ``report``, to call now and then with the
    fraction done; that call is also where a cancelled job stops. An exception
    that is no `LightpenError` is a bug and goes to `sys.excepthook`.

    Signals
    -------
    progressed(float)
        Fraction done, 0 to 1.
    succeeded(object)
        What the function returned.
    failed(str)
        Text for the user.
    ended()
        The last of all, whether it succeeded, failed, was cancelled or crashed.
    """

    progressed = Signal(float)
    succeeded = Signal(object)
    failed = Signal(str)
    ended = Signal()
    _returned = Signal(object)
    _refused = Signal(str)

    def __init__(
        self, function: Callable[[Report], object], parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._function = function
        self._cancelled = Event()

        # Connections
        self._returned.connect(self._on_returned)
        self._refused.connect(self._on_refused)

    def start(self) -> None:
        """Queue the job."""
        QThreadPool.globalInstance().start(self._run)

    def cancel(self) -> None:
        """Ask the job to stop at its next report; its outcome is then not told."""
        self._cancelled.set()

    def _run(self) -> None:
        try:
            self._returned.emit(self._function(self._report))
        except Cancelled:
            pass
        except LightpenError as error:
            self._refused.emit(str(error))
        finally:
            self.ended.emit()

    def _report(self, fraction: float) -> None:
        if self._cancelled.is_set():
            raise Cancelled
        self.progressed.emit(fraction)

    # An outcome may be under way between the threads while the user cancels: it is
    # judged here, on the thread of the user.

    def _on_returned(self, result: object) -> None:
        if not self._cancelled.is_set():
            self.succeeded.emit(result)

    def _on_refused(self, text: str) -> None:
        if not self._cancelled.is_set():
            self.failed.emit(text)
