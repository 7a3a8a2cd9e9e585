"""Poses in the files of trackers and of other programs, see `pose_columns`.

Besides tables: sequences of PLUS (``.igs.mha``, ``.mha``, ``.nrrd``), whose transforms
stand before the pixels, and recordings of Motive (OptiTrack), whose columns are named
by several lines.
"""

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.errors import FileError
from lightpen.formats.files import kind_of, opened
from lightpen.formats.pen_tables import UNIT_NAMES, UNITS
from lightpen.formats.tables import Table
from lightpen.messages import Message, message, printable

# Recognise rotation and translation among the columns of other programs' poses.
#
# ===================== ==============================================================
# Lightpen              ``r11`` to ``r33``, ``tx_mm ty_mm tz_mm``
# quaternions           names end in w x y z (or q0 to q3), as of NDI Track, Motive,
#                       EuRoC, ROS and many loggers; ``tx``, ``position.x``, ``p_x``
# rotation vectors      ``rvec_x``, ``rodrigues.y``, in radians, as of OpenCV
# matrices              ``m00`` to ``m33`` or ``m11`` to ``m44``; or 16 columns, 4
#                       columns with 4 rows a pose, or 12 columns, without names
# TUM, 7 or 8 columns   time, three coordinates and a quaternion in any order
# ===================== ==============================================================
#
# Where names do not tell it, the order is the one whose poses leave the least scatter
# of a tip that rests at one place.


METRES_BELOW = 10.0  # mm of a typical translation; no pen is as close to its tracker
FEW_POSES = 4
UNIT_TOLERANCE = 0.01  # of the length of a quaternion

_UNIT = (
    rf"(?:(?:[\s_.]+[\[(]?|[\[(])({'|'.join(UNIT_NAMES)})[\])]?"
    r"|\s*[\[(]([^\])]*)[\])])$"
)
_ROTATING = {"q", "quat", "quaternion", "orientation", "orient", "rotation", "rot"}
_MOVING = {"t", "p", "pos", "position", "trans", "translation", "location", "tvec"}
_SCALARS = {"o": "w", "s": "w", "0": "w", "1": "x", "2": "y", "3": "z"}
_VECTORS = {"rvec", "rotvec", "rodrigues"}
_ANGLE = r"(euler_?|rot_?)?(roll|pitch|yaw|r?[xyz]|[abc])([\W_]+(deg|rad)\w*\W?)?"
_ELEMENT = r"(?:r|m|t|rot|mat|matrix|rotation)?_?\[?([0-4])[,_]?([0-4])\]?"
_STATE = r".*(state|status|valid|visible|visibility|tracked).*"
_FLAG = r"valid|visib|tracked"  # 0 says no; as a state, it may say that all is well
_LOST = (
    r"(?i)(missing|invalid|lost|disabled|occluded|false|not|no\b|bad|fail|error|out"
    r"|untracked|unknown|nan).*"
)


@dataclass(frozen=True, eq=False)
class ToolColumns:
    """Columns of one tool: its rotation in one of three forms, translation, state."""

    name: str
    translation: tuple[int, ...]  # x, y, z
    quaternion: tuple[int, ...] = ()  # w, x, y, z
    vector: tuple[int, ...] = ()  # x, y, z, rad
    matrix: tuple[int, ...] = ()  # row by row
    state: int | None = None
    unit: float | None = None  # mm, of the translation


@dataclass(frozen=True)
class _Role:
    kind: str  # "q", "v" or "t"
    axis: str
    unit: float | None
    tool: str


