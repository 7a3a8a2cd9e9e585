"""Tables of LED centres and poses measured by other programs.

LED centres have the columns ``frame,led,x_px,y_px``; those of unknown LEDs have
``frame,x_px,y_px``. A frame has a number, or a time of up to 9 decimals. A table may
also have a line for each frame with columns such as ``x1,y1,x2,y2`` or
``led1_x,led1_y``. LEDs that were not seen may be left out, have empty cells, NaN,
(0, 0) or (-1, -1), or a column such as ``visible`` that says so. Poses have the
row-major rotation ``r11,r12,r13,r21,...,r33`` and the translation
``tx_mm,ty_mm,tz_mm`` of cam_from_pen. A column ``pose`` with the number of each is
optional; further columns are not read.
Without a header the columns stand in this order, with the number first if there is one.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path, PurePath
from typing import TypeAlias

import numpy as np

from lightpen.arrays import BoolArray, FloatArray, IntArray
from lightpen.errors import FileError
from lightpen.formats.files import HEAD, MEGABYTE, foreign_program, quoted
from lightpen.formats.images import natural_order
from lightpen.formats.pose_columns import STATE, is_lost
from lightpen.formats.pose_files import (
    SEQUENCE_SUFFIXES,
    GivenPoses,
    foreign_poses,
    is_motive,
    is_own,
    motive_table,
    read_sequence,
    refuse_foreign_poses,
)
from lightpen.formats.spreadsheets import table_text
from lightpen.formats.tables import NOTHING, Table, parse_table
from lightpen.messages import Message, message, printable
from lightpen.model.rigid import nearest_rotation

OBSERVATION_FILE_LIMIT = 16 * MEGABYTE
MAX_FRAMES = 5_000  # 0.3 GB while a tip is calibrated from them
LARGEST_PIXEL = 1e6
FEWEST_COLUMNS = 2  # x and y of LEDs, in a table with a line for each frame
NOWHERE = (9999, 32767, 65535, 99999)  # both coordinates of an LED that is not seen
LARGEST_SENSOR = 30  # mm from its middle, of medium format
MANY_CENTERS = 20  # as no program lists only in the corner of an image
LARGEST_TRANSLATION = 1e6  # mm
ROTATION_TOLERANCE = 1e-3  # of R R^T - 1: more is not a rotation in a few digits
ROUNDING_TOLERANCE = 1e-6  # of R R^T - 1: less is kept as it is

# Names of columns, the best first, without regard to blanks and punctuation.
_NUMBER = ("", "id", "no", "nr", "num", "number", "idx", "index", "nummer", "name")
_CLOCKS = ("time", "timestamp", "t", "stamp", "elapsed", "elapsed_time", "zeit")
_TIMES = ("", "s", "sec", "seconds", "ms", "msec", "us", "ns")
_POINTS = (
    *("marker", "point", "pt", "target", "spot", "blob", "dot", "keypoint"),
    "feature",
)
_PLACES = (
    *("center", "centre", "centroid", "position", "pos", "coord", "coordinate"),
    *("koordinate", "image", "img"),
)
_FRAME = (
    *(f"frame{end}" for end in _NUMBER),
    *(f"{word}{end}" for word in ("image", "img", "photo", "pic") for end in _NUMBER),
    *("filename", "file", "image_file", "path", "slice", "shot", "bild", "bild_nr"),
    *("bildnummer", "帧", "帧号", "帧序号", "图像", "图像编号", "图片", "フレーム"),
    *("フレーム番号", "datetime", "zeitstempel", "时间", "x_value"),  # of LabVIEW
    *(f"{word}_{unit}" for unit in _TIMES for word in _CLOCKS),
)
_LED = (
    *(f"led{end}" for end in (*_NUMBER, "编号", "号", "番号")),
    *(f"{word}{end}" for word in _POINTS for end in _NUMBER),
    *("track_id", "particle", "灯", "灯号", "标记点", "点号", "label", "name", "id"),
)
_PIXEL = tuple(
    (
        *(f"{axis}_px", f"{other}_px", other, f"c{axis}", f"{axis}c"),
        *(f"{word}_{axis}{unit}" for word in _PLACES for unit in ("", "_px")),
        *(f"{axis}_{word}{unit}" for word in _PLACES for unit in ("", "_px")),
        *(axis, f"{axis}_pixel", f"pixel_{axis}", f"p{axis}"),
        *(f"{axis}坐标", f"{axis}座標", *further),
    )
    for axis, other, *further in (
        ("x", "u", "column", "col", "centroid_1"),  # as of MATLAB and scikit-image
        ("y", "v", "row", "centroid_0", "centroid_2"),
    )
)
_BOX = ("w", "width", "h", "height")
_APART = r"[ _.:/#-]*"
_OF_LED = rf"(?:led|{'|'.join(_POINTS)}|p|m)?{_APART}(\d+)"  # in a column's name
_WIDE = rf"(?a)(?:{_OF_LED}{_APART}([xyuv])|([xyuv]){_APART}{_OF_LED})(_px| *[\[(].*)?"
_AXES = {"x": "x", "y": "y", "u": "x", "v": "y"}
_LETTER = r"(?i:(?:led|marker)?[ _-]?([a-z]))"
_CENTERS = (_FRAME, _LED, *_PIXEL)
_UNLABELLED = (_FRAME, *_PIXEL)
_POSE = (
    *((f"r{i}{j}",) for i in "123" for j in "123"),
    *((f"t{axis}_mm", f"t{axis}") for axis in "xyz"),
)


@dataclass(frozen=True, eq=False)
class Centers:
    """LED centres (F, L, 2), px, NaN if not seen, in frames of ascending numbers."""

    frames: IntArray
    pixels: FloatArray
    path: Path
    remark: Message | None = None  # on LEDs that the file lists as not seen


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
    path: Path
    places: IntArray  # (N,), of the poses among all in the file, from 1
    n_lost: int = 0  # rows without a pose
    remarks: tuple[Message, ...] = ()  # on how the file was read


def read_centers(path: Path, n_leds: int) -> Centers:
    """Read LED centres of a pen with ``n_leds`` LEDs; see the module for the layout.

    Raises `FileError`, which names the line, for LEDs that the pen does not have, an
    LED twice in a frame, or cells that are not numbers.
    """
    table = _long(_table_of_centers(path))
    columns = table.columns(_CENTERS, message("table.of-centers"))
    table = _numbered(_with_leds(table, columns), columns[1])
    for above, row in pairwise(table.rows):  # of merged cells
        row[columns[0]] = row[columns[0]] or above[columns[0]]
    frame_of_row = table.moments(columns[0])
    led_of_row = table.whole_numbers(columns[1])
    pixels = _seen_pixels(table, columns[2:])
    box = next((name for name in table.header if name in _BOX), None)
    if box and np.nanmax(np.abs(pixels - np.round(pixels)), initial=0) == 0:
        raise FileError("centers.boxes", name=table.name, column=box)
    _check_centers(table, led_of_row, pixels, n_leds)
    frames, place = np.unique(frame_of_row, return_inverse=True)
    _check_number(table, len(frames))
    _check_no_pair_twice(table, frame_of_row, led_of_row, place * n_leds + led_of_row)
    grid = np.full((len(frames), n_leds, 2), np.nan)
    grid[place, led_of_row - 1] = pixels
    unseen = np.isnan(pixels[:, 0])
    remark = None
    if unseen.any():
        remark = message(
            "centers.not-seen",
            n_leds=int(unseen.sum()),
            n_frames=len(set(frame_of_row[unseen].tolist())),
            name=table.name,
        )
    return Centers(frames, grid, path, remark)


def _table_of_centers(path: Path) -> Table:
    """Read a table without lines of units; refuse the file of a program by its name."""
    what = message("file.centers")
    text = table_text(path, what, OBSERVATION_FILE_LIMIT, _refuse_foreign)
    table = parse_table(text, printable(path.name))
    is_text = [not re.search(r"\d", "".join(row)) for row in table.rows]
    first = is_text.index(False) if False in is_text else 0
    return table.only(range(first, len(table.rows)))


def _refuse_foreign(data: bytes, name: str) -> None:
    if program := foreign_program(data[:HEAD], "centers")[0]:
        raise FileError("centers.foreign", name=name, program=program)


def _long(table: Table) -> Table:
    """Return a table with a line for each LED, also if it has columns of each LED."""
    places = {
        (_AXES[named[2] or named[3]], int(named[1] or named[4])): i
        for i, column in enumerate(table.header)
        if (named := re.fullmatch(_WIDE, column))
    }
    leds = [led for axis, led in places if axis == "x" and ("y", led) in places]
    if len(leds) < FEWEST_COLUMNS or set(_LED) & set(table.header):
        return table
    (frame,) = table.columns([_FRAME], message("table.of-centers"))
    rows = [
        [row[frame], str(led), row[places["x", led]], row[places["y", led]]]
        for row in table.rows
        for led in leds
    ]
    lines = [line for line in table.lines for _ in leds]
    return Table(table.name, (), rows, lines)


def _with_leds(table: Table, columns: list[int]) -> Table:
    """Return a table without the rows of frames in which no LED was seen."""
    named = [
        i
        for i, row in enumerate(table.rows)
        if any(row[column].casefold() not in NOTHING for column in columns[1:])
    ]
    return table.only(named) if named else table


def _numbered(table: Table, column: int) -> Table:
    """Return a table with the numbers of LEDs that are called A, B, C."""
    letters = [re.fullmatch(_LETTER, row[column]) for row in table.rows]
    for row, letter in zip(table.rows, letters, strict=True):
        if all(letters) and letter:
            row[column] = str(ord(letter[1].upper()) - ord("A") + 1)
    for i, row in enumerate(table.rows):
        if row[column] and not re.search(r"\d", row[column]):
            flaw = message("centers.led-name", cell=quoted(row[column]))
            raise table.error(i, flaw)
    return table


def read_unlabelled_centers(path: Path) -> UnlabelledCenters:
    """Read centres of unknown LEDs; see the module for the layout."""
    table = _table_of_centers(path)
    columns = table.columns(_UNLABELLED, message("table.of-centers"))
    frame_of_row = table.moments(columns[0])
    pixels = _seen_pixels(table, columns[1:])
    _check_inside_any(table, pixels)
    numbers = np.unique(frame_of_row)
    frames = numbers
    span = int(numbers[-1]) - int(numbers[0]) + 1
    if span <= 2 * len(numbers):  # else numbered in steps, or by a clock
        frames = np.arange(numbers[0], numbers[-1] + 1)
    _check_number(table, len(frames))
    seen = np.isfinite(pixels[:, 0])
    centers = tuple(pixels[seen & (frame_of_row == frame)] for frame in frames)
    return UnlabelledCenters(frames, centers, path)


def _seen_pixels(table: Table, columns: list[int]) -> FloatArray:
    """Return centres (N, 2), px; NaN where the table says that there is none."""
    pixels = table.numbers_or_none(columns)
    # Programs write (0, 0), (-1, -1), (-9999, -9999) for centres that they lack.
    x, y = pixels.T
    is_mark = (x <= 0) | np.isin(np.floor(x), NOWHERE)
    nothing = (x == y) & is_mark | (x == -1) | (y == -1)
    for column, name in enumerate(table.header):
        if re.fullmatch(STATE, name):
            nothing |= np.array([is_lost(row[column], name) for row in table.rows])
    seen = np.where((nothing | np.isnan(pixels).any(axis=1))[:, None], np.nan, pixels)
    size = np.nanmax(np.abs(seen), initial=0)
    if size <= LARGEST_SENSOR and len(seen) > MANY_CENTERS:
        raise FileError("centers.normalised", name=table.name, size=size)
    return seen


def read_poses(path: Path, tool: str | None = None) -> PoseTable:
    """Read poses; see the module and `lightpen.formats.pose_files` for the layouts.

    Rotations given in few digits are replaced by the nearest rotations; those that are
    rotations to 1e-6 stay as they are. Rows without a pose are left out. ``tool`` is
    the name of one of several. Raises `FileError`, which names the line, for matrices
    that are no rotations, or cells that are not numbers.
    """
    if path.name.lower().endswith(SEQUENCE_SUFFIXES):
        given = read_sequence(path, tool)
        return _foreign_poses(given, path)
    name = printable(path.name)
    what = message("file.poses")
    text = table_text(path, what, OBSERVATION_FILE_LIMIT, refuse_foreign_poses)
    text = motive_table(text, name) if is_motive(text) else text
    if is_own(parse_table(text, name, is_foreign=True)):
        return _own_poses(parse_table(text, name), path)
    return _foreign_poses(
        foreign_poses(parse_table(text, name, is_foreign=True), tool), path
    )


def _foreign_poses(given: GivenPoses, path: Path) -> PoseTable:
    far = np.abs(given.translations).max(axis=1) > LARGEST_TRANSLATION
    if np.any(far):
        line = int(given.places[np.argmax(far)])
        flaw = message("poses.far", most=LARGEST_TRANSLATION / 1000)
        raise FileError("table.line", line=line, name=printable(path.name), flaw=flaw)
    return PoseTable(
        nearest_rotation(given.rotations),
        given.translations,
        path,
        given.places,
        given.n_lost,
        given.remarks,
    )


def _own_poses(table: Table, path: Path) -> PoseTable:
    columns = _pose_columns(table)
    all_numbers = table.numbers_or_none(columns)
    is_seen: BoolArray = np.asarray(np.isfinite(all_numbers).all(axis=1))
    if not is_seen.any():
        raise FileError("poses.all-lost", name=table.name, n_poses=len(is_seen))
    places = np.flatnonzero(is_seen)
    table = table.only(places)
    numbers = all_numbers[is_seen]
    translations = numbers[:, 9:]
    far = np.abs(translations).max(axis=1) > LARGEST_TRANSLATION
    if np.any(far):
        raise table.error(
            int(np.argmax(far)), message("poses.far", most=LARGEST_TRANSLATION / 1000)
        )
    rotations = _checked_rotations(table, numbers[:, :9].reshape(-1, 3, 3))
    n_lost = int(np.count_nonzero(~is_seen))
    return PoseTable(rotations, translations, path, places + 1, n_lost)


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
    far = np.abs(pixels).max(axis=1) > LARGEST_PIXEL  # not where it is NaN
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


def _pose_columns(table: Table) -> list[int]:
    if table.header:
        return table.columns(_POSE, message("table.of-poses"))
    if table.n_columns not in (12, 13):  # with the number of the pose
        raise FileError("poses.no-header", name=table.name, n_columns=table.n_columns)
    return list(range(table.n_columns - 12, table.n_columns))


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


NONE = -1
SHARED = 0.5  # share of images that must match, of the camera with fewest

Key: TypeAlias = str | int


@dataclass(frozen=True, eq=False)
class Pairing:
    """The images of C cameras at N moments."""

    images: IntArray  # (N, C), index of the image, from 0; -1 for none
    by_order: bool = False  # as the names do not match


def pair_images(names: Sequence[Sequence[str]], cameras: Sequence[str]) -> Pairing:
    """Pair the images of cameras by name, by the last number in the names, or by order.

    Raises `FileError` if the names do not match and the numbers of images differ.
    """
    for key_of in (_stem, _last_number):
        paired = _paired(names, key_of)
        if paired is not None:
            return Pairing(paired)
    counts = [len(each) for each in names]
    if min(counts) < max(counts):
        few, many = counts.index(min(counts)), counts.index(max(counts))
        raise FileError(
            "rig.names-tell-nothing",
            n_few=counts[few],
            few=cameras[few],
            n_many=counts[many],
            many=cameras[many],
            example=names[few][0],
            other=names[many][0],
        )
    return Pairing(np.tile(np.arange(counts[0])[:, None], (1, len(names))), True)


def _paired(
    names: Sequence[Sequence[str]], key_of: Callable[[str], Key | None]
) -> IntArray | None:
    """Return the images of each key in order; None if the keys do not match."""
    places: list[dict[Key, int]] = []
    for each in names:
        keys = [key_of(name) for name in each]
        if None in keys or len(set(keys)) < len(keys):
            return None
        places.append({key: i for i, key in enumerate(keys) if key is not None})
    every = set[Key]().union(*places)
    n_shared = sum(sum(key in each for each in places) > 1 for key in every)
    if n_shared < SHARED * min(map(len, places)):
        return None
    ordered = sorted(every, key=lambda key: natural_order(str(key)))
    return np.array([[each.get(key, NONE) for each in places] for key in ordered])


def _stem(name: str) -> str:
    return PurePath(name).stem


def _last_number(name: str) -> int | None:
    digits = re.findall(r"(?a:\d+)", _stem(name))
    return int(digits[-1]) if digits else None
