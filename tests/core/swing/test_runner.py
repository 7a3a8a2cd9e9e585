"""One swing from its first image to the tip in force, and what may come between."""

import json
import os
import shutil
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from queue import SimpleQueue
from subprocess import CompletedProcess
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from lightpen.cameras.protocol import CameraSettings
from lightpen.cameras.worker import WorkerEvent
from lightpen.errors import FileError
from lightpen.estimation.report import calibration_json
from lightpen.estimation.verdict import Grade
from lightpen.formats.pen_files import write_pen
from lightpen.live.looking import Live, LiveImage
from lightpen.messages import Code
from lightpen.model.limits import SwingLimits
from lightpen.record.names import Names
from lightpen.record.reading import DISCARDED, HEADER, IMAGES, JOURNAL, open_record
from lightpen.record.solving import record_inputs, solve_record
from lightpen.record.unfinished import find_unfinished
from lightpen.record.writing import RecordWriter
from lightpen.simulator.sample_pens import SAMPLE_PENS
from lightpen.swing.preparation import (
    Lack,
    PenFile,
    Preparation,
    SourceChoice,
    SourceKind,
)
from lightpen.swing.resuming import read_resumable
from lightpen.swing.rules import stillness
from lightpen.swing.runner import SwingRunner
from lightpen.swing.state import Happening, Pause, Phase
from lightpen.swing.status import Activity

if TYPE_CHECKING:
    from tests.core.conftest import Station

TIMEOUT = 60.0  # s until a test gives up
N_IMAGES = 20  # of the record that is resumed
FRAME_RATE = 10.0  # 1/s: half of the usual one, as looking at an image takes long
BETWEEN = (Happening.KEPT, Happening.FIELD_FULL, Happening.SLIPPED)
Command = Callable[[Path], dict[str, Any]]


def limit_uncertainty(folder: Path, limit: float) -> None:
    """Have a record ask for this U at most, mm."""
    header = json.loads((folder / HEADER).read_text("utf-8"))
    header["settings"]["max_uncertainty_mm"] = limit
    (folder / HEADER).write_text(json.dumps(header), "utf-8")


def is_free(folder: Path) -> bool:
    """Return whether somebody else may write to a record: it is closed."""
    with RecordWriter.resume(open_record(folder)):
        return True


def interrupted_swings(station: "Station") -> list[Path]:
    return [each.folder for each in find_unfinished(station.records).interrupted]


class Screen:
    """Looks away."""

    def on_image(self, image: LiveImage) -> None:
        """Nothing is shown."""

    def on_camera(self, event: WorkerEvent) -> None:
        """Nothing happens to this camera."""


@pytest.fixture
def solved(station: "Station", interrupted: Path) -> "Station":
    """A swing that was solved, whose tip can be accepted."""
    limit_uncertainty(interrupted, 1.0)
    station.go_on(interrupted)
    station.solve()
    return station


@pytest.fixture
def in_force(solved: "Station") -> "Station":
    """A swing whose tip was accepted."""
    solved.runner.accept()
    solved.wait_until(lambda: solved.status.result is not None)
    return solved


@pytest.fixture
def present(station: "Station") -> "Station":
    """Somebody is at the swing, and all is chosen; no image has come yet."""
    station.runner.choose(station.preparation)
    station.runner.come()
    return station


@pytest.fixture
def command(
    lightpen: Callable[..., CompletedProcess[str]], tmp_path: Path
) -> Callable[[Path], dict[str, Any]]:
    """Return a function that runs `lightpen calibrate RECORD --json`."""

    def run(folder: Path) -> dict[str, Any]:
        file = tmp_path / "result.json"
        outcome = lightpen("calibrate", folder, "--json", file)
        assert outcome.returncode == 0, outcome.stderr
        fields: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        fields.pop("created")
        return fields

    return run


# From the first image to the accepted tip


def test_a_swing_goes_from_the_first_image_to_the_accepted_tip_without_a_key(
    present: "Station", command: Command
) -> None:
    station, witness = present, present.witness
    assert (station.status.state, station.status.is_capturing) == (None, False)
    live = Live(
        *(station.new_camera(), CameraSettings(frame_rate=FRAME_RATE)),
        *(Screen(), station.runner),
        clock=station.clock,
    )
    live.set_aim(station.preparation.aim)
    live.start()
    try:
        station.wait_for_phase(Phase.VERDICT)
        station.operator.lean(0.0, 0.0, 0.0)
        station.wait_until(lambda: Happening.CONFIRMED in witness.happenings)
    finally:
        live.stop()
    station.runner.accept()
    station.wait_until(lambda: station.status.result is not None)
    kept = [event.numbers for event in witness.events if event.what is Happening.KEPT]
    others = [what for what in witness.happenings if what not in BETWEEN]
    phases = [status.state.phase for status in witness.statuses if status.state]

    assert list(dict.fromkeys(phases)) == [
        *(Phase.WAIT, Phase.SEEN, Phase.SETTLED, Phase.COUNTDOWN, Phase.CAPTURING),
        *(Phase.SOLVING, Phase.VERDICT),
    ]
    assert kept == [(number,) for number in range(1, station.n_recorded + 1)]
    assert others == [
        *(Happening.SEATED, Happening.CAPTURED, Happening.DONE, Happening.CONFIRMED)
    ]
    assert witness.troubles == []
    assert station.status.verdict is not None
    assert station.status.verdict.grade is not Grade.REPEAT
    assert station.tip == command(station.record_folder)["tip_pen_mm"]
    result = station.in_force()
    assert result is not None
    assert result.tip_pen.tolist() == station.tip
    assert open_record(station.record_folder).verdict == result.grade


