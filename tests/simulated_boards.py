"""Images of calibration boards, and poses in which they are seen."""

from functools import lru_cache

import cv2
import numpy as np

from lightpen.arrays import BoolArray, FloatArray, Image, IntArray
from lightpen.errors import CalibrationError
from lightpen.model.camera import Camera
from lightpen.model.fisheye import LensField
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.boards.boards import Board, BoardKind, marker_dictionary
from lightpen_extensions.boards.start import BoardPoses
from lightpen_extensions.simulator.scenes import Sensor

SAMPLES = (
    3  # for measurements, per pixel and axis; blurred before they are taken together
)
WHITE_MARGIN = 1.0  # of a square, round the board
WHITE, BLACK, BEHIND = 0.72, 0.05, 0.01  # of full scale
MAX_TILT = np.radians(35.0)
FILLED = (0.5, 0.8)  # of the image's shorter side, by the longer side of the board
ROLLS = np.radians([-90.0, -15.0, 0.0, 10.0, 90.0])
OUTER_MARGIN = 2.0  # squares or distances beyond the points, also in the image
MAX_TRIES = 100
MARGIN = 10  # px round what is seen of it


def render_board(
    camera: Camera,
    board: Board,
    rotation: FloatArray,
    translation: FloatArray,
    blur: float = 0.8,
    bend: tuple[float, float, float] = (0.0, 0.0, 0.0),
    field: LensField | None = None,
    uneven: FloatArray | None = None,
    samples: int = SAMPLES,
) -> FloatArray:
    """Return the light of a board on the sensor, (H, W), fraction of full scale.

    Parameters
    ----------
    rotation, translation : (3, 3) and (3,) array
        Of cam_from_board, mm.
    blur : float
        Standard deviation of the optics' blur, px.
    bend : tuple of float
        By how much its corners lie away from the camera along x^2, xy and y^2, mm.
    field : LensField, optional
        What the lens does beside the camera's distortion.
    uneven : (N, 2) array, optional
        By how much the corners of a chessboard are off in its plane, mm.
    samples : int
        Per pixel and axis.
    """
    window = _window(camera, board, rotation, translation)
    rows, columns = (slice(samples * at.start, samples * at.stop) for at in window)
    directions = _directions(camera, field, samples)[rows, columns]
    places = _on_board(board, directions, rotation, translation, bend)
    if uneven is not None:
        places = places - _moved(board, places, uneven)
    light = _light(board, places.astype(np.float32))
    sigma = blur * samples
    blurred = cv2.GaussianBlur(light, (0, 0), sigma, borderType=cv2.BORDER_REPLICATE)
    image = np.full((camera.height, camera.width), BEHIND)
    size = (window[1].stop - window[1].start, window[0].stop - window[0].start)
    image[window] = cv2.resize(blurred, size, interpolation=cv2.INTER_AREA)
    return image


def _window(
    camera: Camera, board: Board, rotation: FloatArray, translation: FloatArray
) -> tuple[slice, slice]:
    """Return rows and columns of the image that show the board and its margin."""
    whole = slice(0, camera.height), slice(0, camera.width)
    sheet = board.outline + (OUTER_MARGIN + 0.2) * board.pitch * np.sign(board.outline)
    along = np.linspace(0, 1, 20)[:, None, None]
    margin = sheet + along * (np.roll(sheet, -1, axis=0) - sheet)
    points = margin.reshape(-1, 3) @ rotation.T + translation
    if points[:, 2].min() <= 0:
        return whole
    pixels = camera.project(points)
    try:
        again = camera.unproject(pixels)
    except CalibrationError:  # the lens folds what lies beyond the image
        return whole
    if not np.allclose(again, points[:, :2] / points[:, 2:], atol=1e-6):
        return whole
    low = np.clip(np.floor(pixels.min(axis=0)).astype(int) - MARGIN, 0, None)
    high = np.ceil(pixels.max(axis=0)).astype(int) + MARGIN
    if np.any(high <= low) or np.any(low >= camera.image_size):
        return whole
    return slice(int(low[1]), min(int(high[1]), camera.height)), slice(
        int(low[0]), min(int(high[0]), camera.width)
    )


