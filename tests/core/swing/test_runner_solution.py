"""From the end of the capture to the tip in force."""

import shutil
import threading
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from benchmarks.small_records import entries_of

from lightpen.estimation.reports.report import calibration_record
from lightpen.messages import Code
from lightpen.record.swings.reading import DISCARDED, JOURNAL, Record, open_record
from lightpen.record.swings.solving import Solution, record_inputs, solve_record
from lightpen.swing.capture.rules import stillness
from lightpen.swing.capture.state import Phase, SwingEventKind
from lightpen.swing.runner import SwingRunner
from lightpen.swing.status import Activity
from lightpen.swing.swing_recorder import read_resumable
from lightpen.swing.workflow import SwingWorkflow

if TYPE_CHECKING:
    from tests.core.conftest import Station

TIMEOUT = 60.0  # s until a test gives up
N_IMAGES = 20  # of the record that is resumed
Command = Callable[[Path], dict[str, Any]]


# The solution


@pytest.mark.slow
def test_the_tip_is_that_of_the_command_line_to_the_last_digit(
    solved: "Station", command: Command
) -> None:
    solution = solved.solution
    inputs = record_inputs(solution.source)
    limits = open_record(solved.record_folder).header.limits
    record = calibration_record(solution.calibration, inputs, limits)
    fields = entries_of(record)
    fields.pop("created")

    assert fields == command(solved.record_folder)


def test_how_far_the_tip_is_computed_is_reported_from_0_to_1(solved: "Station") -> None:
    fractions = solved.witness.fractions

    assert fractions == sorted(fractions)
    assert len(fractions) >= N_IMAGES
    assert (fractions[0] < 0.1, fractions[-1]) == (True, 1.0)


@pytest.mark.slow
def test_a_tip_that_is_reported_by_the_two_stage_method_is_accepted_so(
    solved: "Station",
) -> None:
    solved.runner.ask(lambda workflow: workflow.solving.report_by("two-stage"))
    solved.wait_until_solved()
    paper = solved.solution.calibration.two_stage.tip_pen.tolist()
    solved.runner.ask(lambda workflow: workflow.solving.exclude([2]))
    solved.wait_until_solved()
    assert solved.solution.calibration.method == "two-stage"
    solved.runner.ask(lambda workflow: workflow.solving.include([2]))
    solved.wait_until_solved()
    solved.wait_until_solved()
    solved.accept()

    assert solved.status.result is not None
    record = solved.status.result.calibration
    assert record.method == "two-stage"
    assert record.tip_pen_mm == pytest.approx(paper)
    joint = record.methods["joint"].expanded_uncertainty_mm
    assert np.all(np.array(record.expanded_uncertainty_mm) > np.array(joint))


def _without(workflow: SwingWorkflow, number: int) -> None:
    workflow.solving.exclude([number])


@pytest.mark.slow
def test_images_taken_out_in_quick_succession_all_count(
    solved: "Station", command: Command
) -> None:
    for number in range(1, 8):
        solved.runner.ask(partial(_without, number=number))
    solved.runner.ask(lambda workflow: workflow.solving.include([4]))
    solved.wait_until_solved()

    assert set(solved.solution.excluded) == {1, 2, 3, 5, 6, 7}
    assert set(open_record(solved.record_folder).excluded) == {1, 2, 3, 5, 6, 7}
    assert solved.tip == command(solved.record_folder)["tip_pen_mm"]
    event_kinds = solved.witness.event_kinds
    assert event_kinds[-1] in (SwingEventKind.DONE, SwingEventKind.FAILED)
    assert event_kinds.count(event_kinds[-1]) == 1  # the verdict is reported once


@pytest.mark.slow
def test_too_few_images_left_keep_the_solution_and_the_record(
    solved: "Station",
) -> None:
    solved.runner.ask(lambda workflow: workflow.solving.exclude([1]))
    solved.wait_until_solved()
    before, journal = solved.solution, (solved.record_folder / JOURNAL).read_bytes()
    solved.runner.ask(lambda workflow: workflow.solving.exclude(range(1, N_IMAGES)))
    solved.wait_until_solved()

    assert solved.solution is before
    assert (solved.record_folder / JOURNAL).read_bytes() == journal
    (sentence,) = solved.witness.faults
    assert "images are usable" in sentence
    assert (
        "Without these images the tip is not determined; they remain included."
        in sentence
    )
    assert solved.witness.reliefs == []
    # what failed is not asked for again
    solved.runner.ask(lambda workflow: workflow.solving.exclude([2]))
    solved.wait_until_solved()
    assert set(solved.solution.excluded) == {1, 2}
    assert solved.witness.reliefs == solved.witness.faults


