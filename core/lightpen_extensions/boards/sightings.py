"""Detection of the points of a board in one image.

OpenCV finds the board [1]_, in a reduced image first if there is one. Corners are then
located by the gradients around them in the original image at its full bit depth [2]_,
and by a fit of the brightness, circles by their edges, like LEDs.

References
----------
.. [1] A. Duda, U. Frese, "Accurate detection and localization of checkerboard corners
   for calibration", BMVC 2018; S. Garrido-Jurado et al., "Automatic generation and
   detection of highly reliable fiducial markers under occlusion", Pattern Recognition
   47 (2014) 2280-2292.
.. [2] W. Forstner, E. Gulch, "A fast operator for detection and precise location of
   distinct points, corners and centres of circular features", ISPRS 1987.
"""

from contextlib import nullcontext
from functools import partial
from itertools import product
from threading import Lock
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from lightpen.arrays import FloatArray, Image
from lightpen.detection.edge_fit import EdgeStarts, fit_edges
from lightpen_extensions.boards.boards import Board, BoardKind, marker_dictionary
from lightpen_extensions.boards.corner_fit import fit_corners

SEEN_IN = 0.2  # of a square to each side of its middle
TELLING = 0.1  # of the most contrast of two squares
NEARLY_ALL = 0.8  # of the squares beside each other
PARTS = (5, 4), (3, 3)  # of a chessboard, that grow
SEARCHED = 1280  # px, of the longer side of the image that is searched first
SEARCHED_SMALL = 640  # px; without the noise that misleads some searches
SEARCHED_WHOLE = 2_600_000  # px; in larger images a board is found smaller, or not
MARKED_WHOLE = 12_000_000  # px; in larger images markers are searched smaller
ENLARGED = 1_300_000  # px; in smaller images markers may be too small to be read
REFINED = 0.4  # of the distance of neighbours: no other edge is that near
MIN_REFINED, MAX_REFINED = 2, 11  # px to each side
LEAST_FITTED = 3  # px: smaller corners have too few pixels for their edges
RIDGE = 1e-9
REFINING = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 60, 1e-4)
FEWEST = 6  # points that determine a pose and identify a board
UNEVEN = 0.5  # of a step, by which the next may differ; tilt and lens make up to 0.2
SPREAD = 0.3  # of a square: least standard deviation across
SPOT_SPREAD = 0.25  # of the distance of neighbours, standard deviation of a circle
OFF_SPOT = 0.35  # of the distance of neighbours: a rim farther off is another's
QUICK = (
    cv2.CALIB_CB_ADAPTIVE_THRESH
    | cv2.CALIB_CB_NORMALIZE_IMAGE
    | cv2.CALIB_CB_FAST_CHECK
)
THOROUGH = cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_EXHAUSTIVE
# Each search finds some boards that the others miss.
WAYS = (THOROUGH, THOROUGH | cv2.CALIB_CB_ACCURACY, 0)
_THOROUGHLY = Lock()  # one at a time, as each takes some 200 MB
EVENED = 0.1  # of the longer side: what is darker over more than that is uneven light


def find_points(
    image: Image, board: Board, *, quick: bool = False
) -> FloatArray | None:
    """Return the points of a board, (N, 2), px; None if the board is not found.

    They are in the order of `Board.points`, NaN where one is not seen; of circles the
    centres of their ellipses. ``quick`` leaves out what takes long, where a next image
    comes at once.
    """
    grey = _to_8_bit(image)
    if board.kind.is_circles:
        return _circles(image, grey, board, quick=quick)
    if board.kind.has_markers:
        points = _marked(grey, board, quick=quick)
    else:
        points = _chessboard(grey, (board.columns, board.rows), quick=quick)
        if points is not None:
            points = _numbered(grey, _from_front(points, board), board)
    if points is None or not _is_spread(points, board):
        return None
    refined = _refined(image, points, board)
    return refined if _is_spread(refined, board) else None


def _is_spread(points: FloatArray, board: Board) -> bool:
    """Return whether the points seen fix a pose: enough, not all but one in one row."""
    seen = board.points[np.isfinite(points[:, 0]), :2]
    n_seen = len(seen)
    if n_seen < FEWEST:
        return False
    away = seen - seen.mean(axis=0)
    of_each = n_seen / (n_seen - 1) * away[:, :, None] * away[:, None, :]
    without = away.T @ away - of_each  # as the scatter is about their own mean
    across = np.sqrt(np.maximum(np.linalg.eigvalsh(without)[:, 0].min(), 0.0))
    return bool(across > SPREAD * board.pitch * np.sqrt(n_seen))