def expose_board(light: FloatArray, sensor: Sensor, rng: np.random.Generator) -> Image:
    """Return the image that a sensor reads of the light of a board."""
    charge = light * sensor.full_well
    noise = np.sqrt(charge + sensor.read_noise**2) * rng.standard_normal(light.shape)
    read = np.round((charge + noise + sensor.offset) / sensor.electrons_per_dn)
    kind = np.uint8 if sensor.bits == 8 else np.uint16
    return np.asarray(np.clip(read, 0, sensor.full_scale).astype(kind))


@lru_cache(maxsize=2)
def _directions(camera: Camera, field: LensField | None, samples: int) -> FloatArray:
    """Return the direction of each sample, (S H, S W, 3); computed once per camera.

    Linear between pixels, which is off by less than 1e-4 px for the lenses here.
    """
    x, y = (np.arange(-1.0, side + 1) for side in camera.image_size)
    pixels = np.stack(np.meshgrid(x, y), axis=-1)
    if field is not None:
        pixels = pixels - field.at(pixels)
    size = samples * (camera.width + 2), samples * (camera.height + 2)
    normalised = cv2.resize(camera.unproject(pixels), size)
    normalised = normalised[samples:-samples, samples:-samples]
    return np.concatenate([normalised, np.ones((*normalised.shape[:-1], 1))], axis=-1)


def _on_board(
    board: Board,
    directions: FloatArray,
    rotation: FloatArray,
    translation: FloatArray,
    bend: tuple[float, float, float],
) -> FloatArray:
    """Return the intersections of the samples with the board, (..., 2), mm."""
    rays = directions @ rotation
    eye = -rotation.T @ translation
    half = np.abs(board.points[:, :2]).max(axis=0)
    height: FloatArray | float = 0.0
    for _ in range(4 if any(bend) else 1):  # a bend moves the place by little
        depth = (height - eye[2]) / rays[..., 2]
        places = eye[:2] + depth[..., None] * rays[..., :2]
        u, v = places[..., 0] / half[0], places[..., 1] / half[1]
        height = bend[0] * u * u + bend[1] * u * v + bend[2] * v * v
    return np.asarray(places)


def _moved(board: Board, places: FloatArray, uneven: FloatArray) -> FloatArray:
    """Return the errors of the corners at places, interpolated linearly, (..., 2)."""
    grid = uneven.reshape(board.rows, board.columns, 2).astype(np.float32)
    at = (places - board.points[0, :2]) / board.pitch
    x, y = np.moveaxis(at.astype(np.float32), -1, 0)
    return np.asarray(
        cv2.remap(grid, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE),
        dtype=np.float64,
    )


def _light(board: Board, places: FloatArray) -> FloatArray:
    """Return the brightness of the board at places on it."""
    if board.kind.is_circles:
        return _circles_light(board, places)
    extra = 0 if board.kind.has_markers else 1
    columns, rows = board.columns + extra, board.rows + extra
    step = board.pitch
    width, height = columns * step, rows * step
    x, y = places[..., 0] + 0.5 * width, places[..., 1] + 0.5 * height
    margin = WHITE_MARGIN * step
    on_sheet = (
        (x > -margin) & (x < width + margin) & (y > -margin) & (y < height + margin)
    )
    edge = np.minimum(_soft(np.minimum(x, width - x)), _soft(np.minimum(y, height - y)))
    white = 1 - edge * (1 - _squares(x / step, y / step))
    if board.kind.has_markers:
        column, row = np.floor(x / step).astype(int), np.floor(y / step).astype(int)
        on_board = (x >= 0) & (x < width) & (y >= 0) & (y < height)
        marked = on_board & ((row + column) % 2 != 0)
        gap = 0.5 * (step - board.detail)
        white[marked] *= _markers_white(
            board,
            _numbers(columns, rows)[row[marked], column[marked]],
            (x[marked] - column[marked] * step - gap) / board.detail,
            (y[marked] - row[marked] * step - gap) / board.detail,
        )
    return np.asarray(np.where(on_sheet, BLACK + (WHITE - BLACK) * white, BEHIND))


def _soft(depth: FloatArray) -> FloatArray:
    """Return the share of each sample that lies within, by how deep it does.

    Without it an edge along the rows of the samples would jump from one to the next.
    """
    down, across = np.gradient(depth)
    width = np.maximum(np.hypot(down, across), 1e-12)
    return np.asarray(np.clip(0.5 + depth / width, 0, 1))