def tools_of(table: Table) -> list[ToolColumns]:
    """Return the tools that the header of a table names."""
    roles = [_role(name) for name in table.header]
    for name, role in zip(table.header, roles, strict=True):
        stated = re.search(_UNIT, name)
        if role is not None and role.kind == "t" and stated and stated[2]:
            unit = printable(stated[2])
            raise FileError("poses.unit", name=table.name, unit=unit)
    matrix = _matrix(table.header)
    if matrix is not None:
        return [matrix]
    known = [i for i, role in enumerate(roles) if role is not None]
    if not known:
        return []
    first = roles[known[0]]
    assert first is not None
    starts = [
        i
        for i, role in enumerate(roles)
        if role is not None and (role.kind, role.axis) == (first.kind, first.axis)
    ]
    tools = []
    before = 0
    for start, end in zip(starts, [*starts[1:], len(roles)], strict=True):
        tool = _tool(table, roles, range(start, end), range(before, start))
        tools += [] if tool is None else [tool]
        before = start
    return tools


def is_lost(state: str, column: str = "") -> bool:
    """Return whether the state of a tool, in this column, says that it was not seen."""
    is_flag = re.search(_FLAG, column) is not None
    return bool(re.fullmatch(_LOST, state) or (is_flag and state in ("0", "0.0")))


def _role(name: str) -> _Role | None:
    stated = re.search(_UNIT, name)
    base = re.sub(_UNIT, "", name).strip()
    unit = UNITS[UNIT_NAMES[stated[1]]] if stated and stated[1] else None
    stem, axis = re.sub(r"[^a-z0-9]+$", "", base[:-1]), base[-1:]
    words = set(re.findall(r"[a-z]+", stem))
    tool = re.sub(r"[\W_]*(" + "|".join(_ROTATING | _MOVING) + r")$", "", stem)
    if words & _VECTORS and axis in {*"xyz"}:
        return _Role("v", axis, unit, tool)
    if words & _ROTATING and axis in {*"wxyz", *_SCALARS}:
        return _Role("q", _SCALARS.get(axis, axis), unit, tool)
    if axis in {*"xyz"} and (words & _MOVING or not words):
        return _Role("t", axis, unit, tool)
    return _Role("q", "w", unit, tool) if base == "w" else None


def _tool(
    table: Table, roles: Sequence[_Role | None], own: range, before: range
) -> ToolColumns | None:
    """Return the tool of a block of columns; None if they are no whole pose."""
    places: dict[tuple[str, str], int] = {}
    moving = [i for i in own if (role := roles[i]) is not None and role.kind == "t"]
    is_moved = not all(_is_bare(table, i) for i in moving)
    for i in own:
        role = roles[i]
        if role is not None:
            key = role.kind, role.axis
            if role.kind == "t" and is_moved and _is_bare(table, i):
                # Beside tx ty tz, bare names w x y z are the quaternion.
                key = "q", role.axis
            places.setdefault(key, i)
    quaternion = [places.get(("q", axis)) for axis in "wxyz"]
    vector = [places.get(("v", axis)) for axis in "xyz"]
    translation = [places.get(("t", axis)) for axis in "xyz"]
    if None in translation or (None in quaternion and None in vector):
        angles = [name for name in table.header if re.fullmatch(_ANGLE, name)]
        if None not in translation and (None not in quaternion[1:] or len(angles) > 2):
            raise FileError("poses.angles", name=table.name)
        return None
    role = roles[translation[0] or 0]
    state = [i for i in before if re.fullmatch(_STATE, table.header[i])][-1:]
    state += [i for i in own if re.fullmatch(_STATE, table.header[i])][:1]
    return ToolColumns(
        name=_name(table, before, role.tool if role is not None else ""),
        translation=tuple(i for i in translation if i is not None),
        quaternion=tuple(i for i in quaternion if i is not None),
        vector=tuple(i for i in vector if i is not None),
        state=state[0] if state else None,
        unit=None if role is None else role.unit,
    )


def _is_bare(table: Table, column: int) -> bool:
    return len(re.sub(_UNIT, "", table.header[column]).strip()) == 1


def _name(table: Table, before: range, prefix: str) -> str:
    """Return the name of a tool by its port, or by the names of its columns."""
    ports = [i for i in before if table.header[i].startswith("port")]
    if not ports:
        return prefix
    cell = table.rows[0][ports[-1]]
    header = table.header[ports[-1]]
    return cell if ":" not in header and not cell.isdecimal() else header


