"""Every listener receives the newest pose, as 3D Slicer does by pyigtl's client."""

import socket
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
import pytest
from benchmarks.small_records import SMALL
from pyigtl import OpenIGTLinkClient, TransformMessage
from tests.simulated_centers import simulate_centers

from lightpen.arrays import FloatArray
from lightpen.cameras.protocol import Frame, sealed
from lightpen.detection.pen_detection import PenDetection
from lightpen.detection.pose import fit_poses
from lightpen.detection.reasons import Reason
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.formats.own_json import record_bytes
from lightpen.model.names import Origin
from lightpen.model.rigid import rig_of
from lightpen.record.calibrations import read_calibration
from lightpen.record.swings.header import Names
from lightpen_extensions.measure.probing.instruments import instrument_of_files
from lightpen_extensions.measure.tasks.probed_point import (
    ProbingFrame,
    StillFrames,
    measure_touches,
)
from lightpen_extensions.simulator.swings import (
    PAPER_CONE,
    PAPER_TIP,
    paper_camera,
    paper_pen,
)
from lightpen_extensions.stream.messages import StreamedTip, pose_messages, tip_metadata
from lightpen_extensions.stream.server import (
    LOOPBACK,
    MOST_CLIENTS,
    PoseStream,
    StreamError,
    StreamPlace,
    StreamStatus,
)

LONGEST = 60.0  # s until a test gives up
ANY = StreamPlace(port=0)
UPRIGHT = np.diag([1.0, -1.0, -1.0])
SIGMA = 0.05  # px
SENT = 4000  # bytes, more than two messages


class Statuses:
    """Hears how a stream is, and lets a test wait for it."""

    def __init__(self) -> None:
        self.reported: list[StreamStatus] = []
        self._changed = threading.Condition()

    def note(self, status: StreamStatus) -> None:
        with self._changed:
            self.reported.append(status)
            self._changed.notify_all()

    def wait_for_clients(self, n_clients: int) -> None:
        with self._changed:
            assert self._changed.wait_for(
                lambda: self.reported[-1].n_clients == n_clients, LONGEST
            )


@pytest.fixture(scope="module")
def instrument() -> Instrument:
    pen = replace(paper_pen(), led_sigma=0.002)
    return instrument_of_files(
        rig_of(paper_camera()), pen, PAPER_TIP, 0.01**2 * np.eye(3), SIGMA
    )


@pytest.fixture(scope="module")
def tip(instrument: Instrument) -> StreamedTip:
    return StreamedTip(Names(pen="光笔-04", tip="T-1"), instrument)


@pytest.fixture(scope="module")
def detection(instrument: Instrument) -> PenDetection:
    """A pen that stands upright in the cone."""
    t = PAPER_CONE - UPRIGHT @ PAPER_TIP
    pixels = simulate_centers(
        *(instrument.camera, instrument.pen, UPRIGHT[None], t[None]),
        *(SIGMA, np.random.default_rng(1)),
    )
    poses = fit_poses(instrument.camera, instrument.pen, pixels, UPRIGHT[None], t[None])
    return PenDetection(
        *(pixels[0], pixels[0], Reason.NONE, poses.rotations[0], poses.translations[0]),
        *(poses.covariances[0] / poses.sigma**2, poses.sigma),
    )


@pytest.fixture
def statuses() -> Statuses:
    return Statuses()


@pytest.fixture
def stream(statuses: Statuses, tip: StreamedTip) -> Iterator[PoseStream]:
    stream = PoseStream(on_change=statuses.note)
    stream.set_tip(tip)
    stream.open(ANY)
    yield stream
    stream.close()


@pytest.fixture
def client(stream: PoseStream, statuses: Statuses) -> Iterator[OpenIGTLinkClient]:
    client = OpenIGTLinkClient(LOOPBACK, port_of(stream))
    statuses.wait_for_clients(1)
    yield client
    client.stop()


def port_of(stream: PoseStream) -> int:
    assert stream.status.place is not None
    return stream.status.place.port


def frame(number: int = 0, age_s: float = 0.0) -> Frame:
    taken_ns = time.monotonic_ns() - round(age_s * 1e9)
    return Frame(sealed(np.zeros((2, 2), np.uint8)), number, taken_ns)


def received(client: OpenIGTLinkClient, name: str) -> TransformMessage:
    message = client.wait_for_message(name, timeout=LONGEST)
    assert isinstance(message, TransformMessage)
    return message


def covariance_in(message: TransformMessage) -> FloatArray:
    numbers = np.array([float(word) for word in message.metadata["Covariance"].split()])
    size = round(len(numbers) ** 0.5)
    return numbers.reshape(size, size)