def _squares(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the brightness of a chessboard with squares of side 1, 0 to 1."""
    across, down = (2 * _soft(_wave(each)) - 1 for each in (x, y))
    return np.asarray(0.5 - 0.5 * across * down)


def _wave(x: FloatArray) -> FloatArray:
    """Return the distance from the nearest whole number, by turns above and below 0."""
    nearest = np.round(x)
    return np.asarray((x - nearest) * np.where(nearest % 2 == 0, 1, -1))


def _numbers(columns: int, rows: int) -> IntArray:
    """Return the numbers of the markers in white squares, row by row."""
    row, column = np.mgrid[:rows, :columns]
    white = (row + column) % 2 != 0
    return np.asarray(np.where(white, np.cumsum(white).reshape(white.shape) - 1, 0))


def _markers_white(
    board: Board, numbers: IntArray, u: FloatArray, v: FloatArray
) -> BoolArray:
    """Return the mask of white places within markers, 0 to 1 along their sides."""
    dictionary = marker_dictionary(board)
    n_cells = dictionary.markerSize + 2
    cells = np.stack(
        [
            np.asarray(dictionary.generateImageMarker(number, n_cells)) > 127
            for number in range(int(numbers.max()) + 1)
        ]
    )
    inside = (u >= 0) & (u < 1) & (v >= 0) & (v < 1)
    row = np.clip((v * n_cells).astype(int), 0, n_cells - 1)
    column = np.clip((u * n_cells).astype(int), 0, n_cells - 1)
    return np.asarray(np.where(inside, cells[numbers, row, column], True))


def _circles_light(board: Board, places: FloatArray) -> FloatArray:
    points = board.points[:, :2]
    radius = 0.5 * board.detail
    half = np.abs(points).max(axis=0) + board.pitch
    on_sheet = (np.abs(places) < half).all(axis=-1)
    away = places - points.min(axis=0)
    if board.kind is BoardKind.ASYMMETRIC_CIRCLES:
        twice, n_odd = 2 * board.pitch, board.rows // 2
        distance = np.minimum(
            _from_circles(away, twice, board.columns, board.rows - n_odd),
            _from_circles(away - board.pitch, twice, board.columns, n_odd),
        )
    else:
        distance = _from_circles(away, board.pitch, board.columns, board.rows)
    black = _soft(radius - distance)
    return np.asarray(np.where(on_sheet, WHITE + (BLACK - WHITE) * black, BEHIND))


def _from_circles(away: FloatArray, step: float, columns: int, rows: int) -> FloatArray:
    """Return the distances of places from the nearest circle centre of a grid."""
    most = np.array([columns, rows]) - 1
    nearest = np.clip(np.round(away / step), 0, most)
    return np.asarray(np.linalg.norm(away - step * nearest, axis=-1))


def simulate_board_poses(
    camera: Camera, board: Board, n_views: int, rng: np.random.Generator
) -> BoardPoses:
    """Return poses in which the whole board is seen, its margin included."""
    size = np.array(camera.image_size)
    longer = 2 * float(np.abs(board.points[:, :2]).max())
    sheet = board.outline + OUTER_MARGIN * board.pitch * np.sign(board.outline)
    rotations: list[FloatArray] = []
    translations: list[FloatArray] = []
    for _ in range(MAX_TRIES * n_views):
        if len(rotations) == n_views:
            break
        tilt = np.append(rng.uniform(-MAX_TILT, MAX_TILT, 2), 0.0)
        roll = np.array([0.0, 0.0, rng.choice(ROLLS)])
        R = rotation_from_vector(tilt) @ rotation_from_vector(roll)
        depth = camera.fx * longer / (rng.uniform(*FILLED) * size.min())
        place = camera.unproject(rng.uniform(0.2, 0.8, 2) * size)
        t = depth * np.append(place, 1.0)
        pixels = camera.project(sheet @ R.T + t) / size
        if np.all((pixels > 0) & (pixels < 1)):
            rotations.append(R)
            translations.append(t)
    return BoardPoses(np.array(rotations), np.array(translations))