def test_without_a_nominal_tip_the_swing_finds_the_seat_and_goes_to_the_verdict(
    station: "Station",
) -> None:
    pen = station.preparation.pen
    assert pen is not None
    write_pen(replace(pen, nominal_tip=None), station.folder / "pen.json")
    pen_file = PenFile.read(station.folder / "pen.json")
    station.preparation = replace(station.preparation, pen_file=pen_file)
    station.begin()
    assert station.status.setup is not None
    assert station.status.setup.pen.nominal_tip is None
    station.see_until(lambda: not station.status.is_capturing)
    station.wait_for_phase(Phase.VERDICT)

    assert station.witness.happenings[0] is Happening.SEATED
    assert station.status.verdict is not None
    assert station.status.verdict.grade is not Grade.REPEAT
    uncertainty = station.status.setup.limits.max_uncertainty
    true_tip = station.camera.scene.tip_pen
    assert np.abs(np.array(station.tip) - true_tip).max() < 2 * uncertainty


# Beginning


def test_two_swings_in_one_second_have_records_of_their_own(station: "Station") -> None:
    folders = set[Path]()
    for _ in range(4):
        station.begin()
        folders.add(station.record_folder)

    assert len(folders) == 4
    assert all(is_free(folder) for folder in folders - {station.record_folder})


@pytest.mark.parametrize(
    "name",
    ["a/b\\c:d", "../..", "量具 7", "T" * 300, "针" * 300, ".", "\x00", "\udce4"],
)
def test_whatever_the_pen_and_the_tip_are_called_the_record_has_a_folder(
    station: "Station", name: str
) -> None:
    names = Names("Hall 2", "Ann", pen=name, tip=name, cone=name)
    station.preparation = replace(station.preparation, names=names)
    station.begin()

    assert station.record_folder.parent == station.records
    assert station.status.names == names


def test_a_record_that_cannot_be_made_leaves_the_swing_before(
    station: "Station",
) -> None:
    station.begin()
    before, state = station.record_folder, station.state
    station.records.rename(station.records.with_name("old"))
    station.records.write_text("not a folder")
    station.runner.begin(station.preparation)
    station.wait_until(lambda: len(station.witness.troubles) == 1)

    assert "cannot be written" in station.witness.troubles[0]
    assert station.state is state
    assert station.record_folder == before
    assert station.status.is_capturing


def test_the_swing_is_captured_with_the_files_as_they_are_recorded(
    station: "Station", tmp_path: Path
) -> None:
    pen_file = station.preparation.pen_file
    assert pen_file is not None
    shutil.copy(pen_file.path, tmp_path)
    pen_file = PenFile.read(tmp_path / pen_file.path.name)
    station.preparation = replace(station.preparation, pen_file=pen_file)
    write_pen(SAMPLE_PENS["six"](), pen_file.path)  # behind the program's back
    station.begin()

    assert station.status.setup is not None
    assert station.status.setup.pen.n_leds == 6


def test_files_that_are_gone_are_told_before_anything_begins(
    station: "Station", tmp_path: Path
) -> None:
    pen_file = station.preparation.pen_file
    assert pen_file is not None
    gone = replace(pen_file, path=tmp_path / "gone.csv")
    station.runner.begin(replace(station.preparation, pen_file=gone))
    station.wait_until(lambda: len(station.witness.troubles) == 1)

    assert "does not exist" in station.witness.troubles[0]
    assert station.status.state is None


def test_a_swing_waits_for_its_first_image(station: "Station") -> None:
    station.begin()
    assert station.status.is_capturing
    station.see()
    phases = [status.state.phase for status in station.witness.statuses if status.state]

    assert phases == [Phase.WAIT, Phase.SEEN]


def test_commands_without_a_swing_do_nothing(station: "Station") -> None:
    runner = station.runner
    for act in (
        *(runner.pause, runner.resume, runner.finish, runner.solve, runner.cancel),
        *(runner.capture_more, runner.accept, runner.set_aside),
    ):
        act()
    runner.take_out([1])
    runner.put_back([1])
    station.see()

    assert station.witness.told == []
    assert station.witness.troubles == []
    assert not station.records.exists()


# Capture


def test_a_paused_swing_keeps_nothing_until_it_is_resumed(
    station: "Station", interrupted: Path
) -> None:
    station.go_on(interrupted)
    station.keep(1)
    station.runner.pause()
    station.wait_for_phase(Phase.PAUSED)
    assert station.state.pause is Pause.BY_USER
    assert station.state.message.code is Code.PAUSED
    assert station.status.is_paused_by_user
    n_images = station.n_recorded
    station.see(30)
    assert station.n_recorded == n_images
    assert station.state.pause is Pause.BY_USER

    station.runner.resume()
    station.keep(1)
    assert station.n_recorded == n_images + 1


def test_a_paused_swing_can_be_finished(station: "Station", interrupted: Path) -> None:
    station.go_on(interrupted)
    station.runner.pause()
    station.solve()

    assert station.status.solution is not None


def test_nothing_is_kept_after_the_end(station: "Station", interrupted: Path) -> None:
    station.go_on(interrupted)
    station.keep(1)
    setup = station.status.setup
    station.solve()
    before = (interrupted / JOURNAL).read_bytes()
    frame = station.camera.read(1.0)
    station.runner.take(frame, station.state.sighting, setup)

    assert (interrupted / JOURNAL).read_bytes() == before


def test_an_image_of_another_swing_is_not_kept(
    station: "Station", interrupted: Path
) -> None:
    station.go_on(interrupted)
    station.see_until(lambda: station.state.phase is Phase.CAPTURING)
    state, setup = station.state, station.status.setup
    assert setup is not None
    frame = station.camera.read(1.0)
    for other in (None, replace(setup)):  # it was looked for something else
        station.runner.take(frame, state.sighting, other)
        assert station.state is state

    station.runner.take(frame, state.sighting, setup)
    assert station.state is not state


def test_a_swing_without_images_ends_with_the_sentence_why(station: "Station") -> None:
    station.begin()
    station.solve()

    assert station.state.message.code is Code.NO_TIP
    assert "holds no images. Resume the swing" in str(
        station.state.message.arguments[0]
    )
    assert station.witness.happenings == [Happening.CAPTURED, Happening.FAILED]
    assert (station.status.solution, station.status.verdict) == (None, None)
    assert not station.status.is_solving


