"""A verification that a test leads: a runner, and a pen held before its camera."""

import json
import threading
from collections.abc import Callable, Iterable
from copy import deepcopy
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from tests.accepted_tip import Hold, Holder

from lightpen.cameras.protocol import Frame, sealed
from lightpen.detection.pen_detection import PenDetection
from lightpen.detection.pixel_box import RegionOfInterest
from lightpen.messages import Message
from lightpen.model.artefacts import Artefact, ArtefactKind
from lightpen.model.rigid import rig_of
from lightpen.record.folder import TOUCHES, VERIFICATIONS
from lightpen.record.results.result_folder import SIMULATED, FolderArchive
from lightpen.swing.preparation import Preparation
from lightpen_extensions.comparisons.assessment import CONCLUSION
from lightpen_extensions.measure.measuring.plan import artefact_plan
from lightpen_extensions.measure.measuring.surfaces import FeatureKind
from lightpen_extensions.measure.probing.probing import ProbingPhase
from lightpen_extensions.measure.session import (
    ReadingState,
    SessionEventKind,
    SessionState,
    VerificationStatus,
)
from lightpen_extensions.measure.tasks.fixed_point import FIXED_POINT
from lightpen_extensions.measure.tasks.part import PART
from lightpen_extensions.measure.tasks.task import (
    FoundT,
    VerificationChoices,
    VerificationTask,
)
from lightpen_extensions.measure.workflow import VerificationRunner

TIMEOUT = 60.0  # s until a test gives up
NOON = datetime(2031, 5, 1, 12, tzinfo=UTC)
RING = Artefact(ArtefactKind.RING, 31.751, 0.001)
LENGTH = Artefact(ArtefactKind.LENGTH, 150.0, 0.001)
ARTEFACTS = artefact_plan("Ring and bar", [RING, LENGTH], {FeatureKind.CIRCLE: 10})
CHOICES = VerificationChoices(
    FIXED_POINT.kind, ARTEFACTS, n_cone=4, n_cone_frames=3, n_frames=3
)
PART_CHOICES = replace(CHOICES, kind=PART.kind)
FRAME = Frame(sealed(np.zeros((2, 2), np.uint8)), 0, 0)
TABLE = Hold((0.0, 80.0, 0.0))
BAR = Hold((-75.0, -20.0, 0.0)), Hold((75.0, -20.0, 0.0))


def found_by(state: SessionState | None, task: VerificationTask[FoundT]) -> FoundT:
    """Return what a task has found."""
    found = None if state is None else state.found_by(task)
    assert found is not None
    return found


class Ear:
    """Hears what a runner tells, and lets a test wait for it."""

    def __init__(self) -> None:
        self.events: list[SessionEventKind] = []
        self.faults: list[str] = []
        self.reliefs: list[str] = []
        self.n_read = 0  # times that the tip in force was read
        self._reading = ReadingState.NOTHING
        self._changed = threading.Condition()

    def on_verification(
        self, status: VerificationStatus, events: tuple[SessionEventKind, ...]
    ) -> None:
        if (self._reading, status.reading) == (ReadingState.TIP, ReadingState.NOTHING):
            self.n_read += 1
        self._reading = status.reading
        self._note(lambda: self.events.extend(events))

    def on_progress(self, fraction: float) -> None:
        """Nothing is shown."""

    def on_fault(self, message: Message) -> None:
        self._note(lambda: self.faults.append(message.code))

    def on_fault_cleared(self, message: Message) -> None:
        self._note(lambda: self.reliefs.append(message.code))

    def wait_until(self, is_so: Callable[[], bool]) -> None:
        with self._changed:
            assert self._changed.wait_for(is_so, TIMEOUT)

    def _note(self, note: Callable[[], None]) -> None:
        with self._changed:
            note()
            self._changed.notify_all()


class Verifier:
    """A runner, and a pen that is held before its camera."""

    def __init__(self, folder: Path, prepared: Preparation) -> None:
        self.folder, self.preparation = folder, prepared
        self.ear = Ear()
        self.runner = VerificationRunner(
            FolderArchive(folder), folder, self.ear, lambda: NOON
        )
        camera, pen, rig_file = prepared.camera, prepared.pen, prepared.rig_file
        assert camera is not None
        assert pen is not None
        rig = rig_of(camera) if rig_file is None else rig_file.rig
        self.holder = Holder(rig, pen)

    @property
    def status(self) -> VerificationStatus:
        return self.runner.status

    @property
    def kept(self) -> Path:
        return self.folder / SIMULATED / VERIFICATIONS

    @property
    def records(self) -> list[dict[str, Any]]:
        """What each task found."""
        return [each for each in self._all if each["verification"] != CONCLUSION]

    @property
    def conclusions(self) -> list[dict[str, Any]]:
        return [each for each in self._all if each["verification"] == CONCLUSION]

    @property
    def _all(self) -> list[dict[str, Any]]:
        files = sorted(self.kept.glob("*.json"))
        return [json.loads(file.read_bytes()) for file in files]

    @property
    def runs(self) -> list[Path]:
        """Records of the images of live touches."""
        return sorted((self.kept / TOUCHES).glob("*"))

    def come(self, choices: VerificationChoices = CHOICES) -> None:
        """Be at it, and wait until the tip is read."""
        n_read = self.ear.n_read
        self.runner.ask(lambda workflow: workflow.choose(self.preparation, choices))
        self.runner.ask(lambda workflow: workflow.note_arrival())
        self.ear.wait_until(lambda: self.ear.n_read > n_read)

    def refusal(self) -> str:
        assert self.status.refusal is not None
        return self.status.refusal.code

    def see(
        self, detections: Iterable[PenDetection], region: RegionOfInterest | None = None
    ) -> None:
        for detection in detections:
            wanted = region or self.status.region
            assert wanted is not None
            frame = replace(FRAME, others=(FRAME,) * (len(wanted.regions) - 1))
            self.runner.process_image(frame, detection, wanted)

    def touch(self, *holds: Hold) -> None:
        self.pick_up()
        for hold in holds:
            self.see(self.holder.still(hold))

    def pick_up(self) -> None:
        """Take the pen up if it rests, as it must be before the first touch."""
        done = threading.Event()
        self.runner.ask(lambda _: done.set())
        done.wait(TIMEOUT)
        state = self.status.state
        if state is not None and state.touching.phase is ProbingPhase.AT_REST:
            self.see(deepcopy(self.holder).still(TABLE, 1))
