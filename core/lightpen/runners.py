"""Threads that own long procedures: serial queue, background tasks, faults."""

import logging
from collections.abc import Callable
from enum import Enum
from functools import partial
from queue import SimpleQueue
from threading import Event, Thread
from time import monotonic
from typing import Generic, Protocol, TypeAlias, TypeVar

from lightpen.errors import Cancelled, LightpenError
from lightpen.messages import Message

_logger = logging.getLogger(__name__)


class FaultListener(Protocol):
    """Listener to faults; must return quickly."""

    def on_fault(self, message: Message) -> None:
        """Receive a fault as a message to be shown."""

    def on_fault_cleared(self, message: Message) -> None:
        """Receive the end of a fault."""


class FaultReporter:
    """Reports one fault at a time, and its end.

    A fault that can end automatically has a cause, a value of a type of its owner.
    """

    def __init__(self, listener: FaultListener) -> None:
        self._listener = listener
        self._fault: Message | None = None
        self._cause: Enum | None = None

    @property
    def is_any(self) -> bool:
        """Whether a fault is active."""
        return self._fault is not None

    def trying(self, act: Callable[[], object]) -> None:
        """Run a function; if it fails, report the fault and keep the state."""
        try:
            act()
        except LightpenError as error:
            self.report(error.message)

    def report(self, fault: Message, cause: Enum | None = None) -> None:
        """Report a fault in place of the one before."""
        self._fault, self._cause = fault, cause
        _logger.warning("fault raised: %s: %s", fault.code, fault)
        self._listener.on_fault(fault)

    def end(self) -> None:
        """Clear the fault, whatever its cause."""
        fault, self._fault = self._fault, None
        if fault is not None:
            _logger.info("fault cleared: %s", fault.code)
            self._listener.on_fault_cleared(fault)

    def end_of(self, cause: Enum) -> None:
        """State that the fault is over, if this was its cause."""
        if self._cause is cause:
            self.end()


LONGEST_WAIT = 0.1  # s, longest wait for a queue that has ended

T = TypeVar("T")
Act: TypeAlias = Callable[[], None]
Report: TypeAlias = Callable[[float], None]


class SerialQueue:
    """Runs queued functions one after the other in its own thread.

    The thread survives a bug: the failed function is not completed, the crash goes to
    `threading.excepthook`, and ``on_bug`` is done next, except after a bug in itself.
    """

    def __init__(self, name: str, on_bug: Act) -> None:
        self._name = name
        self._on_bug = on_bug
        self._acts: SimpleQueue[Act] = SimpleQueue()
        self._ending = Event()
        self._tasks: list[Task] = []
        self._begin()

    def ask(self, act: Act) -> None:
        """Queue a function, from any thread; nothing is run after `end`."""
        self._acts.put(act)

    def ask_and_wait(self, act: Act) -> None:
        """Queue a function; wait until it has run or the queue has ended."""
        is_done = Event()

        def act_and_signal() -> None:
            try:
                act()
            finally:
                is_done.set()

        self.ask(act_and_signal)
        while not is_done.wait(LONGEST_WAIT) and not self._ending.is_set():
            pass

    def start(
        self,
        work: Callable[[Report], T],
        then: Callable[[T], None],
        otherwise: Callable[[Message], None],
        on_bug: Act,
        on_progress: Report = lambda fraction: None,
    ) -> "Task":
        """Start a computation in the background; its result is queued.

        Parameters
        ----------
        work : callable
            Calls its argument now and then with the fraction done, 0 to 1; a cancelled
            task ends there.
        then : callable
            Takes what ``work`` returned.
        otherwise : callable
            Takes why it could not be done.
        on_bug : callable
            Done if it ended by a bug.
        on_progress : callable, optional
            Takes the fraction done, on the thread of the task.
        """
        task = Task()

        def report(fraction: float) -> None:
            if task.is_cancelled:
                raise Cancelled
            on_progress(fraction)

        def run() -> None:
            outcome: Act = on_bug
            try:
                outcome = partial(then, work(report))
            except Cancelled:
                outcome = task.cancel
            except LightpenError as error:
                outcome = partial(otherwise, error.message)
            finally:
                self.ask(lambda: None if task.is_cancelled else outcome())

        self._tasks = [each for each in self._tasks if each.is_running]
        self._tasks.append(task)
        task.run(run, f"{self._name} task")
        return task

    def end(self, last: Act = lambda: None) -> None:
        """Run what is queued so far, then the last function, and end.

        Nothing comes between that and the end. Running tasks are cancelled.
        """
        self.ask(partial(self._end, last))

    def await_end(self, timeout_s: float) -> bool:
        """Wait until the thread and all tasks have ended; return whether they have."""
        deadline = monotonic() + timeout_s
        if not self._ending.wait(timeout_s):  # until then a bug may change the thread
            return False
        self._thread.join(max(0.0, deadline - monotonic()))
        for task in self._tasks:
            task.join(max(0.0, deadline - monotonic()))
        is_running = any(task.is_running for task in self._tasks)
        return not (self._thread.is_alive() or is_running)

    def _begin(self, *, after_bug: bool = False) -> None:
        self._thread = Thread(
            target=self._run, args=(after_bug,), name=self._name, daemon=True
        )
        self._thread.start()

    def _run(self, after_bug: bool) -> None:
        act = self._on_bug if after_bug else self._acts.get()
        try:
            while True:
                act()
                if self._ending.is_set():
                    return
                act = self._acts.get()
        finally:
            if not self._ending.is_set():
                self._begin(after_bug=act is not self._on_bug)

    def _end(self, last: Act) -> None:
        try:
            last()
        finally:
            self._ending.set()
            for task in self._tasks:
                task.cancel()


