"""Two cameras looked at as one: each in its thread, their images by moments."""

import re
import shutil
import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from tests.faulty_camera import FaultyCamera
from tests.gige_simulator import ADDRESS, SECOND_ADDRESS, GigeSimulator
from typing_extensions import override

from lightpen.arrays import Image
from lightpen.cameras.pairing import MachineClock
from lightpen.cameras.protocol import (
    CameraSettings,
    Connection,
    ConnectionChanged,
    Failed,
    FaultRaised,
    Frame,
    ImageCamera,
    Region,
    WorkerEvent,
)
from lightpen.cameras.replay import ReplayCamera
from lightpen.detection.pen_detection import PenDetection, unseen
from lightpen.detection.pixel_box import RegionOfInterest
from lightpen.detection.reasons import Reason
from lightpen.formats.decoding import encode_png
from lightpen.live.pipeline import LIVELY_NS, UNHURRIED, Live, LiveImage
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen_extensions.simulator.scenes import Scene, beside

if TYPE_CHECKING:
    from tests.core.conftest import Station

TIMEOUT = 60.0  # s until a test gives up
TINY = Camera(width=102, height=86, fx=193, fy=193, cx=51, cy=43)
HOUR_NS = 3_600_000_000_000
ON_THEIR_WAY_NS = 5_000_000
HELD_UP_NS, N_HELD_UP = 100_000_000, 20
SETTINGS = CameraSettings(frame_rate=25.0, region=Region(0, 0, 160, 120))


class Screen:
    """Takes what is shown of both cameras, and lets a test wait."""

    def __init__(self) -> None:
        self.images: tuple[list[LiveImage], list[LiveImage]] = ([], [])
        self.connections: tuple[list[Connection], list[Connection]] = ([], [])
        self.failures: list[str] = []
        self.faults: list[str] = []
        self._changed = threading.Condition()

    def on_image(self, image: LiveImage) -> None:
        with self._changed:
            self.images[image.camera].append(image)
            self._changed.notify_all()

    def on_camera(self, event: WorkerEvent, camera: int) -> None:
        with self._changed:
            if isinstance(event, ConnectionChanged):
                self.connections[camera].append(event.connection)
            if isinstance(event, FaultRaised):
                self.faults.append(str(event.error))
            if isinstance(event, Failed):
                self.failures.append(str(event.error))
            self._changed.notify_all()

    def wait_until(self, is_so: Callable[[], bool]) -> None:
        with self._changed:
            assert self._changed.wait_for(is_so, TIMEOUT)

    def wait_for_moments(self, n_moments: int) -> None:
        """Wait until so many more images of the second camera were shown."""
        wanted = len(self.images[1]) + n_moments
        self.wait_until(lambda: len(self.images[1]) >= wanted)

    def shown_ns(self) -> list[int]:
        """When the images of the first camera came that were shown."""
        return [image.frame.host_ts_ns for image in self.images[0]]

    def moments(self) -> list[tuple[LiveImage, LiveImage]]:
        with self._changed:  # the second image of the last moment may be still to come
            return list(zip(*self.images, strict=False))


@pytest.fixture
def screen() -> Screen:
    return Screen()


MakeLive = Callable[[Sequence[ImageCamera]], Live]


@pytest.fixture
def make_live(
    station: "Station", screen: Screen, swung: Callable[..., Path]
) -> Iterator[MakeLive]:
    """Return a function that looks at two cameras while a swing is captured.

    Their images are too small for it, so that looking at them takes no time.
    """
    folder = station.records / "interrupted"
    shutil.copytree(swung(14, by_two=True), folder)
    lives: list[Live] = []

    def make(cameras: Sequence[ImageCamera]) -> Live:
        station.go_on(folder)
        live = Live(cameras, SETTINGS, screen, station.runner)
        lives.append(live)
        live.start()
        return live

    yield make
    for live in lives:
        live.stop()


class PunctualCamera(FaultyCamera):
    """Its images take the same time on their way, whatever else the machine does."""

    @override
    def read(self, timeout_s: float) -> Frame:
        frame = super().read(timeout_s)
        assert frame.device_ts_ns is not None
        return replace(frame, host_ts_ns=frame.device_ts_ns + ON_THEIR_WAY_NS)


@pytest.fixture
def simulated() -> tuple[FaultyCamera, FaultyCamera]:
    scene, clock = Scene(camera=TINY), MachineClock()
    first = PunctualCamera(scene, clock)
    rig = beside(scene.camera, scene.cone_cam)
    return first, PunctualCamera(scene, clock, first.operator, rig=rig)


