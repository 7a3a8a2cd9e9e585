"""One swing from the first image to the tip in force, and what may come between."""

import json
import shutil
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from lightpen.cameras.protocol import CameraSettings
from lightpen.errors import FileError
from lightpen.estimation.report import calibration_record
from lightpen.estimation.verdict import Grade
from lightpen.formats.pen_files import write_pen
from lightpen.messages import Code
from lightpen.model.limits import SwingLimits
from lightpen.record.names import Names
from lightpen.record.reading import (
    HEADER,
    IMAGES,
    JOURNAL,
    open_record,
    recorded_limits,
)
from lightpen.record.results import Result
from lightpen.record.solving import Solution, record_inputs, solve_record
from lightpen.record.unfinished import (
    find_unfinished,
)
from lightpen.simulator.camera import SimulatedCamera
from lightpen.simulator.hand import Operator
from lightpen.simulator.sample_pens import SAMPLE_PENS
from lightpen.swing.preparation import (
    PenFile,
    SourceChoice,
    SourceKind,
)
from lightpen.swing.resuming import read_resumable
from lightpen.swing.state import (
    Happening,
    Pause,
    Phase,
    SwingEvent,
)
from lightpen_app.work.swing_run import SwingRun
from lightpen_app.work.workbench import Workbench

TIMEOUT = 20_000  # ms until a test gives up
N_IMAGES = 20  # of the record that is resumed
SHORT = SwingLimits(max_uncertainty=0.015, min_images=12, min_per_field=0)


class Stage:
    """The workbench, the simulated operator, and what the run tells."""

    def __init__(self, workbench: Workbench, qtbot: QtBot) -> None:
        self.workbench, self.run, self.qtbot = workbench, workbench.run, qtbot
        self.happened: list[SwingEvent] = []
        self.sentences: list[str] = []
        self.relieved: list[str] = []

        # Connections
        workbench.run.happened.connect(self.happened.append)
        workbench.troubled.connect(self._note)
        workbench.live.relieved.connect(self.relieved.append)
        workbench.run.relieved.connect(self.relieved.append)

    def open_camera(self) -> None:
        """Open a camera that sees the pen in its cone; the operator follows."""
        around = self.workbench.around
        operator = Operator(around.clock, seated=True)
        camera = SimulatedCamera(around.scene, around.clock, operator)
        self.workbench.live.open(camera, CameraSettings(), around.clock)
        self.workbench.live.set_following(True)

    def begin(self, limits: SwingLimits = SHORT) -> None:
        self.workbench.set_preparation(
            replace(self.workbench.preparation, limits=limits)
        )
        self.run.begin(self.workbench.preparation)

    def capture_more(self) -> None:
        """Go on with a swing that was solved, and wait until it does."""
        self.run.capture_more()
        self.wait_until(lambda: self.run.is_capturing)

    def wait_until(self, is_so: Callable[[], bool]) -> None:
        self.qtbot.waitUntil(is_so, timeout=TIMEOUT)

    def wait_for_kept(self, n_images: int) -> None:
        self.wait_until(lambda: n_kept(self.run) >= n_images)

    def wait_for_phase(self, phase: Phase) -> None:
        self.wait_until(
            lambda: self.run.state is not None and self.run.state.phase is phase
        )

    def wait_until_solved(self) -> None:
        """Wait until nothing is computed any more."""
        self.wait_until(lambda: not self.run.is_solving)

    def solution(self) -> Solution:
        assert self.run.solution is not None
        return self.run.solution

    def folder(self) -> Path:
        assert self.run.record_folder is not None
        return self.run.record_folder

    def n_recorded(self) -> int:
        return len(open_record(self.folder()).images)

    def tip(self) -> list[float]:
        tip: list[float] = self.solution().calibration.joint.tip_pen.tolist()
        return tip

    def in_force(self) -> Result | None:
        names = self.run.names
        return self.run.archive.in_force(names.pen, names.tip)

    def _note(self, sentence: str) -> None:
        if "computer is too slow" not in sentence:  # others may use it, too
            self.sentences.append(sentence)


def n_kept(run: SwingRun) -> int:
    return 0 if run.state is None else run.state.n_kept


