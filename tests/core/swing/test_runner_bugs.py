"""A bug costs no more than what was being done."""

import shutil
from collections.abc import Callable
from pathlib import Path
from queue import SimpleQueue
from typing import TYPE_CHECKING

import pytest

from lightpen.record.swings.reading import open_record
from lightpen.swing.capture.state import Phase
from lightpen.swing.status import Activity, OperatorPresence
from lightpen.swing.swing_recorder import read_resumable

if TYPE_CHECKING:
    from tests.core.conftest import Station

TIMEOUT = 60.0  # s until a test gives up
N_IMAGES = 20  # of the record that is resumed


class MistakeError(Exception):
    """A bug."""


def fail(*_: object, **__: object) -> None:
    raise MistakeError


@pytest.fixture
def crashes(monkeypatch: pytest.MonkeyPatch) -> "Crashes":
    """The bugs that are reported."""
    caught: Crashes = SimpleQueue()
    monkeypatch.setattr("threading.excepthook", lambda args: caught.put(args.exc_type))
    return caught


Crashes = SimpleQueue[type[BaseException]]


def is_reported_once(crashes: Crashes) -> bool:
    """Return whether a bug is reported, soon, and no other was."""
    return crashes.get(timeout=TIMEOUT) is MistakeError and crashes.empty()


@pytest.mark.slow
def test_a_bug_while_an_image_is_taken_pauses_the_swing_and_costs_nothing_else(
    station: "Station",
    interrupted: Path,
    crashes: Crashes,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    station.go_on(interrupted)
    station.keep(1)
    with monkeypatch.context() as broken:
        broken.setattr("lightpen.swing.swing_recorder.advance_swing", fail)
        station.see(5)
    station.wait_until(lambda: len(station.witness.faults) == 1)

    assert is_reported_once(crashes)  # not with every image
    assert "An internal error occurred" in station.witness.faults[0]
    assert station.status.is_paused_by_user
    assert not station.status.has_fault
    assert station.n_recorded == station.state.n_kept == N_IMAGES + 1
    station.runner.ask(lambda workflow: workflow.resume())
    station.keep(1)
    assert station.witness.reliefs == station.witness.faults
    station.solve()
    assert station.solution.numbers.tolist() == list(range(1, N_IMAGES + 3))


def test_a_bug_when_a_swing_begins_is_reported_once_and_tried_again_when_asked_for(
    present: "Station", crashes: Crashes, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as broken:
        broken.setattr("lightpen.swing.workflow.read_resumable", fail)
        present.see(5)
        present.wait_until(lambda: len(present.witness.faults) == 1)
    assert is_reported_once(crashes)
    assert len(list(present.records.iterdir())) == 1
    assert present.status.state is None

    present.runner.ask(lambda workflow: workflow.try_again())
    present.see()
    assert present.status.is_capturing


def test_a_bug_in_a_command_pauses_the_swing_and_costs_nothing_else(
    station: "Station",
    interrupted: Path,
    crashes: Crashes,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    station.go_on(interrupted)
    with monkeypatch.context() as broken:
        broken.setattr("lightpen.swing.workflow.finish", fail)
        station.runner.ask(lambda workflow: workflow.finish())
        station.wait_until(lambda: len(station.witness.faults) == 1)
    assert is_reported_once(crashes)
    assert station.status.is_paused_by_user

    station.runner.ask(lambda workflow: workflow.resume())
    station.keep(1)
    station.solve()
    assert station.solution.numbers.tolist() == list(range(1, N_IMAGES + 2))


def test_a_swing_whose_entrance_fails_by_a_bug_leaves_the_one_before_whole(
    station: "Station",
    interrupted: Path,
    swung: Callable[..., Path],
    crashes: Crashes,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    other = station.records / "other"
    shutil.copytree(swung(), other)
    station.go_on(interrupted)
    with monkeypatch.context() as broken:
        broken.setattr("lightpen.swing.workflow.SwingRecorder", fail)
        resumable = read_resumable(other)
        station.runner.ask(lambda workflow: workflow.continue_swing(resumable))
        station.wait_until(lambda: len(station.witness.faults) == 1)
    station.runner.ask(lambda workflow: workflow.resume())
    station.keep(1)

    assert is_reported_once(crashes)
    assert station.record_folder == interrupted
    assert station.n_recorded == N_IMAGES + 1
    assert len(open_record(other).images) == N_IMAGES
    assert station.is_free(other)


@pytest.mark.parametrize("step", ["solve_record", "assess"])
def test_a_bug_in_the_computation_of_the_tip_leaves_the_swing_to_be_solved_again(
    station: "Station",
    interrupted: Path,
    crashes: Crashes,
    monkeypatch: pytest.MonkeyPatch,
    step: str,
) -> None:
    station.go_on(interrupted)
    with monkeypatch.context() as broken:
        broken.setattr(f"lightpen.swing.solving.{step}", fail)
        station.runner.ask(lambda workflow: workflow.finish())
        assert is_reported_once(crashes)
        station.wait_until(lambda: not station.status.is_solving)
    assert station.status.solution is None

    station.runner.ask(lambda workflow: workflow.solving.solve())
    station.wait_for_phase(Phase.VERDICT)
    assert station.status.solution is not None


def test_a_bug_while_images_are_read_again_leaves_the_solution(
    solved: "Station", crashes: Crashes, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = solved.solution
    with monkeypatch.context() as broken:
        broken.setattr("lightpen.swing.workflow.read_for_more", fail)
        solved.runner.ask(lambda workflow: workflow.capture_more())
        assert is_reported_once(crashes)
        solved.wait_until(lambda: not solved.status.is_reading)
    assert solved.solution is before

    solved.runner.ask(lambda workflow: workflow.capture_more())
    solved.wait_until(lambda: solved.status.is_capturing)
    assert solved.state.n_kept == N_IMAGES


def test_a_bug_while_a_result_is_stored_leaves_the_tip_to_be_accepted(
    solved: "Station", crashes: Crashes, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as broken:
        broken.setattr("lightpen.swing.solving.accept", fail)
        solved.runner.ask(lambda workflow: workflow.solving.accept("It is seen to."))
        solved.wait_until(lambda: len(solved.witness.faults) == 1)
    assert is_reported_once(crashes)
    assert solved.status.activity is Activity.NONE
    assert solved.status.result is None

    solved.accept()


def test_a_bug_in_a_command_lets_what_is_computed_go_on(
    station: "Station",
    interrupted: Path,
    crashes: Crashes,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    station.go_on(interrupted)
    with monkeypatch.context() as broken:
        broken.setattr(OperatorPresence, "arrived", fail)
        station.runner.ask(lambda workflow: workflow.finish())
        station.runner.ask(lambda workflow: workflow.note_arrival())
        station.wait_until(lambda: len(station.witness.faults) == 1)
    station.wait_for_phase(Phase.VERDICT)

    assert is_reported_once(crashes)
    assert station.status.solution is not None


def test_a_bug_of_the_listener_ends_neither_the_swing_nor_the_runner(
    station: "Station",
    interrupted: Path,
    crashes: Crashes,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    station.go_on(interrupted)
    with monkeypatch.context() as broken:
        broken.setattr(station.witness, "on_swing", fail)
        station.see(4)
    for _ in range(2):  # with the image, and when that was to be reported
        assert crashes.get(timeout=TIMEOUT) is MistakeError
    assert crashes.empty()

    station.runner.ask(lambda workflow: workflow.resume())
    station.keep(1)
    assert station.n_recorded == N_IMAGES + 1