def test_a_recording_ends_the_swing_after_a_whole_pass_without_a_new_image(
    station: "Station", interrupted: Path
) -> None:
    station.go_on(interrupted)
    station.see_until(lambda: station.state.phase is Phase.CAPTURING)
    frame, setup = station.camera.read(1.0), station.status.setup
    sighting = station.state.sighting  # the same again and again
    for _ in range(3):  # and the one that began the capture
        station.runner.take(frame, sighting, setup, n_images=5)
    assert station.state.phase is Phase.CAPTURING

    station.runner.take(frame, sighting, setup, n_images=5)
    assert station.state.phase is not Phase.CAPTURING
    assert station.witness.happenings[-1] is Happening.CAPTURED


def test_a_disk_that_is_gone_pauses_the_swing_and_costs_one_image(
    station: "Station", interrupted: Path
) -> None:
    station.go_on(interrupted)
    station.keep(1)
    (interrupted / IMAGES).rename(interrupted / "elsewhere")
    station.see_until(lambda: station.status.is_paused_by_user)
    n_kept = station.state.n_kept
    assert station.status.is_troubled
    (sentence,) = station.witness.troubles
    assert "cannot be written" in sentence

    (interrupted / "elsewhere").rename(interrupted / IMAGES)
    assert station.n_recorded == n_kept == N_IMAGES + 1
    station.runner.resume()
    station.see()
    assert not station.status.is_troubled
    assert station.witness.reliefs == []  # who knows yet
    station.keep(2)
    numbers = [image.number for image in open_record(interrupted).images]

    assert station.witness.reliefs == [sentence]
    assert numbers == list(range(1, len(numbers) + 1))
    assert len(numbers) == n_kept + 2


def test_a_pause_of_the_user_is_not_taken_for_a_trouble(
    station: "Station", interrupted: Path
) -> None:
    station.go_on(interrupted)
    station.runner.pause()
    station.see(2)

    assert station.status.is_paused_by_user
    assert not station.status.is_troubled


@pytest.mark.parametrize(
    "end", ["finish", "abandon", "begin", "set_aside", "shut_down"]
)
def test_the_record_is_closed_however_the_swing_ends(
    station: "Station", interrupted: Path, end: str
) -> None:
    station.go_on(interrupted)
    if end == "begin":
        station.begin()
    else:
        getattr(station.runner, end)()
    station.wait_until(lambda: not station.status.is_capturing or end == "begin")

    assert is_free(interrupted)
    assert len(open_record(interrupted).images) == N_IMAGES


def test_a_record_is_not_free_while_it_is_captured(
    station: "Station", interrupted: Path
) -> None:
    station.go_on(interrupted)

    with pytest.raises(FileError, match="is writing to"):
        is_free(interrupted)


