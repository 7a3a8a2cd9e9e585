"""Tests of `lightpen_extensions.measure.workflow`, without threads.

What is done in the background is done when a test says so.
"""

import json
import shutil
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from tests.accepted_tip import Hold, Holder, accept_tip, leant, round_a_ring
from tests.verifying import BAR, CHOICES, FRAME, NOON, PART_CHOICES, TABLE

from lightpen.detection.pen_detection import PenDetection
from lightpen.errors import LightpenError
from lightpen.formats.opened_files import CameraFile
from lightpen.messages import Message
from lightpen.model.rigid import rig_of
from lightpen.record.folder import TOUCHES, VERIFICATIONS
from lightpen.record.library.signing import STATION_FILE
from lightpen.record.library.supervision import Signature
from lightpen.record.results.result_folder import SIMULATED, FolderArchive
from lightpen.runners import Act, Report, T, Task
from lightpen.swing.preparation import Preparation, SourceChoice
from lightpen_extensions.measure.probing.sources import point_image_name, touch_place
from lightpen_extensions.measure.session import SessionEventKind, VerificationStatus
from lightpen_extensions.measure.storage.session_files import abandon_interrupted
from lightpen_extensions.measure.storage.session_record import find_interrupted
from lightpen_extensions.measure.tasks.fixed_point import FIXED_POINT
from lightpen_extensions.measure.tasks.part import PART
from lightpen_extensions.measure.tasks.task import VerificationChoices
from lightpen_extensions.measure.workflow import VerificationWorkflow
from lightpen_extensions.simulator.swings import PAPER_TIP

EVE = Signature("Eve", "correct horse")


class Trace:
    """A workflow, and a list of all that it publishes."""

    def __init__(self, folder: Path, prepared: Preparation) -> None:
        self.folder, self.prepared = folder, prepared
        self.events: list[SessionEventKind] = []
        self.faults: list[str] = []
        self._waiting: list[Act] = []
        archive = FolderArchive(folder)
        self.workflow = VerificationWorkflow(
            archive, folder, self, lambda: NOON, self._begin
        )
        assert prepared.camera is not None
        assert prepared.pen is not None
        self.holder = Holder(rig_of(prepared.camera), prepared.pen)

    def _begin(
        self,
        work: Callable[[Report], T],
        then: Callable[[T], None],
        otherwise: Callable[[Message], None],
        on_bug: Act,
        on_progress: Report,
    ) -> Task:
        task = Task()

        def run() -> None:
            try:
                outcome = partial(then, work(on_progress))
            except LightpenError as error:
                outcome = partial(otherwise, error.message)
            if not task.is_cancelled:
                outcome()

        self._waiting.append(run)
        return task

    def settle(self) -> None:
        """Have done what waits in the background."""
        while self._waiting:
            self._waiting.pop(0)()

    def come(self, choices: VerificationChoices = CHOICES) -> None:
        self.workflow.choose(self.prepared, choices)
        self.workflow.note_arrival()
        self.settle()

    def see(self, detections: Iterator[PenDetection]) -> None:
        region = self.workflow.status.region
        assert region is not None
        for detection in detections:
            self.workflow.process_image(FRAME, detection, region)

    def touch(self, *holds: Hold, n_images: int = 6) -> None:
        for hold in holds:
            self.see(self.holder.still(hold, n_images))

    def pick_up(self) -> None:
        self.touch(TABLE, n_images=1)

    # What it publishes

    def on_verification(
        self, status: VerificationStatus, events: tuple[SessionEventKind, ...]
    ) -> None:
        self.events += events

    def on_progress(self, fraction: float) -> None:
        """Nothing is shown."""

    def on_fault(self, message: Message) -> None:
        self.faults.append(message.code)

    def on_fault_cleared(self, message: Message) -> None:
        """Nothing is shown."""

    # What is kept

    def kept(self) -> list[tuple[str, str]]:
        """Return kind and reason of all records, of conclusions their outcome."""
        files = sorted((self.folder / SIMULATED / VERIFICATIONS).glob("*.json"))
        records = [json.loads(file.read_bytes()) for file in files]
        return [
            (each["verification"], each.get("outcome") or each["verdict"]["code"])
            for each in records
        ]


@pytest.fixture
def trace(tmp_path: Path, prepared: Preparation) -> Trace:
    """A tip is in force."""
    accept_tip(tmp_path, prepared)
    return Trace(tmp_path, prepared)


def test_a_verification_with_pauses_and_points_taken_back(trace: Trace) -> None:
    act = trace.workflow
    trace.come()
    act.undo()  # nothing yet
    trace.pick_up()
    trace.touch(leant(4)[0])
    trace.see(trace.holder.away())
    trace.touch(leant(4)[0])  # is known
    trace.touch(leant(4)[1], n_images=3)
    trace.see(trace.holder.away(2))  # broken off
    trace.touch(leant(4)[2])
    act.undo()
    act.toggle_pause()
    trace.touch(leant(4)[2])
    act.toggle_pause()
    trace.pick_up()
    act.note_departure()
    trace.touch(leant(4)[2])
    act.note_arrival()
    trace.settle()
    trace.pick_up()
    trace.touch(*leant(4)[1:3])
    trace.touch(leant(4)[3])
    act.start_over()
    trace.settle()
    trace.pick_up()
    trace.touch(*leant(3))
    act.end_task()
    act.shut_down()

    assert trace.faults == []
    assert trace.events.count(SessionEventKind.KNOWN) == 1
    assert trace.events.count(SessionEventKind.DONE) == 2
    assert trace.kept() == [
        ("fixed point", "tip.weak-power"),
        ("conclusion", "refused"),
        ("fixed point", "tip.weak-power"),
        ("conclusion", "refused"),
    ]


