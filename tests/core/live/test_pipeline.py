"""Images are looked at as they come; a swing is given every one of them, in order."""

import socket
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from queue import SimpleQueue
from typing import TYPE_CHECKING

import cv2
import numpy as np
import pytest
from tests.simulated_pens import SAMPLE_PENS

from lightpen.cameras.protocol import (
    CameraSettings,
    Connection,
    ConnectionChanged,
    Failed,
    ImageCamera,
    WorkerEvent,
)
from lightpen.cameras.replay import ReplayCamera
from lightpen.detection.pixel_box import RegionOfInterest
from lightpen.detection.spots import Spots, detect_spots, have_moved
from lightpen.formats.decoding import encode_png
from lightpen.live.pipeline import UNHURRIED, ImageListener, Live, LiveImage
from lightpen.model.limits import SwingLimits
from lightpen.record.swings.reading import open_record
from lightpen.swing.capture.state import Phase, SwingEventKind
from lightpen_extensions.simulator.camera import SkippingClock

if TYPE_CHECKING:
    from tests.core.conftest import Station

TIMEOUT = 60.0  # s until a test gives up
LONG_NS = 10**18  # which no swing takes
FRAME_RATE = 6.0  # 1/s: a third of the usual one, as looking at an image takes long
PAINTED = np.zeros((200, 200), np.uint8)  # two bright discs
for _place in ((60, 60), (140, 130)):
    cv2.circle(PAINTED, _place, 8, 200, -1, cv2.LINE_AA)
N_IMAGES = 20  # of the record that is resumed


class Screen:
    """Takes what is shown, may hold up the images, and lets a test wait."""

    def __init__(self) -> None:
        self.images: list[LiveImage] = []
        self.camera: list[WorkerEvent] = []
        self.may_go_on = threading.Event()
        self.may_go_on.set()
        self._changed = threading.Condition()

    @property
    def connections(self) -> list[Connection]:
        events = self.camera
        return [e.connection for e in events if isinstance(e, ConnectionChanged)]

    @property
    def failures(self) -> list[str]:
        return [str(e.error) for e in self.camera if isinstance(e, Failed)]

    @property
    def n_spots(self) -> int:
        """How many are in the newest image."""
        return len(self.images[-1].spots) if self.images else 0

    def on_image(self, image: LiveImage) -> None:
        self._tell(lambda: self.images.append(image))
        self.may_go_on.wait(TIMEOUT)

    def on_camera(self, event: WorkerEvent, camera: int) -> None:
        self._tell(lambda: self.camera.append(event))

    def wait_until(self, is_so: Callable[[], bool]) -> None:
        with self._changed:
            assert self._changed.wait_for(is_so, TIMEOUT)

    def wait_for_images(self, n_images: int) -> None:
        """Wait until so many more images were shown."""
        wanted = len(self.images) + n_images
        self.wait_until(lambda: len(self.images) >= wanted)

    def _tell(self, note: Callable[[], None]) -> None:
        with self._changed:
            note()
            self._changed.notify_all()


MakeLive = Callable[..., Live]


@pytest.fixture
def screen() -> Screen:
    return Screen()


@pytest.fixture
def make_live(station: "Station", screen: Screen) -> Iterator[MakeLive]:
    """Return a function that looks at a camera, by default at the simulated pen."""
    lives: list[Live] = []

    def make(
        camera: ImageCamera | None = None,
        *,
        starts: bool = True,
        listeners: Sequence[ImageListener] = (),
    ) -> Live:
        settings = CameraSettings(frame_rate=FRAME_RATE)
        live = Live(
            *([camera or station.new_camera()], settings, screen, station.runner),
            clock=station.clock,
            listeners=listeners,
        )
        lives.append(live)
        if starts:
            live.start()
        return live

    yield make
    screen.may_go_on.set()
    for live in lives:
        live.stop()


def sees_pen(image: LiveImage) -> bool:
    return image.detection is not None and image.detection.has_pose


# What is looked for