def _from_front(points: FloatArray, board: Board) -> FloatArray:
    """Return the points numbered as seen from the front, not mirrored."""
    rows = np.arange(board.n_points).reshape(board.rows, board.columns)
    corners = points[rows[[0, 0, -1, -1], [0, -1, -1, 0]]]
    x, y = (corners - corners.mean(axis=0)).T
    turns = float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
    if turns >= 0:
        return points
    is_set_off = board.kind is BoardKind.ASYMMETRIC_CIRCLES
    return points[(rows[::-1] if is_set_off else rows[:, ::-1]).ravel()]


def _numbered(
    grey: npt.NDArray[np.uint8], points: FloatArray, board: Board
) -> FloatArray:
    """Return corners numbered from the end of the board with a dark first square.

    The ways of searching begin at either end; where both ends look the same, as one
    of them had it.
    """
    if (board.columns + board.rows) % 2 == 0:
        return points
    shade = _samples(grey, points.reshape(board.rows, board.columns, 2)).mean(axis=0)
    is_first_dark = np.sum(_turns(shade) * (shade - shade.mean())) < 0
    return points if is_first_dark else points[::-1]


def count_corners(image: Image) -> tuple[int, int] | None:
    """Return the inner corners along both sides of a chessboard, the larger first.

    None without one, or where the image may cut it.
    """
    grey = _to_8_bit(image)
    flags = THOROUGH | cv2.CALIB_CB_LARGER
    sizes = sorted({min(side, max(grey.shape)) for side in (SEARCHED_SMALL, SEARCHED)})
    for longer, corners in product(sizes, PARTS):
        small, _ = _smaller(grey, longer)
        found, points, meta = cv2.findChessboardCornersSBWithMeta(small, corners, flags)
        if found and _is_board(small, points, meta.shape[::-1]):
            grid = points.reshape(*meta.shape[:2], 2)
            sides = map(partial(np.rot90, grid), range(4))
            rim = np.concatenate([2 * side[0] - side[1] for side in sides])
            is_whole = np.all((rim > 0) & (rim < np.array(small.shape[::-1])))
            fewer, more = sorted(meta.shape[:2])
            return (more, fewer) if is_whole else None
    return None


def _to_8_bit(image: Image) -> npt.NDArray[np.uint8]:
    if image.dtype == np.uint8:
        return np.asarray(image, dtype=np.uint8)
    brightest = max(float(image.max()), 1.0)
    return np.asarray(image * (255 / brightest), dtype=np.uint8)


def _smaller(
    grey: npt.NDArray[np.uint8], longer_side: float = SEARCHED
) -> tuple[Any, float]:
    """Return an image to be searched, and its scale."""
    scale = min(1.0, longer_side / max(grey.shape))
    if scale == 1.0:
        return grey, scale
    small = cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    return small, scale


def _whole(points: Any, scale: float) -> FloatArray:
    """Return points of a smaller image in the whole one."""
    found = np.asarray(points, dtype=np.float64).reshape(-1, 2)
    return (found + 0.5) / scale - 0.5


def _chessboard(
    grey: npt.NDArray[np.uint8], corners: tuple[int, int], *, quick: bool
) -> FloatArray | None:
    plain, exact = cv2.findChessboardCorners, cv2.findChessboardCornersSB
    ways: list[tuple[Any, int, int]] = [(plain, SEARCHED, QUICK)]
    if not quick:
        ways += [(exact, SEARCHED, flags) for flags in WAYS]
        if max(grey.shape) <= SEARCHED or grey.size > SEARCHED_WHOLE:
            ways.append((plain, SEARCHED_SMALL, QUICK & ~cv2.CALIB_CB_FAST_CHECK))
        else:
            ways.append((exact, max(grey.shape), THOROUGH))
    for search, longer, flags in ways:
        small, scale = _smaller(grey, longer)
        with _THOROUGHLY if search is exact else nullcontext():
            found, points = search(small, corners, flags=flags)
        if found and _is_board(small, points, corners):
            return _whole(points, scale)
    return None


def _is_board(
    grey: npt.NDArray[np.uint8], points: Any, corners: tuple[int, int]
) -> bool:
    """Return whether corners belong to one board."""
    columns, rows = corners
    grid = np.asarray(points, dtype=np.float64).reshape(rows, columns, 2)
    return _is_even(grid) and is_chequered(grey, grid)


def _is_even(grid: FloatArray) -> bool:
    """Return whether rows and columns are evenly spaced."""
    for along in (grid, np.swapaxes(grid, 0, 1)):
        steps = np.diff(along, axis=1)
        bends = np.linalg.norm(np.diff(steps, axis=1), axis=-1)
        lengths = np.linalg.norm(steps, axis=-1)
        if np.any(bends > UNEVEN * np.minimum(lengths[:, 1:], lengths[:, :-1])):
            return False
    return True


