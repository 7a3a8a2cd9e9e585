"""Acts are done in turn by one thread, tasks run beside it, and no bug ends it."""

import threading
from collections.abc import Callable, Iterator
from queue import SimpleQueue

import pytest

from lightpen.errors import Cancelled, LightpenError
from lightpen.messages import message
from lightpen.runners import Report, SerialQueue

TIMEOUT = 60.0  # s until a test gives up
FULL = message("system.full")


class Diary:
    """Notes what is done, and by which thread."""

    def __init__(self) -> None:
        self.entries: list[object] = []
        self.threads: list[threading.Thread] = []

    def note(self, what: object) -> None:
        self.entries.append(what)
        self.threads.append(threading.current_thread())

    def noting(self, what: object) -> Callable[[], None]:
        return lambda: self.note(what)


@pytest.fixture
def diary() -> Diary:
    return Diary()


@pytest.fixture
def queue(diary: Diary) -> Iterator[SerialQueue]:
    queue = SerialQueue("clerk", diary.noting("recovered"))
    yield queue
    queue.end()
    assert queue.await_end(TIMEOUT)


@pytest.fixture
def crashes(monkeypatch: pytest.MonkeyPatch) -> "SimpleQueue[type[BaseException]]":
    """The bugs that are reported."""
    caught: SimpleQueue[type[BaseException]] = SimpleQueue()
    monkeypatch.setattr("threading.excepthook", lambda args: caught.put(args.exc_type))
    return caught


def settle(queue: SerialQueue) -> None:
    """Wait until all is done that was asked for."""
    queue.ask_and_wait(lambda: None)


def fail(*_: object) -> None:
    raise ZeroDivisionError


# Acts


def test_acts_are_done_in_turn_by_one_thread(queue: SerialQueue, diary: Diary) -> None:
    for number in range(20):
        queue.ask(diary.noting(number))
    settle(queue)

    assert diary.entries == list(range(20))
    assert len(set(diary.threads)) == 1
    assert diary.threads[0].name == "clerk"
    assert diary.threads[0].daemon  # a disk that never answers keeps no program open


def test_asking_does_not_wait(queue: SerialQueue, diary: Diary) -> None:
    may_go_on = threading.Event()
    queue.ask(lambda: diary.note(may_go_on.wait(TIMEOUT)))
    queue.ask(diary.noting("next"))
    assert diary.entries == []

    may_go_on.set()
    settle(queue)
    assert diary.entries == [True, "next"]


def test_what_is_asked_for_before_the_end_is_done_and_nothing_after_it(
    queue: SerialQueue, diary: Diary
) -> None:
    may_go_on = threading.Event()
    queue.ask(lambda: diary.note(may_go_on.wait(TIMEOUT)))
    queue.ask(diary.noting("before"))
    queue.end()
    queue.ask(diary.noting("after"))
    may_go_on.set()
    assert queue.await_end(TIMEOUT)

    assert diary.entries == [True, "before"]


def test_nothing_comes_between_the_last_act_and_the_end(
    queue: SerialQueue, diary: Diary
) -> None:
    may_go_on = threading.Event()
    queue.ask(lambda: diary.note(may_go_on.wait(TIMEOUT)))
    queue.end(lambda: queue.ask(diary.noting("late")))
    queue.ask(diary.noting("later"))
    may_go_on.set()
    assert queue.await_end(TIMEOUT)

    assert diary.entries == [True]


def test_a_bug_of_the_last_act_does_not_keep_the_queue_from_its_end(
    queue: SerialQueue, crashes: "SimpleQueue[type[BaseException]]"
) -> None:
    queue.end(fail)

    assert queue.await_end(TIMEOUT)
    assert crashes.get(timeout=TIMEOUT) is ZeroDivisionError


def test_nobody_waits_for_what_is_asked_after_the_end(
    queue: SerialQueue, diary: Diary
) -> None:
    queue.end()
    queue.ask_and_wait(diary.noting("too late"))

    assert diary.entries == []


def test_an_act_that_does_not_end_is_not_waited_for_longer_than_said(
    queue: SerialQueue, diary: Diary
) -> None:
    gives_way = threading.Event()
    queue.ask(lambda: diary.note(gives_way.wait(TIMEOUT)))
    queue.end()
    assert not queue.await_end(0.05)

    gives_way.set()
    assert queue.await_end(TIMEOUT)


# Bugs


def test_after_a_bug_it_recovers_first_and_then_goes_on(
    queue: SerialQueue, diary: Diary, crashes: "SimpleQueue[type[BaseException]]"
) -> None:
    may_go_on = threading.Event()
    queue.ask(lambda: fail(may_go_on.wait(TIMEOUT)))
    queue.ask(diary.noting("next"))
    may_go_on.set()
    settle(queue)

    assert diary.entries == ["recovered", "next"]
    assert crashes.get(timeout=TIMEOUT) is ZeroDivisionError


def test_whoever_waits_for_an_act_is_let_go_by_its_bug(
    queue: SerialQueue, diary: Diary, crashes: "SimpleQueue[type[BaseException]]"
) -> None:
    queue.ask_and_wait(fail)
    settle(queue)

    assert diary.entries == ["recovered"]
    assert crashes.get(timeout=TIMEOUT) is ZeroDivisionError