def test_what_is_to_be_looked_for_may_be_said_before_the_start(
    station: "Station", make_live: MakeLive, screen: Screen
) -> None:
    live = make_live(starts=False)
    live.set_region(station.preparation.region)
    live.start()
    screen.wait_for_images(2)

    assert all(map(sees_pen, screen.images))


def test_an_image_of_another_size_than_the_intrinsics_shows_spots_only(
    station: "Station", make_live: MakeLive, screen: Screen
) -> None:
    camera, pen = station.preparation.camera, station.preparation.pen
    assert camera is not None
    live = make_live()
    live.set_region(RegionOfInterest(replace(camera, width=camera.width + 1), pen))
    screen.wait_until(lambda: screen.n_spots == 10)
    screen.wait_for_images(2)

    assert all(image.detection is None for image in screen.images)


def test_masked_light_is_left_out_with_and_without_a_camera(
    station: "Station", make_live: MakeLive, screen: Screen
) -> None:
    everywhere = np.array([[612.0, 512.0, 2000.0]])
    live = make_live()
    screen.wait_until(lambda: screen.n_spots == 10)
    live.set_region(RegionOfInterest(mask=everywhere))
    screen.wait_until(lambda: screen.n_spots == 0)
    live.set_region(replace(station.preparation.region, mask=everywhere))
    screen.wait_until(lambda: screen.images[-1].detection is not None)

    assert screen.n_spots == 0


@pytest.mark.slow
def test_a_swing_keeps_its_pen_and_mask_when_others_are_looked_for(
    station: "Station", make_live: MakeLive, screen: Screen, interrupted: Path
) -> None:
    station.go_on(interrupted)
    live = make_live()
    station.wait_until(lambda: station.state.n_kept > N_IMAGES)
    live.set_region(RegionOfInterest(station.preparation.camera, SAMPLE_PENS["six"]()))
    station.wait_until(lambda: station.state.n_kept > N_IMAGES + 2)
    station.solve()
    screen.wait_until(lambda: n_leds_looked_for(screen.images[-1]) == 6)


def n_leds_looked_for(image: LiveImage) -> int:
    return 0 if image.detection is None else len(image.detection.pixels)


# How often


def test_nobody_looking_on_one_image_is_looked_at_and_no_more(
    make_live: MakeLive, screen: Screen
) -> None:
    live = make_live(starts=False)
    live.set_watched(False)
    live.start()
    screen.wait_for_images(1)
    wait_for_rest(screen)

    live.set_watched(True)
    screen.wait_for_images(3)


def test_while_others_listen_every_image_is_looked_at_though_nobody_looks_on(
    make_live: MakeLive, screen: Screen
) -> None:
    from lightpen_extensions.stream.server import LOOPBACK, PoseStream, StreamPlace

    stream = PoseStream()
    stream.open(StreamPlace(port=0))
    assert stream.status.place is not None
    live = make_live(starts=False, listeners=[stream])
    live.set_watched(False)
    live.start()
    screen.wait_for_images(1)

    with socket.create_connection((LOOPBACK, stream.status.place.port)):
        screen.wait_for_images(5)
    stream.close()