def limit_uncertainty(folder: Path, limit: float) -> None:
    """Have a record ask for this U at most, mm."""
    header = json.loads((folder / HEADER).read_text("utf-8"))
    header["settings"]["max_uncertainty_mm"] = limit
    (folder / HEADER).write_text(json.dumps(header), "utf-8")


@pytest.fixture
def stage(workbench: Workbench, qtbot: QtBot) -> Iterator[Stage]:
    yield Stage(workbench, qtbot)
    workbench.shut_down()


@pytest.fixture
def interrupted(workbench: Workbench, swung: Callable[..., Path]) -> Path:
    """An interrupted swing among the records of the workbench."""
    folder = workbench.run.records_folder / "interrupted"
    shutil.copytree(swung(), folder)
    return folder


@pytest.fixture
def solved(stage: Stage, interrupted: Path) -> Stage:
    """A swing that was solved, whose tip can be accepted."""
    limit_uncertainty(interrupted, 1.0)
    stage.run.go_on(read_resumable(interrupted))
    stage.run.finish()
    stage.wait_for_phase(Phase.VERDICT)
    return stage


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


Command = Callable[[Path], dict[str, Any]]


# Capture


def test_a_swing_goes_from_the_first_image_to_the_verdict_without_a_wish(
    stage: Stage, command: Command
) -> None:
    assert (stage.run.state, stage.run.is_capturing) == (None, False)
    stage.workbench.open_camera()
    assert stage.workbench.live.operator is not None
    stage.workbench.live.operator.seat()
    stage.workbench.live.set_following(True)
    stage.begin()
    assert stage.run.is_capturing
    with stage.qtbot.waitSignal(stage.run.progressed, timeout=TIMEOUT):
        stage.wait_for_phase(Phase.SOLVING)
    stage.wait_for_phase(Phase.VERDICT)
    kept = [e.numbers for e in stage.happened if e.what is Happening.KEPT]
    others = [e.what for e in stage.happened if e.what not in BETWEEN]

    assert kept == [(number,) for number in range(1, stage.n_recorded() + 1)]
    assert others == [Happening.SEATED, Happening.CAPTURED, Happening.DONE]
    assert stage.run.verdict is not None
    assert stage.run.verdict.grade is not Grade.REPEAT
    assert not stage.run.is_capturing
    assert stage.sentences == []
    assert stage.tip() == command(stage.folder())["tip_pen_mm"]


BETWEEN = (Happening.KEPT, Happening.FIELD_FULL, Happening.SLIPPED)


def test_without_a_nominal_tip_the_swing_finds_the_seat_and_goes_to_the_verdict(
    stage: Stage, tmp_path: Path
) -> None:
    prepared = stage.workbench.preparation
    pen = prepared.pen
    assert pen is not None
    write_pen(replace(pen, nominal_tip=None), tmp_path / "pen.json")
    pen_file = PenFile.read(tmp_path / "pen.json")
    stage.workbench.set_preparation(replace(prepared, pen_file=pen_file))
    stage.open_camera()
    stage.begin()
    assert stage.run.setup is not None
    assert stage.run.setup.pen.nominal_tip is None
    stage.wait_for_phase(Phase.VERDICT)

    assert stage.happened[0].what is Happening.SEATED
    assert stage.run.verdict is not None
    assert stage.run.verdict.grade is not Grade.REPEAT
    true_tip = stage.workbench.around.scene.tip_pen
    uncertainty = stage.run.setup.limits.max_uncertainty
    assert np.abs(np.array(stage.tip()) - true_tip).max() < 2 * uncertainty


def test_two_swings_in_one_second_have_records_of_their_own(stage: Stage) -> None:
    folders = set[Path]()
    for _ in range(4):
        stage.begin()
        folders.add(stage.folder())

    assert len(folders) == 4


@pytest.mark.parametrize(
    "name",
    ["a/b\\c:d", "../..", "量具 7", "T" * 300, "针" * 300, ".", "\x00", "\udce4"],
)
def test_whatever_the_pen_and_the_tip_are_called_the_record_has_a_folder(
    stage: Stage, name: str
) -> None:
    names = Names("Hall 2", "Ann", pen=name, tip=name, cone=name)
    stage.run.begin(replace(stage.workbench.preparation, names=names))

    assert stage.folder().parent == stage.run.records_folder
    assert stage.run.names == names


