"""From live images to a record, and from the record to the same tip."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from itertools import count
from pathlib import Path

import numpy as np
import pytest

from lightpen.cameras.protocol import CameraSettings, Frame
from lightpen.detection.pen_detection import PenDetection, detect_pen
from lightpen.detection.reasons import Reason
from lightpen.errors import FileError
from lightpen.formats.camera_files import CAMERA_FILE
from lightpen.formats.pen_files import PEN_FILE, write_pen
from lightpen.formats.rig_files import write_camera
from lightpen.messages import message
from lightpen.record.swings.header import FileCopy, Header, RecordedCamera
from lightpen.record.swings.reading import open_record
from lightpen.record.swings.writing import RecordWriter
from lightpen.swing.capture.state import (
    Phase,
    SwingEvent,
    SwingEventKind,
    SwingSetup,
    SwingState,
    Transition,
    start_swing,
)
from lightpen.swing.swing_recorder import capture_image, resume_swing
from lightpen_extensions.simulator.camera import SimulatedCamera, SkippingClock
from lightpen_extensions.simulator.scenes import Scene
from lightpen_extensions.simulator.swings import paper_camera

FRAME_RATE = 10.0  # 1/s: half of the usual one, as looking at an image takes long


def small_scene() -> Scene:
    """Return the paper's scene seen with a quarter of the pixels."""
    return Scene(camera=paper_camera(binning=2))


@dataclass(frozen=True, eq=False)
class SwingViewState:
    """An image of a camera and what is seen in it, at a time in s."""

    frame: Frame
    detection: PenDetection
    time: float


class Swung:
    """A pen that is swung before a camera; each image of it is looked at once."""

    def __init__(self) -> None:
        scene = small_scene()
        self._clock = SkippingClock()
        self._camera = SimulatedCamera(scene, self._clock)
        self._camera.open()
        self._camera.configure(CameraSettings(frame_rate=FRAME_RATE))
        self._camera.start()
        self._moments: list[SwingViewState] = []
        self.operator = self._camera.operator
        self.operator.swing()

    def moments(self) -> Iterator[SwingViewState]:
        """Yield what is seen, from the first image on."""
        for index in count():
            if index == len(self._moments):
                frame = self._camera.read(1.0)
                scene = self._camera.scene
                before = self._moments[-1].detection if self._moments else None
                detection = detect_pen(
                    frame.image, scene.camera, scene.pen, before=before
                )
                now = self._clock.now_ns() * 1e-9
                self._moments.append(SwingViewState(frame, detection, now))
            yield self._moments[index]


class Wizard:
    """A wizard without a window: what a camera sees, swing and record."""

    def __init__(self, folder: Path, swung: Swung) -> None:
        scene = small_scene()
        write_camera(scene.camera, folder / "camera.yaml")
        write_pen(scene.pen, folder / "lp04.json")
        header = Header(
            cameras=(RecordedCamera(FileCopy.of(folder / "camera.yaml", CAMERA_FILE)),),
            pen_file=FileCopy.of(folder / "lp04.json", PEN_FILE),
            created=datetime(2026, 1, 2, tzinfo=UTC),
        )
        self.folder = folder / "swing"
        self.writer = RecordWriter.create(self.folder, header)
        self.setup = SwingSetup(scene.camera, scene.pen)
        self.state: SwingState = start_swing(self.setup)
        self._moments = swung.moments()

    def run(self, n_images: int) -> None:
        """Capture until so many images are kept."""
        while self.state.n_kept < n_images:
            now = next(self._moments)
            transition = capture_image(
                *(self.setup, self.state, self.writer, now.frame.image, now.detection),
                *(now.time, now.frame.device_ts_ns),
            )
            self.state = transition.state


@pytest.fixture(scope="module")
def undisturbed() -> Swung:
    return Swung()


@pytest.fixture
def wizard(tmp_path: Path, undisturbed: Swung) -> Iterator[Wizard]:
    wizard = Wizard(tmp_path, undisturbed)
    yield wizard
    wizard.writer.close()


@pytest.mark.slow
def test_an_interrupted_swing_goes_on_with_all_its_images(wizard: Wizard) -> None:
    wizard.run(20)
    before = wizard.state
    wizard.writer.close()  # as a killed program does

    record = open_record(wizard.folder)
    wizard.state = resume_swing(wizard.setup, record, before.time)
    assert wizard.state.n_kept == 20
    assert wizard.state.kept.joint is not None
    assert before.kept.joint is not None
    np.testing.assert_allclose(
        wizard.state.kept.joint.tip_pen, before.kept.joint.tip_pen, atol=1e-5
    )
    trace = wizard.state.trace  # so that its curves do not begin anew
    assert trace.n_images[-1] == 20
    assert len(trace.n_images) > 5
    np.testing.assert_allclose(trace.tips[-1], before.trace.tips[-1], atol=1e-5)
    with RecordWriter.resume(record) as writer:
        wizard.writer = writer
        wizard.run(25)

    assert [image.number for image in open_record(wizard.folder).images] == [
        *range(1, 26)
    ]


def test_a_record_without_images_is_resumed_as_a_new_swing(wizard: Wizard) -> None:
    state = resume_swing(wizard.setup, open_record(wizard.folder))
    assert (state.n_kept, state.next_number, state.phase) == (0, 1, Phase.WAIT)


@pytest.mark.slow
def test_slipped_images_are_taken_out_of_the_record(tmp_path: Path) -> None:
    swung = Swung()
    wizard = Wizard(tmp_path, swung)
    wizard.run(3)
    swung.operator.slip(0.3, 0.6)  # hides in what the tip may still be
    wizard.run(12)
    wizard.writer.close()
    record = open_record(wizard.folder)

    assert wizard.state.n_dropped[Reason.SLIPPED] > 0
    assert set(record.excluded.values()) == {"tip slipped"}
    np.testing.assert_array_equal(record.numbers, wizard.state.kept.numbers)


def test_state_and_record_must_belong_together(wizard: Wizard) -> None:
    wizard.run(1)
    other = start_swing(wizard.setup)
    image = np.zeros((1024, 1224), np.uint8)
    detection = detect_pen(image, wizard.setup.camera, wizard.setup.pen)
    with pytest.raises(ValueError, match="at image 1, the record at 2"):
        capture_image(wizard.setup, other, wizard.writer, image, detection, 0.0)


def test_a_slip_that_cannot_be_recorded_leaves_state_and_record_together(
    wizard: Wizard, monkeypatch: pytest.MonkeyPatch
) -> None:
    wizard.run(3)

    def slipped_and_kept(
        setup: SwingSetup, state: SwingState, detection: PenDetection, time: float
    ) -> Transition:
        events = (
            SwingEvent(SwingEventKind.KEPT, (4,)),
            SwingEvent(SwingEventKind.SLIPPED, (2,)),
        )
        return Transition(replace(state, next_number=5), events)

    def fail(writer: RecordWriter, numbers: Sequence[int], reason: str) -> None:
        raise FileError(message("system.full"))

    with monkeypatch.context() as patch:
        patch.setattr("lightpen.swing.swing_recorder.advance_swing", slipped_and_kept)
        patch.setattr(RecordWriter, "exclude", fail)
        with pytest.raises(FileError, match="No space left"):
            wizard.run(4)
    assert wizard.writer.next_number == wizard.state.next_number == 4
    wizard.run(5)
