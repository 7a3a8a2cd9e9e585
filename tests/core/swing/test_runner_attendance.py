"""A swing begins, waits and goes on as its user comes and goes."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from lightpen.record.swings.reading import DISCARDED, IMAGES, JOURNAL, open_record
from lightpen.swing.capture.state import Phase
from lightpen.swing.preparation import Preparation, SourceChoice, SourceKind
from lightpen.swing.workflow import SwingWorkflow

if TYPE_CHECKING:
    from tests.core.conftest import Station

N_IMAGES = 20  # of the record that is resumed


def test_a_swing_begins_with_the_first_image_when_somebody_is_there(
    present: "Station",
) -> None:
    assert present.status.state is None
    present.see()
    assert present.status.is_capturing
    assert present.status.names == present.preparation.names

    present.see()
    assert present.state.phase is Phase.SEEN


def test_a_record_that_cannot_be_made_is_reported_once_and_tried_again_when_asked_for(
    present: "Station",
) -> None:
    present.records.write_text("not a folder")
    present.see(3)
    (sentence,) = present.witness.faults
    assert "cannot be written" in sentence
    assert str(present.status.refusal) == sentence
    assert present.status.state is None

    present.records.unlink()
    present.see()
    assert present.status.state is None
    present.runner.ask(lambda workflow: workflow.try_again())
    present.see()

    assert present.status.is_capturing
    assert present.status.refusal is None
    assert present.witness.reliefs == [sentence]


def test_a_fault_while_nobody_is_there_is_not_over_when_somebody_comes(
    present: "Station", interrupted: Path
) -> None:
    present.go_on(interrupted)
    present.runner.ask(lambda workflow: workflow.note_departure())
    # The operator is not at the step Swing.
    present.runner.ask(lambda workflow: workflow.resume())
    (interrupted / IMAGES).rename(interrupted / "elsewhere")
    present.see_until(lambda: present.status.has_fault)
    present.runner.ask(lambda workflow: workflow.note_arrival())
    present.see()

    assert present.status.has_fault
    assert present.status.is_paused_by_user


def test_a_swing_that_begins_while_everybody_is_away_waits(
    present: "Station", interrupted: Path
) -> None:
    present.runner.ask(lambda workflow: workflow.note_departure())
    present.go_on(interrupted)
    present.wait_until(lambda: present.status.is_paused_by_user)
    present.see(2)
    assert present.status.is_paused_by_user

    present.runner.ask(lambda workflow: workflow.note_arrival())
    present.see()
    assert not present.status.is_paused_by_user


def other_operator(prepared: Preparation) -> Preparation:
    return replace(prepared, names=replace(prepared.names, operator="Bob"))


def test_other_choices_do_not_change_a_swing_that_is_under_way(
    present: "Station",
) -> None:
    present.see()
    setup = present.status.setup
    assert not present.status.has_other_choices
    chosen = other_operator(present.preparation)
    present.runner.ask(lambda workflow: workflow.choose(chosen))
    present.see()

    assert present.status.has_other_choices
    assert present.status.setup is setup
    assert present.status.names.operator == "Ann"


def test_a_swing_that_starts_over_begins_with_what_is_chosen_now(
    present: "Station",
) -> None:
    present.see()
    before = present.record_folder
    chosen = other_operator(present.preparation)
    present.runner.ask(lambda workflow: workflow.choose(chosen))
    present.runner.ask(lambda workflow: workflow.start_over())
    present.see()

    assert present.record_folder != before
    assert present.status.names.operator == "Bob"
    assert not present.status.has_other_choices


def test_starting_over_keeps_the_images_of_the_old_swing(
    present: "Station", interrupted: Path
) -> None:
    present.go_on(interrupted)
    present.runner.ask(lambda workflow: workflow.start_over())
    present.see()

    assert present.status.is_capturing
    assert present.record_folder != interrupted
    assert open_record(interrupted).verdict == DISCARDED
    assert len(open_record(interrupted).images) == N_IMAGES
    assert present.interrupted() == []


def test_a_swing_that_cannot_be_set_aside_goes_on_instead_of_starting_over(
    solved: "Station",
) -> None:
    journal = solved.record_folder / JOURNAL
    journal.rename(journal.with_name("elsewhere"))
    status = solved.status
    for act in (SwingWorkflow.start_over, SwingWorkflow.discard):
        solved.runner.ask(act)
        solved.see()
        assert solved.status.record_folder == status.record_folder
        assert solved.status.solution is status.solution
    assert len(solved.witness.faults) == 2


def test_starting_over_a_swing_whose_tip_is_in_force_leaves_its_verdict(
    in_force: "Station",
) -> None:
    folder, grade = in_force.record_folder, in_force.status.result
    assert grade is not None
    journal = (folder / JOURNAL).read_bytes()
    in_force.runner.ask(lambda workflow: workflow.start_over())
    in_force.wait_until(lambda: in_force.status.state is None)

    assert (folder / JOURNAL).read_bytes() == journal
    assert open_record(folder).verdict == grade.grade


def test_an_accepted_swing_is_left_and_the_next_begins_when_somebody_comes_again(
    in_force: "Station",
) -> None:
    folder = in_force.record_folder
    journal = (folder / JOURNAL).read_bytes()
    in_force.runner.ask(lambda workflow: workflow.choose(in_force.preparation))
    in_force.runner.ask(lambda workflow: workflow.note_departure())
    in_force.see()
    assert in_force.record_folder == folder
    in_force.runner.ask(lambda workflow: workflow.note_arrival())
    in_force.see()

    assert in_force.status.is_capturing
    assert in_force.status.result is None
    assert in_force.record_folder != folder
    assert (folder / JOURNAL).read_bytes() == journal


def test_another_source_leaves_the_swing_to_be_resumed(
    present: "Station", interrupted: Path
) -> None:
    present.go_on(interrupted)
    source = SourceChoice(SourceKind.RECORDED, str(interrupted))
    chosen = replace(present.preparation, source=source, image_size=None)
    present.runner.ask(lambda workflow: workflow.choose(chosen))
    present.see()

    assert present.status.state is None
    assert present.interrupted() == [interrupted]


def test_another_source_leaves_a_swing_that_is_solved_to_be_accepted(
    solved: "Station",
) -> None:
    solved.runner.ask(lambda workflow: workflow.choose(solved.preparation))
    source = SourceChoice(SourceKind.RECORDED, str(solved.folder))
    chosen = replace(solved.preparation, source=source)
    solved.runner.ask(lambda workflow: workflow.choose(chosen))
    solved.see()

    assert solved.status.solution is not None


def test_after_the_verdict_other_choices_are_asked_about_until_the_tip_is_accepted(
    solved: "Station",
) -> None:
    solved.runner.ask(lambda workflow: workflow.choose(solved.preparation))
    solved.runner.ask(lambda workflow: workflow.keep_choices())
    solved.see()
    assert not solved.status.has_other_choices
    chosen = other_operator(solved.preparation)
    solved.runner.ask(lambda workflow: workflow.choose(chosen))
    solved.see()
    assert solved.status.has_other_choices

    solved.accept()
    assert not solved.status.has_other_choices


def test_a_swing_that_lacks_nothing_is_computed_when_it_is_gone_on_with(
    present: "Station", interrupted: Path, rewrite_header: Callable[..., None]
) -> None:
    enough = {"min_images": N_IMAGES, "min_per_field": 0, "max_uncertainty": 1.0}
    rewrite_header(interrupted, limits=enough)
    present.go_on(interrupted)

    present.wait_for_phase(Phase.VERDICT)
    assert present.status.solution is not None
    assert present.n_recorded == N_IMAGES
