"""Poses in the files of trackers and of other programs.

The columns of tables are recognised by `lightpen.formats.pose_columns`.

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
from lightpen.formats.files import HEAD, foreign_program, opened
from lightpen.formats.pen_tables import without_units
from lightpen.formats.pose_columns import (
    STATE,
    ToolColumns,
    are_rotations,
    is_lost,
    matrices_of,
    tools_of,
    without_names,
)
from lightpen.formats.tables import NOTHING, Table, number_flaw
from lightpen.messages import Message, message, printable

METRES_BELOW = 10.0  # mm of a typical translation; no pen is as close to its tracker
SEQUENCE_SUFFIXES = (".mha", ".nrrd", ".mhd")
SEQUENCE_LIMIT = 10**12  # bytes; pixels are not read
LONGEST_HEADER = 64_000_000  # bytes
NOTHING_BELOW = -1e20  # NDI writes -3.7e28 for what it does not see
MAX_TOOLS = 20

_TRANSFORM = r"(?m)^Seq_Frame(\d+)_(\w+?)Transform(Status)?\s*:?=\s*(.+?)\s*$"
_TOOL_COLUMN = (
    r"(?:tool|handle|rigid|object|sensor|target|body|device|port|tag|child).*"
    r"|(?:(?:aruco|marker)[\W_]?)?id"
)


@dataclass(frozen=True, eq=False)
class GivenPoses:
    """Poses of one tool."""

    rotations: FloatArray  # (N, 3, 3)
    translations: FloatArray  # (N, 3), mm
    places: IntArray  # (N,), among all rows of the tool, from 1
    n_lost: int
    remarks: tuple[Message, ...]


def refuse_foreign_poses(data: bytes, name: str) -> None:
    """Refuse poses in a form that is not read, by its name."""
    if program := foreign_program(data[:HEAD], "poses")[0]:
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
        if not all(cell in NOTHING or not number_flaw(cell) for cell in table.rows[0]):
            n_columns = table.n_columns
            raise FileError("poses.no-header", name=table.name, n_columns=n_columns)
        values = table.numbers_or_none(range(table.n_columns))
        return _given(*without_names(values, table.name), None, table.name)
    table, units = without_units(table)
    if units:
        pairs = zip(table.header, units, strict=True)
        header = tuple(f"{name} [{unit}]" if unit else name for name, unit in pairs)
        table = replace(table, header=header)
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
    else:
        places = columns.vector or columns.quaternion
        rotations = matrices_of(own.numbers_or_none(places))
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
        if column in poses or re.fullmatch(STATE, name):
            continue
        if not re.fullmatch(_TOOL_COLUMN, name):
            continue
        rows: dict[str, list[int]] = {}
        for i, row in enumerate(table.rows):
            rows.setdefault(row[column], []).append(i)
        if 1 < len(rows) <= min(MAX_TOOLS, len(table.rows) / 2):
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
    if not above or "Rigid Body" not in text:
        program = message("poses.markers-of-motive")
        raise FileError("poses.foreign", name=name, program=program)
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