def test_a_verification_with_other_choices(trace: Trace) -> None:
    act = trace.workflow
    act.note_arrival()  # nothing is chosen
    act.end_task()
    trace.come(replace(CHOICES, kind=PART.kind, plan=None))
    trace.come()
    trace.come()  # the same
    trace.pick_up()
    trace.touch(*leant(4)[:2])
    act.choose(trace.prepared, replace(CHOICES, n_cone=3))
    trace.touch(leant(4)[2])
    act.choose(trace.prepared, PART_CHOICES)
    trace.pick_up()
    trace.touch(*round_a_ring(11, 31.751)[:3])
    faster = replace(PART_CHOICES, n_frames=2)
    act.choose(trace.prepared, faster)
    trace.touch(*round_a_ring(11, 31.751)[3:10], BAR[0])
    other = replace(trace.prepared, source=SourceChoice(place="other"))
    act.choose(other, faster)
    trace.settle()
    accept_tip(trace.folder, trace.prepared, seed=4)
    act.note_departure()
    act.note_arrival()
    trace.settle()
    trace.pick_up()
    trace.touch(leant(4)[0])
    act.start_over()
    trace.settle()
    trace.pick_up()
    trace.touch(leant(4)[0])
    act.recover()
    act.shut_down()

    assert trace.faults == ["verification.bug"]
    assert trace.kept() == [
        ("fixed point", "tip.weak-power"),
        ("conclusion", "refused"),
        *(3 * [("conclusion", "abandoned")]),
    ]


def test_a_plan_that_is_ended_between_two_features(trace: Trace) -> None:
    trace.come(PART_CHOICES)
    trace.pick_up()
    trace.touch(*round_a_ring(11, 31.751)[:10], BAR[0])
    trace.workflow.end_task()
    trace.workflow.shut_down()

    assert trace.faults == []
    assert [kind for kind, _ in trace.kept()] == ["part", "conclusion"]


def test_a_tip_that_fails(trace: Trace) -> None:
    act = trace.workflow
    bent = PAPER_TIP + np.array([0.3, 0.0, 0.0])
    trace.holder = Holder(trace.holder.rig, trace.holder.pen, bent)
    trace.come(replace(CHOICES, kind=FIXED_POINT.kind))
    trace.pick_up()
    trace.touch(*leant(4))
    act.shut_down()

    assert trace.events[-1] is SessionEventKind.FAILED
    assert trace.faults == []
    assert trace.kept() == [("fixed point", "tip.another"), ("conclusion", "refused")]


def test_a_verification_with_another_camera_file_is_not_resumed(
    trace: Trace, tmp_path: Path
) -> None:
    trace.come()
    trace.pick_up()
    trace.touch(*leant(2))
    copy = tmp_path / "killed"
    shutil.copytree(trace.folder / SIMULATED, copy / SIMULATED)
    shutil.copy(trace.folder / STATION_FILE, copy)
    trace.workflow.shut_down()
    assert trace.prepared.camera_file is not None
    renewed = copy / "camera.yaml"
    content = trace.prepared.camera_file.path.read_text(encoding="utf-8")
    renewed.write_text(f"{content}# renewed\n", encoding="utf-8")

    again = Trace(copy, replace(trace.prepared, camera_file=CameraFile.read(renewed)))
    (interrupted,) = find_interrupted(copy)
    again.come()
    again.workflow.continue_session(interrupted)
    again.settle()
    assert again.faults == ["under-way.other-files"]
    assert find_interrupted(copy) == (interrupted,)


def test_a_verification_that_is_closed(trace: Trace) -> None:
    trace.come()
    trace.pick_up()
    trace.touch(*leant(4)[:2])
    copy = trace.folder / "copy"
    shutil.copytree(trace.folder / SIMULATED, copy / SIMULATED)
    trace.workflow.shut_down()
    (interrupted,) = find_interrupted(copy)
    record = interrupted.path.parent
    for day in ("20010430", "20990502"):
        shutil.copytree(record, record.with_name(day + record.name[8:]))
    newer, same, older = find_interrupted(copy)
    assert newer.path > interrupted.path > older.path
    assert same == interrupted
    for each in (newer, interrupted, older):
        abandon_interrupted(copy, each, NOON)

    assert find_interrupted(copy) == ()


def test_the_images_of_touches_say_which_touch_they_are_of(trace: Trace) -> None:
    trace.come()
    trace.pick_up()
    trace.touch(*leant(4)[:2])
    trace.workflow.undo()
    trace.touch(leant(4)[2])
    (run,) = (trace.folder / SIMULATED / VERIFICATIONS / TOUCHES).iterdir()
    place = touch_place((str(run),))
    held = place.held
    trace.workflow.shut_down()
    assert place.operator == trace.prepared.names.operator
    assert place.conditions == trace.prepared.assumptions_today

    # A touch that is taken back counts no more.
    numbers = [[frame.name for frame in still.frames] for _, still in held]
    assert numbers == [
        [point_image_name(n) for n in ns] for ns in ((1, 2, 3), (7, 8, 9))
    ]
