"""A non-blocking OpenIGTLink server.

pyigtl's own server serves one client at a time and replaces the signal handlers of the
process, so only its messages are used. One thread serves all clients. A slow client
misses poses: each client is sent the newest pose once it has received the last one.
"""

import errno
import logging
import selectors
import socket
import time
from collections import deque
from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from importlib.util import find_spec
from ipaddress import ip_address
from threading import Lock, Thread

from lightpen.cameras.pairing import Clock, MachineClock
from lightpen.cameras.protocol import Frame
from lightpen.detection.pen_detection import PenDetection
from lightpen.errors import LightpenError
from lightpen.formats.files import strerror
from lightpen.messages import Message, message, printable
from lightpen_extensions.stream.messages import StreamedTip, pose_messages

LOOPBACK = "127.0.0.1"  # for programs of this computer only
PORT = 18944  # the default port of OpenIGTLink
NO_PORT = message("stream.no-port")
LAST_PORT = 65535
MOST_CLIENTS = 16
ON_THE_WAY = 16_384  # bytes; a slow client misses poses rather than get old ones
ROOM = 4096  # bytes; what clients send is ignored
RECENT = 40  # number of poses, the latest offered to a client
SLOW = 4  # of these missed, or more, by a client that counts as slow
IDLE_S = 20.0  # a client that takes no data for so long is dropped
# TCP keep-alive of the system, to detect clients with a cut connection.
_KEEPALIVE = {"TCP_KEEPIDLE": 10, "TCP_KEEPINTVL": 5, "TCP_KEEPCNT": 3}

_logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class StreamPlace:
    """Address and port of a stream."""

    address: str = LOOPBACK  # to listen on
    port: int = PORT  # 0: any free one

    @property
    def is_local(self) -> bool:
        """Whether only programs of this computer can connect."""
        try:
            return ip_address(self.address).is_loopback
        except ValueError:  # a name
            return self.address == "localhost"

    def __str__(self) -> str:
        host = f"[{self.address}]" if ":" in self.address else self.address
        return f"{host}:{self.port}"


@dataclass(frozen=True)
class StreamStatus:
    """State of a stream."""

    place: StreamPlace | None = None  # None while the stream is closed
    n_clients: int = 0
    n_slow: int = 0  # clients that miss at least a tenth of the poses


@dataclass(eq=False)
class _Client:
    """A connected client with its pending data."""

    connection: socket.socket
    rest: bytes = b""
    newest: bytes = b""
    active_s: float = field(default_factory=time.monotonic)  # it took or sent data
    waiting_s: float = field(default_factory=time.monotonic)  # since when data waits
    misses: deque[bool] = field(default_factory=lambda: deque(maxlen=RECENT))

    def offer(self, data: bytes) -> None:
        """Make data the next to be sent, in place of what waits unsent."""
        self.misses.append(bool(self.newest))
        if not self.is_waiting:
            self.waiting_s = time.monotonic()
        self.newest = data

    @property
    def is_slow(self) -> bool:
        """Whether it misses at least a tenth of the poses."""
        return sum(self.misses) >= SLOW

    @property
    def is_waiting(self) -> bool:
        """Whether data waits to be sent."""
        return bool(self.rest or self.newest)

    def is_stuck(self, now_s: float) -> bool:
        """Return whether data waits for a client that takes none."""
        since_s = max(self.waiting_s, self.active_s)
        return self.is_waiting and now_s - since_s > IDLE_S

    @property
    def awaited(self) -> int:
        """Selector events: also writing while data is pending."""
        writing = selectors.EVENT_WRITE if self.is_waiting else 0
        return selectors.EVENT_READ | writing


@dataclass(frozen=True, eq=False)
class _Seen:
    """A pose that waits to be sent."""

    detection: PenDetection
    number: int
    at: float  # s since 1970