def _marked(
    grey: npt.NDArray[np.uint8], board: Board, *, quick: bool
) -> FloatArray | None:
    small, scale = _smaller(grey, max(grey.shape) * (MARKED_WHOLE / grey.size) ** 0.5)
    points = _by_markers(small, board)
    if scale < 1.0:
        return None if points is None else _whole(points, scale)
    n_seen = 0 if points is None else int(np.isfinite(points[:, 0]).sum())
    if quick or n_seen == board.n_points or grey.size > ENLARGED:
        return points
    larger = cv2.resize(grey, None, fx=2, fy=2, interpolation=cv2.INTER_CUBIC)
    again = _by_markers(np.asarray(larger, dtype=np.uint8), board)
    if again is None or int(np.isfinite(again[:, 0]).sum()) <= n_seen:
        return points
    return _whole(again, 2.0)


def _by_markers(grey: npt.NDArray[np.uint8], board: Board) -> FloatArray | None:
    size = (board.columns, board.rows)
    charuco = cv2.aruco.CharucoBoard(
        size, board.pitch, board.detail, marker_dictionary(board)
    )
    parameters = cv2.aruco.DetectorParameters()
    parameters.detectInvertedMarker = True  # of a board in white on black
    detector = cv2.aruco.CharucoDetector(charuco, detectorParams=parameters)
    found, numbers, *_ = detector.detectBoard(grey)
    if numbers is None or found is None:
        return None
    points = np.full((board.n_points, 2), np.nan)
    points[numbers.ravel()] = np.asarray(found).reshape(-1, 2)
    return points


def _refined(image: Image, points: FloatArray, board: Board) -> FloatArray:
    """Return corners placed by the gradients round them."""
    reach = REFINED * _least_distance(points, board)
    if board.kind.has_markers:
        to_marker = 0.5 * (1 - board.detail / board.pitch)
        reach = min(reach, reach * to_marker / REFINED)
    half = int(np.clip(round(reach), MIN_REFINED, MAX_REFINED))
    height, width = image.shape
    inside = np.isfinite(points[:, 0])
    inside[inside] = (points[inside] > half + 1).all(axis=1) & (
        points[inside] < np.array([width, height]) - half - 2
    ).all(axis=1)
    refined = np.full_like(points, np.nan)
    if not inside.any():
        return refined
    start = points[inside].astype(np.float32)[:, None]
    moved = cv2.cornerSubPix(
        image if image.dtype == np.uint8 else image.astype(np.float32),
        start.copy(),
        (half, half),
        (-1, -1),
        REFINING,
    )
    corners = moved[:, 0].astype(np.float64)
    if half > LEAST_FITTED:
        edges = _edges_at(corners, board.points[inside, :2] / board.pitch)
        corners = fit_corners(image, corners, edges, half)
    refined[inside] = corners
    return refined


def _edges_at(points: FloatArray, on_board: FloatArray) -> FloatArray:
    """Return the directions of the board's x and y, (N, 2, 2), by the points around."""
    apart = np.square(on_board[:, None] - on_board).sum(axis=-1)
    weights = np.exp(-0.5 * apart)[:, None]
    board = np.column_stack([on_board, np.ones(len(points))])
    normal = (weights * board.T) @ board + RIDGE * np.eye(3)
    return np.asarray(np.linalg.solve(normal, (weights * board.T) @ points)[:, :2])


def _least_distance(points: FloatArray, board: Board) -> float:
    """Return the least distance of neighbours on the board, px."""
    flat = board.points[:, :2]
    seen = np.isfinite(points[:, 0])
    apart = np.linalg.norm(flat[seen, None] - flat[None, seen], axis=-1)
    nearest = np.where(apart > 0, apart, np.inf).min()
    i, j = np.nonzero((apart > 0) & (apart < 1.01 * nearest))
    seen_points = points[seen]
    return float(np.linalg.norm(seen_points[i] - seen_points[j], axis=-1).min())


