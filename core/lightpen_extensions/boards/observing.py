"""Detection of the board in images, with reasons for failures."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial
from itertools import islice

import numpy as np

from lightpen.arrays import BoolArray, FloatArray, Image
from lightpen.errors import CalibrationError, FileError
from lightpen.formats.images import ImageSource, look_at_all
from lightpen.formats.observation_files import NONE, Pairing
from lightpen.messages import Message, message, printable
from lightpen_extensions.boards.boards import Board, BoardKind
from lightpen_extensions.boards.sightings import count_corners, find_points

SAME = 0.002  # of the image's longer side: distance of the points, rms
COMMON = 0.8  # of the points of the view that shows fewer
SHOWN = 6  # names in a message


def listed_names(names: tuple[str, ...]) -> str:
    """Return the first names of views as text."""
    return ", ".join(names[:SHOWN]) + (" ..." if len(names) > SHOWN else "")


@dataclass(frozen=True, eq=False)
class Views:
    """The points of a board in V views of C cameras."""

    board: Board
    names: tuple[str, ...]  # one a view
    pixels: FloatArray  # (V, C, N, 2), px; NaN where a point was not seen
    image_sizes: tuple[tuple[int, int], ...]  # width and height, one a camera, px

    @property
    def n_views(self) -> int:
        """Number of views."""
        return len(self.names)

    @property
    def seen(self) -> BoolArray:
        """Mask of the visible points, (V, C, N)."""
        return np.asarray(np.isfinite(self.pixels).all(axis=-1))

    @property
    def found(self) -> BoolArray:
        """Which views each camera saw the board in, (V, C)."""
        return np.asarray(self.seen.any(axis=-1))

    def chosen(self, which: BoolArray) -> "Views":
        """Return some of the views."""
        names = np.array(self.names)[which].tolist()
        return Views(self.board, tuple(names), self.pixels[which], self.image_sizes)

    def of_camera(self, camera: int) -> "Views":
        """Return the views in which one camera saw the board."""
        own = Views(
            self.board,
            self.names,
            self.pixels[:, camera : camera + 1],
            (self.image_sizes[camera],),
        )
        return own.chosen(own.found[:, 0])


def without_duplicates(views: Views) -> tuple[Views, tuple[str, ...]]:
    """Return the views in which the board is somewhere else, and the others' names.

    What views of one place share (pixels, hang of the board, blur, shadows) is the same
    in all of them: more of them add no information on the camera.
    """
    kept: list[int] = []
    scale = SAME * np.array([max(size) for size in views.image_sizes])
    for v in range(views.n_views):
        others = views.pixels[kept]
        if not np.any(np.all(_apart(others, views.pixels[v]) <= scale, axis=-1)):
            kept.append(v)
    which = np.isin(np.arange(views.n_views), kept)
    return views.chosen(which), tuple(np.array(views.names)[~which].tolist())


def message_on_duplicates(n_views: int, names: tuple[str, ...]) -> Message:
    """Return the message on the named views that do not count; ``n_views`` do."""
    return message(
        "intrinsics.duplicates",
        n_duplicates=len(names),
        n_views=n_views,
        names=listed_names(names),
    )


def _apart(one: FloatArray, other: FloatArray) -> FloatArray:
    """Return the distances of detections (..., N, 2) of a board, px rms.

    Infinite where one of them sees much that the other does not, 0 of nothing.
    """
    squares = np.square(one - other).sum(axis=-1)
    n_common = np.isfinite(squares).sum(axis=-1)
    n_one, n_other = (np.isfinite(each[..., 0]).sum(axis=-1) for each in (one, other))
    means = np.nansum(squares, axis=-1) / np.maximum(n_common, 1)
    are_alike = (n_common > 0) & (n_common >= COMMON * np.minimum(n_one, n_other))
    is_nothing = (n_one == 0) & (n_other == 0)
    return np.where(is_nothing, 0.0, np.where(are_alike, np.sqrt(means), np.inf))


MEMORY_A_PIXEL = 5  # bytes: 16 bits, 8 bits, and copies
EXAMINED = 3  # images that are searched for another board
# Seen in a mirror they are others; a chessboard is the same.
TELLS_SIDES = (BoardKind.CHARUCO, BoardKind.ASYMMETRIC_CIRCLES)


@dataclass(frozen=True, eq=False)
class ObservedBoard:
    """Views of a board."""

    views: Views
    unseen: tuple[str, ...]  # images, or moments, without a detected board


@dataclass(frozen=True, eq=False)
class _Look:
    """Size of one image, and its points."""

    size: tuple[int, int]
    points: FloatArray | None


def observe_board(
    source: ImageSource, board: Board, report: Callable[[float], None]
) -> ObservedBoard:
    """Find a board in the images of one camera.

    Raises
    ------
    FileError
        An image cannot be read, or is of another size.
    CalibrationError
        None shows the board; the text says what they show instead, if that is known.
    """
    pairing = Pairing(np.arange(len(source.names))[:, None])
    return observe_board_of_rig([source], pairing, board, report)


def observe_board_of_rig(
    sources: Sequence[ImageSource],
    pairing: Pairing,
    board: Board,
    report: Callable[[float], None],
) -> ObservedBoard:
    """Detect a board in simultaneous images of several cameras, as `observe_board`."""
    n_images = sum(len(source.names) for source in sources)
    looks: list[list[_Look]] = []
    n_done = 0
    for source in sources:
        own: list[_Look] = []
        for seen in look_at_all(source, partial(_look, board=board), MEMORY_A_PIXEL):
            if own and seen.size != own[0].size:
                raise _other_size(source.names[0], own[0], source.names[len(own)], seen)
            own.append(seen)
            n_done += 1
            report(n_done / n_images)
        if all(look.points is None for look in own):
            raise CalibrationError(_why_unseen(source, board))
        looks.append(own)
    pixels = np.full((len(pairing.images), len(sources), board.n_points, 2), np.nan)
    names = []
    for moment, images in enumerate(pairing.images.tolist()):
        seen_by = [(c, i) for c, i in enumerate(images) if i != NONE]
        for c, i in seen_by:
            points = looks[c][i].points
            pixels[moment, c] = np.nan if points is None else points
        first, image = seen_by[0]
        names.append(sources[first].names[image])
    sizes = tuple(own[0].size for own in looks)
    views = Views(board, tuple(names), pixels, sizes)
    is_seen = np.any(views.found, axis=1)
    unseen = tuple(n for n, seen in zip(names, is_seen, strict=True) if not seen)
    return ObservedBoard(views.chosen(is_seen), unseen)


def why_unseen(images: Callable[[], Iterable[Image]], board: Board) -> Message | None:
    """Return why the board is not found in images; None if unknown.

    ``images`` gives them again, one at a time: they may be large.
    """
    mirrored = (image[:, ::-1].copy() for image in images())
    if board.kind in TELLS_SIDES and _is_found(mirrored, board):
        return message("intrinsics.mirrored", board=board.name)
    if board.kind is BoardKind.CHESSBOARD:  # whose orientation is arbitrary
        return _other_count(images(), board)
    across = replace(board, columns=board.rows, rows=board.columns)
    if across != board and _is_found(images(), across):
        return message("intrinsics.across", board=board.name, other=across.name)
    return None


def _other_count(images: Iterable[Image], board: Board) -> Message | None:
    """Return the message on a chessboard with another number of corners."""
    counts = [count for count in map(count_corners, images) if count is not None]
    stated = max(board.columns, board.rows), min(board.columns, board.rows)
    if not counts or max(counts) == stated:
        return None
    columns, rows = max(counts)
    return message(
        "intrinsics.other-count",
        columns=board.columns,
        rows=board.rows,
        seen_columns=columns,
        seen_rows=rows,
    )


def _look(load: Callable[[], Image], board: Board) -> _Look:
    image = load()
    return _Look((image.shape[1], image.shape[0]), find_points(image, board))


def _other_size(first_name: str, first: _Look, name: str, other: _Look) -> FileError:
    return FileError(
        "intrinsics.other-size",
        name=printable(name),
        width=other.size[0],
        height=other.size[1],
        first=printable(first_name),
        first_width=first.size[0],
        first_height=first.size[1],
    )


def _why_unseen(source: ImageSource, board: Board) -> Message:
    """Return why the board is not found."""

    def images() -> Iterator[Image]:
        return (load() for load in islice(source.open(), EXAMINED))

    return why_unseen(images, board) or message(
        "intrinsics.unseen", n_images=len(source.names), board=board.name
    )


def _is_found(images: Iterable[Image], board: Board) -> bool:
    return any(find_points(image, board) is not None for image in images)


STILL = 0.0015  # of the image's longer side, between detections, rms
STILL_TIME = 0.4  # s
NEW = 0.05  # of the image's longer side, from each captured view, rms
MAX_VIEWS = 60


class BoardVisibility(StrEnum):
    """Visibility of the board in the newest image."""

    UNSEEN = "unseen"
    MOVING = "moving"
    STILL = "still"
    KEPT = "kept"
    ALIKE = "alike"


@dataclass(frozen=True, eq=False)
class Capture:
    """Captured views, and the last detection of the board."""

    board: Board
    image_size: tuple[int, int]
    kept: tuple[FloatArray, ...] = ()  # each (N, 2), px
    # (N, 2), in the newest image; None where it is not seen.
    points: FloatArray | None = None
    still_since: float = 0.0  # s, on the clock of the images
    sight: BoardVisibility = BoardVisibility.UNSEEN

    def after(self, points: FloatArray | None, time_s: float) -> "Capture":
        """Return the capture after another image, which is added if still and new."""
        if points is None:
            return replace(self, points=None, sight=BoardVisibility.UNSEEN)
        longer = max(self.image_size)
        if self.points is None or _apart(self.points, points) > STILL * longer:
            moved = replace(self, points=points, still_since=time_s)
            return replace(moved, sight=BoardVisibility.MOVING)
        seen = replace(self, points=points)
        if any(_apart(each, points) < NEW * longer for each in self.kept):
            is_last = self.sight is BoardVisibility.KEPT
            return replace(
                seen, sight=BoardVisibility.KEPT if is_last else BoardVisibility.ALIKE
            )
        if time_s - self.still_since < STILL_TIME or len(self.kept) >= MAX_VIEWS:
            return replace(seen, sight=BoardVisibility.STILL)
        return replace(seen, kept=(*self.kept, points), sight=BoardVisibility.KEPT)

    @property
    def views(self) -> Views:
        """The captured views."""
        names = tuple(str(number) for number in range(1, len(self.kept) + 1))
        pixels = np.array(self.kept).reshape(-1, 1, self.board.n_points, 2)
        return Views(self.board, names, pixels, (self.image_size,))