def test_a_record_that_cannot_be_made_leaves_the_swing_before(stage: Stage) -> None:
    stage.begin()
    before, state = stage.folder(), stage.run.state
    stage.run.records_folder.rename(stage.run.records_folder.with_name("old"))
    stage.run.records_folder.write_text("not a folder")
    with pytest.raises(FileError, match="cannot be written"):
        stage.begin()

    assert stage.run.state is state
    assert stage.folder() == before


def test_a_swing_begun_while_the_camera_is_closed_waits_for_it(stage: Stage) -> None:
    stage.begin()
    assert stage.run.is_capturing
    stage.open_camera()
    stage.wait_for_kept(1)


def test_the_swing_is_captured_with_the_files_as_they_are_recorded(
    stage: Stage,
) -> None:
    pen_file = stage.workbench.preparation.pen_file
    assert pen_file is not None
    write_pen(SAMPLE_PENS["six"](), pen_file.path)  # behind the program's back
    stage.begin()

    assert stage.run.setup is not None
    assert stage.run.setup.pen.n_leds == 6


def test_files_that_are_gone_are_told_before_anything_begins(stage: Stage) -> None:
    pen_file = stage.workbench.preparation.pen_file
    assert pen_file is not None
    pen_file.path.unlink()
    with pytest.raises(FileError, match="does not exist"):
        stage.begin()

    assert stage.run.state is None


def test_a_paused_swing_goes_on_when_it_is_resumed(
    stage: Stage, interrupted: Path
) -> None:
    stage.open_camera()
    stage.run.go_on(read_resumable(interrupted))
    stage.wait_for_kept(N_IMAGES + 1)
    stage.run.pause()
    stage.wait_for_phase(Phase.PAUSED)
    assert stage.run.state is not None
    assert stage.run.state.pause is Pause.BY_USER
    n_images = stage.n_recorded()
    stage.run.resume()
    stage.wait_for_kept(n_images + 1)


def test_a_paused_swing_can_be_finished(stage: Stage, interrupted: Path) -> None:
    stage.open_camera()
    stage.run.go_on(read_resumable(interrupted))
    stage.run.pause()
    stage.run.finish()
    stage.wait_for_phase(Phase.VERDICT)

    assert stage.run.solution is not None


def test_a_swing_without_images_ends_with_the_sentence_why(stage: Stage) -> None:
    stage.begin()
    stage.run.finish()
    stage.wait_for_phase(Phase.VERDICT)
    state = stage.run.state
    assert state is not None

    assert state.message.code == Code.NO_TIP
    assert "holds no images. Resume the swing" in str(state.message)
    assert [e.what for e in stage.happened] == [Happening.CAPTURED, Happening.FAILED]
    assert (stage.run.solution, stage.run.verdict) == (None, None)


def test_a_disk_that_is_gone_pauses_the_swing_and_is_told(
    stage: Stage, interrupted: Path
) -> None:
    stage.open_camera()
    stage.run.go_on(read_resumable(interrupted))
    stage.wait_for_kept(N_IMAGES + 1)
    (interrupted / IMAGES).rename(interrupted / "elsewhere")
    stage.wait_for_phase(Phase.PAUSED)
    stage.wait_until(lambda: len(stage.sentences) == 1)
    assert "cannot be written" in stage.sentences[0]
    (interrupted / "elsewhere").rename(interrupted / IMAGES)
    n_images = n_kept(stage.run)
    assert stage.n_recorded() == n_images
    assert stage.relieved == []
    stage.run.resume()
    stage.wait_for_kept(n_images + 1)
    assert stage.relieved == stage.sentences


# The camera


def test_the_swing_goes_on_when_its_camera_is_opened_again(
    stage: Stage, interrupted: Path
) -> None:
    stage.open_camera()
    stage.run.go_on(read_resumable(interrupted))
    stage.wait_for_kept(N_IMAGES + 1)
    stage.open_camera()
    n_images = stage.n_recorded()
    stage.wait_for_kept(n_images + 2)
    numbers = [image.number for image in open_record(interrupted).images]

    assert numbers == list(range(1, len(numbers) + 1))
    assert stage.sentences == []