def test_images_of_two_simulated_cameras_come_by_moments(
    simulated: tuple[FaultyCamera, FaultyCamera], make_live: MakeLive, screen: Screen
) -> None:
    live = make_live(simulated)
    screen.wait_for_moments(15)
    screen.wait_until(lambda: live.lag_ms is not None)
    assert live.lag_ms == pytest.approx(0.0, abs=0.01)  # as one signal triggers both
    for one, other in screen.moments():
        assert one.frame.others[0] is other.frame
        assert one.frame.device_ts_ns is not None
        assert other.frame.device_ts_ns is not None
        assert abs(other.frame.device_ts_ns - one.frame.device_ts_ns) < 1000


def test_a_second_camera_is_looked_at_before_it_is_known_what_for(
    simulated: tuple[FaultyCamera, FaultyCamera], station: "Station", screen: Screen
) -> None:
    live = Live(simulated, SETTINGS, screen, station.runner)
    live.set_region(RegionOfInterest(TINY))
    live.start()
    screen.wait_for_moments(2)
    live.stop()

    assert screen.failures == []


def test_each_camera_is_followed_by_itself_and_anew_with_each_pen(
    simulated: tuple[FaultyCamera, FaultyCamera],
    station: "Station",
    screen: Screen,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    cameras = [replace(TINY, serial=str(n)) for n in range(4)]
    reported_before: dict[str, list[PenDetection | None]] = {
        c.serial: [] for c in cameras
    }
    found: dict[str, list[PenDetection]] = {c.serial: [] for c in cameras}

    def look(
        image: Image,
        camera: Camera,
        pen: Pen,
        mask: object,
        before: PenDetection | None,
        full_scale: int,
        *,
        is_followed: bool,
    ) -> PenDetection:
        reported_before[camera.serial].append(before)
        found[camera.serial].append(unseen(pen, Reason.EMPTY))
        return found[camera.serial][-1]

    def has_several(detections: list[PenDetection]) -> bool:
        return len(detections) > 2

    monkeypatch.setattr("lightpen.live.pipeline.detect_pen", look)
    live = Live(simulated, SETTINGS, screen, station.runner)
    pen = station.preparation.pen
    for one, other in (cameras[:2], cameras[2:]):
        live.set_region(
            RegionOfInterest(one, pen, others=(RegionOfInterest(other, pen),))
        )
        if one is cameras[0]:
            live.start()
        screen.wait_until(partial(has_several, found[other.serial]))
    live.stop()

    for serial, detections in found.items():
        first, *rest = reported_before[serial]
        assert first is None
        assert all(a is b for a, b in zip(rest, detections[:-1], strict=True))


class HeldUpCamera(PunctualCamera):
    """Has a clock of its own; its first images are held up on their way."""

    @override
    def read(self, timeout_s: float) -> Frame:
        frame = super().read(timeout_s)
        assert frame.device_ts_ns is not None
        late_ns = HELD_UP_NS if self.stats().delivered <= N_HELD_UP else 0
        return replace(
            frame,
            host_ts_ns=frame.host_ts_ns + late_ns,
            device_ts_ns=frame.device_ts_ns + HOUR_NS,
        )


def test_images_held_up_at_first_are_reported_and_paired_rightly_afterwards(
    simulated: tuple[FaultyCamera, FaultyCamera], make_live: MakeLive, screen: Screen
) -> None:
    first, _ = simulated
    rig = beside(first.scene.camera, first.scene.cone_cam)
    second = HeldUpCamera(first.scene, MachineClock(), first.operator, rig=rig)
    make_live((first, second))
    screen.wait_until(lambda: bool(screen.faults))
    n_before = len(screen.moments())
    screen.wait_for_moments(4)

    said = re.search(r"(\d+) ms apart", screen.faults[0])
    assert said is not None
    assert 1_000_000 * int(said[1]) == HELD_UP_NS
    assert len(screen.faults) == 1
    for one, other in screen.moments()[n_before + 1 :]:
        assert one.frame.device_ts_ns is not None
        assert other.frame.device_ts_ns is not None
        apart_ns = other.frame.device_ts_ns - one.frame.device_ts_ns - HOUR_NS
        assert abs(apart_ns) < 1000


def test_a_lost_image_costs_its_moment_and_is_counted(
    simulated: tuple[FaultyCamera, FaultyCamera], make_live: MakeLive, screen: Screen
) -> None:
    live = make_live(simulated)
    screen.wait_for_moments(3)
    before = live.stats.unpaired
    simulated[1].stall(0.3)
    screen.wait_until(lambda: live.stats.unpaired >= before + 4)
    screen.wait_for_moments(3)
    live.stop()
    assert live.stats.delivered == sum(
        live.worker(camera).stats.delivered for camera in (0, 1)
    )


def test_two_recordings_of_other_moments_are_refused_once(
    make_live: MakeLive, screen: Screen, tmp_path: Path
) -> None:
    for name, n_images in (("one", 3), ("two", 4)):
        (tmp_path / name).mkdir()
        for i in range(n_images):
            image = encode_png(np.zeros((20, 30), np.uint8))
            (tmp_path / name / f"{i}.png").write_bytes(image)
    places = (str(tmp_path / name) for name in ("one", "two"))
    make_live([ReplayCamera(place, loops=True) for place in places])
    screen.wait_until(lambda: len(screen.failures) == 1)

    assert "The two recordings have different numbers of images." in screen.failures[0]


@pytest.fixture
def gige_pair(
    gige: GigeSimulator, second_loopback: str
) -> Iterator[tuple[GigeSimulator, GigeSimulator]]:
    """Two simulated cameras on the loopback."""
    second = GigeSimulator("LP02", second_loopback)
    for simulator, level in ((gige, 10), (second, 20)):
        image: Image = np.full((120, 160), level, np.uint8)
        simulator.serve(lambda exposure_us, gain, image=image: image)  # type: ignore[misc]
    yield gige, second
    second.unplug()


def gige_cameras() -> list[ImageCamera]:
    from lightpen_extensions.drivers.aravis import AravisDevice
    from lightpen_extensions.drivers.device_camera import DeviceCamera

    return [DeviceCamera(AravisDevice(each)) for each in (ADDRESS, SECOND_ADDRESS)]


@pytest.mark.slow
def test_two_cameras_are_still_paired_when_nothing_has_moved_for_long(
    gige_pair: tuple[GigeSimulator, GigeSimulator], make_live: MakeLive, screen: Screen
) -> None:
    make_live(gige_cameras())
    screen.wait_for_moments(1)
    began_ns = screen.shown_ns()[0]
    screen.wait_until(lambda: screen.shown_ns()[-1] - began_ns > LIVELY_NS)
    gige_pair[1].unplug()  # so that its rest ends at another time than the first's
    screen.wait_until(lambda: Connection.LOST in screen.connections[1])
    gige_pair[1].plug_in()
    screen.wait_until(lambda: screen.connections[1][-1] is Connection.STREAMING)
    screen.wait_for_moments(6)

    gaps = np.diff(screen.shown_ns()[-6:]) * 1e-9
    assert np.all(gaps > 0.9 * UNHURRIED)
    assert np.median(gaps) < 2 * UNHURRIED  # a busy machine may miss some moments


def period_ms(images: Sequence[LiveImage]) -> float:
    """Return the time from one image of a camera to the next."""
    taken_ns = np.array([image.frame.device_ts_ns for image in images], np.int64)
    seqs = np.array([image.frame.seq for image in images])
    return float(np.median(np.diff(taken_ns) / np.diff(seqs))) * 1e-6


@pytest.mark.slow
def test_two_gige_cameras_are_paired_and_each_comes_back_by_itself(
    gige_pair: tuple[GigeSimulator, GigeSimulator], make_live: MakeLive, screen: Screen
) -> None:
    live = make_live(gige_cameras())
    screen.wait_for_moments(12)
    for one, other in screen.moments():
        assert one.frame.image[0, 0] == 10
        assert other.frame.image[0, 0] == 20
    assert [live.worker(camera).serial for camera in (0, 1)] == ["LP01", "LP02"]
    # Nothing triggers them together; a busy machine knows the lag later.
    screen.wait_until(lambda: live.lag_ms is not None)
    assert abs(live.lag_ms or 0.0) <= 0.52 * period_ms(
        [one for one, _ in screen.moments()]
    )

    n_before = len(screen.images[0])
    gige_pair[1].unplug()
    screen.wait_until(lambda: Connection.LOST in screen.connections[1])
    assert Connection.LOST not in screen.connections[0]
    assert live.stats.unpaired > 0
    gige_pair[1].plug_in()
    screen.wait_for_moments(3)
    assert len(screen.images[0]) > n_before
