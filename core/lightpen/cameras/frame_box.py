"""How frames pass from the thread of a camera to those that use them."""

from collections import deque
from collections.abc import Callable
from threading import Condition, Lock

from lightpen.cameras.protocol import EndOfImages, Frame, FrameTimeout
from lightpen.sentences import sentence


class FrameBox:
    """Room for one frame: the newest wins, so a slow reader costs no memory."""

    def __init__(self) -> None:
        self._frame: Frame | None = None
        self._lock = Lock()

    def put(self, frame: Frame) -> bool:
        """Leave a frame; return whether the box was empty, so news for its reader."""
        with self._lock:
            was_empty = self._frame is None
            self._frame = frame
            return was_empty

    def take(self) -> Frame | None:
        """Return the frame in the box, which is empty then, or None."""
        with self._lock:
            frame, self._frame = self._frame, None
            return frame


class FrameQueue:
    """Room for ``n_frames`` frames, of which none gets lost inside."""

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
        """Append a frame, and return when it was taken.

        Nothing is made ahead of its reader, so one who answers an image sees what comes
        of it in the next but one.

        Parameters
        ----------
        is_wanted : callable
            Returns whether anybody takes frames; asked again after `clear`.
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

        Raises
        ------
        FrameTimeout
            None came in ``timeout_s``.
        EndOfImages
            None will come.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._frames or self._is_ended, timeout_s)
            if self._frames:
                frame = self._frames.popleft()
                self._changed.notify_all()
                return frame
            if self._is_ended:
                raise EndOfImages
            raise FrameTimeout(
                sentence(
                    "camera.no-image-came",
                    "No image came for {waited:.1f} s. Check the camera.",
                    waited=timeout_s,
                )
            )

    def clear(self) -> None:
        """Forget the frames that nobody took."""
        with self._changed:
            self._frames.clear()
            self._changed.notify_all()

    def end(self) -> None:
        """Let no more frames in; those inside can still be taken."""
        with self._changed:
            self._is_ended = True
            self._changed.notify_all()
