"""Recognise rotation and translation among the columns of other programs' poses.

===================== ==============================================================
Lightpen              ``r11`` to ``r33``, ``tx_mm ty_mm tz_mm``
quaternions           names end in w x y z (or q0 to q3), as of NDI Track, Motive,
                      EuRoC, ROS and many loggers; ``tx``, ``position.x``, ``p_x``
rotation vectors      ``rvec_x``, ``rodrigues.y``, in radians, as of OpenCV
matrices              ``m00`` to ``m33`` or ``m11`` to ``m44``; or 16 columns, 4
                      columns with 4 rows a pose, or 12 columns, without names
TUM, 7 or 8 columns   time, three coordinates and a quaternion in any order
===================== ==============================================================

Where names do not tell it, the order is the one whose poses leave the least scatter
of a tip that rests at one place.
"""

import re
from collections.abc import Container, Sequence
from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import FileError
from lightpen.formats.pen_tables import UNIT_NAMES, UNITS
from lightpen.formats.tables import Table
from lightpen.messages import printable

FEW_POSES = 4
UNIT_TOLERANCE = 0.01  # of the length of a quaternion

_UNIT = (
    rf"(?:(?:[\s_./]+(?:in\s+)?[\[(]?|[\[(])({'|'.join(UNIT_NAMES)})[\])]?"
    r"|\s*[\[(]([^\])]*)[\])])$"
)
_ROTATING = {"q", "quat", "quaternion", "orientation", "orient", "rotation", "rot"}
_ROTATING |= {"四元数", "旋转", "姿态", "o"}  # ox to ow of ZED
_MOVING = {"t", "p", "pos", "position", "trans", "translation", "location", "tvec"}
_MOVING |= {"平移", "位置", "坐标"}
_SCALARS = {"o": "w", "s": "w", "0": "w", "1": "x", "2": "y", "3": "z"}
_VECTORS = {"rvec", "rotvec", "rodrigues"}
_ANGLE = (
    r"((euler_?|rot_?)?(r?[xyz]|[abc])|(.*[\W_])?(r[xyz]|roll|pitch|yaw|omega|phi|kappa"
    r"|alpha|beta|gamma|eta|theta|psi|azimuth|elevation))([\W_]+(deg|rad)\w*\W?)?"
)
_ELEMENT = r"(?:r|m|t|rot|mat|matrix|rotation)?_?\[?([0-4])[,_]?([0-4])\]?"
_WORDS = r"(?<!in)visib|(?<!in)valid|tracked|tracking|detected"
_WORDS += "|(?<!un)gültig|sichtbar|有效"
STATE = rf".*(state|status|zustand|状态|{_WORDS}|\bok|_ok\b).*"
_FLAG = rf"{_WORDS}|ok\b"  # 0 says no; as a state, it may say that all is well
_LOST = (
    r"(?i)(missing|invalid|lost|disabled|occluded|false|not|no\b|bad|fail|error|out"
    r"|untracked|unknown|nan|nein|nicht|ungültig|丢失|无效|否).*"
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
    if any(re.fullmatch(r"(.*[\W_])?q(uat\w*)?_?4", name) for name in table.header):
        return []  # the first of four or the last is w
    roles = _roles(table.header)
    for name, role in zip(table.header, roles, strict=True):
        stated = re.search(_UNIT, name)
        if role is not None and role.kind == "t" and stated and stated[2]:
            unit = printable(stated[2])
            raise FileError("poses.unit", name=table.name, unit=unit)
    matrix = _matrix(table)
    if matrix is not None:
        return [matrix]
    known = [i for i, role in enumerate(roles) if role is not None]
    if not known and _has_angles(table):
        raise FileError("poses.angles", name=table.name)
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


def _roles(header: Sequence[str]) -> list[_Role | None]:
    """Return the roles of columns; beside ``pen_qx``, ``pen_x`` is a place."""
    header = _with_axes(header)
    roles = [_role(name) for name in header]
    tools = {role.tool for role in roles if role is not None and role.kind != "t"}
    return [
        role or _role(name, tools) for name, role in zip(header, roles, strict=True)
    ]


def _with_axes(header: Sequence[str]) -> list[str]:
    """Return names with w, x, y, z for those that end in digits or in r, i, j, k."""
    ends: dict[str, str] = {}
    for name in header:
        ends[name[:-1]] = ends.get(name[:-1], "") + name[-1:]
    known = ("012", "123", "ijkr", "ijkw")
    axes = {each: str.maketrans(each, "xyzw"[: len(each)]) for each in known}
    turns = {stem: axes.get("".join(sorted(end)), {}) for stem, end in ends.items()}
    return [name[:-1] + name[-1:].translate(turns[name[:-1]]) for name in header]


def _role(name: str, tools: Container[str] = ()) -> _Role | None:
    stated = re.search(_UNIT, name)
    base = re.sub(_UNIT, "", name).strip()
    base = re.sub(r"^([xyz])[\W_]+(pos|trans|[ck]oord|坐标|位置)\w*$", r"t_\1", base)
    unit = UNITS[UNIT_NAMES[stated[1]]] if stated and stated[1] else None
    stem, axis = re.sub(r"[\W_]+$", "", base[:-1]), base[-1:]
    words = set(re.findall(r"[a-z]+|[一-龥]+", stem))
    tool = re.sub(r"[\W_]*(" + "|".join(_ROTATING | _MOVING) + r")$", "", stem)
    if words & _VECTORS and axis in {*"xyz"}:
        return _Role("v", axis, unit, tool)
    if (words & _ROTATING or stem == "r") and axis in {*"wxyz", *_SCALARS}:
        return _Role("q", _SCALARS.get(axis, axis), unit, tool)
    if axis in {*"xyz"} and (words & _MOVING or not words or stem in tools):
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
        is_turned = None not in quaternion[1:] or _has_angles(table)
        if None not in translation and is_turned:
            raise FileError("poses.angles", name=table.name)
        return None
    role = roles[translation[0] or 0]
    state = [i for i in before if re.fullmatch(STATE, table.header[i])][-1:]
    state += [i for i in own if re.fullmatch(STATE, table.header[i])][:1]
    return ToolColumns(
        name=_name(table, before, role.tool if role is not None else ""),
        translation=tuple(i for i in translation if i is not None),
        quaternion=tuple(i for i in quaternion if i is not None),
        vector=tuple(i for i in vector if i is not None),
        state=state[0] if state else None,
        unit=None if role is None else role.unit,
    )


def _has_angles(table: Table) -> bool:
    return sum(bool(re.fullmatch(_ANGLE, name)) for name in table.header) > 2


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


def _matrix(table: Table) -> ToolColumns | None:
    """Return the columns of a matrix by names such as ``r11`` and ``m03``."""
    found: dict[tuple[int, int], int] = {}
    for i, name in enumerate(table.header):
        element = re.fullmatch(_ELEMENT, name)
        if element:
            found.setdefault((int(element[1]), int(element[2])), i)
    if not found:
        return None
    least = min(min(found))
    rows = range(least, least + 3)
    last = least + 3
    fourth = [found[i, last] for i in rows if (i, last) in found]
    cells = "".join(row[i] for row in table.rows for i in fourth)
    if (last, least) in found and not re.search("[1-9]", cells):
        # OpenGL and Unity write matrices column by column.
        found = {(j, i): place for (i, j), place in found.items()}
    matrix = [found.get((i, j)) for i in rows for j in rows]
    moved = [found.get((i, last)) for i in rows]
    unit = None
    if None in moved:
        roles = _roles(table.header)
        places = {r.axis: i for i, r in enumerate(roles) if r and r.kind == "t"}
        moved = [places.get(axis) for axis in "xyz"]
        units = [r.unit for r in roles if r and r.kind == "t"]
        unit = units[0] if units else None
    if None in matrix or None in moved:
        return None
    state = [i for i, name in enumerate(table.header) if re.fullmatch(STATE, name)]
    return ToolColumns(
        name="",
        translation=tuple(i for i in moved if i is not None),
        matrix=tuple(i for i in matrix if i is not None),
        state=state[0] if state else None,
        unit=unit,
    )


def matrices_of(values: FloatArray) -> FloatArray:
    """Return rotations (N, 3, 3), NaN of none.

    Of quaternions (N, 4), w x y z, or of rotation vectors (N, 3), rad.
    """
    from scipy.spatial.transform import Rotation  # takes 0.2 s

    matrices = np.full((len(values), 3, 3), np.nan)
    good = np.isfinite(values).all(axis=1)
    if values.shape[1] == 4:
        good &= np.abs(np.linalg.norm(values, axis=1) - 1) < UNIT_TOLERANCE
    if not good.any():  # of none SciPy 1.13 makes no matrices
        return matrices
    if values.shape[1] == 4:
        matrices[good] = Rotation.from_quat(np.roll(values[good], -1, 1)).as_matrix()
    else:
        matrices[good] = Rotation.from_rotvec(values[good]).as_matrix()
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
                candidates += [(matrices_of(np.roll(q, turn, 1)), t) for turn in (0, 1)]
    good = [each for each in candidates if are_rotations(each[0])]
    if not good:
        raise FileError("poses.no-header", name=name, n_columns=values.shape[1])
    counts = [int(np.isfinite(R).all(axis=(1, 2)).sum()) for R, _ in good]
    # A few rows of places and quaternions may by chance be rotations in another order.
    likely = [g for g, n in zip(good, counts, strict=True) if n > max(counts) / 2]
    return min(likely, key=lambda each: scatter(*each))


def are_rotations(matrices: FloatArray) -> bool:
    """Return whether most matrices that are given are rotations."""
    given = matrices[np.isfinite(matrices).all(axis=(1, 2))]
    if not len(given) or np.abs(given).max() > 1e3:
        return False
    off = np.abs(given @ np.swapaxes(given, 1, 2) - np.eye(3)).max(axis=(1, 2))
    return bool(np.median(off) < UNIT_TOLERANCE)
