"""One swing from its first image to the tip in force, and how it is captured."""

import os
import shutil
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from tests.simulated_pens import SAMPLE_PENS

from lightpen.cameras.protocol import CameraSettings, WorkerEvent
from lightpen.estimation.reports.verdict import Grade
from lightpen.formats.opened_files import PenFile
from lightpen.formats.pen_files import write_pen
from lightpen.live.pipeline import Live, LiveImage
from lightpen.messages import Code
from lightpen.model.limits import SwingLimits
from lightpen.record.swings.reading import IMAGES, JOURNAL, open_record
from lightpen.record.swings.solving import solve_record
from lightpen.record.swings.writing import RecordWriter
from lightpen.swing.capture.state import Phase, SwingEventKind
from lightpen.swing.swing_recorder import read_resumable
from lightpen.swing.workflow import SwingWorkflow

if TYPE_CHECKING:
    from tests.core.conftest import Station

TIMEOUT = 60.0  # s until a test gives up
N_IMAGES = 20  # of the record that is resumed
FRAME_RATE = 6.0  # 1/s: a third of the usual one, as looking at an image takes long
BETWEEN = (SwingEventKind.KEPT, SwingEventKind.FIELD_FULL, SwingEventKind.SLIPPED)
Command = Callable[[Path], dict[str, Any]]


class Screen:
    """Looks away."""

    def on_image(self, image: LiveImage) -> None:
        """Nothing is shown."""

    def on_camera(self, event: WorkerEvent, camera: int) -> None:
        """Nothing happens to this camera."""


# From the first image to the accepted tip


@pytest.mark.slow
def test_a_swing_goes_from_the_first_image_to_the_accepted_tip_without_a_key(
    present: "Station", command: Command
) -> None:
    station, witness = present, present.witness
    assert (station.status.state, station.status.is_capturing) == (None, False)
    live = Live(
        *([station.new_camera()], CameraSettings(frame_rate=FRAME_RATE)),
        *(Screen(), station.runner),
        clock=station.clock,
    )
    live.set_region(station.preparation.region)
    live.start()
    try:
        station.wait_for_phase(Phase.VERDICT)
        station.operator.lean_towards(0.0, 0.0, 0.0)
        station.wait_until(lambda: SwingEventKind.CONFIRMED in witness.event_kinds)
    finally:
        live.stop()
    station.accept()
    kept = [
        event.numbers for event in witness.events if event.what is SwingEventKind.KEPT
    ]
    others = [what for what in witness.event_kinds if what not in BETWEEN]
    phases = [status.state.phase for status in witness.statuses if status.state]

    assert list(dict.fromkeys(phases)) == [
        *(Phase.WAIT, Phase.SEEN, Phase.SETTLED, Phase.COUNTDOWN, Phase.CAPTURING),
        *(Phase.SOLVING, Phase.VERDICT),
    ]
    assert kept == [(number,) for number in range(1, station.n_recorded + 1)]
    assert others == [
        *(
            SwingEventKind.SEATED,
            SwingEventKind.CAPTURED,
            SwingEventKind.DONE,
            SwingEventKind.CONFIRMED,
        )
    ]
    assert witness.faults == []
    assert station.status.verdict is not None
    assert station.status.verdict.grade is not Grade.REPEAT
    assert station.tip == command(station.record_folder)["tip_pen_mm"]
    result = station.in_force()
    assert result is not None
    assert result.tip_pen.tolist() == station.tip
    assert open_record(station.record_folder).verdict == result.grade


@pytest.mark.slow
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

    assert station.witness.event_kinds[0] is SwingEventKind.SEATED
    assert station.status.verdict is not None
    assert station.status.verdict.grade is not Grade.REPEAT
    uncertainty = station.status.setup.limits.max_uncertainty
    true_tip = station.camera.scene.tip_pen
    assert np.abs(np.array(station.tip) - true_tip).max() < 2 * uncertainty


# Beginning


def test_a_record_that_cannot_be_made_leaves_the_swing_before(
    station: "Station",
) -> None:
    station.begin()
    before, state = station.record_folder, station.state
    station.records.rename(station.records.with_name("old"))
    station.records.write_text("not a folder")
    station.runner.ask(lambda workflow: workflow.begin(station.preparation))
    station.wait_until(lambda: len(station.witness.faults) == 1)

    assert "cannot be written" in station.witness.faults[0]
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