def test_who_is_in_a_hurry_is_shown_every_image_though_nothing_moves(
    station: "Station", screen: Screen, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("lightpen.live.pipeline.LIVELY_NS", 300_000_000)
    monkeypatch.setattr("lightpen.live.pipeline.UNHURRIED", 10 * TIMEOUT)
    (tmp_path / "still.png").write_bytes(encode_png(PAINTED))
    camera = ReplayCamera(str(tmp_path), loops=True)
    live = Live([camera], CameraSettings(), screen, station.runner)
    live.start()
    screen.wait_for_images(1)
    wait_for_rest(screen)
    for _ in range(3):
        live.hurry()
        screen.wait_for_images(1)
    live.stop()


def wait_for_rest(screen: Screen) -> None:
    """Wait until no more images are shown."""
    for _ in range(round(TIMEOUT / 0.5)):
        n_before = len(screen.images)
        time.sleep(0.5)  # in which five are taken, at least
        if len(screen.images) == n_before:
            return
    pytest.fail("More and more images are shown.")


def test_recorded_images_that_were_all_seen_are_looked_at_less_often(
    station: "Station", screen: Screen, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("lightpen.live.pipeline.LIVELY_NS", 1)
    monkeypatch.setattr("lightpen.live.pipeline.UNHURRIED", 10 * TIMEOUT)
    n_images = 4
    for i in range(n_images):
        image = encode_png(np.roll(PAINTED, 12 * i, axis=1))
        (tmp_path / f"{i}.png").write_bytes(image)
    camera = ReplayCamera(str(tmp_path), loops=True)
    live = Live([camera], CameraSettings(), screen, station.runner)
    live.start()
    screen.wait_for_images(1)
    screen.wait_until(lambda: screen.images[-1].frame.seq >= n_images)
    wait_for_rest(screen)
    live.stop()


def gap_s(screen: Screen) -> float:
    """Return the time from the last image but one to the last."""
    before, now = screen.images[-2:]
    return (now.frame.host_ts_ns - before.frame.host_ts_ns) * 1e-9


@pytest.mark.slow
def test_in_a_swing_what_rests_for_long_is_looked_at_less_often_until_it_moves(
    station: "Station",
    make_live: MakeLive,
    screen: Screen,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("lightpen.live.pipeline.PATIENT_NS", LONG_NS)
    station.witness.follower = None  # so that the pen is held as it is
    station.begin(SwingLimits())
    make_live()

    station.wait_for_phase(Phase.CAPTURING)
    screen.wait_for_images(2)
    assert gap_s(screen) < 2 / FRAME_RATE
    monkeypatch.setattr("lightpen.live.pipeline.PATIENT_NS", 1_000_000_000)
    screen.wait_until(lambda: gap_s(screen) >= UNHURRIED)
    assert station.state.phase is Phase.CAPTURING

    station.operator.swing()
    screen.wait_until(lambda: gap_s(screen) < 2 / FRAME_RATE)


@pytest.mark.slow
def test_a_swing_begins_with_a_pen_that_has_rested_for_long(
    station: "Station",
    make_live: MakeLive,
    screen: Screen,
    interrupted: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("lightpen.live.pipeline.PATIENT_NS", 1)
    live = make_live()
    live.set_region(station.preparation.region)
    screen.wait_until(lambda: len(screen.images) > 2 and gap_s(screen) >= UNHURRIED)
    station.go_on(interrupted)

    station.wait_until(lambda: station.state.phase is Phase.CAPTURING)


def test_what_rests_is_looked_at_less_often_until_it_moves() -> None:
    spots = detect_spots(PAINTED)
    assert not have_moved(spots, spots)
    assert not have_moved(Spots.none(), Spots.none())
    assert not have_moved(spots, replace(spots, centers=spots.centers + 1.0))

    for other in (
        Spots.none(),
        replace(spots, centers=spots.centers + 9.0),
        replace(spots, areas=1.3 * spots.areas),
        replace(spots, contrasts=0.7 * spots.contrasts),
    ):
        assert have_moved(spots, other)


# Images


def test_an_image_of_12_bits_reaches_the_spots_at_its_full_depth(
    make_live: MakeLive, screen: Screen, tmp_path: Path
) -> None:
    noise = np.random.default_rng(1).integers(0, 16, PAINTED.shape)
    deep = np.where(PAINTED > 0, 16 * PAINTED.astype(np.uint16) + noise, 0)
    deep = deep.astype(np.uint16)
    (tmp_path / "deep.png").write_bytes(encode_png(deep))
    make_live(ReplayCamera(str(tmp_path), loops=True, clock=SkippingClock()))
    screen.wait_for_images(1)
    image = screen.images[-1]
    centers = detect_spots((deep >> 4).astype(np.uint8)).centers

    assert image.frame.bits == 12
    expected = detect_spots(deep, full_scale=4095).centers
    np.testing.assert_array_equal(image.spots.centers, expected)
    assert not np.array_equal(image.spots.centers, centers)


def test_a_slow_reader_is_shown_the_newest_image(
    make_live: MakeLive, screen: Screen
) -> None:
    screen.may_go_on.clear()
    live = make_live()
    screen.wait_until(lambda: len(screen.images) == 1)
    newest = screen.images[0].frame.seq + 11
    while live.stats.delivered <= newest:
        screen.may_go_on.wait(0.001)
    screen.may_go_on.set()
    screen.wait_until(lambda: len(screen.images) >= 2)

    assert screen.images[1].frame.seq >= newest


def test_a_swing_is_given_every_image_in_order_however_slow_the_reader_is(
    station: "Station", make_live: MakeLive, screen: Screen, interrupted: Path
) -> None:
    station.go_on(interrupted)
    camera = station.new_camera()
    make_live(camera)
    screen.wait_for_images(3)
    screen.may_go_on.clear()
    wait_until_camera_waits(camera, screen)
    screen.may_go_on.set()
    screen.wait_for_images(8)
    seqs = [image.frame.seq for image in screen.images]

    assert seqs == list(range(seqs[0], seqs[0] + len(seqs)))


def wait_until_camera_waits(camera: ImageCamera, screen: Screen) -> None:
    """Wait until a camera that waits for its reader has made the image after his."""
    pause = threading.Event()
    for _ in range(round(TIMEOUT / 0.01)):
        if camera.stats().delivered > screen.images[-1].frame.seq + 1:
            return
        pause.wait(0.01)
    pytest.fail("Nothing was made ahead.")


def test_after_a_swing_a_recording_that_waited_for_its_reader_goes_on(
    station: "Station", make_live: MakeLive, screen: Screen, interrupted: Path
) -> None:
    station.go_on(interrupted)
    camera = ReplayCamera(str(interrupted), loops=True, clock=SkippingClock())
    make_live(camera)
    screen.wait_for_images(1)
    screen.may_go_on.clear()
    wait_until_camera_waits(camera, screen)
    station.runner.ask(lambda workflow: workflow.finish())
    screen.may_go_on.set()
    station.wait_until(lambda: not station.status.is_capturing)
    screen.wait_for_images(8)


def test_a_recording_ends_the_swing_after_a_whole_pass_without_a_new_image(
    station: "Station", make_live: MakeLive, swung: Callable[..., Path]
) -> None:
    station.begin()
    make_live(ReplayCamera(str(swung()), loops=True, clock=SkippingClock()))
    station.wait_until(lambda: not station.status.is_capturing)

    assert 0 < station.n_recorded <= N_IMAGES
    assert SwingEventKind.CAPTURED in station.witness.event_kinds


def test_a_swing_begins_with_the_images_of_whoever_is_there(
    station: "Station", make_live: MakeLive
) -> None:
    make_live()
    station.runner.ask(lambda workflow: workflow.choose(station.preparation))
    station.runner.ask(lambda workflow: workflow.note_arrival())
    station.wait_until(lambda: station.status.is_capturing)
    station.wait_until(lambda: station.state.phase is not Phase.WAIT)


def test_images_are_shown_when_there_is_no_runner_any_more(
    station: "Station", make_live: MakeLive, screen: Screen
) -> None:
    station.runner.shut_down()
    make_live()
    screen.wait_for_images(2)


# The camera


def test_the_swing_goes_on_when_a_lost_camera_is_back(
    station: "Station", make_live: MakeLive, screen: Screen, interrupted: Path
) -> None:
    camera = station.new_camera()
    station.go_on(interrupted)
    make_live(camera)
    station.wait_until(lambda: station.state.n_kept > N_IMAGES)
    camera.unplug()
    screen.wait_until(lambda: Connection.LOST in screen.connections)
    camera.plug_in()
    screen.wait_until(lambda: screen.connections[-1] is Connection.STREAMING)

    n_kept = station.state.n_kept
    station.wait_until(lambda: station.state.n_kept > n_kept)


def test_a_swing_goes_on_with_another_camera(
    station: "Station", make_live: MakeLive, interrupted: Path
) -> None:
    station.go_on(interrupted)
    first = make_live()
    station.wait_until(lambda: station.state.n_kept > N_IMAGES)
    first.stop()
    n_kept = station.state.n_kept
    make_live()
    station.wait_until(lambda: station.state.n_kept > n_kept)
    numbers = [image.number for image in open_record(interrupted).images]

    assert numbers == list(range(1, len(numbers) + 1))
    assert station.witness.faults == []


def test_a_swing_waits_for_a_camera_that_is_not_there(
    station: "Station", make_live: MakeLive, screen: Screen, interrupted: Path
) -> None:
    station.go_on(interrupted)
    make_live(ReplayCamera(str(station.folder / "nothing"), loops=True))
    screen.wait_until(lambda: len(screen.failures) == 1)
    assert station.status.is_capturing

    station.solve()
    assert station.status.solution is not None


def test_stopping_twice_or_before_the_start_does_no_harm(make_live: MakeLive) -> None:
    make_live(starts=False).stop()
    live = make_live()
    live.stop()
    live.stop()


def test_stopping_leaves_the_swing_as_far_as_it_came(
    station: "Station", make_live: MakeLive, screen: Screen, interrupted: Path
) -> None:
    station.go_on(interrupted)
    live = make_live()
    station.wait_until(lambda: station.state.n_kept > N_IMAGES)
    live.stop()
    state, n_shown = station.state, len(screen.images)

    assert station.status.is_capturing
    assert state.next_number == station.n_recorded + 1
    assert screen.connections[-1] is Connection.CLOSED
    assert len(screen.images) == n_shown


# A bug of its own


class LookingError(Exception):
    """A bug."""


@pytest.fixture
def crashed(
    station: "Station",
    make_live: MakeLive,
    screen: Screen,
    interrupted: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> Live:
    """Live images of a swing that can be looked at no more."""
    caught: SimpleQueue[type[BaseException]] = SimpleQueue()
    monkeypatch.setattr("threading.excepthook", lambda args: caught.put(args.exc_type))
    station.go_on(interrupted)
    live = make_live()
    station.wait_until(lambda: station.state.n_kept > N_IMAGES)
    with monkeypatch.context() as broken:
        broken.setattr("lightpen.live.pipeline.detect_pen", fail)
        screen.wait_until(lambda: screen.connections[-1] is Connection.CLOSED)
        assert caught.get(timeout=TIMEOUT) is LookingError
    return live


def fail(*_: object, **__: object) -> None:
    raise LookingError


def test_a_bug_while_looking_leaves_the_swing_to_the_next_camera(
    crashed: Live, station: "Station", make_live: MakeLive, screen: Screen
) -> None:
    (sentence,) = screen.failures
    assert sentence.endswith("Open the camera again.")
    n_kept = station.state.n_kept
    assert station.status.is_capturing
    assert not station.status.is_paused_by_user
    station.runner.ask(lambda workflow: workflow.pause())
    station.wait_until(lambda: station.status.is_paused_by_user)
    station.runner.ask(lambda workflow: workflow.resume())
    make_live()
    station.wait_until(lambda: station.state.n_kept > n_kept)

    assert station.witness.faults == []


def test_a_bug_while_an_image_is_taken_does_not_end_the_camera(
    station: "Station",
    make_live: MakeLive,
    screen: Screen,
    interrupted: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("threading.excepthook", lambda args: None)
    station.go_on(interrupted)
    make_live()
    screen.wait_for_images(1)
    with monkeypatch.context() as broken:
        broken.setattr("lightpen.swing.swing_recorder.advance_swing", fail)
        station.wait_until(lambda: len(station.witness.faults) == 1)
        screen.wait_for_images(3)
    station.runner.ask(lambda workflow: workflow.resume())
    station.wait_until(lambda: station.state.n_kept > N_IMAGES)

    assert screen.failures == []