def _circles(
    image: Image, grey: npt.NDArray[np.uint8], board: Board, *, quick: bool
) -> FloatArray | None:
    """Return the centres of the ellipses of dark circles, or of bright ones."""
    small, scale = _smaller(grey)
    asymmetric = board.kind is BoardKind.ASYMMETRIC_CIRCLES
    flags = cv2.CALIB_CB_ASYMMETRIC_GRID if asymmetric else cv2.CALIB_CB_SYMMETRIC_GRID
    ways = (flags,) if quick else (flags, flags | cv2.CALIB_CB_CLUSTERING)
    lit = (_stretched(small),) if quick else (_stretched(small), _evened(small))
    for light, is_dark, way in product(lit, (True, False), ways):
        seen = light if is_dark else cv2.bitwise_not(light)
        found, centers = cv2.findCirclesGrid(
            seen, (board.columns, board.rows), None, way, _blobs(small.size)
        )
        if found:
            rough = _from_front(_whole(centers, scale), board)
            return _rim_centers(image, rough, board, is_dark=is_dark)
    return None


def _stretched(grey: Any) -> Any:
    """Return an image stretched to the full scale."""
    return cv2.normalize(grey, np.empty_like(grey), 0, 255, cv2.NORM_MINMAX)


def _evened(grey: Any) -> Any:
    """Return an image with uneven lighting removed."""
    tiny = cv2.resize(grey, None, fx=0.125, fy=0.125, interpolation=cv2.INTER_AREA)
    around = cv2.GaussianBlur(tiny, (0, 0), EVENED * max(tiny.shape))
    around = cv2.resize(around, grey.shape[::-1])
    return _stretched(cv2.divide(grey, around, scale=128.0))


def _blobs(n_pixels: int) -> cv2.SimpleBlobDetector:
    parameters = cv2.SimpleBlobDetector.Params()
    parameters.minArea = 12.0
    parameters.maxArea = n_pixels / 50
    parameters.minDistBetweenBlobs = 3.0
    return cv2.SimpleBlobDetector.create(parameters)


def _rim_centers(
    image: Image, rough: FloatArray, board: Board, *, is_dark: bool
) -> FloatArray | None:
    """Return the centres of rims, NaN where a rim is not whole."""
    light = (image.max() - image) if is_dark else image
    apart = _least_distance(rough, board)
    start = (SPOT_SPREAD * board.detail / board.pitch * apart) ** 2 * np.eye(2)
    shapes = np.tile(start, (len(rough), 1, 1))
    rims = fit_edges(light, EdgeStarts.anew(rough, shapes))
    off = np.linalg.norm(rims.centers - rough, axis=1)
    good = rims.are_whole & (off < OFF_SPOT * apart)
    # Small or soft circles have no rim to fit: what OpenCV found is kept for all.
    if good.sum() <= len(rough) // 2:
        return rough
    return np.where(good[:, None], rims.centers, np.nan)


def is_chequered(grey: npt.NDArray[np.uint8], grid: FloatArray) -> bool:
    """Return whether the squares between corners are black and white in turn.

    The corners ``grid`` (R, C, 2), px, are candidates. Where light blinds the camera,
    or none falls, squares tell nothing.
    """
    seen = _samples(grey, grid)
    if not np.isfinite(seen).all():
        return False
    shade, darkest, brightest = seen.mean(axis=0), seen.min(axis=0), seen.max(axis=0)
    turns = _turns(shade)
    if np.sum(turns * (shade - shade.mean())) < 0:
        turns = -turns
    steps, are_clear = [], []
    for axis in (0, 1):
        sign, light, low, high = (
            np.moveaxis(each, axis, 0) for each in (turns, shade, darkest, brightest)
        )
        is_bright = sign[:-1] > 0
        clear = np.where(is_bright, low[:-1] > high[1:], low[1:] > high[:-1])
        steps.append(np.abs(light[:-1] - light[1:]).ravel())
        are_clear.append(clear.ravel())
    contrast, clear = np.concatenate(steps), np.concatenate(are_clear)
    telling = contrast > TELLING * contrast.max()
    return bool(clear[telling].mean() >= NEARLY_ALL)


def _turns(shade: FloatArray) -> FloatArray:
    """Return 1 and -1 in turn, 1 at the first square."""
    return np.where(np.indices(shade.shape).sum(axis=0) % 2 == 0, 1.0, -1.0)


def _samples(grey: npt.NDArray[np.uint8], grid: FloatArray) -> FloatArray:
    """Return the light at 5 places of each square, NaN out of the image."""
    corners = np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]])
    middles = corners.mean(axis=0)
    places = np.concatenate([middles[None], middles + SEEN_IN * (corners - middles)])
    height, width = grey.shape
    inside = ((places >= 0) & (places <= np.array([width, height]) - 1)).all(axis=-1)
    x, y = np.moveaxis(places.reshape(-1, 1, 2).astype(np.float32), -1, 0)
    light = cv2.remap(grey, x, y, cv2.INTER_LINEAR).astype(np.float64)
    light = light.reshape(places.shape[:-1])
    return np.where(inside.all(axis=0), light, np.nan)
