"""The press test: a second swing with firm pressure, beside the one that counts."""

from dataclasses import replace
from typing import TYPE_CHECKING

import pytest

from lightpen.errors import AcceptanceError
from lightpen.local_time import local_now
from lightpen.record.results.acceptance import accept
from lightpen.record.swings.interrupted import find_unfinished
from lightpen.record.swings.reading import DISCARDED, open_record
from lightpen.record.swings.solving import solve_record
from lightpen.swing.capture.state import Phase

if TYPE_CHECKING:
    from tests.core.conftest import Station

N_IMAGES = 12


@pytest.fixture
def pressing(solved: "Station") -> "Station":
    """A swing that was solved, and a press test under way."""
    solved.runner.ask(lambda workflow: workflow.choose(solved.preparation))
    solved.runner.ask(lambda workflow: workflow.keep_choices())
    first = solved.record_folder
    solved.runner.ask(lambda workflow: workflow.press())
    solved.wait_until(lambda: solved.status.record_folder != first)
    return solved


def test_it_is_a_short_swing_of_the_same_tip(pressing: "Station") -> None:
    setup = pressing.status.setup

    assert setup is not None
    assert setup.is_press_test
    assert pressing.status.is_capturing
    assert setup.limits.min_images == 60
    assert pressing.status.names == pressing.preparation.names


@pytest.mark.slow
def test_its_solution_comes_beside_the_first_and_replaces_nothing(
    solved: "Station",
) -> None:
    before, first = solved.solution, solved.record_folder
    solved.runner.ask(lambda workflow: workflow.choose(solved.preparation))
    solved.runner.ask(lambda workflow: workflow.keep_choices())
    solved.runner.ask(lambda workflow: workflow.press())
    solved.wait_until(lambda: solved.status.record_folder != first)
    firm = solved.record_folder
    solved.keep(N_IMAGES)
    solved.runner.ask(lambda workflow: workflow.finish())
    solved.wait_until(lambda: solved.status.record_folder == first)

    assert solved.state.phase is Phase.VERDICT
    assert solved.solution is before
    pressed = solved.status.pressed
    assert pressed is not None
    assert pressed.source.folder == firm
    assert open_record(firm).verdict == DISCARDED
    solved.accept()
    assert solved.status.result is not None
    assert solved.status.result.record == first


def test_it_can_be_left_for_the_first_swing(pressing: "Station") -> None:
    pressing.keep(1)
    firm = pressing.record_folder
    pressing.runner.ask(lambda workflow: workflow.discard())
    pressing.wait_until(lambda: pressing.status.solution is not None)

    assert pressing.record_folder != firm
    assert pressing.status.pressed is None
    found = find_unfinished(pressing.records).interrupted
    assert firm not in [each.folder for each in found]  # the first can be resumed


@pytest.mark.slow
def test_one_that_was_interrupted_is_neither_resumed_nor_accepted(
    pressing: "Station",
) -> None:
    pressing.keep(N_IMAGES)
    firm = pressing.record_folder

    assert firm not in [
        each.folder for each in find_unfinished(pressing.records).interrupted
    ]
    solution = solve_record(open_record(firm))
    with pytest.raises(AcceptanceError, match="cannot be accepted"):
        accept(pressing.archive, solution, local_now())


def test_it_needs_the_choices_of_the_first_swing(solved: "Station") -> None:
    first = solved.record_folder
    solved.runner.ask(lambda workflow: workflow.choose(solved.preparation))
    solved.runner.ask(lambda workflow: workflow.keep_choices())
    names = replace(solved.preparation.names, tip="T-11")
    chosen = replace(solved.preparation, names=names)
    solved.runner.ask(lambda workflow: workflow.choose(chosen))
    solved.runner.ask(lambda workflow: workflow.press())
    solved.see()

    assert solved.record_folder == first
    assert "repeat the press test" in solved.witness.faults[-1]