@pytest.mark.parametrize("wish", ["pause", "finish"])
def test_what_is_wished_for_between_two_cameras_is_done_with_the_second(
    stage: Stage, interrupted: Path, wish: str
) -> None:
    stage.open_camera()
    stage.run.go_on(read_resumable(interrupted))
    stage.wait_for_kept(N_IMAGES + 1)
    stage.open_camera()
    getattr(stage.run, wish)()

    if wish == "pause":
        stage.wait_until(
            lambda: (
                stage.run.state is not None and stage.run.state.pause is Pause.BY_USER
            )
        )
    else:
        stage.wait_for_phase(Phase.VERDICT)


def test_a_record_that_is_gone_by_then_is_told(stage: Stage, interrupted: Path) -> None:
    stage.open_camera()
    stage.run.go_on(read_resumable(interrupted))
    stage.wait_for_kept(N_IMAGES)
    shutil.move(interrupted, interrupted.with_name("elsewhere"))
    stage.open_camera()
    stage.wait_until(lambda: stage.run.state is None)

    assert "does not exist" in stage.sentences[-1]


def test_another_source_leaves_the_swing_to_be_resumed(
    stage: Stage, interrupted: Path
) -> None:
    stage.workbench.open_camera()
    stage.run.go_on(read_resumable(interrupted))
    source = SourceChoice(SourceKind.RECORDED, str(interrupted))
    stage.workbench.set_preparation(replace(stage.workbench.preparation, source=source))

    assert stage.run.state is None
    assert (
        find_unfinished(stage.run.records_folder).interrupted[0].folder == interrupted
    )


# An interrupted swing


def test_an_abandoned_swing_is_resumed_with_all_its_images(stage: Stage) -> None:
    stage.open_camera()
    stage.begin()
    stage.wait_for_kept(3)
    folder, names = stage.folder(), stage.run.names
    stage.run.abandon()
    assert (stage.run.state, stage.run.record_folder) == (None, None)
    stage.workbench.live.close()
    stage.workbench.live.await_closed()
    n_images = len(open_record(folder).images)
    stage.run.go_on(read_resumable(folder))

    assert n_kept(stage.run) == n_images >= 3
    assert stage.run.names == names


def test_a_resumed_swing_goes_by_its_own_files_and_limits(
    stage: Stage, interrupted: Path
) -> None:
    write_pen(SAMPLE_PENS["six"](), interrupted.parent / "other.json")
    stage.begin(replace(SHORT, max_images=77))
    stage.run.go_on(read_resumable(interrupted))
    assert stage.run.setup is not None

    assert stage.run.setup.pen.n_leds == 10
    assert stage.run.setup.limits.max_images == 300
    assert stage.run.setup.limits.min_images == N_IMAGES


def test_resuming_the_swing_that_is_under_way_changes_nothing(
    stage: Stage, interrupted: Path
) -> None:
    stage.run.go_on(read_resumable(interrupted))
    setup = stage.run.setup
    stage.run.go_on(read_resumable(interrupted))

    assert stage.run.setup is setup


def test_a_damaged_record_is_refused_and_nothing_begins(
    stage: Stage, interrupted: Path
) -> None:
    (interrupted / JOURNAL).write_bytes(b"{}\n{}\n")
    with pytest.raises(FileError, match="Line 1 of"):
        stage.run.go_on(read_resumable(interrupted))

    assert stage.run.state is None


def test_the_end_of_a_swing_before_is_not_taken_for_the_end_of_this_one(
    stage: Stage, interrupted: Path
) -> None:
    stage.open_camera()
    stage.begin()
    stage.wait_for_kept(1)
    delivered = stage.workbench.live.stats.delivered
    stage.run.finish()
    deadline = time.monotonic() + TIMEOUT / 1000
    while stage.workbench.live.stats.delivered < delivered + 5:
        assert time.monotonic() < deadline
    stage.run.go_on(read_resumable(interrupted))
    stage.wait_for_kept(N_IMAGES + 1)

    assert stage.run.is_capturing
    assert not stage.run.is_solving