def _matrix(header: Sequence[str]) -> ToolColumns | None:
    """Return the columns of a matrix by names such as ``r11`` and ``m03``."""
    found: dict[tuple[int, int], int] = {}
    for i, name in enumerate(header):
        element = re.fullmatch(_ELEMENT, name)
        if element:
            found.setdefault((int(element[1]), int(element[2])), i)
    if not found:
        return None
    least = min(min(found))
    rows = range(least, least + 3)
    last = least + 3
    matrix = [found.get((i, j)) for i in rows for j in rows]
    moved = [found.get((i, last)) for i in rows]
    unit = None
    if None in moved:
        roles = [_role(name) for name in header]
        places = {r.axis: i for i, r in enumerate(roles) if r and r.kind == "t"}
        moved = [places.get(axis) for axis in "xyz"]
        units = [r.unit for r in roles if r and r.kind == "t"]
        unit = units[0] if units else None
    if None in matrix or None in moved:
        return None
    state = [i for i, name in enumerate(header) if re.fullmatch(_STATE, name)]
    return ToolColumns(
        name="",
        translation=tuple(i for i in moved if i is not None),
        matrix=tuple(i for i in matrix if i is not None),
        state=state[0] if state else None,
        unit=unit,
    )


def rotations_of_quaternions(quaternions: FloatArray) -> FloatArray:
    """Return rotations (N, 3, 3) of quaternions (N, 4), w x y z; NaN of none."""
    from scipy.spatial.transform import Rotation  # takes 0.2 s

    matrices = np.full((len(quaternions), 3, 3), np.nan)
    good = np.abs(np.linalg.norm(quaternions, axis=1) - 1) < UNIT_TOLERANCE
    if good.any():
        turned = np.roll(quaternions[good], -1, axis=1)
        matrices[good] = Rotation.from_quat(turned).as_matrix()
    return matrices


def _rotations_of_vectors(vectors: FloatArray) -> FloatArray:
    """Return rotations (N, 3, 3) of rotation vectors (N, 3), rad; NaN of none."""
    from scipy.spatial.transform import Rotation  # takes 0.2 s

    matrices = np.full((len(vectors), 3, 3), np.nan)
    good = np.isfinite(vectors).all(axis=1)
    matrices[good] = Rotation.from_rotvec(vectors[good]).as_matrix()
    return matrices


def scatter(rotations: FloatArray, translations: FloatArray) -> float:
    """Return the median distance of the tips of poses from where they rest, mm.

    By linear least squares of ``R tip + t = pivot``; infinite with too few poses.
    """
    good = np.isfinite(rotations).all(axis=(1, 2)) & np.isfinite(translations).all(1)
    R, t = rotations[good], translations[good]
    if len(R) < FEW_POSES:
        return np.inf
    design = np.concatenate([R, -np.tile(np.eye(3), (len(R), 1, 1))], axis=2)
    solution = np.linalg.lstsq(design.reshape(-1, 6), -t.ravel(), rcond=None)[0]
    off = design @ solution + t
    return float(np.median(np.linalg.norm(off, axis=1)))