def test_a_client_receives_the_pose_with_its_covariance(
    stream: PoseStream, client: OpenIGTLinkClient, detection: PenDetection
) -> None:
    stream.process_image(frame(7), detection)

    message = received(client, "PenToCamera")

    np.testing.assert_allclose(message.matrix[:3, :3], detection.rotation, atol=1e-6)
    # A transform is sent with 24 bits: 0.0001 mm at 2 m.
    np.testing.assert_allclose(message.matrix[:3, 3], detection.translation, atol=1e-4)
    sigma = max(detection.sigma, SIGMA)
    np.testing.assert_allclose(
        covariance_in(message), detection.cofactors * sigma**2, rtol=1e-7
    )
    assert message.metadata["CovarianceOrder"] == "rx ry rz x y z"
    assert message.metadata["Units"] == "mm rad"
    assert message.metadata["Image"] == "7"


def test_it_receives_the_tip_as_a_touch_would_measure_it(
    stream: PoseStream,
    client: OpenIGTLinkClient,
    detection: PenDetection,
    instrument: Instrument,
) -> None:
    pixels = detection.pixels[None]
    seen = ProbingFrame("", pixels, detection.rotation, detection.translation)
    (touch,) = measure_touches(instrument, [StillFrames((seen,))])

    stream.process_image(frame(), detection)
    message = received(client, "TipToCamera")

    np.testing.assert_allclose(message.matrix[:3, 3], touch.point_cam, atol=1e-4)
    np.testing.assert_allclose(
        covariance_in(message), touch.covariance(instrument), rtol=1e-7
    )


def test_a_name_that_is_not_ascii_arrives_escaped(
    stream: PoseStream, client: OpenIGTLinkClient, detection: PenDetection
) -> None:
    stream.process_image(frame(), detection)

    assert received(client, "TipToCamera").metadata["Pen"] == r"\u5149\u7b14-04"


def test_origin_verdict_due_date_and_status_of_the_tip_are_in_the_metadata(
    stream: PoseStream,
    client: OpenIGTLinkClient,
    detection: PenDetection,
    instrument: Instrument,
    tmp_path: Path,
) -> None:
    file = tmp_path / "tip.json"
    file.write_bytes(record_bytes(dict(SMALL)))
    calibration = replace(
        read_calibration(file), origin=Origin.SIMULATED, due=date(2027, 1, 31)
    )
    reported = tip_metadata(calibration)
    stream.set_tip(StreamedTip(Names(), instrument, reported))
    stream.process_image(frame(), detection)

    metadata = received(client, "TipToCamera").metadata
    assert metadata["Origin"] == "simulated"
    assert metadata["Verdict"] == "pass"
    assert metadata["Due"] == "2027-01-31"
    assert metadata["Status"] == "SIMULATED"


def test_without_a_tip_in_force_the_pose_goes_out_alone(
    stream: PoseStream, client: OpenIGTLinkClient, detection: PenDetection
) -> None:
    stream.set_tip(None)
    stream.process_image(frame(), detection)
    received(client, "PenToCamera")
    stream.process_image(frame(), detection)
    received(client, "PenToCamera")

    assert client.wait_for_message("TipToCamera", timeout=0) is None


def test_a_message_tells_when_its_image_was_taken(
    stream: PoseStream, client: OpenIGTLinkClient, detection: PenDetection
) -> None:
    before = time.time()
    stream.process_image(frame(age_s=100.0), detection)
    after = time.time()

    taken = received(client, "PenToCamera").timestamp
    assert before - 100.1 < taken < after - 99.9


def test_an_image_without_the_pen_sends_nothing(
    stream: PoseStream, client: OpenIGTLinkClient, detection: PenDetection
) -> None:
    stream.process_image(frame(1), replace(detection, reason=Reason.EMPTY))
    stream.process_image(frame(2), None)
    stream.process_image(frame(3), detection)

    assert received(client, "PenToCamera").metadata["Image"] == "3"


def test_an_unknown_covariance_is_left_out(detection: PenDetection) -> None:
    rough = replace(detection, cofactors=np.full((6, 6), np.nan))

    assert b"Covariance" in pose_messages(detection, None, 0, 0.0)
    assert b"Covariance" not in pose_messages(rough, None, 0, 0.0)


