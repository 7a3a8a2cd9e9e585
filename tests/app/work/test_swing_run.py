"""The GUI gets every event and the newest status of a swing on its own thread."""

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import Qt, QThread
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot
from typing_extensions import override

from lightpen.swing.capture.state import Phase, SwingEventKind, SwingState
from lightpen.swing.preparation import Preparation
from lightpen.swing.swing_recorder import read_resumable
from lightpen_app.work.job import Notifications
from lightpen_app.work.swing_run import SwingRun
from lightpen_extensions.simulator.camera import GuidedOperator, SkippingClock
from lightpen_extensions.simulator.hand import SimulatedOperator

TIMEOUT = 60.0  # s until a test gives up
SIGNALS = ("changed", "happened", "progressed", "refused")


class Diary:
    """Writes down what a run tells, as it tells it."""

    def __init__(self, run: SwingRun) -> None:
        self.entries: list[tuple[str, tuple[Any, ...]]] = []
        self.threads: set[QThread] = set()
        for name in SIGNALS:
            direct = Qt.ConnectionType.DirectConnection
            getattr(run, name).connect(self._writer(name), direct)

    def names(self) -> list[str]:
        return [name for name, _ in self.entries]

    def of(self, name: str) -> list[Any]:
        return [values[0] for reported, values in self.entries if reported == name]

    def event_kinds(self) -> list[SwingEventKind]:
        return [event.what for event in self.of("happened")]

    def _writer(self, name: str) -> Callable[..., None]:
        def write(*values: object) -> None:
            self.entries.append((name, values))
            self.threads.add(QThread.currentThread())

        return write


@pytest.fixture
def diary(run: SwingRun) -> Diary:
    return Diary(run)


def hold_up_until(is_so: Callable[[], bool]) -> None:
    """Let the GUI do nothing until something is so."""
    pause = threading.Event()
    for _ in range(round(TIMEOUT / 0.005)):
        if is_so():
            return
        pause.wait(0.005)
    pytest.fail("It never came to that.")


def phase(run: SwingRun) -> Phase | None:
    """Return how far a swing is, which the GUI need not know yet."""
    state = run.runner.status.state
    return None if state is None else state.phase


def test_records_and_results_are_kept_in_the_folder(
    run: SwingRun, prepared: Preparation, qtbot: QtBot, tmp_path: Path
) -> None:
    with qtbot.waitSignal(run.changed, timeout=round(1000 * TIMEOUT)):
        run.runner.ask(lambda workflow: workflow.begin(prepared))

    assert run.records_folder.parent == run.archive.folder.parent == tmp_path / "run"
    assert run.status.record_folder is not None
    assert run.status.record_folder.parent == run.records_folder
    assert "2031" in run.status.record_folder.name


def test_a_gui_that_was_busy_gets_every_event_and_then_the_newest_status(
    run: SwingRun, diary: Diary, prepared: Preparation
) -> None:
    for _ in range(2):
        run.runner.ask(lambda workflow: workflow.begin(prepared))
        hold_up_until(lambda: run.runner.status.is_capturing)
        # without an image there is no tip
        run.runner.ask(lambda workflow: workflow.finish())
        hold_up_until(lambda: phase(run) is Phase.VERDICT)
    # does nothing; all that was reported before is on its way
    run.runner.ask(lambda workflow: workflow.pause())
    run.runner.shut_down()
    assert run.runner.await_end(TIMEOUT)
    QApplication.processEvents()

    assert diary.names() == ["happened"] * 4 + ["changed"]
    assert diary.event_kinds() == [SwingEventKind.CAPTURED, SwingEventKind.FAILED] * 2
    assert run.status is run.runner.status


def test_an_event_comes_before_the_status_after_it(
    run: SwingRun, diary: Diary, prepared: Preparation, qtbot: QtBot
) -> None:
    phases: list[Phase] = []

    def note() -> None:
        if run.status.state is not None:
            phases.append(run.status.state.phase)

    run.happened.connect(note)
    run.runner.ask(lambda workflow: workflow.begin(prepared))
    run.runner.ask(lambda workflow: workflow.finish())
    qtbot.waitUntil(
        lambda: SwingEventKind.FAILED in diary.event_kinds(),
        timeout=round(1000 * TIMEOUT),
    )

    assert phases[-1] is Phase.VERDICT  # which a slot of the event can rely on
    assert diary.names()[-1] == "changed"


def test_all_is_reported_on_the_thread_of_the_gui(
    run: SwingRun,
    diary: Diary,
    prepared: Preparation,
    interrupted: Path,
    notifications: Notifications,
    qapp: QApplication,
    qtbot: QtBot,
) -> None:
    reported, withdrawn = list[str](), list[str]()
    notifications.raised.connect(lambda text, _: reported.append(text))
    notifications.withdrawn.connect(withdrawn.append)
    run.records_folder.rename(run.records_folder.with_name("old"))
    run.records_folder.write_text("not a folder")
    run.runner.ask(lambda workflow: workflow.begin(prepared))
    qtbot.waitUntil(lambda: "refused" in diary.names(), timeout=round(1000 * TIMEOUT))
    run.records_folder.unlink()
    run.records_folder.with_name("old").rename(run.records_folder)
    resumable = read_resumable(interrupted)
    run.runner.ask(lambda workflow: workflow.continue_swing(resumable))
    run.runner.ask(lambda workflow: workflow.finish())
    qtbot.waitUntil(
        lambda: run.status.solution is not None, timeout=round(1000 * TIMEOUT)
    )

    assert set(diary.names()) == set(SIGNALS)
    assert diary.threads == {qapp.thread()}
    fractions = diary.of("progressed")
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0
    assert len(reported) == 1
    assert "cannot be written" in reported[0]
    assert withdrawn == reported


def test_a_follower_sees_every_state_though_the_gui_is_busy(
    run: SwingRun, prepared: Preparation
) -> None:
    class Watcher(GuidedOperator):
        seen: list[SwingState]

        @override
        def follow(self, state: SwingState) -> None:
            self.seen.append(state)

    watcher = Watcher(SimulatedOperator(SkippingClock()))
    watcher.seen = []
    run.follower = watcher
    run.runner.ask(lambda workflow: workflow.begin(prepared))
    run.runner.ask(lambda workflow: workflow.pause())
    run.runner.ask(lambda workflow: workflow.resume())
    # of which there is nothing to follow
    run.runner.ask(lambda workflow: workflow.abandon())
    run.runner.shut_down()
    assert run.runner.await_end(TIMEOUT)

    phases = [state.phase for state in watcher.seen]
    assert phases == [Phase.WAIT, Phase.PAUSED, Phase.WAIT]
