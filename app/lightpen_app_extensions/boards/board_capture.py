"""Capture of board views from live images, with the next pose suggested."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from hashlib import sha256

from PySide6.QtCore import QCoreApplication, QObject, Signal

from lightpen.arrays import FloatArray, Image
from lightpen.cameras.protocol import Frame
from lightpen.messages import Message
from lightpen_app.look.sentences import worded
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import Tone
from lightpen_app.widgets.sign_label import StatusMessage
from lightpen_app.work.job import LatestJob, Report
from lightpen_extensions.boards.boards import Board
from lightpen_extensions.boards.capture import BoardVisibility, Capture
from lightpen_extensions.boards.observing import why_unseen
from lightpen_extensions.boards.sightings import find_points
from lightpen_extensions.boards.wanted_views import wanted_outline

LONGEST_UNSEEN = 3.0  # s, after which the cause is sought
NANOSECONDS = 1e9


@dataclass(frozen=True, eq=False)
class BoardLook:
    """Detection in one image, and the hash of its pixels if it shows the board."""

    points: FloatArray | None
    sha256: str = ""
    why_unseen: Message | None = None


@dataclass(frozen=True, eq=False)
class CaptureState:
    """State of the capture."""

    sought: Board | None = None  # board to detect; None while no views are captured
    capture: Capture | None = None  # None before the first image
    why_unseen: Message | None = None  # why it has not been seen for a while
    # When it was seen, or last asked why it is not, s on the clock of the images.
    seen_s: float = 0.0
    # SHA-256 of the views that were kept, by name.
    hashes: Mapping[str, str] = field(default_factory=dict)

    @property
    def n_kept(self) -> int:
        """Number of captured views."""
        return 0 if self.capture is None else len(self.capture.kept)

    @property
    def outline(self) -> FloatArray | None:
        """Where the board should be held next, (4, 2), px."""
        if self.capture is None or self.sought is None:
            return None
        return wanted_outline(self.sought, self.capture.image_size, self.n_kept)


class BoardCapture(QObject):
    """Detects a board in one image after another, off the GUI thread."""

    changed = Signal()  # `state` is different

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._state = CaptureState()
        self._searching = LatestJob(self)

    @property
    def state(self) -> CaptureState:
        """The present state."""
        return self._state

    @property
    def is_searching(self) -> bool:
        """Whether an image is being processed."""
        return self._searching.is_running

    def start(self, board: Board | None) -> None:
        """Restart, without views."""
        self._searching.cancel()
        self._become(CaptureState(board))

    def stop(self) -> None:
        """Stop capturing; captured views are kept."""
        self._become(replace(self._state, sought=None))

    def take(self, frame: Frame) -> None:
        """Process an image unless the previous one is still being processed."""
        state, time_s = self._state, frame.host_ts_ns / NANOSECONDS
        if state.sought is None or self._searching.is_running:
            return
        capture = state.capture
        if capture is None:
            height, width = frame.image.shape
            capture = Capture(state.sought, (width, height))
            state = replace(state, capture=capture, seen_s=time_s, why_unseen=None)
            self._state = state
        asks_why = time_s - state.seen_s >= LONGEST_UNSEEN
        if asks_why or capture.points is not None:
            self._state = replace(state, seen_s=time_s)
        look = partial(look_for_board, frame.image, capture.board, asks_why)
        self._searching.start(look, lambda seen: self._on_looked(seen, time_s))

    def _become(self, state: CaptureState) -> None:
        self._state = state
        self.changed.emit()

    def _on_looked(self, seen: BoardLook, time_s: float) -> None:
        state = self._state
        if state.capture is None or state.sought is None:
            return
        now = replace(state, capture=state.capture.after(seen.points, time_s))
        if seen.why_unseen is not None or seen.points is not None:
            now = replace(now, why_unseen=seen.why_unseen)
        if now.capture is not None and now.n_kept > state.n_kept:
            name = now.capture.views.names[-1]
            now = replace(now, hashes={**state.hashes, name: seen.sha256})
        self._become(now)


def look_for_board(
    image: Image, board: Board, asks_why: bool, report: Report
) -> BoardLook:
    """Return the detection of a board in an image, and the reason of a failure."""
    points = find_points(image, board, quick=True)
    if points is None:
        return BoardLook(
            None, why_unseen=why_unseen(lambda: [image], board) if asks_why else None
        )
    return BoardLook(points, sha256(image.tobytes()).hexdigest())


def sight_text(sight: BoardVisibility) -> str:
    """Return the detection of the board, and an instruction."""
    translate = QCoreApplication.translate
    words = {
        BoardVisibility.UNSEEN: translate("BoardWindow", "Board not detected"),
        BoardVisibility.MOVING: translate("BoardWindow", "Hold still."),
        BoardVisibility.STILL: translate("BoardWindow", "Hold still."),
        BoardVisibility.KEPT: translate(
            "BoardWindow", "View captured. Align the board with the outline."
        ),
        BoardVisibility.ALIKE: translate(
            "BoardWindow",
            "Similar view already captured. Align the board with the outline.",
        ),
    }
    return words[sight]


def sight_message(state: CaptureState) -> StatusMessage | None:
    """Return the message on the last image; None while no views are captured."""
    if state.sought is None:
        return None
    if state.why_unseen is not None:
        return fault_message(state.why_unseen)
    if state.capture is None:
        return None
    return StatusMessage(sight_text(state.capture.sight), Sign.WAIT, Tone.QUIET)


def fault_message(message: Message) -> StatusMessage:
    """Return a message marked as a fault."""
    return StatusMessage.fault(worded(message))
