"""Aravis on the loopback: what goes wrong with a camera, and is mended.

The simulated camera is Aravis' own, over UDP; only the images in it are ours.
"""

import signal
import socket
import struct
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event, Thread

import numpy as np
import pytest
from tests.core.extensions.drivers.images import TIMEOUT, whole_image
from tests.gige_simulator import ADDRESS, GigeSimulator

from lightpen.arrays import Image
from lightpen.cameras.protocol import (
    CameraSettings,
    Connection,
    ConnectionChanged,
    DeviceBusy,
    DeviceLost,
    DeviceNotFound,
    Failed,
    FaultRaised,
    FrameIncomplete,
    Region,
    WorkerEvent,
)
from lightpen.cameras.worker import CameraWorker
from lightpen_extensions.drivers.aravis import AravisDevice
from lightpen_extensions.drivers.device_camera import DeviceCamera

RNG = np.random.default_rng(5)


def camera() -> DeviceCamera:
    return DeviceCamera(AravisDevice(ADDRESS))


@contextmanager
def packets_of_others(number: int) -> Iterator[None]:
    """Send packets like those of a camera's image to another port all the time."""
    image_packet = struct.pack(">HHBxxx", 0, number, 1) + bytes(40)
    is_over = Event()
    sending = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    taking = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    taking.bind((ADDRESS, 0))

    def send() -> None:
        while not is_over.wait(0.0005):
            for _ in range(20):
                sending.sendto(image_packet, taking.getsockname())

    with sending, taking:
        thread = Thread(target=send)
        thread.start()
        yield
        is_over.set()
        thread.join()


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


@pytest.mark.slow
def test_packets_of_others_are_not_taken_for_images_of_the_camera(
    gige: GigeSimulator,
) -> None:
    others_number = 65_450  # soon after which the simulated camera's own begin
    seen = AravisDevice(ADDRESS)
    first = []
    with packets_of_others(others_number):
        for _ in range(4):  # as not each start meets some
            seen.open()
            seen.features.set("Width", 160)
            seen.features.set("Height", 120)
            seen.start()
            first.append(seen.fetch(TIMEOUT))
            seen.stop()
            seen.close()

    assert all(image is not None and image.is_complete for image in first)
    assert max(image.number for image in first if image is not None) < others_number


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
    whole_image(seen)
    assert asked[-1] == exposures.high  # not what is left of 1e12 in 32 bits
    seen.set_exposure(2500.0)
    while whole_image(seen).exposure_us != 2500.0:
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
    n_delivered = worker.stats.delivered
    asleep.wait(1.0)  # in which three come where it rests as before
    assert worker.stats.delivered <= n_delivered + 1  # that was under way
    worker.set_rest(0.0)
    worker.measure(False)
    worker.measure(True)
    worker.next_frame(TIMEOUT)
    worker.next_frame(TIMEOUT)
    worker.stop()

    assert np.median(behind) <= 2  # a busy machine may hold up the one or other
    assert worker.stats.missed == 0
    assert worker.stats.delivered > n_delivered


def test_an_address_without_a_camera_is_reported(gige: GigeSimulator) -> None:
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
    assert lost.wait(TIMEOUT)
    gige.plug_in()
    assert back.wait(TIMEOUT)
    worker.measure(False)
    worker.measure(True)
    frame = worker.next_frame(TIMEOUT)
    while frame.exposure_us is None:
        frame = worker.next_frame(TIMEOUT)
    worker.stop()

    assert frame.image.shape == (region.height, region.width)
    assert frame.exposure_us == 777.0
    errors = [event.error for event in events if isinstance(event, FaultRaised)]
    assert isinstance(errors[0], DeviceLost)
    assert "no longer responds" in str(errors[0])


# What befalls the stream


