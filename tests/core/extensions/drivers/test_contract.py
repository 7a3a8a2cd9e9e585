"""What every source of images promises, tried on each of them.

The real libraries run, each with what it has to stand for a camera.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Event

import cv2
import numpy as np
import pytest
from tests.core.extensions.drivers.images import TIMEOUT, whole_image

from lightpen.cameras.pairing import MachineClock
from lightpen.cameras.protocol import (
    CameraSettings,
    ConfigError,
    Connection,
    ConnectionChanged,
    FrameTimeout,
    ImageCamera,
    Region,
    TriggerMode,
    WorkerEvent,
)
from lightpen.cameras.replay import ReplayCamera
from lightpen.cameras.source import SourcePlace
from lightpen.cameras.sources import source_named
from lightpen.cameras.worker import CameraWorker
from lightpen.formats.decoding import encode_png
from lightpen.model.camera import Camera
from lightpen_extensions.simulator.camera import SimulatedCamera, SkippingClock
from lightpen_extensions.simulator.scenes import Scene

SMALL = Camera(width=306, height=256, fx=580, fy=580, cx=152, cy=129)
N_RECORDED = 12
HUGE = Region(0, 0, 10**6, 10**6)


@dataclass(frozen=True)
class Source:
    """A source of images under test, and how to make one of it."""

    name: str
    make: Callable[[Path, pytest.FixtureRequest], ImageCamera]


def simulated(_: Path, __: object) -> ImageCamera:
    return SimulatedCamera(Scene(camera=SMALL))


def simulated_without_waiting(_: Path, __: object) -> ImageCamera:
    return SimulatedCamera(Scene(camera=SMALL), SkippingClock())


def replayed_folder(folder: Path, _: object) -> ImageCamera:
    for i in range(N_RECORDED):
        image = np.full((SMALL.height, SMALL.width), i, np.uint8)
        (folder / f"frame_{i}.png").write_bytes(encode_png(image))
    return ReplayCamera(str(folder), frame_rate=200)


def replayed_video(folder: Path, _: object) -> ImageCamera:
    path = folder / "swing.avi"
    fourcc = cv2.VideoWriter.fourcc(*"MJPG")
    video = cv2.VideoWriter(str(path), fourcc, 20, (SMALL.width, SMALL.height))
    for i in range(N_RECORDED):
        video.write(np.full((SMALL.height, SMALL.width, 3), 20 * i, np.uint8))
    video.release()
    return ReplayCamera(str(path), frame_rate=200)


def of_stack(stack: str) -> Callable[[Path, pytest.FixtureRequest], ImageCamera]:
    """Return what makes a camera of a library by what stands for one there."""

    def make(_: Path, request: pytest.FixtureRequest) -> ImageCamera:
        place: SourcePlace = request.getfixturevalue(stack)
        source = source_named(stack)
        assert source is not None
        assert source.camera is not None
        return source.camera(place, MachineClock())

    return make


def webcam(folder: Path, request: pytest.FixtureRequest) -> ImageCamera:
    """OpenCV on a file in place of a webcam, which no test machine has."""
    # By its name alone: on Windows, OpenCV opens no path with letters of others.
    request.getfixturevalue("monkeypatch").chdir(folder)
    source = source_named("webcam")
    assert source is not None
    assert source.camera is not None
    replayed_folder(folder, request)
    return source.camera(SourcePlace("frame_%d.png"), MachineClock())


SOURCES = (
    Source("simulated", simulated),
    Source("simulated, without waiting", simulated_without_waiting),
    Source("replayed folder", replayed_folder),
    Source("replayed video", replayed_video),
    Source("Aravis", of_stack("aravis")),
    Source("Harvesters", of_stack("genicam")),
    Source("webcam", webcam),
)


@pytest.fixture(params=SOURCES, ids=lambda source: source.name)
def camera(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[ImageCamera]:
    source: Source = request.param
    camera = source.make(tmp_path, request)
    yield camera
    camera.close()


@pytest.fixture
def streaming(camera: ImageCamera) -> ImageCamera:
    camera.open()
    camera.start()
    return camera


def read_on(camera: ImageCamera, timeout_s: float) -> None:
    """Read more images than come at once, or on a beat of the camera right after."""
    for _ in range(20):
        whole_image(camera, timeout_s)


def test_opening_and_closing_twice_is_as_once(camera: ImageCamera) -> None:
    camera.close()
    camera.open()
    camera.open()
    camera.start()
    camera.close()
    camera.close()


def test_starting_and_stopping_twice_is_as_once(streaming: ImageCamera) -> None:
    streaming.start()
    whole_image(streaming)
    streaming.stop()
    streaming.stop()
    with pytest.raises(ValueError, match="start"):
        whole_image(streaming)


def test_a_closed_camera_refuses_to_work(camera: ImageCamera) -> None:
    for call in (camera.start, camera.probe, lambda: camera.caps):
        with pytest.raises(ValueError, match="open"):
            call()
    with pytest.raises(ValueError, match=r"open|start"):
        whole_image(camera)


def test_each_frame_is_memory_of_its_own_that_nobody_can_change(
    streaming: ImageCamera,
) -> None:
    one, other = whole_image(streaming), whole_image(streaming)

    assert not np.shares_memory(one.image, other.image)
    with pytest.raises(ValueError, match="read-only"):
        one.image[0, 0] = 1


def test_frames_are_as_the_camera_says(streaming: ImageCamera) -> None:
    caps, frame = streaming.caps, whole_image(streaming)

    assert frame.image.shape == (caps.height, caps.width)
    assert frame.pixel_format in caps.pixel_formats
    assert frame.image.itemsize == (1 if frame.bits == 8 else 2)
    assert (frame.exposure_us is not None) == (caps.exposure_us is not None)


def test_numbers_and_times_ascend_also_after_a_new_start(
    streaming: ImageCamera,
) -> None:
    frames = [whole_image(streaming) for _ in range(3)]
    streaming.close()
    streaming.open()
    streaming.start()
    frames += [whole_image(streaming) for _ in range(3)]

    assert (np.diff([frame.seq for frame in frames]) > 0).all()
    assert (np.diff([frame.host_ts_ns for frame in frames]) >= 0).all()


def test_every_frame_is_counted(streaming: ImageCamera) -> None:
    whole_image(streaming)
    before = streaming.stats()
    frames = [whole_image(streaming) for _ in range(4)]
    since = streaming.stats().since(before)

    assert since.delivered == 4
    assert since.incomplete == since.skipped == since.timeouts == 0
    assert since.missed >= frames[-1].seq - frames[0].seq - 3


def test_waiting_for_a_frame_ends_when_it_should_and_is_counted(
    camera: ImageCamera,
) -> None:
    camera.open()
    if camera.caps.frame_rate is None:
        pytest.skip("The rate of this camera cannot be set.")
    # A camera may end its image before it stops.
    camera.configure(CameraSettings(frame_rate=camera.caps.frame_rate.nearest(1.0)))
    camera.start()
    with pytest.raises(FrameTimeout, match=r"[A-Z].*\."):
        read_on(camera, 0.05)

    assert camera.stats().timeouts == 1


def test_the_answer_to_settings_is_what_is_in_force(camera: ImageCamera) -> None:
    camera.open()
    caps = camera.caps
    wanted = CameraSettings(
        exposure_us=caps.exposure_us.high if caps.exposure_us else None,
        gain_db=caps.gain_db.high if caps.gain_db else None,
        frame_rate=caps.frame_rate.nearest(50) if caps.frame_rate else None,
        pixel_format=caps.pixel_formats[-1],
    )
    applied = camera.configure(wanted)

    assert replace(applied, region=None, trigger=None, packet_size=None) == wanted
    assert camera.configure(CameraSettings()) == applied  # None leaves it
    camera.start()
    assert whole_image(camera).pixel_format == wanted.pixel_format


def test_settings_out_of_range_are_brought_into_it(camera: ImageCamera) -> None:
    camera.open()
    caps = camera.caps
    highest = camera.configure(CameraSettings(1e12, 1e12, 1e12))
    lowest = camera.configure(CameraSettings(-1e12, -1e12, -1e12))

    for name in ("exposure_us", "gain_db", "frame_rate"):
        offered = getattr(caps, name)
        if offered is None:
            assert getattr(highest, name) is None
        else:
            assert getattr(highest, name) == min(offered.high, 1e12)
            assert getattr(lowest, name) == offered.low


def test_the_region_gives_the_size_of_the_images(camera: ImageCamera) -> None:
    camera.open()
    regions = camera.caps.regions
    if regions is None:
        pytest.skip("This camera sends but the whole image.")
    wanted = regions.nearest(Region(16, 8, 301, 201))
    applied = camera.configure(CameraSettings(region=wanted, frame_rate=50))

    assert applied.region == wanted
    assert (camera.caps.width, camera.caps.height) == (wanted.width, wanted.height)
    camera.start()
    assert whole_image(camera).image.shape == (wanted.height, wanted.width)
    camera.stop()
    whole = camera.configure(CameraSettings(region=regions.nearest(HUGE))).region
    assert whole == regions.whole


def test_a_triggered_camera_sends_an_image_whenever_one_is_read(
    camera: ImageCamera,
) -> None:
    camera.open()
    if TriggerMode.SOFTWARE not in camera.caps.triggers:
        with_trigger = CameraSettings(trigger=TriggerMode.SOFTWARE)
        assert camera.configure(with_trigger).trigger is not TriggerMode.SOFTWARE
        return
    wanted = CameraSettings(trigger=TriggerMode.SOFTWARE, frame_rate=50)
    assert camera.configure(wanted).trigger is TriggerMode.SOFTWARE
    camera.start()
    frames = [whole_image(camera) for _ in range(4)]
    time.sleep(0.2)  # in which a camera that runs freely takes ten images
    frames.append(whole_image(camera))

    assert [frame.seq - frames[0].seq for frame in frames] == [0, 1, 2, 3, 4]
    camera.stop()
    free = camera.configure(CameraSettings(trigger=TriggerMode.FREE))
    assert free.trigger is TriggerMode.FREE
    camera.start()
    whole_image(camera)


def test_a_pixel_format_that_is_not_offered_is_refused(camera: ImageCamera) -> None:
    camera.open()
    with pytest.raises(ConfigError, match="Confidence8"):
        camera.configure(CameraSettings(pixel_format="Confidence8"))


def test_exposure_changes_while_images_come_or_is_refused(
    streaming: ImageCamera,
) -> None:
    whole_image(streaming)
    if streaming.caps.exposure_us is None:
        with pytest.raises(ConfigError, match="exposure"):
            streaming.set_exposure(500)
        return
    applied = streaming.set_exposure(500)

    limit = time.monotonic() + TIMEOUT
    while whole_image(streaming).exposure_us != applied:
        assert time.monotonic() < limit
    assert streaming.set_exposure(1e12) == streaming.caps.exposure_us.high


def test_gain_changes_while_images_come_or_is_refused(streaming: ImageCamera) -> None:
    if streaming.caps.gain_db is None:
        with pytest.raises(ConfigError, match="gain"):
            streaming.set_gain(6)
        return
    assert streaming.set_gain(1e12) == streaming.caps.gain_db.high
    whole_image(streaming)


def test_a_sound_camera_answers_the_probe(streaming: ImageCamera) -> None:
    streaming.probe()
    whole_image(streaming)
    streaming.probe()


def test_a_worker_runs_the_camera_and_closes_it(camera: ImageCamera) -> None:
    events: list[WorkerEvent] = []
    closed = Event()

    def note(event: WorkerEvent) -> None:
        events.append(event)
        if event == ConnectionChanged(Connection.CLOSED):
            closed.set()

    worker = CameraWorker(camera, CameraSettings(), note)
    worker.measure(True)
    worker.start()
    frames = [worker.next_frame(TIMEOUT) for _ in range(5)]
    worker.stop()

    assert closed.is_set()
    assert (np.diff([frame.seq for frame in frames]) > 0).all()
    with pytest.raises(ValueError, match="open"):
        camera.probe()
