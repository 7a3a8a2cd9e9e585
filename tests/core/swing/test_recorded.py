"""A swing of recorded images: all are read once, in order, and nothing is asked."""

import shutil
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np
import pytest

from lightpen.cameras.protocol import Frame, FrameIncomplete
from lightpen.cameras.replay import ReplayCamera
from lightpen.detection.observations import observe_images
from lightpen.detection.pen_detection import detect_pen
from lightpen.estimation.calibrate import calibrate
from lightpen.estimation.reports.verdict import Grade, judge
from lightpen.formats.decoding import encode_png, read_image
from lightpen.formats.images import find_images
from lightpen.messages import Code
from lightpen.model.names import Origin
from lightpen.record.swings.reading import open_record
from lightpen.record.swings.solving import solve_record, source
from lightpen.swing.capture.state import Phase, Progress, SwingEventKind
from lightpen.swing.preparation import SourceChoice, SourceKind
from lightpen.swing.swing_recorder import read_resumable

if TYPE_CHECKING:
    from tests.core.conftest import Station

N_IMAGES = 20


class Recording:
    """Recorded images that are shown over and over to a station's runner."""

    def __init__(self, station: "Station", place: Path) -> None:
        self.station, self.place = station, place
        self.camera = ReplayCamera(str(place), loops=True, clock=station.clock)
        self.camera.open()
        self.camera.start()
        station.preparation = replace(
            station.preparation, source=SourceChoice(SourceKind.RECORDED, str(place))
        )

    def show(self, n_images: int) -> None:
        """Show so many of the next images; what cannot be read is not seen."""
        for _ in range(n_images):
            with suppress(FrameIncomplete):
                self.take(self.camera.read(1.0))

    def take(self, frame: Frame) -> None:
        station = self.station
        setup = station.status.setup
        assert setup is not None
        seen = detect_pen(frame.image, setup.camera, setup.pen, setup.mask)
        n_images = self.camera.caps.n_images
        station.runner.process_image(frame, seen, setup, n_images)


@pytest.fixture
def recording(station: "Station", swung: Callable[..., Path]) -> Recording:
    """The images of a swing, whose state begins when they are shown."""
    recording = Recording(station, swung() / "images")
    station.begin()
    return recording


@pytest.mark.slow
def test_all_images_are_read_once_and_in_order_and_then_the_tip_is_computed(
    recording: Recording, station: "Station", swung: Callable[..., Path]
) -> None:
    recording.show(12)
    assert station.state.phase is Phase.CAPTURING
    assert station.state.progress == Progress(12, N_IMAGES)
    assert station.state.message.code == Code.IMAGES_READ
    assert station.state.target is None
    assert station.state.trace.n_images.tolist() == list(range(1, 13))
    recording.show(8)
    station.wait_for_phase(Phase.VERDICT)

    images, again = swung() / "images", station.record_folder / "images"
    shown = [path.read_bytes() for path in sorted(images.iterdir())]
    assert [path.read_bytes() for path in sorted(again.iterdir())] == shown
    event_kinds = station.witness.event_kinds
    assert event_kinds.count(SwingEventKind.KEPT) == N_IMAGES
    assert SwingEventKind.SEATED not in event_kinds
    tip = solve_record(open_record(swung())).calibration.joint.tip_pen
    assert station.tip == tip.tolist()


def test_it_begins_with_the_first_image_whichever_is_shown(
    recording: Recording, station: "Station"
) -> None:
    frames = [recording.camera.read(1.0) for _ in range(N_IMAGES + 3)]
    for frame in frames[17:20]:
        recording.take(frame)
    assert station.state.progress == Progress()
    assert station.n_recorded == 0

    for frame in frames[20:]:
        recording.take(frame)
    assert station.state.progress.n_read == station.n_recorded == 3