def without_names(values: FloatArray, name: str) -> tuple[FloatArray, FloatArray]:
    """Return rotations and translations of columns (N, k) without names.

    Raises `FileError` if they are no poses of a known layout.
    """
    candidates: list[tuple[FloatArray, FloatArray]] = []
    n_columns = values.shape[1]
    if n_columns == 4 and len(values) % 4 == 0:
        values = values.reshape(-1, 16)
        n_columns = 16
    for skipped in range(min(n_columns, 3)):
        own = values[:, skipped:]
        if own.shape[1] == 16:
            matrices = own.reshape(-1, 4, 4)
            candidates += [
                (each[:, :3, :3], each[:, :3, 3])
                for each in (matrices, np.swapaxes(matrices, 1, 2))
                if np.nanmax(np.abs(each[:, 3] - [0, 0, 0, 1]), initial=0) < 1e-6
            ]
        elif own.shape[1] == 12:
            matrices = own.reshape(-1, 3, 4)
            candidates.append((own[:, :9].reshape(-1, 3, 3), own[:, 9:]))
            candidates.append((matrices[..., :3], matrices[..., 3]))
        elif own.shape[1] == 7:
            for q, t in ((own[:, 3:], own[:, :3]), (own[:, :4], own[:, 4:])):
                candidates += [
                    (rotations_of_quaternions(np.roll(q, turn, 1)), t)
                    for turn in (0, 1)
                ]
    good = [each for each in candidates if are_rotations(each[0])]
    if not good:
        raise FileError("poses.no-header", name=name, n_columns=values.shape[1])
    return min(good, key=lambda each: scatter(*each))


def are_rotations(matrices: FloatArray) -> bool:
    """Return whether most matrices that are given are rotations."""
    given = matrices[np.isfinite(matrices).all(axis=(1, 2))]
    if not len(given) or np.abs(given).max() > 1e3:
        return False
    off = np.abs(given @ np.swapaxes(given, 1, 2) - np.eye(3)).max(axis=(1, 2))
    return bool(np.median(off) < UNIT_TOLERANCE)


SEQUENCE_SUFFIXES = (".mha", ".nrrd", ".mhd")
SEQUENCE_LIMIT = 10**12  # bytes; pixels are not read
LONGEST_HEADER = 64_000_000  # bytes
NOTHING_BELOW = -1e20  # NDI writes -3.7e28 for what it does not see
MAX_TOOLS = 20

_FOREIGN = (
    (r"\A\s*\[\[[^,\]]*\]", "numpy (display)"),
    (r"\A\s*[\[{]", "JSON"),
    (r"\Afr \d+\s*\n(ts|6d)", "DTrack (ART)"),
    (r"\A\d+[ \t]+\d+[ \t]+\d+\s*\n(?:\S+[ \t]+){3}\S+[ \t]*\n", "Open3D (.log)"),
    (r"\A#Insight Transform", "ITK"),
    (r"\ANO_OF_FRAMES", "Qualisys Track Manager (6D)"),
    (r"\APathFileType", "TRC (markers)"),
    (r"\A(Trajectories|Joints|Segments|Objects)\b", "Vicon"),
    (r"\A(---\s*)?header:\s", "ROS (text)"),
    (r"\A# Image list with two lines", "COLMAP (images.txt)"),
)
_TRANSFORM = r"(?m)^Seq_Frame(\d+)_(\w+?)Transform(Status)?\s*:?=\s*(.+?)\s*$"
_TOOL_COLUMN = r"(?:tool|handle|rigid|object|sensor|target|body|device|port).*"


@dataclass(frozen=True, eq=False)
class GivenPoses:
    """Poses of one tool."""

    rotations: FloatArray  # (N, 3, 3)
    translations: FloatArray  # (N, 3), mm
    places: IntArray  # (N,), among all rows of the tool, from 1
    n_lost: int
    remarks: tuple[Message, ...]


def refuse_foreign_poses(head: bytes, name: str) -> None:
    """Refuse poses in a form that is not read, by its name."""
    text = head.decode("latin-1").removeprefix("\xef\xbb\xbf")
    own = next((program for mark, program in _FOREIGN if re.search(mark, text)), "")
    if program := own or kind_of(head):
        raise FileError("poses.foreign", name=name, program=program)


def is_own(table: Table) -> bool:
    """Return whether a table has poses in the layout of this program."""
    if table.header:
        names = {f"r{i}{j}" for i in "123" for j in "123"}
        return names <= set(table.header) and "tx_mm" in table.header
    if table.n_columns not in (12, 13):
        return False
    values = table.numbers_or_none(range(table.n_columns - 12, table.n_columns))
    if are_rotations(values[:, :9].reshape(-1, 3, 3)):
        return True
    try:
        without_names(values, table.name)
    except FileError:
        return True  # its own reader names what is wrong
    return False


