"""The form of a camera calibration, and the images that it captures."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from hashlib import sha256

from PySide6.QtCore import QCoreApplication, QObject, Signal
from PySide6.QtWidgets import QWidget
from typing_extensions import override

from lightpen.arrays import FloatArray, Image
from lightpen.cameras.protocol import Frame
from lightpen.messages import Message
from lightpen_app.look.languages import worded
from lightpen_app.look.layouts import grid_layout
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import GRID, Tone
from lightpen_app.widgets.fields import (
    ChoiceField,
    Translated,
    add_labelled,
    field_label,
)
from lightpen_app.widgets.number_field import NumberField
from lightpen_app.widgets.state_banner import StatusMessage
from lightpen_app.work.job import LatestJob, Report
from lightpen_extensions.boards.boards import (
    MAX_LENGTH,
    MAX_SIDE,
    MIN_SIDE,
    Board,
    BoardKind,
    parse_board,
)
from lightpen_extensions.boards.observing import BoardVisibility, Capture, why_unseen
from lightpen_extensions.boards.sightings import find_points
from lightpen_extensions.boards.wanted_views import wanted_outline

DICTIONARIES = (
    "DICT_4X4_50",
    "DICT_4X4_100",
    "DICT_4X4_250",
    "DICT_5X5_50",
    "DICT_5X5_100",
    "DICT_5X5_250",
    "DICT_6X6_50",
    "DICT_6X6_100",
    "DICT_6X6_250",
    "DICT_7X7_50",
    "DICT_7X7_100",
    "DICT_ARUCO_ORIGINAL",
    "DICT_APRILTAG_36h11",
)
USUAL = {
    kind: parse_board(f"{kind}:{form}")
    for kind, form in (
        (BoardKind.CHESSBOARD, "11x8:20"),
        (BoardKind.CHARUCO, "12x9:20:15:DICT_5X5_100"),
        (BoardKind.CIRCLES, "9x7:20:10"),
        (BoardKind.ASYMMETRIC_CIRCLES, "4x11:20:10"),
    )
}
# Row and column of kind, dictionary, columns, rows, pitch and detail: most boards have
# no dictionary and no detail.
PLACES = (0, 0), (2, 1), (1, 0), (1, 1), (0, 1), (2, 0)


class BoardForm(Translated, QWidget):
    """Kind, columns, rows and lengths of a board."""

    changed = Signal()  # the board in the fields has changed

    def __init__(self) -> None:
        super().__init__()

        # Widgets
        self._kind = ChoiceField()
        for kind in BoardKind:
            self._kind.addItem("", kind)
        self._columns, self._rows = (
            NumberField("", (MIN_SIDE, MAX_SIDE), 0) for _ in range(2)
        )
        self._pitch = NumberField("mm", (0.0, MAX_LENGTH), 3)
        self._detail = NumberField("mm", (0.0, MAX_LENGTH), 3)
        self._dictionary = ChoiceField()
        self._dictionary.addItems(DICTIONARIES)
        for choice in (self._kind, self._dictionary):  # narrower than their words
            choice.setSizeAdjustPolicy(
                ChoiceField.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon
            )
            choice.setMinimumContentsLength(8)
        fields = (
            self._kind,
            self._dictionary,
            self._columns,
            self._rows,
            self._pitch,
            self._detail,
        )
        self._labels = [field_label(field) for field in fields]

        # Layout
        layout = grid_layout(self, spacing=(GRID, GRID))
        for label, widget, place in zip(self._labels, fields, PLACES, strict=True):
            add_labelled(layout, label, widget, at=place)
        layout.setColumnStretch(0, 1)
        layout.setColumnStretch(1, 1)

        # Connections
        self._kind.activated.connect(self._on_kind_chosen)
        self._dictionary.activated.connect(self._on_changed)
        for number in (self._columns, self._rows, self._pitch, self._detail):
            number.textEdited.connect(self._on_changed)
            number.value_changed.connect(self._on_changed)

        self.set_board(USUAL[BoardKind.CHESSBOARD])
        self._refresh()

    def board(self) -> Board:
        """Return the board of the fields, or raise `UsageError`."""
        kind = BoardKind(self._kind.currentData())
        entered = Board(
            kind=kind,
            columns=round(self._columns.value()),
            rows=round(self._rows.value()),
            pitch=self._pitch.value(),
            detail=0.0 if kind is BoardKind.CHESSBOARD else self._detail.value(),
            dictionary=self._dictionary.currentText() if kind.has_markers else "",
        )
        return parse_board(entered.name)

    def set_board(self, board: Board) -> None:
        """Show another board."""
        fields = (self._columns, self._rows, self._pitch, self._detail)
        for each in fields:
            each.blockSignals(True)
        self._kind.setCurrentIndex(self._kind.findData(board.kind))
        self._columns.set_value(board.columns)
        self._rows.set_value(board.rows)
        self._pitch.set_value(board.pitch)
        self._detail.set_value(board.detail)
        for each in fields:
            each.blockSignals(False)
        if board.dictionary:
            if self._dictionary.findText(board.dictionary) < 0:
                self._dictionary.addItem(board.dictionary)
            self._dictionary.setCurrentText(board.dictionary)
        self._on_changed()

    def _on_kind_chosen(self) -> None:
        kind = BoardKind(self._kind.currentData())
        self.set_board(USUAL[kind])

    def _on_changed(self) -> None:
        self._refresh()
        self.changed.emit()

    @override
    def _refresh(self) -> None:
        kind = BoardKind(self._kind.currentData())
        names = {
            BoardKind.CHESSBOARD: self.tr("Chessboard"),
            BoardKind.CHARUCO: "ChArUco",
            BoardKind.CIRCLES: self.tr("Circles"),
            BoardKind.ASYMMETRIC_CIRCLES: self.tr("Asymmetric circles"),
        }
        for i in range(self._kind.count()):
            self._kind.setItemText(i, names[BoardKind(self._kind.itemData(i))])
        is_chessboard = kind is BoardKind.CHESSBOARD
        pitch, detail = self.tr("Square"), self.tr("Marker")
        if kind.is_circles:
            pitch, detail = self.tr("Distance"), self.tr("Diameter")
        words = (
            self.tr("Board"),
            self.tr("Dictionary"),
            self.tr("Corners per row") if is_chessboard else self.tr("Columns"),
            self.tr("Corners per column") if is_chessboard else self.tr("Rows"),
            pitch,
            detail,
        )
        for label, text in zip(self._labels, words, strict=True):
            label.setText(text)
            buddy = label.buddy()
            assert buddy is not None
            buddy.setAccessibleName(text)
        for label, is_used in (
            (self._labels[1], kind.has_markers),
            (self._labels[5], not is_chessboard),
        ):
            label.setVisible(is_used)
            label.buddy().setVisible(is_used)


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

    def process_frame(self, frame: Frame) -> None:
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
