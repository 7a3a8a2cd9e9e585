"""Pair simultaneous frames of two cameras and estimate their time offset.

Cameras with clocks are paired by these. Where the clocks do not agree, each is set by
the frame that reached this machine fastest: all others were held up on the way. Nothing
is paired before a few frames were no faster; what was paired wrongly all the same, as
every frame so far was held up, is reported as soon as one is not.
Recordings are paired by the numbers of their images.
"""

import time
from collections import deque
from dataclasses import replace
from statistics import median
from threading import Event
from typing import Protocol

import numpy as np

from lightpen.cameras.protocol import Frame
from lightpen.messages import Message, message

WAITING = 6  # frames of one camera that wait for the other
LONGEST_WAITING = 16  # while the clocks are not known
WINDOW = 64  # frames by which rates are estimated
CLOCK_WINDOW = 256  # frames to estimate clock offsets, which drift by less than 1 ms
SETTLED = 6  # frames after which a clock is known, if none was much faster
CLOCK_SET_NS = 1_000_000_000  # jump of a clock that is set manually
SAME_CLOCK_NS = 50_000_000  # apart at most; clocks of two cameras are hours apart
MUCH_FASTER = 0.25  # of the time between two frames
NEAR = 0.6  # of the time between two frames; more than half, as times jitter
MIN_TIMED, N_TIMED = 8, 32  # moments for the median lag
LEAST_LAG_MS = 1.0  # a pen moves 0.1 mm meanwhile
PEN_SPEED = 100.0  # mm/s


class FramePairs:
    """Pairs the frames of two cameras; each delivers in order."""

    def __init__(self) -> None:
        self._waiting: tuple[deque[Frame], deque[Frame]] = (deque(), deque())
        self._times = (_Times(), _Times())
        self._lags_ns: deque[float] = deque(maxlen=N_TIMED)
        self._offsets_ns: deque[int] = deque(maxlen=WINDOW)  # of the last pairs
        self._n_unpaired = 0
        self._moved_ns = 0

    @property
    def n_unpaired(self) -> int:
        """Frames that found no partner."""
        return self._n_unpaired

    @property
    def lag_ms(self) -> float | None:
        """Lag of the second camera; None until it is known.

        At most half a frame period: beyond that, a frame pairs with the next one.
        """
        if len(self._lags_ns) < MIN_TIMED:
            return None
        return float(np.median(self._lags_ns)) * 1e-6

    @property
    def wanted(self) -> int:
        """The camera whose next frame is needed."""
        first, second = self._waiting
        return int(len(first) > len(second))

    def note(self, c: int, frame: Frame) -> None:
        """Use the times of a frame of camera 0 or 1 without pairing it."""
        own, other = self._times[c], self._times[1 - c]
        own.note(frame)
        if other.last is None or not self._is_settled:
            return
        period_ns = self._period_ns
        if period_ns is None:
            return
        first, second = (frame, other.last) if c == 0 else (other.last, frame)
        apart_ns = self._apart_ns(first, second)
        self._lags_ns.append((apart_ns + period_ns / 2) % period_ns - period_ns / 2)

    def add(self, c: int, frame: Frame) -> None:
        """Add a frame of camera 0 or 1."""
        self.note(c, frame)
        self._waiting[c].append(frame)

    def next_frame(self, n_images: int | None = None) -> Frame | None:
        """Return the first camera's frame with the other's; None without a pair.

        ``n_images`` is the length of two recordings that are repeated.
        """
        is_known = n_images is not None or self._is_settled
        first, second = self._waiting
        while is_known and first and second:
            apart = self._apart(first[0], second[0], n_images)
            if apart is None:  # not known yet
                break
            if abs(apart) <= NEAR:
                self._check_offset()
                return replace(first.popleft(), others=(second.popleft(),))
            self._drop(0 if apart > 0 else 1)
        for c, own in enumerate(self._waiting):
            while len(own) > (WAITING if is_known else LONGEST_WAITING):
                self._drop(c)
        return None

    def moved_ms(self) -> float | None:
        """Return, once, the error of the clock offset of the last pairs.

        None where it is less than half the time between two frames.
        """
        moved_ns, self._moved_ns = self._moved_ns, 0
        return moved_ns * 1e-6 if moved_ns else None

    def forget(self) -> None:
        """Discard waiting frames without counting them."""
        for each in self._waiting:
            each.clear()
        self._offsets_ns.clear()

    @property
    def _period_ns(self) -> float | None:
        """Time between two frames of the faster camera; None until it is known."""
        known = [each.period_ns for each in self._times if each.period_ns is not None]
        return min(known, default=None)

    @property
    def _is_settled(self) -> bool:
        """Whether the clocks of both cameras are known."""
        return all(each.is_settled for each in self._times)

    @property
    def _offset_ns(self) -> int:
        """Clock offset to add to times of the second camera; 0 for a common clock."""
        one, other = self._times
        if not one.has_clock or not other.has_clock:
            return 0
        offset_ns = other.offset_ns - one.offset_ns
        return offset_ns if abs(offset_ns) >= SAME_CLOCK_NS else 0

    def _check_offset(self) -> None:
        """Record that the clock offset changed after the last pairs."""
        offset_ns, period_ns = self._offset_ns, self._period_ns
        moved_ns = abs(offset_ns - self._offsets_ns[0]) if self._offsets_ns else 0
        if period_ns is not None and moved_ns > period_ns / 2:
            self._offsets_ns.clear()
            self._lags_ns.clear()
            if moved_ns < CLOCK_SET_NS:
                self._moved_ns = moved_ns
        self._offsets_ns.append(offset_ns)

    def _drop(self, c: int) -> None:
        self._waiting[c].popleft()
        self._n_unpaired += 1

    def _apart(self, first: Frame, second: Frame, n_images: int | None) -> float | None:
        """Return the lag of the second frame, in frame periods."""
        if n_images is not None:
            half = n_images // 2
            return float((second.seq - first.seq + half) % n_images - half)
        period_ns = self._period_ns
        return None if period_ns is None else self._apart_ns(first, second) / period_ns

    def _apart_ns(self, first: Frame, second: Frame) -> float:
        if first.device_ts_ns is None or second.device_ts_ns is None:
            return float(second.host_ts_ns - first.host_ts_ns)
        return float(second.device_ts_ns - first.device_ts_ns + self._offset_ns)