def test_an_image_that_is_kept_is_on_the_disk_when_it_is_told(
    station: "Station", interrupted: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    on_disk: list[int] = []
    on_swing = station.witness.on_swing

    def look_at_disk(*told: Any) -> None:
        if any(event.what is Happening.KEPT for event in told[1]):
            on_disk.append(station.n_recorded)
        on_swing(*told)

    monkeypatch.setattr(station.witness, "on_swing", look_at_disk)
    station.go_on(interrupted)
    station.keep(2)

    assert on_disk == [N_IMAGES + 1, N_IMAGES + 2]


def test_every_status_is_told_in_order_with_its_events_by_one_thread(
    station: "Station", interrupted: Path
) -> None:
    station.go_on(interrupted)
    station.keep(2)
    station.runner.pause()
    station.runner.resume()
    station.keep(1)
    station.solve()
    n_kept = N_IMAGES

    (thread,) = station.witness.threads
    assert thread is not threading.current_thread()
    for status, events in station.witness.told:
        n_kept += sum(event.what is Happening.KEPT for event in events)
        if status.state is not None and status.state.n_kept:
            assert status.state.next_number == n_kept + 1
    assert n_kept == N_IMAGES + 3


# An interrupted swing


def test_an_abandoned_swing_is_resumed_with_all_its_images(
    station: "Station", interrupted: Path
) -> None:
    station.go_on(interrupted)
    names, setup = station.status.names, station.status.setup
    station.keep(2)
    station.runner.abandon()
    station.wait_until(lambda: station.status.state is None)
    assert station.status.record_folder is None
    assert station.status.setup is setup
    assert interrupted_swings(station) == [interrupted]
    station.go_on(interrupted)

    assert station.state.n_kept == len(open_record(interrupted).images) == N_IMAGES + 2
    assert station.status.names == names


def test_a_resumed_swing_goes_by_its_own_files_and_limits(
    station: "Station", interrupted: Path
) -> None:
    station.begin(SwingLimits(max_images=77))
    station.go_on(interrupted)
    assert station.status.setup is not None

    assert station.status.setup.limits.max_images == 300
    assert station.status.setup.limits.min_images == N_IMAGES


def test_resuming_the_swing_that_is_under_way_changes_nothing(
    station: "Station", interrupted: Path
) -> None:
    station.go_on(interrupted)
    status = station.status
    station.runner.go_on(read_resumable(interrupted))
    station.runner.take(station.camera.read(1.0), None)

    assert station.status is status
    assert station.witness.troubles == []


def test_a_swing_that_was_changed_since_it_was_read_is_refused_and_nothing_begins(
    station: "Station", interrupted: Path
) -> None:
    swing = read_resumable(interrupted)
    with RecordWriter.resume(swing.record) as writer:
        writer.take_out([1], "by somebody else")
    station.runner.go_on(swing)
    station.wait_until(lambda: len(station.witness.troubles) == 1)

    assert "has changed since it was read" in station.witness.troubles[0]
    assert station.status.state is None


def test_the_end_of_a_swing_before_is_not_taken_for_the_end_of_this_one(
    station: "Station", interrupted: Path, swung: Callable[..., Path]
) -> None:
    other = station.records / "other"
    shutil.copytree(swung(), other)
    station.go_on(other)
    station.runner.finish()  # which begins to solve
    station.go_on(interrupted)
    station.keep(1)

    assert station.status.is_capturing
    assert not station.status.is_solving
    assert station.status.solution is None
    assert station.record_folder == interrupted


# Who is at the swing


def test_a_swing_begins_with_the_first_image_when_somebody_is_there(
    present: "Station",
) -> None:
    assert present.status.state is None
    present.see()
    assert present.status.is_capturing
    assert present.status.names == present.preparation.names

    present.see()
    assert present.state.phase is Phase.SEEN


def test_no_swing_begins_while_something_lacks(station: "Station") -> None:
    prepared = station.preparation
    lacking = replace(prepared, image_size=None)
    assert lacking.lacks() == (Lack.IMAGES,)
    station.runner.come()
    station.see()
    assert station.status.state is None
    station.runner.choose(lacking)
    station.see()
    assert station.status.state is None

    station.runner.choose(prepared)
    station.see()
    assert station.status.is_capturing


def test_no_swing_begins_while_nobody_is_there(station: "Station") -> None:
    station.runner.choose(station.preparation)
    station.see()
    assert station.status.state is None
    station.runner.come()
    station.runner.leave()
    station.see()
    assert station.status.state is None
    assert not station.records.exists()


def test_a_record_that_cannot_be_made_is_told_once_and_tried_again_when_asked_for(
    present: "Station",
) -> None:
    present.records.write_text("not a folder")
    present.see(3)
    (sentence,) = present.witness.troubles
    assert "cannot be written" in sentence
    assert str(present.status.refusal) == sentence
    assert present.status.state is None

    present.records.unlink()
    present.see()
    assert present.status.state is None
    present.runner.try_again()
    present.see()

    assert present.status.is_capturing
    assert present.status.refusal is None
    assert present.witness.reliefs == [sentence]


def test_whoever_comes_again_tries_again(present: "Station") -> None:
    present.records.write_text("not a folder")
    present.see()
    present.records.unlink()
    present.runner.leave()
    present.runner.come()
    present.see()

    assert present.status.is_capturing
    assert present.status.refusal is None


def test_leaving_pauses_and_coming_back_goes_on(
    present: "Station", interrupted: Path
) -> None:
    present.go_on(interrupted)
    present.keep(1)
    present.runner.leave()
    present.wait_until(lambda: present.status.is_paused_by_user)
    n_images = present.n_recorded
    present.see(30)
    assert present.n_recorded == n_images

    present.runner.come()
    present.keep(1)


def test_a_swing_that_its_user_paused_stays_paused_when_he_comes_back(
    present: "Station",
) -> None:
    present.see()
    present.runner.pause()
    present.runner.leave()
    present.runner.come()
    present.see()
    assert present.status.is_paused_by_user

    present.runner.resume()
    present.see()
    assert not present.status.is_paused_by_user


def test_a_swing_that_is_paused_while_nobody_is_there_stays_paused(
    present: "Station",
) -> None:
    present.see()
    present.runner.leave()
    present.runner.pause()
    present.runner.come()
    present.see()

    assert present.status.is_paused_by_user


def test_a_trouble_while_nobody_is_there_is_not_over_when_somebody_comes(
    present: "Station", interrupted: Path
) -> None:
    present.go_on(interrupted)
    present.runner.leave()
    present.runner.resume()  # by somebody who is elsewhere
    (interrupted / IMAGES).rename(interrupted / "elsewhere")
    present.see_until(lambda: present.status.is_troubled)
    present.runner.come()
    present.see()

    assert present.status.is_troubled
    assert present.status.is_paused_by_user


def test_a_swing_that_begins_while_everybody_is_away_waits(
    present: "Station", interrupted: Path
) -> None:
    present.runner.leave()
    present.go_on(interrupted)
    present.wait_until(lambda: present.status.is_paused_by_user)
    present.see(2)
    assert present.status.is_paused_by_user

    present.runner.come()
    present.see()
    assert not present.status.is_paused_by_user


def test_more_that_is_captured_while_everybody_is_away_waits(
    solved: "Station",
) -> None:
    solved.runner.leave()
    solved.runner.capture_more()
    solved.wait_until(lambda: solved.status.is_paused_by_user)
    solved.runner.come()
    solved.see()

    assert solved.status.is_capturing
    assert not solved.status.is_paused_by_user


def test_a_swing_that_is_led_by_commands_waits_for_nobody(
    station: "Station", interrupted: Path
) -> None:
    station.go_on(interrupted)
    station.keep(1)

    assert not station.status.is_paused_by_user


def other_operator(prepared: Preparation) -> Preparation:
    return replace(prepared, names=replace(prepared.names, operator="Bob"))


def test_other_choices_do_not_change_a_swing_that_is_under_way(
    present: "Station",
) -> None:
    present.see()
    setup = present.status.setup
    assert not present.status.has_other_choices
    present.runner.choose(other_operator(present.preparation))
    present.see()

    assert present.status.has_other_choices
    assert present.status.setup is setup
    assert present.status.names.operator == "Ann"


def test_other_choices_are_settled_when_they_are_kept_or_taken_back(
    present: "Station",
) -> None:
    present.see()
    present.runner.choose(other_operator(present.preparation))
    present.runner.choose(present.preparation)
    present.see()
    assert not present.status.has_other_choices

    present.runner.choose(other_operator(present.preparation))
    present.runner.keep_choices()
    present.see()
    assert not present.status.has_other_choices
    assert present.status.names.operator == "Ann"


def test_other_choices_are_not_settled_by_capturing_more(
    solved: "Station", interrupted: Path
) -> None:
    solved.runner.choose(solved.preparation)
    solved.runner.abandon()
    solved.go_on(interrupted)
    solved.runner.choose(other_operator(solved.preparation))
    solved.solve()
    assert not solved.status.has_other_choices  # nothing more is captured with it
    solved.runner.capture_more()
    solved.wait_until(lambda: solved.status.is_capturing)

    assert solved.status.has_other_choices


def test_a_swing_that_starts_over_begins_with_what_is_chosen_now(
    present: "Station",
) -> None:
    present.see()
    before = present.record_folder
    present.runner.choose(other_operator(present.preparation))
    present.runner.start_over()
    present.see()

    assert present.record_folder != before
    assert present.status.names.operator == "Bob"
    assert not present.status.has_other_choices


def test_starting_over_keeps_the_images_of_the_old_swing(
    present: "Station", interrupted: Path
) -> None:
    present.go_on(interrupted)
    present.runner.start_over()
    present.see()

    assert present.status.is_capturing
    assert present.record_folder != interrupted
    assert open_record(interrupted).verdict == DISCARDED
    assert len(open_record(interrupted).images) == N_IMAGES
    assert interrupted_swings(present) == []


def test_a_swing_that_cannot_be_set_aside_goes_on_instead_of_starting_over(
    solved: "Station",
) -> None:
    journal = solved.record_folder / JOURNAL
    journal.rename(journal.with_name("elsewhere"))
    status = solved.status
    for act in (solved.runner.start_over, solved.runner.set_aside):
        act()
        solved.see()
        assert solved.status.record_folder == status.record_folder
        assert solved.status.solution is status.solution
    assert len(solved.witness.troubles) == 2


def test_starting_over_a_swing_whose_tip_is_in_force_leaves_its_verdict(
    in_force: "Station",
) -> None:
    folder, grade = in_force.record_folder, in_force.status.result
    assert grade is not None
    journal = (folder / JOURNAL).read_bytes()
    in_force.runner.start_over()
    in_force.wait_until(lambda: in_force.status.state is None)

    assert (folder / JOURNAL).read_bytes() == journal
    assert open_record(folder).verdict == grade.grade


def test_an_accepted_swing_is_left_and_the_next_begins_when_somebody_comes_again(
    in_force: "Station",
) -> None:
    folder = in_force.record_folder
    journal = (folder / JOURNAL).read_bytes()
    in_force.runner.choose(in_force.preparation)
    in_force.runner.leave()
    in_force.see()
    assert in_force.record_folder == folder
    in_force.runner.come()
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
    present.runner.choose(replace(present.preparation, source=source, image_size=None))
    present.see()

    assert present.status.state is None
    assert interrupted_swings(present) == [interrupted]


def test_another_source_leaves_a_swing_that_is_solved_to_be_accepted(
    solved: "Station",
) -> None:
    solved.runner.choose(solved.preparation)
    source = SourceChoice(SourceKind.RECORDED, str(solved.folder))
    solved.runner.choose(replace(solved.preparation, source=source))
    solved.see()

    assert solved.status.solution is not None


# The solution


def test_the_tip_is_that_of_the_command_line_to_the_last_digit(
    solved: "Station", command: Command
) -> None:
    solution = solved.solution
    inputs = record_inputs(solution.source)
    fields = json.loads(calibration_json(solution.calibration, inputs, "joint"))
    fields.pop("created")

    assert fields == command(solved.record_folder)


def test_so_it_is_after_taking_images_out_and_putting_some_back(
    solved: "Station", command: Command
) -> None:
    before = solved.tip
    solved.runner.take_out([2, 5, 9])
    solved.wait_until_solved()
    without = solved.tip
    solved.runner.put_back([5])
    solved.wait_until_solved()
    assert len({tuple(tip) for tip in (before, without, solved.tip)}) == 3
    assert solved.tip == command(solved.record_folder)["tip_pen_mm"]
    assert set(open_record(solved.record_folder).taken_out) == {2, 9}

    solved.runner.put_back([2, 9])
    solved.wait_until_solved()
    assert solved.tip == before == command(solved.record_folder)["tip_pen_mm"]


def test_how_far_the_tip_is_computed_is_told_from_0_to_1(solved: "Station") -> None:
    fractions = solved.witness.fractions

    assert fractions == sorted(fractions)
    assert len(fractions) >= N_IMAGES
    assert (fractions[0] < 0.1, fractions[-1]) == (True, 1.0)


def test_images_taken_out_in_quick_succession_all_count(
    solved: "Station", command: Command
) -> None:
    for number in range(1, 8):
        solved.runner.take_out([number])
    solved.runner.put_back([4])
    solved.wait_until_solved()

    assert set(solved.solution.taken_out) == {1, 2, 3, 5, 6, 7}
    assert set(open_record(solved.record_folder).taken_out) == {1, 2, 3, 5, 6, 7}
    assert solved.tip == command(solved.record_folder)["tip_pen_mm"]
    happenings = solved.witness.happenings
    assert happenings[-1] in (Happening.DONE, Happening.FAILED)
    assert happenings.count(happenings[-1]) == 1  # the verdict is told once


def test_too_few_images_left_keep_the_solution_and_the_record(
    solved: "Station",
) -> None:
    solved.runner.take_out([1])
    solved.wait_until_solved()
    before, journal = solved.solution, (solved.record_folder / JOURNAL).read_bytes()
    solved.runner.take_out(range(1, N_IMAGES))
    solved.wait_until_solved()

    assert solved.solution is before
    assert (solved.record_folder / JOURNAL).read_bytes() == journal
    (sentence,) = solved.witness.troubles
    assert "images are usable" in sentence
    assert "Without these images there is no tip, so they stay in." in sentence
    assert solved.witness.reliefs == []
    solved.runner.take_out([2])  # what failed is not asked for again
    solved.wait_until_solved()
    assert set(solved.solution.taken_out) == {1, 2}
    assert solved.witness.reliefs == solved.witness.troubles


def test_what_is_wished_for_while_a_wish_fails_is_fulfilled(solved: "Station") -> None:
    solved.runner.take_out(range(1, N_IMAGES))
    solved.runner.put_back(range(4, N_IMAGES))
    solved.wait_until_solved()

    assert set(solved.solution.taken_out) == {1, 2, 3}
    assert solved.witness.troubles == []


def test_a_record_that_cannot_be_written_keeps_the_solution(solved: "Station") -> None:
    before = solved.solution
    journal = solved.record_folder / JOURNAL
    journal.rename(journal.with_name("elsewhere"))
    solved.runner.take_out([3])
    solved.wait_until_solved()
    journal.with_name("elsewhere").rename(journal)

    assert solved.solution is before
    (sentence,) = solved.witness.troubles
    assert "does not exist" in sentence
    assert "stay in" not in sentence
    assert solved.witness.reliefs == []
    solved.runner.take_out([3])
    solved.wait_until_solved()
    assert solved.witness.reliefs == [sentence]


def test_solving_can_be_cancelled_and_done_again(
    station: "Station", interrupted: Path
) -> None:
    station.go_on(interrupted)
    station.runner.finish()
    station.runner.cancel()
    station.see()
    assert Activity.SOLVING in [s.activity for s in station.witness.statuses]
    assert not station.status.is_solving
    assert station.state.phase is Phase.SOLVING
    assert station.status.solution is None

    station.runner.solve()
    station.wait_for_phase(Phase.VERDICT)
    assert station.status.solution is not None


def test_a_cancelled_wish_leaves_solution_and_record_as_they_were(
    solved: "Station",
) -> None:
    before, journal = solved.solution, (solved.record_folder / JOURNAL).read_bytes()
    solved.runner.take_out([3])
    solved.runner.cancel()
    solved.see()
    assert not solved.status.is_solving
    solved.runner.take_out([7])
    solved.wait_until_solved()

    assert before.taken_out == {}
    assert set(solved.solution.taken_out) == {7}
    assert journal in (solved.record_folder / JOURNAL).read_bytes()
    assert set(open_record(solved.record_folder).taken_out) == {7}


# After the verdict


def test_holding_the_pen_upright_and_still_after_the_verdict_is_told_once(
    solved: "Station",
) -> None:
    solved.operator.lean(0.4, 0.0, 0.0)
    solved.see(35)
    assert Happening.CONFIRMED not in solved.witness.happenings

    solved.operator.lean(0.0, 0.0, 0.0)
    solved.see_until(lambda: Happening.CONFIRMED in solved.witness.happenings)
    assert stillness(solved.state) == 1.0
    solved.see(10)
    assert solved.witness.happenings.count(Happening.CONFIRMED) == 1
    assert solved.state.phase is Phase.VERDICT


def test_more_images_can_be_captured_after_the_verdict(
    solved: "Station", command: Command
) -> None:
    solved.runner.take_out([3])
    solved.wait_until_solved()
    solved.runner.capture_more()
    solved.wait_until(lambda: solved.status.is_capturing)
    assert solved.status.solution is None
    assert not solved.status.is_reading
    assert solved.state.n_kept == N_IMAGES - 1
    solved.keep(1)
    solved.solve()

    assert solved.n_recorded == N_IMAGES + 1
    assert set(solved.solution.taken_out) == {3}
    assert solved.tip == command(solved.record_folder)["tip_pen_mm"]


def test_more_images_than_needed_are_not_needed_because_they_were_asked_for(
    solved: "Station",
) -> None:
    solved.runner.capture_more()
    solved.wait_until(lambda: solved.status.is_capturing)
    assert solved.status.setup is not None
    assert solved.status.setup.limits.min_images > N_IMAGES + 1
    solved.keep(1)
    solved.solve()

    assert solved.status.verdict is not None
    assert solved.status.verdict.reason.code is not Code.TOO_FEW_IMAGES


def test_more_images_can_be_captured_while_a_wish_is_computed(
    solved: "Station",
) -> None:
    solved.runner.take_out([3])
    solved.runner.capture_more()
    solved.wait_until(lambda: solved.status.is_capturing)
    solved.keep(1)

    assert open_record(solved.record_folder).taken_out == {}
    assert solved.status.solution is None


def test_images_that_cannot_be_read_again_leave_the_solution_and_no_wish(
    solved: "Station",
) -> None:
    before = solved.solution
    journal = solved.record_folder / JOURNAL
    journal.rename(journal.with_name("elsewhere"))
    solved.runner.take_out([3])
    solved.runner.capture_more()
    solved.runner.take_out([4])  # while they are read nothing is taken out
    solved.wait_until(lambda: len(solved.witness.troubles) == 1)
    solved.wait_until(lambda: solved.status.activity is Activity.NONE)
    journal.with_name("elsewhere").rename(journal)
    assert solved.solution is before
    assert not solved.status.is_capturing

    solved.runner.take_out([7])
    solved.wait_until_solved()
    assert set(solved.solution.taken_out) == {7}


def test_a_solved_swing_is_set_aside_with_its_images(solved: "Station") -> None:
    folder = solved.record_folder
    solved.runner.set_aside()
    solved.wait_until(lambda: solved.status.state is None)

    assert open_record(folder).verdict == DISCARDED
    assert len(open_record(folder).images) == N_IMAGES
    assert interrupted_swings(solved) == []


def test_a_swing_that_is_captured_is_set_aside_for_good(
    station: "Station", interrupted: Path
) -> None:
    station.go_on(interrupted)
    station.keep(1)
    station.runner.set_aside()
    station.wait_until(lambda: station.status.state is None)
    assert open_record(interrupted).verdict == DISCARDED
    station.begin()
    station.see()

    assert open_record(interrupted).verdict == DISCARDED
    assert len(open_record(interrupted).images) == N_IMAGES + 1


# Accepting, or not


def test_the_tip_before_stays_in_force_until_the_new_one_is_accepted(
    in_force: "Station", swung: Callable[..., Path]
) -> None:
    first = in_force.status.result
    assert first is not None
    other = in_force.records / "other"
    shutil.copytree(swung(), other)
    limit_uncertainty(other, 1.0)
    in_force.go_on(other)
    in_force.solve()
    assert in_force.status.result is None
    before = in_force.in_force()
    assert before is not None
    assert before.accepted == first.accepted

    in_force.runner.accept()
    in_force.wait_until(lambda: in_force.status.result is not None)
    after, second = in_force.in_force(), in_force.status.result
    assert after is not None
    assert second is not None
    assert after.accepted == second.accepted > first.accepted
    assert after.tip_pen.tolist() == in_force.tip


def test_an_accepted_swing_is_concluded_and_no_longer_offered(
    solved: "Station",
) -> None:
    assert interrupted_swings(solved) == [solved.record_folder]
    solved.runner.accept()
    solved.wait_until(lambda: solved.status.result is not None)
    result = solved.status.result
    assert result is not None

    assert open_record(solved.record_folder).verdict == result.grade
    assert Path(result.record) == solved.record_folder
    assert result.names == solved.status.names
    assert interrupted_swings(solved) == []


def test_a_tip_that_is_accepted_twice_is_stored_once(solved: "Station") -> None:
    solved.runner.accept()
    solved.runner.accept()
    solved.see()

    assert solved.status.result is not None
    assert len(list(solved.results.iterdir())) == 1


def test_a_tip_is_not_accepted_while_another_is_computed(solved: "Station") -> None:
    solved.runner.take_out([3])
    solved.runner.accept()
    solved.wait_until_solved()

    assert solved.status.result is None
    assert solved.in_force() is None


def test_a_tip_that_is_to_be_repeated_is_not_accepted(
    station: "Station", interrupted: Path
) -> None:
    limit_uncertainty(interrupted, 1e-6)
    station.go_on(interrupted)
    station.solve()
    assert station.status.verdict is not None
    assert station.status.verdict.grade is Grade.REPEAT
    assert station.witness.happenings[-1] is Happening.FAILED

    station.runner.accept()
    station.see()
    assert station.status.result is None
    assert station.in_force() is None
    assert open_record(interrupted).verdict is None


def test_the_swing_of_a_tip_in_force_stays_as_it_is(in_force: "Station") -> None:
    solution, result = in_force.solution, in_force.status.result
    journal = (in_force.record_folder / JOURNAL).read_bytes()
    runner = in_force.runner
    runner.take_out([1])
    for act in (runner.solve, runner.capture_more, runner.set_aside, runner.accept):
        act()
    in_force.see()

    assert in_force.status.activity is Activity.NONE
    assert in_force.solution is solution
    assert in_force.status.result is result
    assert (in_force.record_folder / JOURNAL).read_bytes() == journal
    assert len(list(in_force.results.iterdir())) == 1


def test_a_result_that_cannot_be_stored_is_not_in_force(solved: "Station") -> None:
    solved.results.write_text("not a folder")
    solved.runner.accept()
    solved.wait_until(lambda: len(solved.witness.troubles) == 1)
    assert solved.status.result is None
    assert solved.status.activity is Activity.NONE
    assert open_record(solved.record_folder).verdict is None

    solved.results.unlink()
    solved.runner.accept()
    solved.wait_until(lambda: solved.status.result is not None)
    solved.see()
    assert solved.witness.reliefs == solved.witness.troubles


def test_a_result_bears_the_time_that_the_runner_goes_by(
    station: "Station", interrupted: Path
) -> None:
    noon = datetime(2026, 5, 1, 12, tzinfo=UTC)
    runner = SwingRunner(
        station.records, station.results, station.witness, now=lambda: noon
    )
    limit_uncertainty(interrupted, 1.0)
    runner.go_on(read_resumable(interrupted))
    runner.finish()
    station.witness.wait_until(lambda: runner.status.verdict is not None)
    runner.accept()
    runner.shut_down()
    assert runner.await_end(TIMEOUT)
    result = station.in_force()

    assert result is not None
    assert result.accepted == noon


# A bug


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


def test_a_bug_while_an_image_is_taken_pauses_the_swing_and_costs_nothing_else(
    station: "Station",
    interrupted: Path,
    crashes: Crashes,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    station.go_on(interrupted)
    station.keep(1)
    with monkeypatch.context() as broken:
        broken.setattr("lightpen.swing.capture.advance", fail)
        station.see(5)
    station.wait_until(lambda: len(station.witness.troubles) == 1)

    assert is_reported_once(crashes)  # not with every image
    assert "made a mistake of its own" in station.witness.troubles[0]
    assert station.status.is_paused_by_user
    assert not station.status.is_troubled
    assert station.n_recorded == station.state.n_kept == N_IMAGES + 1
    station.runner.resume()
    station.keep(1)
    assert station.witness.reliefs == station.witness.troubles
    station.solve()
    assert station.solution.numbers.tolist() == list(range(1, N_IMAGES + 3))


def test_a_bug_when_a_swing_begins_is_told_once_and_tried_again_when_asked_for(
    present: "Station", crashes: Crashes, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as broken:
        broken.setattr("lightpen.swing.course.read_resumable", fail)
        present.see(5)
        present.wait_until(lambda: len(present.witness.troubles) == 1)
    assert is_reported_once(crashes)
    assert len(list(present.records.iterdir())) == 1
    assert present.status.state is None

    present.runner.try_again()
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
        broken.setattr("lightpen.swing.course.finish", fail)
        station.runner.finish()
        station.wait_until(lambda: len(station.witness.troubles) == 1)
    assert is_reported_once(crashes)
    assert station.status.is_paused_by_user

    station.runner.resume()
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
        broken.setattr("lightpen.swing.course.recorded_limits", fail)
        station.runner.go_on(read_resumable(other))
        station.wait_until(lambda: len(station.witness.troubles) == 1)
    station.runner.resume()
    station.keep(1)

    assert is_reported_once(crashes)
    assert station.record_folder == interrupted
    assert station.n_recorded == N_IMAGES + 1
    assert len(open_record(other).images) == N_IMAGES
    assert is_free(other)


def test_a_bug_while_the_tip_is_computed_leaves_the_swing_to_be_solved_again(
    station: "Station",
    interrupted: Path,
    crashes: Crashes,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    station.go_on(interrupted)
    with monkeypatch.context() as broken:
        broken.setattr("lightpen.swing.course.solve_record", fail)
        station.runner.finish()
        station.wait_for_phase(Phase.SOLVING)
        station.wait_until(lambda: not station.status.is_solving)
    assert is_reported_once(crashes)
    assert station.status.solution is None

    station.runner.solve()
    station.wait_for_phase(Phase.VERDICT)
    assert station.status.solution is not None


def test_a_bug_when_the_tip_is_judged_leaves_the_swing_to_be_solved_again(
    station: "Station",
    interrupted: Path,
    crashes: Crashes,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    station.go_on(interrupted)
    with monkeypatch.context() as broken:
        broken.setattr("lightpen.swing.course.judge", fail)
        station.runner.finish()
        station.wait_until(lambda: len(station.witness.troubles) == 1)
    assert is_reported_once(crashes)
    assert not station.status.is_solving
    assert station.status.solution is None

    station.runner.solve()
    station.wait_for_phase(Phase.VERDICT)


def test_a_bug_while_images_are_read_again_leaves_the_solution(
    solved: "Station", crashes: Crashes, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = solved.solution
    with monkeypatch.context() as broken:
        broken.setattr("lightpen.swing.course.read_for_more", fail)
        solved.runner.capture_more()
        assert is_reported_once(crashes)
        solved.wait_until(lambda: not solved.status.is_reading)
    assert solved.solution is before

    solved.runner.capture_more()
    solved.wait_until(lambda: solved.status.is_capturing)
    assert solved.state.n_kept == N_IMAGES


def test_a_bug_while_a_result_is_stored_leaves_the_tip_to_be_accepted(
    solved: "Station", crashes: Crashes, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as broken:
        broken.setattr("lightpen.swing.course.accept", fail)
        solved.runner.accept()
        solved.wait_until(lambda: len(solved.witness.troubles) == 1)
    assert is_reported_once(crashes)
    assert solved.status.activity is Activity.NONE
    assert solved.status.result is None

    solved.runner.accept()
    solved.wait_until(lambda: solved.status.result is not None)


def test_a_bug_in_a_command_lets_what_is_computed_go_on(
    station: "Station",
    interrupted: Path,
    crashes: Crashes,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    station.go_on(interrupted)
    with monkeypatch.context() as broken:
        broken.setattr("lightpen.swing.attendance.replace", fail)
        station.runner.finish()
        station.runner.come()
        station.wait_until(lambda: len(station.witness.troubles) == 1)
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
    for _ in range(2):  # with the image, and when that was to be told
        assert crashes.get(timeout=TIMEOUT) is MistakeError
    assert crashes.empty()

    station.runner.resume()
    station.keep(1)
    assert station.n_recorded == N_IMAGES + 1


# The end


def test_what_was_commanded_before_the_end_is_done(
    station: "Station", interrupted: Path
) -> None:
    station.go_on(interrupted)
    station.runner.set_aside()
    station.runner.shut_down()
    assert station.runner.await_end(TIMEOUT)

    assert open_record(interrupted).verdict == DISCARDED
    assert station.status.state is None


def test_an_end_while_images_are_captured_keeps_all_of_them(
    station: "Station", interrupted: Path
) -> None:
    station.go_on(interrupted)
    station.keep(2)
    setup, sighting = station.status.setup, station.state.sighting
    station.runner.shut_down()
    assert station.runner.await_end(TIMEOUT)
    station.runner.take(station.camera.read(1.0), sighting, setup)  # comes too late

    assert len(open_record(interrupted).images) == N_IMAGES + 2
    assert interrupted_swings(station) == [interrupted]
    assert is_free(interrupted)


def test_an_end_while_a_solution_is_computed_leaves_the_swing_to_be_resumed(
    station: "Station", interrupted: Path
) -> None:
    station.go_on(interrupted)
    station.runner.finish()
    station.runner.shut_down()
    assert station.runner.await_end(TIMEOUT)

    assert Phase.VERDICT not in {
        status.state.phase for status in station.witness.statuses if status.state
    }
    assert interrupted_swings(station) == [interrupted]
    assert solve_record(open_record(interrupted)).calibration.used.all()


@pytest.fixture
def stuck(
    station: "Station", interrupted: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[threading.Event]:
    """A disk that answers no more once the event is set, until the test ends."""
    sticks, gives_way = threading.Event(), threading.Event()
    fsync = os.fsync

    def wait_for_disk(descriptor: int) -> None:
        if sticks.is_set():
            gives_way.wait()
        fsync(descriptor)

    monkeypatch.setattr("os.fsync", wait_for_disk)
    station.go_on(interrupted)
    yield sticks
    gives_way.set()


def test_nobody_waits_longer_than_he_says_for_a_disk_that_does_not_answer(
    station: "Station", stuck: threading.Event
) -> None:
    stuck.set()
    station.runner.set_aside()
    station.runner.shut_down()

    assert not station.runner.await_end(0.05)


def test_an_image_waits_for_a_disk_that_does_not_answer_but_no_command_does(
    station: "Station", stuck: threading.Event
) -> None:
    stuck.set()
    station.runner.set_aside()
    looking = threading.Thread(target=station.see, daemon=True)
    looking.start()
    station.runner.pause()
    looking.join(0.2)

    assert looking.is_alive()


def test_an_image_that_comes_after_the_end_is_not_waited_for(
    station: "Station", interrupted: Path
) -> None:
    station.go_on(interrupted)
    station.runner.shut_down()
    assert station.runner.await_end(TIMEOUT)
    n_told = len(station.witness.told)
    station.see(2)
    station.runner.begin(station.preparation)
    station.see()

    assert len(station.witness.told) == n_told
    assert station.status.state is None