def test_a_client_that_stalls_holds_up_nobody_and_misses_poses(
    stream: PoseStream,
    statuses: Statuses,
    client: OpenIGTLinkClient,
    detection: PenDetection,
) -> None:
    with socket.socket() as stalled:
        stalled.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        stalled.connect((LOOPBACK, port_of(stream)))
        statuses.wait_for_clients(2)

        for number in range(100):  # more than lies between the two
            stream.process_image(frame(number), detection)
            assert received(client, "TipToCamera").metadata["Image"] == str(number)
        assert stream.status.n_slow == 1

        stalled.settimeout(LONGEST)
        heard = b""
        while b"Image99" not in heard[-SENT:]:  # the newest comes in the end
            heard += stalled.recv(2**20)
    assert b"Image50" not in heard
    statuses.wait_for_clients(1)


def test_what_a_client_says_is_passed_over(
    stream: PoseStream,
    statuses: Statuses,
    client: OpenIGTLinkClient,
    detection: PenDetection,
) -> None:
    with socket.create_connection((LOOPBACK, port_of(stream))) as rude:
        statuses.wait_for_clients(2)
        rude.sendall(b"GET / HTTP/1.1\r\n\r\n" * 1000)
        stream.process_image(frame(), detection)

        received(client, "PenToCamera")


def test_it_is_closed_until_it_is_opened_and_after_it_is_closed(
    detection: PenDetection,
) -> None:
    stream = PoseStream()
    assert stream.status == StreamStatus()
    stream.process_image(frame(), detection)  # of which nothing comes

    stream.open(ANY)
    place = LOOPBACK, port_of(stream)
    stream.close()

    assert stream.status == StreamStatus()
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(place)


def test_it_listens_on_the_loopback_by_default(stream: PoseStream) -> None:
    assert StreamPlace().address == LOOPBACK
    assert StreamPlace().is_local
    with socket.socket() as other:  # of the same port, elsewhere on this computer
        other.bind(("127.0.0.2", port_of(stream)))


def test_a_place_of_a_network_is_not_local() -> None:
    assert not StreamPlace("0.0.0.0").is_local
    assert not StreamPlace("hall-2").is_local
    assert StreamPlace("::1").is_local
    assert StreamPlace("localhost").is_local
    assert str(StreamPlace("::1", 5)) == "[::1]:5"


def test_a_taken_port_is_reported(stream: PoseStream) -> None:
    port = port_of(stream)

    with pytest.raises(StreamError, match=f"Port {port} is in use already"):
        PoseStream().open(StreamPlace(port=port))


def test_an_address_of_another_computer_is_reported() -> None:
    for address in ("192.0.2.1", "no such place"):
        with pytest.raises(StreamError, match="is not an address of this computer"):
            PoseStream().open(StreamPlace(address, 0))


def test_an_impossible_port_is_reported() -> None:
    with pytest.raises(StreamError, match="Choose a free port from 1024 to 65535"):
        PoseStream().open(StreamPlace(port=70_000))


def test_without_its_package_it_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(
        "lightpen_extensions.stream.server.find_spec", lambda name: None
    )

    with pytest.raises(StreamError, match=r"pip install \"lightpen\[stream\]\""):
        PoseStream().open(ANY)


def is_served(
    stream: PoseStream, client: socket.socket, detection: PenDetection
) -> bool:
    """Return whether a client receives poses, or was turned away."""
    client.settimeout(0.05)
    while True:
        stream.process_image(frame(), detection)
        with suppress(TimeoutError):
            return client.recv(1) != b""


def test_silent_clients_leave_their_places_to_others(
    stream: PoseStream,
    statuses: Statuses,
    detection: PenDetection,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with ExitStack() as stack:

        def connected() -> socket.socket:
            address = LOOPBACK, port_of(stream)
            return stack.enter_context(socket.create_connection(address))

        for _ in range(MOST_CLIENTS):
            connected()
        statuses.wait_for_clients(MOST_CLIENTS)
        assert not is_served(stream, connected(), detection)
        monkeypatch.setattr("lightpen_extensions.stream.server.IDLE_S", 0.1)
        time.sleep(0.15)
        assert any(is_served(stream, connected(), detection) for _ in range(5))


def test_a_client_that_takes_no_data_is_dropped(
    stream: PoseStream,
    statuses: Statuses,
    detection: PenDetection,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("lightpen_extensions.stream.server.IDLE_S", 0.2)
    with socket.socket() as stuck:
        stuck.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        stuck.connect((LOOPBACK, port_of(stream)))
        statuses.wait_for_clients(1)
        number = 0
        while stream.is_heard:  # until its buffers are full and it is dropped
            number += 1
            stream.process_image(frame(number), detection)
            time.sleep(0.001)
        statuses.wait_for_clients(0)