class _Times:
    """Exposure and arrival times of the frames of one camera."""

    def __init__(self) -> None:
        self.last: Frame | None = None
        self._offsets_ns: deque[int] = deque(maxlen=CLOCK_WINDOW)
        self._gaps_ns: deque[float] = deque(maxlen=WINDOW)
        self._n_no_faster = 0

    @property
    def has_clock(self) -> bool:
        """Whether frames have device timestamps."""
        return bool(self._offsets_ns)

    @property
    def offset_ns(self) -> int:
        """Upper bound of this machine's clock minus the camera's."""
        return min(self._offsets_ns)

    @property
    def is_settled(self) -> bool:
        """Whether the estimate of the clock offset has settled."""
        has_no_clock = self.last is not None and self.last.device_ts_ns is None
        return has_no_clock or self._n_no_faster >= SETTLED

    @property
    def period_ns(self) -> float | None:
        """Time between two frames; None until it is known."""
        return median(self._gaps_ns) if self._gaps_ns else None

    def note(self, frame: Frame) -> None:
        """Add the times of a frame."""
        last, self.last = self.last, frame
        if last is not None and _is_set(last, frame):  # as after a power failure
            self._offsets_ns.clear()
            self._n_no_faster = 0
        if frame.device_ts_ns is not None:
            self._note_offset(frame.host_ts_ns - frame.device_ts_ns)
        if last is None or frame.seq <= last.seq:
            return
        gap = _time_ns(frame) - _time_ns(last)
        if gap > 0:  # else it was set back
            self._gaps_ns.append(gap / (frame.seq - last.seq))

    def _note_offset(self, offset_ns: int) -> None:
        period_ns = self.period_ns
        is_faster = (
            not self._offsets_ns
            or period_ns is None
            or self.offset_ns - offset_ns > MUCH_FASTER * period_ns
        )
        if not self.is_settled:
            self._n_no_faster = 0 if is_faster else self._n_no_faster + 1
        self._offsets_ns.append(offset_ns)


def _is_set(last: Frame, frame: Frame) -> bool:
    """Return whether the camera clock was reset between two frames."""
    if last.device_ts_ns is None or frame.device_ts_ns is None:
        return False
    by_camera = frame.device_ts_ns - last.device_ts_ns
    by_machine = frame.host_ts_ns - last.host_ts_ns
    return by_camera < 0 or abs(by_camera - by_machine) > CLOCK_SET_NS


def _time_ns(frame: Frame) -> int:
    return frame.host_ts_ns if frame.device_ts_ns is None else frame.device_ts_ns


def held_up(moved_ms: float) -> Message:
    """Return the message of pairs that were not simultaneous."""
    return message("pairing.held-up", moved=moved_ms)


def not_synchronised(lag_ms: float | None, px_per_mm: float | None) -> Message | None:
    """Return the message of a lag that matters at the pen's speed, or None.

    The scale at the pen, px/mm, may be unknown.
    """
    if lag_ms is None or abs(lag_ms) < LEAST_LAG_MS:
        return None
    way = abs(lag_ms) * PEN_SPEED / 1000
    if px_per_mm is None:
        return message("pairing.late", lag=abs(lag_ms), way=way)
    return message("pairing.late-in-px", lag=abs(lag_ms), way=way, px=way * px_per_mm)


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
