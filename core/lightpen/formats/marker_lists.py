"""LED coordinates in the files of other programs, and in workbooks.

A list is found by its name: points as three numbers, with three more of the normal, or
as mappings with x y z, position and normal; in a mapping, each point has its own name.
"""

import io
import re
import zipfile
from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import FileError
from lightpen.formats.documents import Tree
from lightpen.formats.entries import Entries
from lightpen.messages import message

LARGEST_WORKBOOK = 50_000_000  # bytes, unpacked
# Where programs list markers, and in what unit if they always use the same.
LISTS = (
    ("marker_positions", "m"),  # rpg_monocular_pose_estimator
    ("TrackedObject/ModelPoints", ""),  # Rift
    ("lighthouse_config/modelPoints", "m"),  # Vive
    *(("ModelPoints", ""), ("modelPoints", "m")),
    *((name, "") for name in ("markers", "MarkerPositions", "points", "leds")),
    *((f"{body}/markers", "") for body in ("RigidBody", "rigid_body", "asset", "tool")),
)
_PLACES = ("position", "pos", "xyz", "location", "offset", "coordinates")
_NORMAL_FIELDS = ("normal", "direction", "dir")
_AXES = ("x", "y", "z")
_WORKBOOKS = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1")  # xlsx and ods; xls
_ROM = b"NDI\x00"
_FOREIGN = (  # how files begin that cannot be read
    (rb"\s*<", "XML (Motive, Vicon)"),
    (rb"ply\r?\n", "PLY (point cloud)"),
    (rb"\s*Format Version,", "Motive (CSV)"),
    (rb"\s*\[\w+\]\s*\n\s*\w+\s*=", "INI (Atracsys)"),
)


class Markers(NamedTuple):
    """Points of a list, in its own unit."""

    points: FloatArray  # (L, 3)
    normals: FloatArray | None  # (L, 3)
    unit: str  # empty if it does not go without saying


def is_workbook(data: bytes) -> bool:
    """Return whether the content of a file is that of a workbook."""
    return data.startswith(_WORKBOOKS)


def refuse_foreign_list(data: bytes, name: str) -> None:
    """Refuse the file of a program whose points cannot be read, by name."""
    if data.startswith(_ROM):
        raise FileError("pen-file.rom", name=name)
    for start, program in _FOREIGN:
        if re.match(start, data.removeprefix(b"\xef\xbb\xbf")):
            raise FileError("pen-file.foreign", name=name, program=program)


def workbook_text(data: bytes, name: str) -> str:
    """Return the first sheet of a workbook that has cells, as lines with tabs."""
    try:
        from python_calamine import CalamineError, CalamineWorkbook
    except ImportError as error:
        raise FileError("pen-file.no-workbooks", name=name) from error
    try:
        if data.startswith(b"PK"):
            with zipfile.ZipFile(io.BytesIO(data)) as packed:
                size = sum(each.file_size for each in packed.infolist())
            if size > LARGEST_WORKBOOK:
                raise FileError("pen-file.large-workbook", name=name)
        book = CalamineWorkbook.from_filelike(io.BytesIO(data))
        for index in range(len(book.sheet_names)):
            rows = book.get_sheet_by_index(index).to_python(skip_empty_area=True)
            rows = [row for row in rows if any(cell != "" for cell in row)]
            if rows:
                return "".join("\t".join(map(_cell, row)) + "\n" for row in rows)
    except (CalamineError, zipfile.BadZipFile, OSError, ValueError) as error:
        raise FileError("pen-file.damaged-workbook", name=name) from error
    raise FileError("table.no-rows", name=name)


def _cell(value: object) -> str:
    if isinstance(value, float) and value.is_integer() and abs(value) < 2**53:
        return str(int(value))
    return " ".join(str(value).split())


def markers_of(tree: Tree, name: str) -> Markers | None:
    """Return the points of a document of another program; None if it lists none."""
    if not isinstance(tree, dict):
        return None
    for path, unit in LISTS:
        found: Tree = tree
        for key in path.split("/"):
            entries = Entries.of(found, name) if isinstance(found, dict) else None
            found = None
            if entries is not None and entries.has(key):
                found = entries.value(key)
        if isinstance(found, dict):
            found = list(found.values())
        if isinstance(found, list) and found:
            return _markers(found, unit, name)
    return None


def _markers(listed: list[Tree], unit: str, name: str) -> Markers:
    rows: list[list[float]] = []
    for number, point in enumerate(listed, 1):
        place = message("pen-file.led", led=number, name=name)
        entries = Entries.of(
            point if isinstance(point, dict) else {"position": point}, place
        )
        if entries.has(*_AXES):
            row = [float(entries.counted(1, axis)[0]) for axis in _AXES]
        else:
            row = entries.numbers(*_PLACES).tolist()
        if entries.has(*_NORMAL_FIELDS):
            row = [*row[:3], *entries.counted(3, *_NORMAL_FIELDS).tolist()]
        if len(row) < 3 or len(row) != len(rows[0] if rows else row):
            raise FileError("pen-file.no-point", place=place, count=len(row))
        rows.append(row)
    values = np.array(rows)
    normals = values[:, 3:6] if values.shape[1] >= 6 else None
    return Markers(values[:, :3], normals, unit)
