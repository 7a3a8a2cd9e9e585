"""Run one computation of the core off the GUI thread."""

import gc
import logging
from collections.abc import Callable, Hashable
from functools import partial
from threading import Event
from typing import TypeAlias

from PySide6.QtCore import QObject, QThreadPool, QTimer, Signal, SignalInstance

from lightpen.errors import Cancelled, LightpenError
from lightpen.formats.decoding import release_freed_memory
from lightpen.messages import Message
from lightpen_app.look.languages import worded
from lightpen_app.look.theme import Tone

Report: TypeAlias = Callable[[float], None]
Slot: TypeAlias = Callable[..., object] | SignalInstance

_logger = logging.getLogger(__name__)


class Job(QObject):
    """One run of a core function on the thread pool.

    The function gets one argument, ``report``, to call now and then with the
    fraction done; that call is also where a cancelled job stops. An exception
    that is no `LightpenError` is a bug and goes to `sys.excepthook`. A job is done
    with after `ended`: it deletes itself.
    """

    progressed = Signal(float)  # fraction done, 0 to 1
    succeeded = Signal(object)  # result of the function
    failed = Signal(str)  # text for the user, translated
    crashed = Signal()  # it ended by a bug, without an outcome
    # The last of all, whether it succeeded, failed, was cancelled or crashed.
    ended = Signal()
    _moved = Signal(float)
    _returned = Signal(object)
    _refused = Signal(object)
    _broke = Signal()
    _finished = Signal()

    def __init__(
        self, function: Callable[[Report], object], parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._function = function
        self._cancelled = Event()
        self._over = Event()

        # Connections
        self._moved.connect(self._on_moved)
        self._returned.connect(self._on_returned)
        self._refused.connect(self._on_refused)
        self._broke.connect(self._on_broke)
        self._finished.connect(self._on_finished)

    def start(
        self,
        succeeded: Slot | None = None,
        failed: Slot | None = None,
        *,
        progressed: Slot | None = None,
        crashed: Slot | None = None,
        ended: Slot | None = None,
    ) -> None:
        """Connect the slots to the signals of these names, and queue the job."""
        for signal, slot in (
            (self.succeeded, succeeded),
            (self.failed, failed),
            (self.progressed, progressed),
            (self.crashed, crashed),
            (self.ended, ended),
        ):
            if slot is not None:
                signal.connect(slot)
        QThreadPool.globalInstance().start(self._run)

    def cancel(self) -> None:
        """Request a stop at the next progress report; the result is discarded."""
        self._cancelled.set()

    def _run(self) -> None:
        emit: Callable[[], object] = self._broke.emit
        try:
            if self._cancelled.is_set():  # while it waited for a thread
                raise Cancelled
            emit = partial(self._returned.emit, self._function(self._report))
        except Cancelled:
            emit = _emit_nothing
        except LightpenError as error:
            _logger.warning("%s: %s", error.message.code, error.message)
            emit = partial(self._refused.emit, error.message)
        finally:
            emit()
            self._finished.emit()
            self._over.set()

    def _report(self, fraction: float) -> None:
        if self._cancelled.is_set():
            raise Cancelled
        self._moved.emit(fraction)

    # A queued signal may arrive after the user has cancelled; checked here, on the
    # thread of the GUI.

    def _on_moved(self, fraction: float) -> None:
        if not self._cancelled.is_set():
            self.progressed.emit(fraction)

    def _on_returned(self, result: object) -> None:
        if not self._cancelled.is_set():
            self.succeeded.emit(result)

    def _on_refused(self, why: Message) -> None:
        if not self._cancelled.is_set():
            self.failed.emit(worded(why))

    def _on_broke(self) -> None:
        if not self._cancelled.is_set():
            self.crashed.emit()

    def _on_finished(self) -> None:
        self._over.wait()  # its thread may still release its reference
        self.ended.emit()
        self.deleteLater()


class LatestJob(QObject):
    """Runs one job at a time; an earlier job reports nothing any more."""

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._job: Job | None = None

    @property
    def is_running(self) -> bool:
        """Whether an outcome is awaited; no longer once it is reported."""
        return self._job is not None

    def start(
        self,
        function: Callable[[Report], object],
        succeeded: Slot | None = None,
        failed: Slot | None = None,
        *,
        progressed: Slot | None = None,
        crashed: Slot | None = None,
        ended: Slot | None = None,
    ) -> None:
        """Cancel the earlier job, and start another with the slots of `Job.start`.

        ``ended`` follows its outcome, unless it is cancelled.
        """
        self.cancel()
        self._job = job = Job(function, self)
        outcomes = job.succeeded, job.failed, job.crashed
        for outcome in outcomes:
            outcome.connect(self._forget)
        job.start(succeeded, failed, progressed=progressed, crashed=crashed)
        for outcome in outcomes if ended is not None else ():
            outcome.connect(ended)

    def cancel(self) -> None:
        """Cancel the job, if there is one; it reports nothing any more."""
        if self._job is not None:
            self._job.cancel()
            self._job = None

    def _forget(self) -> None:
        self._job = None


def _emit_nothing() -> None:
    """No-op for a cancelled job."""


# Python's garbage collector, restricted to the GUI thread; freed memory.
#
# The collector runs in whatever thread happens to allocate. It may free a Qt object
# there whose thread is another one, and Qt ends the program (PYSIDE-810).
#
# Freed memory is returned to the system now and then, see `release_freed_memory`.


PERIOD_MS, RELEASE_PERIOD_MS = 500, 2_000
LIMITS = (700, 10, 10)  # of the generations: objects, and collections of the younger


class GarbageCollector(QObject):
    """Collects garbage in the thread that makes it, and in no other."""

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        gc.disable()
        gc.freeze()  # present objects stay: no search delays the window
        for period_ms, action in (
            (PERIOD_MS, collect_if_due),
            (RELEASE_PERIOD_MS, release_freed_memory),
        ):
            timer = QTimer(self, interval=period_ms)
            timer.timeout.connect(action)
            timer.start()


def collect_if_due() -> None:
    """Collect the oldest generation that has grown beyond its threshold."""
    for generation in (2, 1, 0):
        if gc.get_count()[generation] > LIMITS[generation]:
            gc.collect(generation)
            return


class Notifications(QObject):
    """The active notifications, each until its cause has ended."""

    raised = Signal(str, object)  # str, Tone: text for the user
    # A sentence of `raised` whose cause is gone, in the language it was raised in.
    withdrawn = Signal(str)
    status_changed = Signal(str)  # a sentence for the status line

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._texts: dict[Hashable, str] = {}

    def text(self, cause: Hashable) -> str:
        """Return the text of a cause; empty without one."""
        return self._texts.get(cause, "")

    def notify(self, cause: Hashable, text: str, tone: Tone = Tone.BAD) -> None:
        """Publish a sentence, instead of an earlier one of its cause."""
        if self.text(cause) != text:
            self.withdraw(cause)
        self._texts[cause] = text
        self.raised.emit(text, tone)

    def show_status(self, text: str) -> None:
        """Publish a sentence for the status line; an empty one clears it."""
        self.status_changed.emit(text)

    def withdraw(self, *causes: Hashable) -> None:
        """Withdraw the notifications of causes that have ended."""
        for cause in causes:
            text = self._texts.pop(cause, "")
            if text:
                self.withdrawn.emit(text)
