"""What can go wrong with a simulated camera."""

from dataclasses import dataclass, replace
from threading import Lock

from lightpen.cameras.clock import Clock


@dataclass(frozen=True)
class Broken:
    """What is wrong with a device.

    Attributes
    ----------
    busy_until, stalled_until : float
        By the clock, s.
    n_to_lose, n_to_spoil : int
        Images still to come.
    n_unplugged : int
        How often the cable was pulled.
    """

    busy_until: float = 0.0
    stalled_until: float = 0.0
    n_to_lose: int = 0
    n_to_spoil: int = 0
    is_unplugged: bool = False
    n_unplugged: int = 0


class Faults:
    """What goes wrong with a simulated camera, from any thread."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._broken = Broken()
        self._lock = Lock()

    def unplug(self) -> None:
        """Pull the cable."""
        with self._lock:
            n_unplugged = self._broken.n_unplugged + 1
            self._broken = replace(
                self._broken, is_unplugged=True, n_unplugged=n_unplugged
            )

    def plug_in(self) -> None:
        """Put the cable back; the camera must be opened again."""
        with self._lock:
            self._broken = replace(self._broken, is_unplugged=False)

    def stall(self, seconds: float) -> None:
        """Let no image come for a time, though the device answers."""
        with self._lock:
            until = self._clock.now_ns() * 1e-9 + seconds
            self._broken = replace(self._broken, stalled_until=until)

    def occupy(self, seconds: float) -> None:
        """Let another program have the device for a time."""
        with self._lock:
            until = self._clock.now_ns() * 1e-9 + seconds
            self._broken = replace(self._broken, busy_until=until)

    def lose_frames(self, n_frames: int) -> None:
        """Lose the next images on the way."""
        with self._lock:
            self._broken = replace(self._broken, n_to_lose=n_frames)

    def spoil_frames(self, n_frames: int) -> None:
        """Damage the next images on the way."""
        with self._lock:
            self._broken = replace(self._broken, n_to_spoil=n_frames)

    def now(self) -> Broken:
        """Return what is wrong at present."""
        return self._broken

    def take_lost(self) -> int:
        """Return how many images are to be lost now, once."""
        with self._lock:
            n_lost = self._broken.n_to_lose
            self._broken = replace(self._broken, n_to_lose=0)
            return n_lost

    def take_spoilt(self) -> bool:
        """Return whether this image is to be damaged."""
        with self._lock:
            n_left = self._broken.n_to_spoil
            self._broken = replace(self._broken, n_to_spoil=max(n_left - 1, 0))
            return n_left > 0