@pytest.mark.slow
def test_the_verdict_is_that_on_the_same_files(
    station: "Station", swung: Callable[..., Path], tmp_path: Path
) -> None:
    images = tmp_path / "images"
    shutil.copytree(swung() / "images", images)
    paths = sorted(images.iterdir())
    deep = read_image(paths[0]).astype(np.uint16) * 257
    paths[0].write_bytes(encode_png(deep))
    paths[3].write_bytes(b"no image")
    for path in paths[5:15:2]:
        path.write_bytes(encode_png(np.zeros_like(deep)))
    limits = replace(station.preparation.limits, min_images=14)
    recording = Recording(station, images)
    station.begin(limits)
    recording.show(3 * N_IMAGES)
    station.wait_for_phase(Phase.VERDICT)
    setup = station.status.setup
    assert setup is not None
    seen = observe_images(find_images(str(images)), setup.camera, setup.pen)
    on_files = calibrate(setup.camera, setup.pen, seen, setup.assumptions)

    assert station.n_recorded == on_files.used.sum() == 14
    assert station.tip == on_files.joint.tip_pen.tolist()
    reported = judge(station.solution.calibration, limits)
    assert reported == judge(on_files, limits)
    assert reported.grade is Grade.PASS


@pytest.mark.slow
def test_an_image_takes_part_that_would_on_files_with_few_leds_whole(
    station: "Station", swung: Callable[..., Path], tmp_path: Path
) -> None:
    images = tmp_path / "images"
    shutil.copytree(swung() / "images", images)
    path = sorted(images.iterdir())[7]
    preparation = station.preparation
    assert preparation.camera is not None
    assert preparation.pen is not None
    image = read_image(path)
    detection = detect_pen(image, preparation.camera, preparation.pen)
    image = image.copy()
    for x, y in np.rint(detection.pixels[:5]).astype(int).tolist():
        cv2.circle(image, (x, y - 14), 4, 255, -1)  # at the rim of the disc
    path.write_bytes(encode_png(image))
    spoiled = detect_pen(image, preparation.camera, preparation.pen)
    assert spoiled.has_pose
    assert spoiled.n_leds == 5
    recording = Recording(station, images)
    station.begin()
    recording.show(N_IMAGES)
    station.wait_for_phase(Phase.VERDICT)

    assert station.n_recorded == N_IMAGES
    assert not station.state.n_dropped


@pytest.mark.slow
def test_an_interrupted_reading_goes_on_and_takes_no_image_twice(
    recording: Recording, station: "Station"
) -> None:
    recording.show(8)
    folder = station.record_folder
    station.runner.ask(lambda workflow: workflow.abandon())
    station.wait_until(lambda: station.status.state is None)
    station.go_on(folder)
    recording.show(N_IMAGES - 8)  # to the end of the pass
    recording.show(N_IMAGES)
    station.wait_for_phase(Phase.VERDICT)

    sums = [image.sha256 for image in open_record(folder).images]
    assert len(sums) == len(set(sums)) == N_IMAGES


@pytest.mark.slow
def test_after_the_verdict_nothing_more_can_be_captured_or_confirmed(
    recording: Recording, station: "Station"
) -> None:
    recording.show(N_IMAGES)
    station.wait_for_phase(Phase.VERDICT)
    station.runner.ask(lambda workflow: workflow.capture_more())
    recording.show(N_IMAGES)

    assert station.state.phase is Phase.VERDICT
    assert SwingEventKind.CONFIRMED not in station.witness.event_kinds
    assert station.n_recorded == N_IMAGES


def test_the_images_of_a_simulated_swing_stay_simulated(
    recording: Recording, station: "Station"
) -> None:
    recording.show(3)

    assert station.status.origin is Origin.SIMULATED
    assert open_record(station.record_folder).header.origin is Origin.SIMULATED


def test_a_reading_goes_on_with_its_own_recording_only(
    recording: Recording, station: "Station", tmp_path: Path
) -> None:
    recording.show(3)
    station.runner.ask(lambda workflow: workflow.abandon())
    station.wait_until(lambda: station.status.state is None)
    (folder,) = station.interrupted()
    swing = read_resumable(folder)

    assert swing.is_of([SourceChoice(SourceKind.RECORDED, str(recording.place))])
    assert not swing.is_of([SourceChoice(SourceKind.RECORDED, str(tmp_path))])
    assert not swing.is_of([SourceChoice(SourceKind.SIMULATED)])
    assert source(swing.record).origin is Origin.SIMULATED
