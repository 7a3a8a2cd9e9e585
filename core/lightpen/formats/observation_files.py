"""Tables of LED centres and poses measured by other programs.

LED centres have the columns ``frame,led,x_px,y_px``; those of unknown LEDs have
``frame,x_px,y_px``. Poses have the row-major rotation
``r11,r12,r13,r21,...,r33`` and the translation ``tx_mm,ty_mm,tz_mm`` of cam_from_pen,
and optionally the covariance ``c11,c12,...,c66`` of the small rotation vector w and the
translation t, in this order, rad and mm: the true rotation is ``exp([w]x) R``. A column
``pose`` with the number of each is optional; further columns are not read. Without a
header the columns stand in this order, with the number first if there is one.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.errors import FileError
from lightpen.formats.files import MEGABYTE
from lightpen.formats.tables import Table, read_table
from lightpen.messages import message
from lightpen.model.rigid import nearest_rotation

OBSERVATION_FILE_LIMIT = 16 * MEGABYTE
MAX_FRAMES = 5_000  # 0.3 GB while a tip is calibrated from them
LARGEST_PIXEL = 1e6
LARGEST_TRANSLATION = 1e6  # mm
LARGEST_COVARIANCE = 1e12  # rad^2, rad mm or mm^2
ROTATION_TOLERANCE = 1e-3  # of R R^T - 1: more is not a rotation in a few digits
ROUNDING_TOLERANCE = 1e-6  # of R R^T - 1: less is kept as it is
SINGULAR = 1e-14  # least over largest variance of a pose, in rad and mm
SYMMETRY_TOLERANCE = 1e-6  # of a covariance, relative

_CENTERS = (("frame",), ("led",), ("x_px", "x"), ("y_px", "y"))
_UNLABELLED = (("frame",), ("x_px", "x"), ("y_px", "y"))
_POSE = (
    *((f"r{i}{j}",) for i in "123" for j in "123"),
    *((f"t{axis}_mm", f"t{axis}") for axis in "xyz"),
)
_COVARIANCE = tuple((f"c{i}{j}",) for i in "123456" for j in "123456")


@dataclass(frozen=True, eq=False)
class Centers:
    """LED centres (F, L, 2), px, NaN if not seen, in frames of ascending numbers."""

    frames: IntArray
    pixels: FloatArray
    path: Path


@dataclass(frozen=True, eq=False)
class UnlabelledCenters:
    """Images of unknown LEDs in a series of frames."""

    frames: IntArray  # (F,), ascending, also those without a centre
    centers: tuple[FloatArray, ...]  # (S, 2) in each frame, in any order, px
    path: Path


@dataclass(frozen=True, eq=False)
class PoseTable:
    """Poses of a pen, cam_from_pen."""

    rotations: FloatArray  # (N, 3, 3)
    translations: FloatArray  # (N, 3), mm
    covariances: FloatArray | None  # (N, 6, 6), of w and t, rad and mm
    path: Path


def read_centers(path: Path, n_leds: int) -> Centers:
    """Read LED centres of a pen with ``n_leds`` LEDs; see the module for the layout.

    Raises `FileError`, which names the line, for LEDs that the pen does not have, an
    LED twice in a frame, or cells that are not numbers.
    """
    table = read_table(path, message("file.centers"), OBSERVATION_FILE_LIMIT)
    columns = table.columns(_CENTERS, message("table.of-centers"))
    frame_of_row = table.whole_numbers(columns[0])
    led_of_row = table.whole_numbers(columns[1])
    pixels = table.numbers(columns[2:])
    _check_centers(table, led_of_row, pixels, n_leds)
    frames, place = np.unique(frame_of_row, return_inverse=True)
    _check_number(table, len(frames))
    _check_no_pair_twice(table, frame_of_row, led_of_row, place * n_leds + led_of_row)
    grid = np.full((len(frames), n_leds, 2), np.nan)
    grid[place, led_of_row - 1] = pixels
    return Centers(frames, grid, path)


def read_unlabelled_centers(path: Path) -> UnlabelledCenters:
    """Read centres of unknown LEDs; see the module for the layout."""
    table = read_table(path, message("file.centers"), OBSERVATION_FILE_LIMIT)
    columns = table.columns(_UNLABELLED, message("table.of-centers"))
    frame_of_row = table.whole_numbers(columns[0])
    pixels = table.numbers(columns[1:])
    _check_inside_any(table, pixels)
    numbers, counts = np.unique(frame_of_row, return_counts=True)
    frames = np.arange(numbers[0], numbers[-1] + 1)
    if len(frames) > 2 * len(numbers):  # numbered in steps, or by a clock
        frames = numbers
    _check_number(table, len(frames))
    order = np.argsort(frame_of_row, kind="stable")
    parts = np.split(pixels[order], np.cumsum(counts)[:-1])
    of_frame = dict(zip(numbers.tolist(), parts, strict=True))
    nothing = np.zeros((0, 2))
    centers = tuple(of_frame.get(frame, nothing) for frame in frames.tolist())
    return UnlabelledCenters(frames, centers, path)


def read_poses(path: Path) -> PoseTable:
    """Read poses; see the module for the layout.

    Rotations given in few digits are replaced by the nearest rotations; those that are
    rotations to 1e-6 stay as they are. Raises `FileError`, which names the line, for
    matrices that are no rotations or covariances, poses given twice, or cells that are
    not numbers.
    """
    table = read_table(path, message("file.poses"), OBSERVATION_FILE_LIMIT)
    columns, covariance_columns = _pose_columns(table)
    numbers = table.numbers(columns)
    if "pose" in table.header:
        _check_repeated(table, table.numbers([table.header.index("pose")])[:, 0])
    elif not table.header and columns[0] == 1:
        _check_repeated(table, table.numbers([0])[:, 0])
    translations = numbers[:, 9:]
    far = np.abs(translations).max(axis=1) > LARGEST_TRANSLATION
    if np.any(far):
        raise table.error(
            int(np.argmax(far)), message("poses.far", most=LARGEST_TRANSLATION / 1000)
        )
    covariances = None
    if covariance_columns:
        covariances = table.numbers(covariance_columns).reshape(-1, 6, 6)
        _check_covariances(table, covariances)
    rotations = _checked_rotations(table, numbers[:, :9].reshape(-1, 3, 3))
    return PoseTable(rotations, translations, covariances, path)


def _check_centers(
    table: Table, leds: IntArray, pixels: FloatArray, n_leds: int
) -> None:
    unknown = (leds < 1) | (leds > n_leds)
    if np.any(unknown):
        row = int(np.argmax(unknown))
        raise table.error(
            row, message("centers.unknown-led", led=leds[row], n_leds=n_leds)
        )
    _check_inside_any(table, pixels)


def _check_inside_any(table: Table, pixels: FloatArray) -> None:
    far = np.abs(pixels).max(axis=1) > LARGEST_PIXEL
    if np.any(far):
        row = int(np.argmax(far))
        raise table.error(
            row, message("centers.far", x=pixels[row, 0], y=pixels[row, 1])
        )


def _check_number(table: Table, n_frames: int) -> None:
    if n_frames > MAX_FRAMES:
        raise FileError(
            "centers.too-many-frames",
            name=table.name,
            n_frames=n_frames,
            most=MAX_FRAMES,
        )


def _check_no_pair_twice(
    table: Table, frames: IntArray, leds: IntArray, keys: IntArray
) -> None:
    order = np.argsort(keys, kind="stable")
    twice = np.flatnonzero(np.diff(keys[order]) == 0)
    if len(twice):
        pair = np.argmin(order[twice + 1])
        first, second = order[twice][pair], order[twice + 1][pair]
        raise table.error(
            int(second),
            message(
                "centers.twice",
                led=leds[second],
                frame=frames[second],
                line=table.lines[first],
            ),
        )


def _pose_columns(table: Table) -> tuple[list[int], list[int]]:
    """Return the columns of the pose and, if present, of its covariance."""
    what = message("table.of-poses")
    if table.header:
        with_covariance = any(name in table.header for (name,) in _COVARIANCE)
        return (
            table.columns(_POSE, what),
            table.columns(_COVARIANCE, what) if with_covariance else [],
        )
    skipped = table.n_columns % 12  # the number of the pose
    if skipped > 1 or table.n_columns - skipped not in (12, 48):
        raise FileError("poses.no-header", name=table.name, n_columns=table.n_columns)
    places = list(range(skipped, table.n_columns))
    return places[:12], places[12:]


def _check_repeated(table: Table, poses: FloatArray) -> None:
    """Refuse a pose number that an earlier row has."""
    _, first, which = np.unique(poses, return_index=True, return_inverse=True)
    repeated = first[which] != np.arange(len(poses))
    if np.any(repeated):
        row = int(np.argmax(repeated))
        raise table.error(
            row,
            message(
                "poses.twice", pose=poses[row], line=table.lines[first[which[row]]]
            ),
        )


def _checked_rotations(table: Table, matrices: FloatArray) -> FloatArray:
    """Return rotations, orthonormalised if given with few digits."""
    large = np.abs(matrices).max(axis=(1, 2)) > 2
    safe = np.where(large[:, None, None], 0.0, matrices)
    deviations = np.abs(safe @ np.swapaxes(safe, 1, 2) - np.eye(3)).max(axis=(1, 2))
    wrong = deviations > ROTATION_TOLERANCE
    if np.any(wrong):
        raise table.error(int(np.argmax(wrong)), message("poses.no-rotation"))
    mirrored = np.linalg.det(matrices) < 0
    if np.any(mirrored):
        raise table.error(int(np.argmax(mirrored)), message("poses.mirrored"))
    coarse = deviations > ROUNDING_TOLERANCE
    rotations = matrices.copy()
    rotations[coarse] = nearest_rotation(matrices[coarse])
    return rotations


def _check_covariances(table: Table, covariances: FloatArray) -> None:
    variances = np.diagonal(covariances, axis1=1, axis2=2)
    large = np.abs(covariances).max(axis=(1, 2)) > LARGEST_COVARIANCE
    safe = np.where(large[:, None, None], 0.0, covariances)
    safe_variances = np.diagonal(safe, axis1=1, axis2=2)
    limits = safe_variances[:, :, None] * safe_variances[:, None, :]
    asymmetry = (safe - np.swapaxes(safe, 1, 2)) ** 2
    wrong = (
        large
        | np.any(variances < 0, axis=1)
        | np.any(safe**2 > limits * (1 + SYMMETRY_TOLERANCE), axis=(1, 2))
        | np.any(asymmetry > limits * SYMMETRY_TOLERANCE**2, axis=(1, 2))
    )
    if np.any(wrong):
        raise table.error(int(np.argmax(wrong)), message("poses.no-covariance"))
    values = np.linalg.eigvalsh(covariances)
    singular = values[:, 0] <= SINGULAR * values[:, -1]
    if np.any(singular):
        raise table.error(int(np.argmax(singular)), message("poses.certain-direction"))