def test_files_that_are_gone_are_reported_before_anything_begins(
    station: "Station", tmp_path: Path
) -> None:
    pen_file = station.preparation.pen_file
    assert pen_file is not None
    gone = replace(pen_file, path=tmp_path / "gone.csv")
    chosen = replace(station.preparation, pen_file=gone)
    station.runner.ask(lambda workflow: workflow.begin(chosen))
    station.wait_until(lambda: len(station.witness.faults) == 1)

    assert "does not exist" in station.witness.faults[0]
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
        SwingWorkflow.pause,
        SwingWorkflow.resume,
        SwingWorkflow.finish,
        lambda workflow: workflow.solving.solve(),
        lambda workflow: workflow.solving.cancel(),
        SwingWorkflow.capture_more,
        lambda workflow: workflow.solving.accept(),
        SwingWorkflow.discard,
    ):
        runner.ask(act)
    runner.ask(lambda workflow: workflow.solving.exclude([1]))
    runner.ask(lambda workflow: workflow.solving.include([1]))
    station.see()

    assert station.witness.reported == []
    assert station.witness.faults == []
    assert not station.records.exists()


# Capture


def test_nothing_is_kept_after_the_end(station: "Station", interrupted: Path) -> None:
    station.go_on(interrupted)
    station.keep(1)
    setup = station.status.setup
    station.solve()
    before = (interrupted / JOURNAL).read_bytes()
    frame = station.camera.read(1.0)
    station.runner.process_image(frame, station.state.detection, setup)

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
        station.runner.process_image(frame, state.detection, other)
        assert station.state is state

    station.runner.process_image(frame, state.detection, setup)
    assert station.state is not state


def test_a_swing_without_images_ends_with_the_sentence_why(station: "Station") -> None:
    station.begin()
    station.solve()

    assert station.state.message.code == Code.NO_TIP
    assert "contains no images. Resume the swing" in str(station.state.message)
    assert station.witness.event_kinds == [
        SwingEventKind.CAPTURED,
        SwingEventKind.FAILED,
    ]
    assert (station.status.solution, station.status.verdict) == (None, None)
    assert not station.status.is_solving


def test_a_disk_that_is_gone_pauses_the_swing_and_costs_one_image(
    station: "Station", interrupted: Path
) -> None:
    station.go_on(interrupted)
    station.keep(1)
    (interrupted / IMAGES).rename(interrupted / "elsewhere")
    station.see_until(lambda: station.status.is_paused_by_user)
    n_kept = station.state.n_kept
    assert station.status.has_fault
    (sentence,) = station.witness.faults
    assert "cannot be written" in sentence

    (interrupted / "elsewhere").rename(interrupted / IMAGES)
    assert station.n_recorded == n_kept == N_IMAGES + 1
    station.runner.ask(lambda workflow: workflow.resume())
    station.see()
    assert not station.status.has_fault
    assert station.witness.reliefs == []  # who knows yet
    station.keep(2)
    numbers = [image.number for image in open_record(interrupted).images]

    assert station.witness.reliefs == [sentence]
    assert numbers == list(range(1, len(numbers) + 1))
    assert len(numbers) == n_kept + 2


def test_a_pause_of_the_user_is_not_taken_for_a_fault(
    station: "Station", interrupted: Path
) -> None:
    station.go_on(interrupted)
    station.runner.ask(lambda workflow: workflow.pause())
    station.see(2)

    assert station.status.is_paused_by_user
    assert not station.status.has_fault


@pytest.mark.parametrize("end", ["finish", "abandon", "begin", "discard", "shut_down"])
def test_the_record_is_closed_however_the_swing_ends(
    station: "Station", interrupted: Path, end: str
) -> None:
    station.go_on(interrupted)
    if end == "begin":
        station.begin()
    elif end == "shut_down":
        station.runner.shut_down()
    else:
        station.runner.ask(getattr(SwingWorkflow, end))
    station.wait_until(lambda: not station.status.is_capturing or end == "begin")

    assert station.is_free(interrupted)
    assert len(open_record(interrupted).images) == N_IMAGES