def test_what_is_wished_for_while_a_wish_fails_is_fulfilled(solved: "Station") -> None:
    solved.runner.ask(lambda workflow: workflow.solving.exclude(range(1, N_IMAGES)))
    solved.runner.ask(lambda workflow: workflow.solving.include(range(4, N_IMAGES)))
    solved.wait_until_solved()

    assert set(solved.solution.excluded) == {1, 2, 3}
    assert solved.witness.faults == []


def test_a_record_that_cannot_be_written_keeps_the_solution(solved: "Station") -> None:
    before = solved.solution
    journal = solved.record_folder / JOURNAL
    journal.rename(journal.with_name("elsewhere"))
    solved.runner.ask(lambda workflow: workflow.solving.exclude([3]))
    solved.wait_until_solved()
    journal.with_name("elsewhere").rename(journal)

    assert solved.solution is before
    (sentence,) = solved.witness.faults
    assert "does not exist" in sentence
    assert "stay in" not in sentence
    assert solved.witness.reliefs == []
    solved.runner.ask(lambda workflow: workflow.solving.exclude([3]))
    solved.wait_until_solved()
    assert solved.witness.reliefs == [sentence]


def test_solving_can_be_cancelled_and_done_again(
    station: "Station", interrupted: Path
) -> None:
    station.go_on(interrupted)
    station.runner.ask(lambda workflow: workflow.finish())
    station.runner.ask(lambda workflow: workflow.solving.cancel())
    station.see()
    assert Activity.SOLVING in [s.activity for s in station.witness.statuses]
    assert not station.status.is_solving
    assert station.state.phase is Phase.SOLVING
    assert station.status.solution is None

    station.runner.ask(lambda workflow: workflow.solving.solve())
    station.wait_for_phase(Phase.VERDICT)
    assert station.status.solution is not None


def test_a_swing_is_solved_from_the_moment_that_it_ends(solved: "Station") -> None:
    ended = [
        status
        for status in solved.witness.statuses
        if status.state is not None and status.state.phase is Phase.SOLVING
    ]

    assert ended
    assert all(status.is_solving for status in ended)