# The solution


def test_the_tip_is_that_of_the_command_line_to_the_last_digit(
    solved: Stage, command: Command
) -> None:
    solution = solved.solution()
    inputs = record_inputs(solution.source)
    limits = recorded_limits(open_record(solved.folder()))
    fields = calibration_record(solution.calibration, inputs, "joint", limits)
    fields.pop("created")

    assert fields == command(solved.folder())


def test_so_it_is_after_taking_images_out_and_putting_some_back(
    solved: Stage, command: Command
) -> None:
    before = solved.tip()
    solved.run.take_out([2, 5, 9])
    solved.wait_until_solved()
    without = solved.tip()
    solved.run.put_back([5])
    solved.wait_until_solved()
    assert len({tuple(tip) for tip in (before, without, solved.tip())}) == 3
    assert solved.tip() == command(solved.folder())["tip_pen_mm"]
    assert set(open_record(solved.folder()).taken_out) == {2, 9}

    solved.run.put_back([2, 9])
    solved.wait_until_solved()
    assert solved.tip() == before == command(solved.folder())["tip_pen_mm"]


def test_images_taken_out_in_quick_succession_all_count(
    solved: Stage, command: Command
) -> None:
    for number in range(1, 8):
        solved.run.take_out([number])
    solved.run.put_back([4])
    solved.wait_until_solved()

    assert set(solved.solution().taken_out) == {1, 2, 3, 5, 6, 7}
    assert set(open_record(solved.folder()).taken_out) == {1, 2, 3, 5, 6, 7}
    assert solved.tip() == command(solved.folder())["tip_pen_mm"]
    assert solved.happened[-1].what in (Happening.DONE, Happening.FAILED)
    assert [e.what for e in solved.happened].count(solved.happened[-1].what) == 1


def test_too_few_images_left_keep_the_solution_and_the_record(solved: Stage) -> None:
    solved.run.take_out([1])
    solved.wait_until_solved()
    before, journal = solved.solution(), (solved.folder() / JOURNAL).read_bytes()
    solved.run.take_out(range(1, N_IMAGES))
    solved.wait_until_solved()

    assert solved.solution() is before
    assert (solved.folder() / JOURNAL).read_bytes() == journal
    assert "images are usable" in solved.sentences[-1]
    assert (
        "Without these images there is no tip, so they stay in."
        in (solved.sentences[-1])
    )
    assert solved.relieved == []
    solved.run.take_out([2])  # what failed is not asked for again
    solved.wait_until_solved()
    assert set(solved.solution().taken_out) == {1, 2}
    assert solved.relieved == solved.sentences


def test_what_is_wished_for_while_a_wish_fails_is_fulfilled(solved: Stage) -> None:
    solved.run.take_out(range(1, N_IMAGES))
    solved.run.put_back(range(4, N_IMAGES))
    solved.wait_until_solved()

    assert set(solved.solution().taken_out) == {1, 2, 3}
    assert solved.sentences == []


def test_a_record_that_cannot_be_written_keeps_the_solution(solved: Stage) -> None:
    before = solved.solution()
    journal = solved.folder() / JOURNAL
    journal.rename(journal.with_name("elsewhere"))
    solved.run.take_out([3])
    solved.wait_until_solved()
    journal.with_name("elsewhere").rename(journal)

    assert solved.solution() is before
    assert "does not exist" in solved.sentences[-1]
    assert "stay in" not in solved.sentences[-1]
    assert solved.relieved == []
    solved.run.take_out([3])
    solved.wait_until_solved()
    assert solved.relieved == solved.sentences


def test_solving_can_be_cancelled_and_done_again(
    stage: Stage, interrupted: Path
) -> None:
    stage.run.go_on(read_resumable(interrupted))
    stage.run.finish()
    assert stage.run.is_solving
    stage.run.cancel()
    assert not stage.run.is_solving
    assert stage.run.solution is None

    stage.run.solve()
    stage.wait_for_phase(Phase.VERDICT)
    assert stage.run.solution is not None