def test_an_image_that_is_kept_is_on_the_disk_when_it_is_reported(
    station: "Station", interrupted: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    on_disk: list[int] = []
    on_swing = station.witness.on_swing

    def look_at_disk(*reported: Any) -> None:
        if any(event.what is SwingEventKind.KEPT for event in reported[1]):
            on_disk.append(station.n_recorded)
        on_swing(*reported)

    monkeypatch.setattr(station.witness, "on_swing", look_at_disk)
    station.go_on(interrupted)
    station.keep(2)

    assert on_disk == [N_IMAGES + 1, N_IMAGES + 2]


@pytest.mark.slow
def test_every_status_is_reported_in_order_with_its_events_by_one_thread(
    station: "Station", interrupted: Path
) -> None:
    station.go_on(interrupted)
    station.keep(2)
    station.runner.ask(lambda workflow: workflow.pause())
    station.runner.ask(lambda workflow: workflow.resume())
    station.keep(1)
    station.solve()
    n_kept = N_IMAGES

    (thread,) = station.witness.threads
    assert thread is not threading.current_thread()
    for status, events in station.witness.reported:
        n_kept += sum(event.what is SwingEventKind.KEPT for event in events)
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
    station.runner.ask(lambda workflow: workflow.abandon())
    station.wait_until(lambda: station.status.state is None)
    assert station.status.record_folder is None
    assert station.status.setup is setup
    assert station.interrupted() == [interrupted]
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
    resumable = read_resumable(interrupted)
    station.runner.ask(lambda workflow: workflow.continue_swing(resumable))
    station.runner.process_image(station.camera.read(1.0), None)

    assert station.status is status
    assert station.witness.faults == []


def test_a_swing_that_was_changed_since_it_was_read_is_refused_and_nothing_begins(
    station: "Station", interrupted: Path
) -> None:
    swing = read_resumable(interrupted)
    with RecordWriter.resume(swing.record) as writer:
        writer.exclude([1], "by somebody else")
    station.runner.ask(lambda workflow: workflow.continue_swing(swing))
    station.wait_until(lambda: len(station.witness.faults) == 1)

    assert "changed the swing" in station.witness.faults[0]
    assert station.status.state is None


@pytest.mark.slow
def test_the_end_of_a_swing_before_is_not_taken_for_the_end_of_this_one(
    station: "Station", interrupted: Path, swung: Callable[..., Path]
) -> None:
    other = station.records / "other"
    shutil.copytree(swung(), other)
    station.go_on(other)
    station.runner.ask(lambda workflow: workflow.finish())  # which begins to solve
    station.go_on(interrupted)
    station.keep(1)

    assert station.status.is_capturing
    assert not station.status.is_solving
    assert station.status.solution is None
    assert station.record_folder == interrupted


# The end


def test_an_end_while_a_solution_is_computed_leaves_the_swing_to_be_resumed(
    station: "Station", interrupted: Path
) -> None:
    station.go_on(interrupted)
    station.runner.ask(lambda workflow: workflow.finish())
    station.runner.shut_down()
    assert station.runner.await_end(TIMEOUT)

    assert Phase.VERDICT not in {
        status.state.phase for status in station.witness.statuses if status.state
    }
    assert station.interrupted() == [interrupted]
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
    station.runner.ask(lambda workflow: workflow.discard())
    station.runner.shut_down()

    assert not station.runner.await_end(0.05)


def test_an_image_waits_for_a_disk_that_does_not_answer_but_no_command_does(
    station: "Station", stuck: threading.Event
) -> None:
    stuck.set()
    station.runner.ask(lambda workflow: workflow.discard())
    looking = threading.Thread(target=station.see, daemon=True)
    looking.start()
    station.runner.ask(lambda workflow: workflow.pause())
    looking.join(0.2)

    assert looking.is_alive()


def test_an_image_that_comes_after_the_end_is_not_waited_for(
    station: "Station", interrupted: Path
) -> None:
    station.go_on(interrupted)
    station.runner.shut_down()
    assert station.runner.await_end(TIMEOUT)
    n_reported = len(station.witness.reported)
    station.see(2)
    station.runner.ask(lambda workflow: workflow.begin(station.preparation))
    station.see()

    assert len(station.witness.reported) == n_reported
    assert station.status.state is None