def foreign_poses(table: Table, tool: str | None) -> GivenPoses:
    """Return the poses of a tool in a table of another program."""
    if not table.header:
        values = table.numbers_or_none(range(table.n_columns))
        return _given(*without_names(values, table.name), None, table.name)
    tools = tools_of(table)
    if not tools:
        raise FileError(
            "poses.unknown-columns", name=table.name, header=", ".join(table.header)
        )
    rows = _rows_by_tool(table, tools)
    if len(tools) == 1 and len(rows) > 1:
        named = dict.fromkeys(rows, tools[0])
    else:
        named = {each.name or str(i): each for i, each in enumerate(tools, 1)}
    chosen = _chosen(list(named), tool, table.name)
    own = rows[chosen] if chosen in rows else list(range(len(table.rows)))
    return _of_tool(table, named[chosen], own)


def _of_tool(table: Table, columns: ToolColumns, rows: list[int]) -> GivenPoses:
    own = table.only(rows)
    if (state := columns.state) is not None:
        # What a tool that is not seen has for numbers is of no interest.
        seen = [
            [""] * len(row) if is_lost(row[state], table.header[state]) else row
            for row in own.rows
        ]
        own = replace(own, rows=seen)
    translations = own.numbers_or_none(columns.translation)
    if columns.matrix:
        rotations = own.numbers_or_none(columns.matrix).reshape(-1, 3, 3)
    elif columns.vector:
        rotations = _rotations_of_vectors(own.numbers_or_none(columns.vector))
    else:
        rotations = rotations_of_quaternions(own.numbers_or_none(columns.quaternion))
    return _given(rotations, translations, columns.unit, table.name)


def _given(
    rotations: FloatArray, translations: FloatArray, unit: float | None, name: str
) -> GivenPoses:
    """Return the poses that are there, in mm."""
    seen = np.isfinite(rotations).all(axis=(1, 2)) & np.isfinite(translations).all(1)
    seen &= np.abs(rotations).max(axis=(1, 2), initial=0) > 0.5
    seen &= np.all(translations > NOTHING_BELOW, axis=1) & np.any(translations, axis=1)
    if not seen.any():
        raise FileError("poses.all-lost", name=name, n_poses=len(seen))
    if not are_rotations(rotations[seen]):
        raise FileError("poses.no-rotations", name=name)
    remarks = []
    if unit is None:
        typical = float(np.median(np.linalg.norm(translations[seen], axis=1)))
        unit = 1000.0 if typical < METRES_BELOW else 1.0
        if unit != 1:
            remarks.append(message("poses.taken-as-metres", typical=typical))
    n_lost = int(np.count_nonzero(~seen))
    places = np.flatnonzero(seen) + 1
    return GivenPoses(
        rotations[seen], translations[seen] * unit, places, n_lost, tuple(remarks)
    )


def _rows_by_tool(table: Table, tools: Sequence[ToolColumns]) -> dict[str, list[int]]:
    """Return the rows of each tool, where a column names one in each row."""
    poses = {i for each in tools for i in (*each.translation, *each.quaternion)}
    for column, name in enumerate(table.header):
        if column in poses or re.fullmatch(_STATE, name):
            continue
        if not re.fullmatch(_TOOL_COLUMN, name):
            continue
        rows: dict[str, list[int]] = {}
        for i, row in enumerate(table.rows):
            rows.setdefault(row[column], []).append(i)
        if 1 < len(rows) <= MAX_TOOLS:
            return rows
    return {}