def test_a_cancelled_wish_leaves_solution_and_record_as_they_were(
    solved: Stage,
) -> None:
    before, journal = solved.solution(), (solved.folder() / JOURNAL).read_bytes()
    solved.run.take_out([3])
    solved.run.cancel()
    assert not solved.run.is_solving
    solved.run.take_out([7])
    solved.wait_until_solved()

    assert before.taken_out == {}
    assert set(solved.solution().taken_out) == {7}
    assert journal in (solved.folder() / JOURNAL).read_bytes()
    assert set(open_record(solved.folder()).taken_out) == {7}


def test_a_solution_asked_for_without_a_swing_is_a_mistake(stage: Stage) -> None:
    for act in (stage.run.solve, stage.run.capture_more, stage.run.set_aside):
        with pytest.raises(ValueError, match="needs a swing"):
            act()
    with pytest.raises(ValueError, match="must be solved"):
        stage.run.take_out([1])


# Accepting, or not


def test_the_tip_before_stays_in_force_until_the_new_one_is_accepted(
    solved: Stage,
) -> None:
    first = solved.run.accept()
    solved.run.take_out([1])
    solved.wait_until_solved()
    before = solved.in_force()
    assert before is not None
    assert before.accepted == first.accepted

    second = solved.run.accept()
    in_force = solved.in_force()
    assert in_force is not None
    assert in_force.accepted == second.accepted
    assert in_force.tip_pen.tolist() == solved.tip()
    assert len(list(solved.run.archive.folder.iterdir())) == 2


def test_an_accepted_swing_is_concluded_and_no_longer_offered(solved: Stage) -> None:
    assert len(find_unfinished(solved.run.records_folder).interrupted) == 1
    result = solved.run.accept()

    assert solved.run.result is result
    assert open_record(solved.folder()).verdict == result.grade
    assert result.record == solved.folder()
    assert find_unfinished(solved.run.records_folder).interrupted == ()


def test_a_tip_that_is_to_be_repeated_is_not_accepted(
    stage: Stage, interrupted: Path
) -> None:
    limit_uncertainty(interrupted, 1e-6)
    stage.run.go_on(read_resumable(interrupted))
    stage.run.finish()
    stage.wait_for_phase(Phase.VERDICT)
    assert stage.run.verdict is not None
    assert stage.run.verdict.grade is Grade.REPEAT

    with pytest.raises(ValueError, match="must not be repeat"):
        stage.run.accept()
    assert stage.in_force() is None
    assert open_record(interrupted).verdict is None


def test_no_more_is_captured_for_a_tip_in_force(solved: Stage) -> None:
    solved.run.accept()
    with pytest.raises(ValueError, match="begin another one"):
        solved.run.capture_more()


def test_a_result_that_cannot_be_stored_is_not_in_force(solved: Stage) -> None:
    solved.run.archive.folder.write_text("not a folder")
    with pytest.raises(FileError, match="cannot be made"):
        solved.run.accept()

    assert solved.run.result is None
    assert open_record(solved.folder()).verdict is None


def test_a_new_solution_has_to_be_accepted_anew(solved: Stage) -> None:
    solved.run.accept()
    solved.run.take_out([1])
    solved.wait_until_solved()

    assert solved.run.result is None


def test_more_images_can_be_captured_after_the_verdict(
    solved: Stage, command: Command
) -> None:
    solved.run.take_out([3])
    solved.wait_until_solved()
    solved.open_camera()
    solved.capture_more()
    assert solved.run.solution is None
    solved.wait_for_kept(N_IMAGES)  # one was taken out, one came
    solved.run.finish()
    solved.wait_for_phase(Phase.VERDICT)

    assert solved.n_recorded() > N_IMAGES
    assert set(solved.solution().taken_out) == {3}
    assert solved.tip() == command(solved.folder())["tip_pen_mm"]


