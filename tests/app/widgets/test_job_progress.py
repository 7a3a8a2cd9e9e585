"""A long job has a bar with percentage and time left, and Cancel."""

from pytestqt.qtbot import QtBot

from lightpen_app.look.words import TimeLeft
from lightpen_app.widgets.bars import JobProgress
from lightpen_app.widgets.controls import PushButton


def test_a_job_tells_its_percentage_and_is_hidden_once_it_has_ended(
    qtbot: QtBot,
) -> None:
    progress = JobProgress()
    qtbot.addWidget(progress)
    assert not progress.isVisible()

    progress.begin()
    progress.set_fraction(0.47)
    assert progress.isVisible()
    assert progress.words() == "47%"

    progress.end()
    assert not progress.isVisible()


def test_cancel_ends_what_is_shown_at_once(qtbot: QtBot) -> None:
    progress = JobProgress()
    qtbot.addWidget(progress)
    progress.begin()
    (cancel,) = progress.findChildren(PushButton)

    with qtbot.waitSignal(progress.cancelled):
        cancel.click()

    assert not progress.is_running
    assert not progress.isVisible()


def test_a_short_job_is_not_shown(qtbot: QtBot) -> None:
    progress = JobProgress(patience_ms=100)
    qtbot.addWidget(progress)
    progress.begin()
    assert not progress.isVisible()
    qtbot.waitUntil(progress.isVisible)
    progress.end()
    progress.begin()
    progress.end()
    qtbot.wait(200)
    assert not progress.isVisible()


def test_the_time_left_is_that_of_the_rate_so_far() -> None:
    now = [100.0]
    left = TimeLeft(lambda: now[0])
    assert left.text(0.5) == ""  # nobody knows the rate yet
    now[0] += 30.0
    assert left.text(0.001) == ""
    assert left.text(0.5) == "about 30 s left"
    assert left.text(0.1) == "about 5 min left"
    assert left.text(1.0) == ""
    left.restart()
    assert left.text(0.5) == ""
