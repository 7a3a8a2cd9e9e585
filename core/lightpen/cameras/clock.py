"""Clocks of image sources: the machine's, or one that skips every wait."""

import time
from threading import Event, Lock
from typing import Protocol


class Clock(Protocol):
    """A clock that can also wait."""

    @property
    def is_real(self) -> bool:
        """Whether time passes without waiting."""

    def now_ns(self) -> int:
        """Return a monotonic time, ns."""

    def wait(self, seconds: float, wake: Event | None = None) -> bool:
        """Wait, or until ``wake`` is set; return whether it is.

        A time that is over, `seconds` below zero, is not waited for.
        """


class MachineClock:
    """The monotonic clock of the machine."""

    is_real = True

    def now_ns(self) -> int:
        """Return the monotonic time, ns."""
        return time.monotonic_ns()

    def wait(self, seconds: float, wake: Event | None = None) -> bool:
        """Wait, or until ``wake`` is set; return whether it is."""
        if wake is not None:
            return wake.wait(seconds)
        time.sleep(max(seconds, 0.0))
        return False


class SkippingClock:
    """A clock that advances only by waiting, at once.

    With it a simulated hour takes as long as its images take to make, and the same
    calls give the same images. If it ``rests``, a wait that can be interrupted takes
    real time, so that a camera without a reader does not occupy the processor.
    """

    is_real = False

    def __init__(self, *, rests: bool = False) -> None:
        self._rests = rests
        self._now_ns = 0
        self._lock = Lock()

    def now_ns(self) -> int:
        """Return the sum of all waits, ns."""
        return self._now_ns

    def wait(self, seconds: float, wake: Event | None = None) -> bool:
        """Advance by ``seconds`` unless ``wake`` is set; return whether it is."""
        if wake is not None and wake.wait(max(seconds, 0.0) if self._rests else 0.0):
            return True
        with self._lock:
            self._now_ns += round(max(seconds, 0.0) * 1e9)
        return False