def test_more_images_than_needed_are_not_needed_because_they_were_asked_for(
    stage: Stage,
) -> None:
    stage.open_camera()
    stage.begin()
    stage.wait_for_phase(Phase.VERDICT)
    n_kept_first = n_kept(stage.run)
    stage.capture_more()
    stage.wait_for_kept(n_kept_first + 1)
    stage.run.finish()
    stage.wait_for_phase(Phase.VERDICT)

    ended = stage.run.state
    assert stage.run.verdict is not None, ended and ended.message
    assert stage.run.verdict.reason.code != Code.TOO_FEW_IMAGES


def test_more_images_can_be_captured_while_a_wish_is_computed(solved: Stage) -> None:
    solved.run.take_out([3])
    solved.open_camera()
    solved.capture_more()
    solved.wait_for_kept(N_IMAGES + 2)

    assert open_record(solved.folder()).taken_out == {}
    assert solved.run.solution is None


def test_a_solved_swing_is_set_aside_with_its_images(solved: Stage) -> None:
    folder = solved.folder()
    solved.run.set_aside()

    assert solved.run.state is None
    assert open_record(folder).verdict == "discarded"
    assert len(open_record(folder).images) == N_IMAGES
    assert find_unfinished(solved.run.records_folder).interrupted == ()


def test_a_swing_that_is_captured_is_set_aside_for_good(
    stage: Stage, interrupted: Path
) -> None:
    stage.open_camera()
    stage.run.go_on(read_resumable(interrupted))
    stage.wait_for_kept(N_IMAGES + 2)
    stage.run.set_aside()
    stage.wait_until(lambda: open_record(interrupted).verdict == "discarded")
    stage.begin()
    stage.wait_for_kept(1)

    assert open_record(interrupted).verdict == "discarded"
    assert len(open_record(interrupted).images) >= N_IMAGES + 2


# A bug


def test_a_bug_while_the_tip_is_computed_leaves_the_swing_to_be_solved_again(
    stage: Stage, interrupted: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    caught: list[BaseException] = []
    monkeypatch.setattr("sys.excepthook", lambda _, error, __: caught.append(error))
    with monkeypatch.context() as broken:
        broken.setattr("lightpen_app.work.swing_run.solve_record", lambda *_: 1 / 0)
        stage.run.go_on(read_resumable(interrupted))
        stage.run.finish()
        stage.wait_until_solved()
        stage.wait_until(lambda: len(caught) == 1)
    assert isinstance(caught[0], ZeroDivisionError)
    assert stage.run.solution is None

    stage.run.solve()
    stage.wait_for_phase(Phase.VERDICT)


def test_a_bug_while_images_are_read_again_leaves_the_solution(
    solved: Stage, monkeypatch: pytest.MonkeyPatch
) -> None:
    caught: list[BaseException] = []
    monkeypatch.setattr("sys.excepthook", lambda _, error, __: caught.append(error))
    before = solved.solution()
    with monkeypatch.context() as broken:
        broken.setattr("lightpen_app.work.swing_run.read_for_more", lambda _: 1 / 0)
        solved.run.capture_more()
        solved.wait_until(lambda: not solved.run.is_reading and len(caught) == 1)
    assert solved.solution() is before

    solved.capture_more()
    assert n_kept(solved.run) == N_IMAGES


# The end of the program


def test_closing_while_a_solution_is_computed_leaves_the_swing_to_be_resumed(
    stage: Stage, interrupted: Path
) -> None:
    stage.run.go_on(read_resumable(interrupted))
    stage.run.finish()
    assert stage.run.is_solving
    stage.workbench.shut_down()

    assert (
        find_unfinished(stage.run.records_folder).interrupted[0].folder == interrupted
    )
    assert solve_record(open_record(interrupted)).calibration.used.all()


def test_closing_while_images_are_captured_keeps_all_of_them(
    stage: Stage, interrupted: Path
) -> None:
    stage.open_camera()
    stage.run.go_on(read_resumable(interrupted))
    stage.wait_for_kept(N_IMAGES + 2)
    stage.workbench.shut_down()
    n_images = len(open_record(interrupted).images)
    stage.qtbot.waitUntil(lambda: True)

    assert n_images >= N_IMAGES + 2
    assert len(open_record(interrupted).images) == n_images
    assert (
        find_unfinished(stage.run.records_folder).interrupted[0].folder == interrupted
    )