class Task:
    """A computation beside a `SerialQueue`, which starts it."""

    def __init__(self) -> None:
        self._cancelled = Event()
        self._thread: Thread | None = None

    def run(self, function: Act, name: str) -> None:
        """Run in its own thread, once."""
        self._thread = Thread(target=function, name=name, daemon=True)
        self._thread.start()

    def cancel(self) -> None:
        """Cancel the work at its next report; its result is dropped."""
        self._cancelled.set()

    @property
    def is_cancelled(self) -> bool:
        """Whether the result is no longer needed."""
        return self._cancelled.is_set()

    @property
    def is_running(self) -> bool:
        """Whether its thread has not ended."""
        return self._thread is not None and self._thread.is_alive()

    def join(self, timeout_s: float) -> None:
        """Wait for its end."""
        if self._thread is not None:
            self._thread.join(timeout_s)


class StartThread(Protocol):
    """Starts a computation in the background; see `SerialQueue.start`."""

    def __call__(
        self,
        work: Callable[[Report], T],
        then: Callable[[T], None],
        otherwise: Callable[[Message], None],
        on_bug: Act,
        on_progress: Report,
    ) -> Task:
        """Return the task; one of the three callables is queued when it ends."""


class Workflow(Protocol):
    """The response of a procedure to commands, on its own thread."""

    def recover(self) -> None:
        """Continue after an internal error."""

    def shut_down(self) -> None:
        """Write what is pending, and stop."""


W = TypeVar("W", bound=Workflow)


class WorkflowRunner(Generic[W]):
    """Runs a workflow in its own thread; ``make`` takes how it starts others."""

    def __init__(self, name: str, make: Callable[[StartThread], W]) -> None:
        self._queue = SerialQueue(name, lambda: self._workflow.recover())
        self._workflow = make(self._queue.start)

    def ask(self, command: Callable[[W], None]) -> None:
        """Queue a command: a call of the workflow."""
        self._queue.ask(lambda: command(self._workflow))

    def shut_down(self) -> None:
        """Carry out all commands, shut the workflow down, and end."""
        self._queue.end(lambda: self._workflow.shut_down())

    def await_end(self, timeout_s: float) -> bool:
        """Wait for the end after `shut_down`; return whether it came in time."""
        return self._queue.await_end(timeout_s)


class BackgroundTask:
    """At most one computation in the background; its result is queued.

    ``on_bug`` is done when it ended by a bug; it is then still there. ``on_progress``
    takes the fraction done, 0 to 1, on the thread of the computation.
    """

    def __init__(self, start: StartThread, on_bug: Act, on_progress: Report) -> None:
        self._start = start
        self._on_bug = on_bug
        self._on_progress = on_progress
        self._task: Task | None = None

    @property
    def is_there(self) -> bool:
        """Whether a result is pending."""
        return self._task is not None

    def begin(
        self,
        work: Callable[[Report], T],
        then: Callable[[T], None],
        otherwise: Callable[[Message], None],
    ) -> None:
        """Start a computation, see `SerialQueue.start`.

        When the outcome is reported, it is there no more.
        """

        def succeed(outcome: T) -> None:
            self._task = None
            then(outcome)

        def fail(why: Message) -> None:
            self._task = None
            otherwise(why)

        self._task = self._start(work, succeed, fail, self._on_bug, self._on_progress)

    def drop(self) -> None:
        """Cancel the computation; its result is discarded."""
        task, self._task = self._task, None
        if task is not None:
            task.cancel()
