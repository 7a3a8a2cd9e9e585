"""A job ends with one outcome, stops when cancelled, and outlives no window."""

import time
from threading import Event

import pytest
from PySide6.QtCore import QObject, QThread, QThreadPool
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from lightpen.errors import CalibrationError
from lightpen.messages import message
from lightpen_app.work.job import Job, LatestJob, Report


def endless(report: Report) -> None:
    """Report until cancelled."""
    while True:
        time.sleep(0.001)
        report(0.5)


def test_the_result_arrives_on_the_gui_thread(qtbot: QtBot) -> None:
    job = Job(lambda report: 42)
    seen: list[tuple[object, bool]] = []
    job.succeeded.connect(
        lambda value: seen.append((value, QThread.currentThread().isMainThread()))
    )

    with qtbot.waitSignal(job.succeeded):
        job.start()

    assert seen == [(42, True)]


def test_a_failure_carries_the_text_for_the_user(qtbot: QtBot) -> None:
    def refuse(report: Report) -> None:
        raise CalibrationError(message("swing.follow-arrow"))

    job = Job(refuse)
    with qtbot.waitSignal(job.failed) as blocker:
        job.start()

    assert blocker.args == ["Keep the tip pressed into the cone."]


def test_a_cancelled_job_stops_and_tells_only_that_it_ended(qtbot: QtBot) -> None:
    job = Job(endless)
    with qtbot.waitSignal(job.progressed):
        job.start()

    with (
        qtbot.assertNotEmitted(job.succeeded),
        qtbot.assertNotEmitted(job.failed),
        qtbot.waitSignal(job.ended),
    ):
        job.cancel()

    assert QThreadPool.globalInstance().waitForDone(60_000)


def test_an_outcome_on_its_way_is_not_reported_once_cancelled(qtbot: QtBot) -> None:
    done = Event()

    def finish(report: Report) -> int:
        done.set()
        return 42

    job = Job(finish)
    with qtbot.assertNotEmitted(job.succeeded):
        job.start()
        assert done.wait(60)
        assert QThreadPool.globalInstance().waitForDone(60_000)
        job.cancel()  # the result waits in the event queue of this thread
        QApplication.processEvents()


def test_a_job_that_is_cancelled_before_its_turn_does_nothing(qtbot: QtBot) -> None:
    n_threads = QThreadPool.globalInstance().maxThreadCount()
    may_end, done = Event(), Event()
    others = [Job(lambda report: may_end.wait(60)) for _ in range(n_threads)]
    for other in others:
        other.start()
    job = Job(lambda report: done.set())
    job.start()
    job.cancel()
    with qtbot.waitSignal(job.ended):
        may_end.set()

    assert not done.is_set()


def test_a_job_that_ended_deletes_itself(qtbot: QtBot) -> None:
    job = Job(lambda report: 42)
    with qtbot.waitSignal(job.destroyed):
        job.start()


def test_a_bug_reaches_the_crash_hook_and_ends_the_job(
    qtbot: QtBot, monkeypatch: pytest.MonkeyPatch
) -> None:
    caught: list[BaseException] = []
    monkeypatch.setattr(
        "sys.excepthook", lambda kind, error, trace: caught.append(error)
    )
    job = Job(lambda report: 1 / 0)
    seen: list[bool] = []
    job.crashed.connect(lambda: seen.append(QThread.currentThread().isMainThread()))

    with qtbot.assertNotEmitted(job.succeeded), qtbot.waitSignal(job.ended):
        job.start()

    assert seen == [True]
    assert QThreadPool.globalInstance().waitForDone(60_000)
    assert isinstance(caught[0], ZeroDivisionError)


def test_the_progress_of_a_cancelled_job_is_not_reported(qtbot: QtBot) -> None:
    job = Job(lambda report: report(0.5))
    with qtbot.assertNotEmitted(job.progressed):
        job.start()
        assert QThreadPool.globalInstance().waitForDone(60_000)
        job.cancel()  # it waits in the event queue of this thread
        QApplication.processEvents()


def test_of_two_jobs_only_the_latest_reports(qtbot: QtBot) -> None:
    parent, told, ends = QObject(), list[int](), list[bool]()
    latest = LatestJob(parent)

    def on_succeeded(number: int) -> None:
        told.append(number)
        ends.append(latest.is_running)

    latest.start(endless, on_succeeded, ended=lambda: told.append(-1))
    latest.start(lambda report: 2, on_succeeded, ended=lambda: told.append(3))
    assert latest.is_running
    qtbot.waitUntil(lambda: told == [2, 3])

    assert ends == [False]  # once reported, the outcome is no longer awaited
    assert QThreadPool.globalInstance().waitForDone(60_000)
    QApplication.processEvents()
    assert told == [2, 3]


def test_a_latest_job_that_is_cancelled_is_no_longer_awaited(qtbot: QtBot) -> None:
    parent, told = QObject(), list[object]()
    latest = LatestJob(parent)
    latest.start(endless, told.append, told.append, ended=lambda: told.append(None))
    latest.cancel()

    assert not latest.is_running
    assert QThreadPool.globalInstance().waitForDone(60_000)
    QApplication.processEvents()
    assert told == []
