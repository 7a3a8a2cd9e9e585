"""Detection of the board in images, with reasons for failures."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice

import numpy as np

from lightpen.arrays import FloatArray, Image
from lightpen.errors import CalibrationError, FileError
from lightpen.formats.images import ImageSource, look_at_all
from lightpen.formats.pairing import NONE, Pairing
from lightpen.messages import Message, message, printable
from lightpen_extensions.boards.boards import Board, BoardKind
from lightpen_extensions.boards.sightings import count_corners, find_points, for_search
from lightpen_extensions.boards.views import Views

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
            if points is not None:
                pixels[moment, c] = points
        c, i = seen_by[0]
        names.append(sources[c].names[i])
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
        return (for_search(load()) for load in islice(source.open(), EXAMINED))

    return why_unseen(images, board) or message(
        "intrinsics.unseen", n_images=len(source.names), board=board.name
    )


def _is_found(images: Iterable[Image], board: Board) -> bool:
    return any(find_points(image, board) is not None for image in images)