def test_an_image_that_lost_packets_is_counted_and_never_seen(
    gige: GigeSimulator,
) -> None:
    scene: Image = RNG.integers(0, 256, (512, 512), np.uint8)
    gige.serve(lambda exposure_us, gain: scene)
    seen = camera()
    seen.open()
    seen.configure(CameraSettings(packet_size=1500, region=Region(0, 0, 512, 512)))
    gige.lose_packets(0.002)
    seen.start()
    first = last = None
    while seen.stats().delivered < 5 or seen.stats().incomplete < 5:
        try:
            frame = seen.read(TIMEOUT)
        except FrameIncomplete:
            continue
        np.testing.assert_array_equal(frame.image, scene)
        first = frame.seq if first is None else first
        last = frame.seq
    stats = seen.stats()
    seen.close()

    assert first is not None
    assert last is not None
    # Every number that the camera gave is accounted for.
    assert stats.delivered + stats.incomplete + stats.missed > last - first


class Server:
    """A simulated camera in a process of its own, to which something befalls."""

    def __init__(self) -> None:
        program = Path(__file__).parents[3] / "gige_simulator.py"
        self._words = [sys.executable, str(program), "LP02", ADDRESS]
        self.begin()

    def begin(self) -> None:
        self.process = subprocess.Popen(self._words, stdout=subprocess.PIPE, text=True)
        assert self.process.stdout is not None
        assert self.process.stdout.readline() == "there\n"

    def end(self) -> None:
        self.process.kill()
        self.process.communicate()


@pytest.fixture
def server(loopback: str) -> Iterator[Server]:
    server = Server()
    yield server
    server.end()


class Watched:
    """A worker, and what its camera went through."""

    def __init__(self) -> None:
        self.events: list[WorkerEvent] = []
        self._news = Event()
        settings = CameraSettings(region=Region(0, 0, 160, 120), frame_rate=20.0)
        device = DeviceCamera(AravisDevice(ADDRESS))
        self.worker = CameraWorker(device, settings, self._note)
        self.worker.measure(True)
        self.worker.start()
        self.worker.next_frame(TIMEOUT)

    @property
    def connections(self) -> list[Connection]:
        return [e.connection for e in self.events if isinstance(e, ConnectionChanged)]

    def await_connection(self, connection: Connection) -> None:
        """Wait until the camera is so."""
        while self.connections[-1] is not connection:
            assert self._news.wait(TIMEOUT)
            self._news.clear()

    def next_new_frame(self) -> None:
        self.worker.measure(False)
        self.worker.measure(True)
        self.worker.next_frame(TIMEOUT)

    def _note(self, event: WorkerEvent) -> None:
        self.events.append(event)
        self._news.set()


@pytest.fixture
def watched(server: Server) -> Iterator[Watched]:
    watched = Watched()
    yield watched
    watched.worker.stop()
    assert not any(isinstance(event, Failed) for event in watched.events)


def test_a_camera_that_hangs_for_a_moment_is_silent_and_goes_on(
    server: Server, watched: Watched
) -> None:
    server.process.send_signal(signal.SIGSTOP)
    watched.await_connection(Connection.SILENT)
    server.process.send_signal(signal.SIGCONT)
    watched.await_connection(Connection.STREAMING)
    watched.next_new_frame()

    assert Connection.LOST not in watched.connections


@pytest.mark.slow
def test_a_camera_that_hangs_for_long_is_lost_and_found_again(
    server: Server, watched: Watched
) -> None:
    server.process.send_signal(signal.SIGSTOP)
    watched.await_connection(Connection.LOST)
    server.process.send_signal(signal.SIGCONT)
    watched.await_connection(Connection.STREAMING)
    watched.next_new_frame()

    assert watched.connections.count(Connection.LOST) == 1


def test_a_second_program_does_not_disturb_the_images_of_the_first(
    gige: GigeSimulator,
) -> None:
    first, second = camera(), camera()
    first.open()
    first.configure(CameraSettings(region=Region(0, 0, 160, 120)))
    first.start()
    first.read(TIMEOUT)
    with pytest.raises(DeviceBusy):
        second.open()
    seqs = [first.read(TIMEOUT).seq for _ in range(5)]
    stats = first.stats()
    first.close()

    assert len(set(seqs)) == 5
    assert stats.incomplete == 0
