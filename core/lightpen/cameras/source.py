"""A source of images, and the region of its frames."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto
from threading import Condition, Lock

from lightpen.cameras.pairing import Clock
from lightpen.cameras.protocol import EndOfImages, Frame, FrameTimeout, ImageCamera
from lightpen.messages import Message


class SourceNeeds(Enum):
    """Parameters that a source needs."""

    CHOICE = auto()  # no source is chosen yet
    NOTHING = auto()
    FILES = auto()  # a folder, a pattern, a video or a record
    DEVICE = auto()  # a camera, by its serial number or address
    DEVICE_AND_PRODUCER = auto()  # and a GenTL producer, unless the system names one


@dataclass(frozen=True)
class SourcePlace:
    """Location of the images of a source."""

    name: str  # folder, pattern or video; or serial number or address of a camera
    producer: str = ""  # file of GenTL; empty for those that the system names


@dataclass(frozen=True)
class FoundDevice:
    """A camera that was found."""

    place: str  # serial number or another identifier
    label: str  # vendor, model and serial number


@dataclass(frozen=True)
class Source:
    """A kind of camera."""

    key: str  # identifies it in settings and records; must not change
    name: Message
    needs: SourceNeeds
    # Returns a camera that is not open; None for the simulator, which needs its scene.
    camera: Callable[[SourcePlace, Clock], ImageCamera] | None = None
    # Returns the cameras that are there, given the file of a producer or nothing. Takes
    # seconds; not to be called while one of them streams. Raises `CameraFailure`.
    find: Callable[[str], tuple[FoundDevice, ...]] = lambda producer: ()
    # Returns what must be installed first, or None.
    why_absent: Callable[[], Message | None] = lambda: None


class FrameBox:
    """Holds the newest frame only."""

    def __init__(self) -> None:
        self._frame: Frame | None = None
        self._lock = Lock()

    def put(self, frame: Frame) -> bool:
        """Put a frame; return whether the box was empty."""
        with self._lock:
            was_empty = self._frame is None
            self._frame = frame
            return was_empty

    def take(self) -> Frame | None:
        """Take the frame out of the box; None if it is empty."""
        with self._lock:
            frame, self._frame = self._frame, None
            return frame


class FrameQueue:
    """A queue of at most ``n_frames`` frames."""

    def __init__(self, n_frames: int) -> None:
        if n_frames < 1:
            raise ValueError(f"`n_frames` must be at least 1, got {n_frames}.")
        self._n_frames = n_frames
        self._frames: deque[Frame] = deque()
        self._changed = Condition()
        self._is_ended = False

    def offer(self, frame: Frame) -> bool:
        """Append a frame if there is room; return whether there was."""
        with self._changed:
            if len(self._frames) >= self._n_frames or self._is_ended:
                return False
            self._frames.append(frame)
            self._changed.notify_all()
            return True

    def hand_over(self, frame: Frame, is_wanted: Callable[[], bool]) -> None:
        """Append a frame and wait until it is taken, or no longer wanted after `clear`.

        No frame is made ahead of its reader, so a response to an image shows in the
        next but one.
        """
        with self._changed:
            if self._is_ended:
                return
            self._frames.append(frame)
            self._changed.notify_all()
            self._changed.wait_for(
                lambda: not self._frames or self._is_ended or not is_wanted()
            )

    def take(self, timeout_s: float) -> Frame:
        """Return the oldest frame.

        Raises `FrameTimeout` without one within ``timeout_s``, and `EndOfImages` after
        the last.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._frames or self._is_ended, timeout_s)
            if self._frames:
                frame = self._frames.popleft()
                self._changed.notify_all()
                return frame
            if self._is_ended:
                raise EndOfImages
            raise FrameTimeout("camera.no-image-came", waited=timeout_s)

    def clear(self) -> None:
        """Discard the queued frames."""
        with self._changed:
            self._frames.clear()
            self._changed.notify_all()

    def end(self) -> None:
        """Accept no more frames; queued ones can still be taken."""
        with self._changed:
            self._is_ended = True
            self._changed.notify_all()