def _chosen(names: Sequence[str], tool: str | None, file: str) -> str:
    """Return the name of the chosen tool, or of the only one."""
    if tool is None and len(names) == 1:
        return names[0]
    wanted = (tool or "").casefold()
    found = [name for name in names if wanted and wanted in name.casefold()]
    exact = [name for name in names if name.casefold() == wanted]
    if len(exact or found) != 1:
        raise FileError(
            "poses.several-tools", name=file, n_tools=len(names), tools=", ".join(names)
        )
    return (exact or found)[0]


def read_sequence(path: Path, tool: str | None) -> GivenPoses:
    """Read the transforms of a sequence of PLUS; the pixels are not read."""
    with opened(path, message("file.poses"), SEQUENCE_LIMIT) as stream:
        head = stream.read(LONGEST_HEADER)
    name = printable(path.name)
    end = re.search(rb"(?m)^ElementDataFile.*$|\n\r?\n", head)
    text = head[: end.start() if end else len(head)].decode("utf-8", "replace")
    matrices: dict[str, dict[int, FloatArray]] = {}
    frames: set[int] = set()
    lost: set[tuple[str, int]] = set()
    for number, transform, is_state, value in re.findall(_TRANSFORM, text):
        frame = int(number)
        frames.add(frame)
        if is_state:
            if value.upper() != "OK":
                lost.add((transform, frame))
            continue
        try:
            matrix = np.array(value.split(), float).reshape(4, 4)
        except ValueError as error:
            raise FileError("poses.no-transform", name=name, frame=frame) from error
        matrices.setdefault(transform, {})[frame] = matrix
    moving = {transform: own for transform, own in matrices.items() if _is_moving(own)}
    if not moving:
        raise FileError("poses.no-transforms", name=name)
    chosen = _chosen(list(moving), tool, name)
    poses = np.full((len(frames), 4, 4), np.nan)
    for i, frame in enumerate(sorted(frames)):
        if (chosen, frame) not in lost and frame in moving[chosen]:
            poses[i] = moving[chosen][frame]
    return _given(poses[:, :3, :3], poses[:, :3, 3], 1.0, name)


def _is_moving(matrices: Mapping[int, FloatArray]) -> bool:
    return bool(np.ptp(np.array(list(matrices.values())), axis=0).any())


def is_motive(text: str) -> bool:
    """Return whether a text is a recording of Motive."""
    return text.lstrip().startswith("Format Version,")


def motive_table(text: str, name: str) -> str:
    """Return a recording of Motive as a table with one line of names."""
    lines = text.strip().split("\n")
    heading = next(csv.reader(lines[:1]))
    stated = dict(zip(heading[::2], heading[1::2], strict=False))
    if stated.get("Rotation Type", "Quaternion") != "Quaternion":
        raise FileError("poses.angles", name=name)
    start = next((i for i, each in enumerate(lines) if each.startswith("Frame,")), 0)
    above = [row for row in csv.reader(lines[1:start]) if any(row)]
    axes = next(csv.reader(lines[start : start + 1]))
    if not above:
        raise FileError("poses.unknown-columns", name=name, header=", ".join(axes))
    width = len(axes)
    rows = [row + [""] * (width - len(row)) for row in above]
    # Before version 2 of Motive the rows have no titles; the names are in the second.
    titled = [row for row in rows if "Name" in row[:2]]
    names = (titled or rows[1:] or rows)[0]
    is_body = [any(row[i] == "Rigid Body" for row in rows) for i in range(width)]
    unit = {"Meters": "[m]", "Millimeters": "[mm]", "Centimeters": "[cm]"}.get(
        stated.get("Length Units", "Meters"), ""
    )
    header = []
    for i, axis in enumerate(axes):
        kind = next((r[i] for r in rows if r[i] in ("Rotation", "Position")), "")
        shown = unit if kind == "Position" else ""
        own = f"{names[i]} {kind} {axis} {shown}".strip()
        header.append(own if kind and is_body[i] else f"column {i}" if i else "frame")
    quoted = ",".join('"' + each.replace('"', "") + '"' for each in header)
    return "\n".join([quoted, *lines[start + 1 :], ""])