class PoseStream:
    """Streams poses while it is open, timed by the clock of the camera.

    ``on_change`` is called with the new status, on the thread that changes it; it must
    return at once.
    """

    def __init__(
        self,
        clock: Clock | None = None,
        on_change: Callable[[StreamStatus], None] = lambda status: None,
    ) -> None:
        self._clock = clock or MachineClock()
        self._on_change = on_change
        self._status = StreamStatus()
        self._tip: StreamedTip | None = None
        self._newest: _Seen | None = None
        self._lock = Lock()
        self._waker: socket.socket | None = None
        self._thread: Thread | None = None

    @property
    def status(self) -> StreamStatus:
        """Address of the stream and number of clients."""
        return self._status

    @property
    def is_heard(self) -> bool:
        """Whether clients are connected."""
        return self._status.n_clients > 0

    def open(self, place: StreamPlace) -> None:
        """Listen at this address only; raise `StreamError` if it cannot be used."""
        self.close()
        if find_spec("pyigtl") is None:
            raise StreamError("stream.no-package")
        if not 0 <= place.port <= LAST_PORT:
            raise StreamError(_not_open(place, NO_PORT))
        try:
            listener = _listener(place)
        except OSError as error:
            raise StreamError(_why_not(place, error)) from error
        waker, woken = socket.socketpair()
        for each in (listener, waker, woken):
            each.setblocking(False)
        self._waker = waker
        bound = StreamPlace(place.address, listener.getsockname()[1])
        self._report(StreamStatus(bound))
        self._thread = Thread(
            target=self._serve, args=(listener, woken), name="stream", daemon=True
        )
        self._thread.start()

    def close(self) -> None:
        """Stop listening; no-op if closed."""
        waker, self._waker = self._waker, None
        thread, self._thread = self._thread, None
        if waker is not None and thread is not None:
            waker.close()  # which ends the thread
            thread.join()

    def set_tip(self, tip: StreamedTip | None) -> None:
        """Stream the position of another tip from the next image on."""
        self._tip = tip

    def process_image(self, frame: Frame, detection: PenDetection | None) -> None:
        """Stream a detection if it shows the pen; returns at once."""
        waker = self._waker
        if waker is None or not self.is_heard:
            return
        if detection is None or not detection.has_pose:
            return
        age_s = (self._clock.now_ns() - frame.host_ts_ns) * 1e-9
        with self._lock:
            self._newest = _Seen(detection, frame.seq, time.time() - age_s)
        with suppress(OSError):  # it is awake, or being closed
            waker.send(b"\0")

    def _serve(self, listener: socket.socket, woken: socket.socket) -> None:
        with ExitStack() as stack:
            stack.callback(self._report, StreamStatus())
            selector = stack.enter_context(selectors.DefaultSelector())
            stack.callback(_dismiss_all, selector)
            selector.register(listener, selectors.EVENT_READ)
            selector.register(woken, selectors.EVENT_READ)
            while True:
                for key, ready in selector.select(IDLE_S / 4):
                    if key.fileobj is woken:
                        if not woken.recv(ROOM):
                            return
                        self._hand_out(selector)
                    elif key.fileobj is listener:
                        _admit(listener, selector)
                    elif _is_dismissed(key.data):
                        continue  # for a newer client of this round
                    elif not _served(key.data, ready):
                        _dismiss(key.data, selector)
                now_s = time.monotonic()
                for client in _clients(selector):
                    if client.is_stuck(now_s):
                        _dismiss(client, selector)
                clients = _clients(selector)
                n_slow = sum(client.is_slow for client in clients)
                status = StreamStatus(self._status.place, len(clients), n_slow)
                if status != self._status:
                    self._report(status)
                for client in clients:
                    selector.modify(client.connection, client.awaited, client)

    def _hand_out(self, selector: selectors.BaseSelector) -> None:
        """Queue the newest pose for every client."""
        with self._lock:
            seen, self._newest = self._newest, None
        clients = _clients(selector)
        if seen is None or not clients:
            return
        sent = pose_messages(seen.detection, self._tip, seen.number, seen.at)
        for client in clients:
            client.offer(sent)

    def _report(self, status: StreamStatus) -> None:
        self._status = status
        _logger.info(
            "stream at %s, %d clients, %d slow",
            status.place,
            status.n_clients,
            status.n_slow,
        )
        self._on_change(status)


def _listener(place: StreamPlace) -> socket.socket:
    """Return a socket bound to this address only."""
    (family, _, _, _, address), *_ = socket.getaddrinfo(
        place.address, place.port, type=socket.SOCK_STREAM
    )
    return socket.create_server(address, family=family)


def _clients(selector: selectors.BaseSelector) -> list[_Client]:
    return [key.data for key in selector.get_map().values() if key.data is not None]


def _admit(listener: socket.socket, selector: selectors.BaseSelector) -> None:
    try:
        connection, _ = listener.accept()
    except OSError:  # it has gone already
        return
    if not _has_slot(selector):
        connection.close()
        return
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for name, value in _KEEPALIVE.items():
        with suppress(AttributeError, OSError):  # not on every system
            connection.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)
    connection.setblocking(False)
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, ON_THE_WAY)
    selector.register(connection, selectors.EVENT_READ, _Client(connection))


def _has_slot(selector: selectors.BaseSelector) -> bool:
    """Return whether a client can be admitted, in place of a silent one if need be."""
    clients = _clients(selector)
    if len(clients) < MOST_CLIENTS:
        return True
    oldest = min(clients, key=lambda client: client.active_s)
    if time.monotonic() - oldest.active_s <= IDLE_S:
        return False
    _dismiss(oldest, selector)
    return True


def _dismiss(client: _Client, selector: selectors.BaseSelector) -> None:
    selector.unregister(client.connection)
    client.connection.close()


def _is_dismissed(client: _Client) -> bool:
    return client.connection.fileno() < 0


def _dismiss_all(selector: selectors.BaseSelector) -> None:
    """Close whatever is still open."""
    for key in list(selector.get_map().values()):
        selector.unregister(key.fileobj)
        if isinstance(key.fileobj, socket.socket):
            key.fileobj.close()


def _served(client: _Client, ready: int) -> bool:
    """Send pending data to a client; return whether it is still connected."""
    try:
        if ready & selectors.EVENT_READ:
            if not client.connection.recv(ROOM):
                return False
            client.active_s = time.monotonic()
        if ready & selectors.EVENT_WRITE:
            if not client.rest:
                client.rest, client.newest = client.newest, b""
            client.rest = client.rest[client.connection.send(client.rest) :]
            client.active_s = time.monotonic()
    except BlockingIOError:
        return True
    except OSError:
        return False
    return True


def _why_not(place: StreamPlace, error: OSError) -> Message:
    if error.errno == errno.EADDRINUSE:
        return message("stream.port-taken", port=place.port)
    if error.errno == errno.EADDRNOTAVAIL or isinstance(error, socket.gaierror):
        return message(
            "stream.no-address", address=printable(place.address), loopback=LOOPBACK
        )
    return _not_open(place, strerror(error))


def _not_open(place: StreamPlace, reason: Message | str) -> Message:
    return message("stream.not-open", place=printable(str(place)), reason=reason)


class StreamError(LightpenError):
    """Poses cannot be streamed as requested."""