def test_nothing_comes_of_a_solution_after_its_swing_was_abandoned(
    station: "Station", interrupted: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    may_go_on, is_solved = threading.Event(), threading.Event()

    def solve_late(record: Record, report: Callable[[float], None]) -> Solution:
        may_go_on.wait(TIMEOUT)
        solution = solve_record(record)
        is_solved.set()
        return solution

    monkeypatch.setattr("lightpen.swing.solving.solve_record", solve_late)
    station.go_on(interrupted)
    station.runner.ask(lambda workflow: workflow.finish())
    station.runner.ask(lambda workflow: workflow.abandon())
    station.see()
    may_go_on.set()
    assert is_solved.wait(TIMEOUT)
    for thread in threading.enumerate():
        if thread.name == "swing task":
            thread.join(TIMEOUT)
    station.see()

    assert station.status.solution is None
    assert station.witness.faults == []


@pytest.mark.slow
def test_a_cancelled_wish_leaves_solution_and_record_as_they_were(
    solved: "Station",
) -> None:
    before, journal = solved.solution, (solved.record_folder / JOURNAL).read_bytes()
    solved.runner.ask(lambda workflow: workflow.solving.exclude([3]))
    solved.runner.ask(lambda workflow: workflow.solving.cancel())
    solved.see()
    assert not solved.status.is_solving
    solved.runner.ask(lambda workflow: workflow.solving.exclude([7]))
    solved.wait_until_solved()

    assert before.excluded == {}
    assert set(solved.solution.excluded) == {7}
    assert journal in (solved.record_folder / JOURNAL).read_bytes()
    assert set(open_record(solved.record_folder).excluded) == {7}


# After the verdict


@pytest.mark.slow
def test_holding_the_pen_upright_and_still_after_the_verdict_is_reported_once(
    solved: "Station",
) -> None:
    solved.see(3)  # until the hand has done what it was guided to last
    solved.operator.lean_towards(0.4, 0.0, 0.0)
    solved.see(35)
    assert SwingEventKind.CONFIRMED not in solved.witness.event_kinds

    solved.operator.lean_towards(0.0, 0.0, 0.0)
    solved.see_until(lambda: SwingEventKind.CONFIRMED in solved.witness.event_kinds)
    assert stillness(solved.state) == 1.0
    solved.see(10)
    assert solved.witness.event_kinds.count(SwingEventKind.CONFIRMED) == 1
    assert solved.state.phase is Phase.VERDICT


@pytest.mark.slow
def test_more_images_can_be_captured_after_the_verdict(
    solved: "Station", command: Command
) -> None:
    solved.runner.ask(lambda workflow: workflow.solving.exclude([3]))
    solved.wait_until_solved()
    solved.runner.ask(lambda workflow: workflow.capture_more())
    solved.wait_until(lambda: solved.status.is_capturing)
    assert solved.status.solution is None
    assert not solved.status.is_reading
    assert solved.state.n_kept == N_IMAGES - 1
    solved.keep(1)
    solved.solve()

    assert solved.n_recorded == N_IMAGES + 1
    assert set(solved.solution.excluded) == {3}
    assert solved.tip == command(solved.record_folder)["tip_pen_mm"]


@pytest.mark.slow
def test_the_operators_side_is_that_of_the_station_and_kept_for_more_images(
    station: "Station", interrupted: Path, rewrite_header: Callable[..., None]
) -> None:
    rewrite_header(interrupted, limits={"max_uncertainty": 1.0})
    chosen = replace(station.preparation, heading=np.pi)
    station.runner.ask(lambda workflow: workflow.choose(chosen))
    station.go_on(interrupted)
    assert station.state.heading == np.pi
    station.solve()
    turned = replace(station.preparation, heading=0.0)
    station.runner.ask(lambda workflow: workflow.choose(turned))
    station.runner.ask(lambda workflow: workflow.capture_more())
    station.wait_until(lambda: station.status.is_capturing)

    assert station.state.heading == np.pi


@pytest.mark.slow
def test_more_images_than_needed_are_not_needed_because_they_were_asked_for(
    solved: "Station",
) -> None:
    solved.runner.ask(lambda workflow: workflow.capture_more())
    solved.wait_until(lambda: solved.status.is_capturing)
    assert solved.status.setup is not None
    assert solved.status.setup.limits.min_images > N_IMAGES + 1
    solved.keep(1)
    solved.solve()

    assert solved.status.verdict is not None
    assert solved.status.verdict.reason.code != Code.TOO_FEW_IMAGES


@pytest.mark.slow
def test_more_images_can_be_captured_while_a_wish_is_computed(
    solved: "Station",
) -> None:
    solved.runner.ask(lambda workflow: workflow.solving.exclude([3]))
    solved.runner.ask(lambda workflow: workflow.capture_more())
    solved.wait_until(lambda: solved.status.is_capturing)
    solved.keep(1)

    assert open_record(solved.record_folder).excluded == {}
    assert solved.status.solution is None


def test_images_that_cannot_be_read_again_leave_the_solution_and_no_wish(
    solved: "Station",
) -> None:
    before = solved.solution
    journal = solved.record_folder / JOURNAL
    journal.rename(journal.with_name("elsewhere"))
    solved.runner.ask(lambda workflow: workflow.solving.exclude([3]))
    solved.runner.ask(lambda workflow: workflow.capture_more())
    # while they are read nothing is taken out
    solved.runner.ask(lambda workflow: workflow.solving.exclude([4]))
    solved.wait_until(lambda: len(solved.witness.faults) == 1)
    solved.wait_until(lambda: solved.status.activity is Activity.NONE)
    journal.with_name("elsewhere").rename(journal)
    assert solved.solution is before
    assert not solved.status.is_capturing

    solved.runner.ask(lambda workflow: workflow.solving.exclude([7]))
    solved.wait_until_solved()
    assert set(solved.solution.excluded) == {7}


def test_a_swing_that_is_captured_is_set_aside_for_good(
    station: "Station", interrupted: Path
) -> None:
    station.go_on(interrupted)
    station.keep(1)
    station.runner.ask(lambda workflow: workflow.discard())
    station.wait_until(lambda: station.status.state is None)
    assert open_record(interrupted).verdict == DISCARDED
    station.begin()
    station.see()

    assert open_record(interrupted).verdict == DISCARDED
    assert len(open_record(interrupted).images) == N_IMAGES + 1


# Accepting, or not


@pytest.fixture
def other(
    in_force: "Station", swung: Callable[..., Path], rewrite_header: Callable[..., None]
) -> Path:
    """The record of another swing, that of the one in force as it was taken."""
    folder = in_force.records / "other"
    shutil.copytree(swung(), folder)
    rewrite_header(folder, limits={"max_uncertainty": 1.0})
    return folder


@pytest.mark.slow
def test_the_tip_before_stays_in_force_until_the_new_one_is_accepted(
    in_force: "Station", other: Path
) -> None:
    first = in_force.status.result
    assert first is not None
    in_force.go_on(other)
    in_force.solve()
    assert in_force.status.result is None
    before = in_force.in_force()
    assert before is not None
    assert before.accepted == first.accepted

    in_force.accept()
    after, second = in_force.in_force(), in_force.status.result
    assert after is not None
    assert second is not None
    assert after.accepted == second.accepted > first.accepted
    assert after.tip_pen.tolist() == in_force.tip


def test_a_tip_is_not_accepted_while_another_is_computed(solved: "Station") -> None:
    solved.runner.ask(lambda workflow: workflow.solving.exclude([3]))
    solved.runner.ask(lambda workflow: workflow.solving.accept("It is seen to."))
    solved.wait_until_solved()

    assert solved.status.result is None
    assert solved.in_force() is None


def test_a_result_of_another_swing_is_taken_back_and_this_one_stays(
    in_force: "Station", other: Path
) -> None:
    first = in_force.status.result
    assert first is not None
    in_force.go_on(other)
    in_force.runner.ask(lambda workflow: workflow.solving.revoke(first, "Ben"))
    in_force.wait_until(lambda: in_force.status.revoked is first)

    assert in_force.status.is_capturing
    assert in_force.in_force() is None


def test_the_swing_of_a_tip_in_force_stays_as_it_is(in_force: "Station") -> None:
    solution, result = in_force.solution, in_force.status.result
    journal = (in_force.record_folder / JOURNAL).read_bytes()
    runner = in_force.runner
    runner.ask(lambda workflow: workflow.solving.exclude([1]))
    runner.ask(lambda workflow: workflow.solving.accept("It is seen to."))
    for act in (
        lambda workflow: workflow.solving.solve(),
        SwingWorkflow.capture_more,
        SwingWorkflow.discard,
    ):
        runner.ask(act)
    in_force.see()

    assert in_force.status.activity is Activity.NONE
    assert in_force.solution is solution
    assert in_force.status.result is result
    assert (in_force.record_folder / JOURNAL).read_bytes() == journal
    assert len(list(in_force.results.iterdir())) == 1


def test_a_result_that_cannot_be_stored_is_not_in_force(solved: "Station") -> None:
    solved.results.parent.mkdir()
    solved.results.write_text("not a folder")
    solved.runner.ask(lambda workflow: workflow.solving.accept("It is seen to."))
    solved.wait_until(lambda: len(solved.witness.faults) == 1)
    assert solved.status.result is None
    assert solved.status.activity is Activity.NONE
    assert open_record(solved.record_folder).verdict is None

    solved.results.unlink()
    solved.accept()
    solved.see()
    assert solved.witness.reliefs == solved.witness.faults


def test_a_result_bears_the_time_that_the_runner_goes_by(
    station: "Station", interrupted: Path, rewrite_header: Callable[..., None]
) -> None:
    noon = datetime(2026, 5, 1, 12, tzinfo=UTC)
    runner = SwingRunner(
        station.records, station.archive, station.witness, now=lambda: noon
    )
    rewrite_header(interrupted, limits={"max_uncertainty": 1.0})
    resumable = read_resumable(interrupted)
    runner.ask(lambda workflow: workflow.continue_swing(resumable))
    runner.ask(lambda workflow: workflow.finish())
    station.witness.wait_until(lambda: runner.status.verdict is not None)
    runner.ask(lambda workflow: workflow.solving.accept("It is seen to."))
    runner.shut_down()
    assert runner.await_end(TIMEOUT)
    result = station.in_force()

    assert result is not None
    assert result.accepted == noon
