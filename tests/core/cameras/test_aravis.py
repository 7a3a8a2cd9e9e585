"""Aravis on the loopback: what goes wrong with a camera, and is mended.

The simulated camera is Aravis' own, over UDP; only the images in it are ours.
"""

import time
from threading import Event

import numpy as np
import pytest
from tests.gige_simulator import ADDRESS, GigeSimulator

from lightpen.arrays import Image
from lightpen.cameras.aravis import AravisDevice
from lightpen.cameras.device_camera import DeviceCamera
from lightpen.cameras.protocol import (
    CameraSettings,
    DeviceBusy,
    DeviceLost,
    DeviceNotFound,
    Region,
)
from lightpen.cameras.worker import (
    CameraWorker,
    Connection,
    ConnectionChanged,
    Troubled,
    WorkerEvent,
)

TIMEOUT = 20.0  # s until a test gives up
RNG = np.random.default_rng(5)


def camera() -> DeviceCamera:
    return DeviceCamera(AravisDevice(ADDRESS))


@pytest.mark.parametrize(
    ("pixel_format", "kind", "highest"),
    [("Mono8", "u1", 255), ("Mono16", "<u2", 65535)],
)
def test_images_come_as_they_were_sent(
    gige: GigeSimulator, pixel_format: str, kind: str, highest: int
) -> None:
    scene: Image = RNG.integers(0, highest + 1, (120, 160)).astype(kind)
    gige.serve(lambda exposure_us, gain: scene)
    seen = camera()
    seen.open()
    seen.configure(
        CameraSettings(pixel_format=pixel_format, region=Region(0, 0, 160, 120))
    )
    seen.start()
    frame = seen.read(TIMEOUT)
    seen.close()

    np.testing.assert_array_equal(frame.image, scene)
    assert frame.full_scale == highest
    assert seen.serial == "LP01"  # though it was looked for by its address


def test_the_exposure_reaches_the_camera(gige: GigeSimulator) -> None:
    asked: list[float] = []

    def scene(exposure_us: float, gain: int) -> Image:
        asked.append(exposure_us)
        return np.zeros((512, 512), np.uint8)

    gige.serve(scene)
    seen = camera()
    seen.open()
    seen.configure(CameraSettings(exposure_us=1e12))
    exposures = seen.caps.exposure_us
    assert exposures is not None
    seen.start()
    seen.read(TIMEOUT)
    assert asked[-1] == exposures.high  # not what is left of 1e12 in 32 bits
    seen.set_exposure(2500.0)
    while seen.read(TIMEOUT).exposure_us != 2500.0:
        pass
    seen.close()

    assert asked[-1] == 2500


def test_images_after_a_rest_are_new_and_none_is_missed(gige: GigeSimulator) -> None:
    sent = 0

    def scene(exposure_us: float, gain: int) -> Image:
        nonlocal sent
        sent += 1
        return np.full((100, 200), sent % 256, np.uint8)

    gige.serve(scene)
    asleep = Event()
    settings = CameraSettings(region=Region(0, 0, 200, 100))
    worker = CameraWorker(camera(), settings, lambda event: None)
    worker.measure(True)
    worker.set_rest(0.3)
    worker.start()
    behind = []
    for _ in range(6):
        image = worker.next_frame(TIMEOUT).image
        behind.append((sent - int(image[0, 0])) % 256)
    worker.set_rest(None)
    asleep.wait(0.5)  # an image may be under way
    n_delivered = worker.stats.delivered
    asleep.wait(0.5)
    assert worker.stats.delivered == n_delivered
    worker.set_rest(0.0)
    worker.measure(False)
    worker.measure(True)
    worker.next_frame(TIMEOUT)
    worker.next_frame(TIMEOUT)
    worker.stop()

    assert max(behind) <= 2
    assert worker.stats.missed == 0
    assert worker.stats.delivered > n_delivered


def test_a_camera_that_another_program_controls_is_busy(gige: GigeSimulator) -> None:
    first, second = camera(), camera()
    first.open()
    with pytest.raises(DeviceBusy, match="Another program"):
        second.open()
    first.close()


def test_an_address_without_a_camera_is_told(gige: GigeSimulator) -> None:
    gige.unplug()
    with pytest.raises(DeviceNotFound, match=r"no camera 127\.0\.0\.1 \(.*address"):
        camera().open()


def test_a_camera_that_is_unplugged_comes_back_with_its_settings(
    gige: GigeSimulator,
) -> None:
    events: list[WorkerEvent] = []
    lost, back = Event(), Event()

    def note(event: WorkerEvent) -> None:
        events.append(event)
        if event == ConnectionChanged(Connection.LOST):
            lost.set()
        if lost.is_set() and event == ConnectionChanged(Connection.STREAMING):
            back.set()

    region = Region(8, 4, 200, 100)
    worker = CameraWorker(camera(), CameraSettings(region=region), note)
    worker.measure(True)
    worker.start()
    worker.next_frame(TIMEOUT)
    worker.set_exposure(777.0)
    worker.next_frame(TIMEOUT)
    gige.unplug()
    unplugged = time.monotonic()
    assert lost.wait(TIMEOUT)
    told = time.monotonic() - unplugged
    gige.plug_in()
    assert back.wait(TIMEOUT)
    worker.measure(False)
    worker.measure(True)
    frame = worker.next_frame(TIMEOUT)
    while frame.exposure_us is None:
        frame = worker.next_frame(TIMEOUT)
    worker.stop()

    assert told < 7  # what the people at a station are promised
    assert frame.image.shape == (region.height, region.width)
    assert frame.exposure_us == 777.0
    errors = [event.error for event in events if isinstance(event, Troubled)]
    assert isinstance(errors[0], DeviceLost)
    assert "no longer answers" in str(errors[0])