def test_a_bug_of_the_recovery_is_reported_and_not_recovered_from(
    diary: Diary, crashes: "SimpleQueue[type[BaseException]]"
) -> None:
    queue = SerialQueue("clerk", lambda: fail("to recover"))
    for number in range(2):
        queue.ask(fail)
        queue.ask(diary.noting(number))
    queue.end()
    assert queue.await_end(TIMEOUT)

    assert diary.entries == [0, 1]
    reported = [crashes.get(timeout=TIMEOUT) for _ in range(4)]
    assert set(reported) == {ZeroDivisionError}
    assert crashes.empty()


def test_the_end_after_a_bug_is_waited_for(
    queue: SerialQueue, diary: Diary, crashes: "SimpleQueue[type[BaseException]]"
) -> None:
    may_go_on = threading.Event()
    queue.ask(fail)
    queue.ask(lambda: diary.note(may_go_on.wait(TIMEOUT)))
    queue.end()
    assert not queue.await_end(0.05)

    may_go_on.set()
    assert queue.await_end(TIMEOUT)
    assert diary.entries == ["recovered", True]


# Tasks


class Outcomes:
    """Takes what comes of a task, and lets a test wait for it."""

    def __init__(self, queue: SerialQueue) -> None:
        self._queue = queue
        self.came: SimpleQueue[tuple[str, object]] = SimpleQueue()
        self.threads: set[str] = set()
        self.fractions: list[float] = []

    def start(self, work: Callable[[Report], object]) -> Callable[[], None]:
        """Start a task and return what cancels it."""
        return self._queue.start(
            work,
            then=lambda result: self._note("then", result),
            otherwise=lambda why: self._note("otherwise", why),
            on_bug=lambda: self._note("bug", None),
            on_progress=self.fractions.append,
        ).cancel

    def next(self) -> tuple[str, object]:
        return self.came.get(timeout=TIMEOUT)

    def _note(self, what: str, of: object) -> None:
        self.threads.add(threading.current_thread().name)
        self.came.put((what, of))


@pytest.fixture
def outcomes(queue: SerialQueue) -> Outcomes:
    return Outcomes(queue)


def test_a_task_runs_beside_the_queue_and_its_result_comes_in_turn(
    queue: SerialQueue, outcomes: Outcomes
) -> None:
    may_go_on = threading.Event()

    def work(report: Report) -> str:
        report(0.5)
        may_go_on.wait(TIMEOUT)
        return threading.current_thread().name

    outcomes.start(work)
    settle(queue)  # which is not held up
    may_go_on.set()

    assert outcomes.next() == ("then", "clerk task")
    assert outcomes.threads == {"clerk"}
    assert outcomes.fractions == [0.5]


def test_why_a_task_could_not_be_done_comes_in_turn(outcomes: Outcomes) -> None:
    def work(report: Report) -> None:
        raise LightpenError(FULL)

    outcomes.start(work)

    assert outcomes.next() == ("otherwise", FULL)
    assert outcomes.threads == {"clerk"}


def test_a_bug_of_a_task_is_reported_and_reported(
    diary: Diary, outcomes: Outcomes, crashes: "SimpleQueue[type[BaseException]]"
) -> None:
    outcomes.start(fail)

    assert outcomes.next() == ("bug", None)
    assert outcomes.threads == {"clerk"}
    assert crashes.get(timeout=TIMEOUT) is ZeroDivisionError
    assert diary.entries == []  # the queue had none


def test_a_task_that_is_cancelled_ends_at_its_next_report_and_nothing_comes_of_it(
    queue: SerialQueue, outcomes: Outcomes
) -> None:
    may_go_on, ends = threading.Event(), SimpleQueue[bool]()

    def work(report: Report) -> None:
        may_go_on.wait(TIMEOUT)
        try:
            report(0.5)
        except Cancelled:
            ends.put(True)
            raise
        ends.put(False)

    cancel = outcomes.start(work)
    cancel()
    may_go_on.set()
    assert ends.get(timeout=TIMEOUT)
    queue.end()
    assert queue.await_end(TIMEOUT)

    assert outcomes.came.empty()
    assert outcomes.fractions == []


def test_nothing_comes_of_a_task_that_is_cancelled_when_it_is_done(
    queue: SerialQueue, outcomes: Outcomes
) -> None:
    may_go_on, is_done = threading.Event(), threading.Event()

    def hold_up() -> None:
        """Cancel in the turn before that of the result."""
        cancel = outcomes.start(lambda report: is_done.set())
        is_done.wait(TIMEOUT)
        may_go_on.wait(TIMEOUT)
        cancel()

    queue.ask(hold_up)
    is_done.wait(TIMEOUT)
    may_go_on.set()
    queue.end()
    assert queue.await_end(TIMEOUT)

    assert outcomes.came.empty()


def test_the_end_cancels_the_tasks_and_waits_for_them(
    queue: SerialQueue, outcomes: Outcomes
) -> None:
    runs, may_go_on = threading.Event(), threading.Event()

    def work(report: Report) -> None:
        runs.set()
        while not may_go_on.wait(0.01):
            pass
        report(0.5)

    outcomes.start(work)
    assert runs.wait(TIMEOUT)
    queue.end()
    assert not queue.await_end(0.05)

    may_go_on.set()
    assert queue.await_end(TIMEOUT)
    assert outcomes.came.empty()
    assert outcomes.fractions == []  # it ended where it would have reported
