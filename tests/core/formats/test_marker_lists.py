"""Tests of reading LED coordinates of other programs, and of workbooks."""

import io
import json
import sys
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.core.formats.test_pen_files import LEDS, refusal, saved

from lightpen.errors import FileError, UsageError
from lightpen.formats.pen_files import read_pen

ACTUAL = LEDS + 0.0125
SHEET = """<worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main">
<sheetData>{}</sheetData></worksheet>"""
BOOK = {
    "[Content_Types].xml": """<Types
xmlns="http://schemas.openxmlformats.org/package/2006/content-types"><Default
Extension="rels"
ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
<Default Extension="xml" ContentType="application/xml"/></Types>""",
    "_rels/.rels": """<Relationships
xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
<Relationship Id="r1"
Type="http://schemas.openxmlformats.org/officeDocument/2006/relationships/officeDocument"
Target="xl/workbook.xml"/></Relationships>""",
    "xl/workbook.xml": """<workbook
xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"
xmlns:r="http://schemas.openxmlformats.org/officeDocument/2006/relationships"><sheets>
<sheet name="Notes" sheetId="1" r:id="r1"/><sheet name="LEDs" sheetId="2" r:id="r2"/>
</sheets></workbook>""",
    "xl/_rels/workbook.xml.rels": """<Relationships
xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
<Relationship Id="r1" Type="http://schemas.openxmlformats.org/officeDocument/2006/relationships/worksheet" Target="worksheets/sheet1.xml"/>
<Relationship Id="r2" Type="http://schemas.openxmlformats.org/officeDocument/2006/relationships/worksheet" Target="worksheets/sheet2.xml"/>
</Relationships>""",  # noqa: E501
    "xl/worksheets/sheet1.xml": SHEET.format(""),
}


def workbook(rows: list[list[str | float]]) -> bytes:
    """Return an .xlsx whose first sheet is empty and whose second has the rows."""
    cells = "".join(
        f'<row r="{r}">'
        + "".join(
            f'<c r="{"ABCDEFG"[c]}{r}" t="inlineStr"><is><t>{cell}</t></is></c>'
            if isinstance(cell, str)
            else f'<c r="{"ABCDEFG"[c]}{r}"><v>{cell!r}</v></c>'
            for c, cell in enumerate(row)
            if cell != ""
        )
        + "</row>"
        for r, row in enumerate(rows, 3)
    )
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as packed:
        for name, text in BOOK.items():
            packed.writestr(name, text)
        packed.writestr("xl/worksheets/sheet2.xml", SHEET.format(cells))
    return stream.getvalue()


NAMED: list[list[str | float]] = [
    [f"LED{i}", *row] for i, row in enumerate(ACTUAL.tolist(), 1)
]


@pytest.mark.parametrize(
    "head",
    [
        [["Name", "X", "Y", "Z"], ["", "mm", "mm", "mm"]],
        [["LED", "x_mm", "y_mm", "z_mm"]],
        [["Marker", "X [mm]", "Y [mm]", "Z [mm]"]],
        [["Pen 7"], ["Measured", "2024"], ["LED", "X [mm]", "Y [mm]", "Z [mm]"]],
    ],
)
def test_a_workbook_is_read(tmp_path: Path, head: list[list[str | float]]) -> None:
    pytest.importorskip("python_calamine")
    path = tmp_path / "leds.xlsx"
    path.write_bytes(workbook([*head, *NAMED]))

    np.testing.assert_array_equal(read_pen(path).leds, ACTUAL)


def test_whole_numbers_of_a_workbook_are_the_numbers_of_leds(tmp_path: Path) -> None:
    pytest.importorskip("python_calamine")
    path = tmp_path / "leds.xlsx"
    rows: list[list[str | float]] = [["led", "x_mm", "y_mm", "z_mm"]]
    rows += [[float(i), *row] for i, row in enumerate(LEDS.tolist(), 1)]
    path.write_bytes(workbook(rows))

    np.testing.assert_array_equal(read_pen(path).leds, LEDS)


def test_a_workbook_that_is_not_read_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("python_calamine")
    path = tmp_path / "leds.xlsx"
    path.write_bytes(workbook([["Name"]])[:-200])
    with pytest.raises(FileError, match="no workbook with a sheet"):
        read_pen(path)

    bomb = io.BytesIO()
    with zipfile.ZipFile(bomb, "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("xl/workbook.xml", bytes(60_000_000))
    path.write_bytes(bomb.getvalue())
    with pytest.raises(FileError, match="unpacks to more than 50 MB"):
        read_pen(path)

    monkeypatch.setitem(sys.modules, "python_calamine", None)
    with pytest.raises(FileError, match="Save it as CSV"):
        read_pen(path)


def cmm(columns: str, values: str, units: str = "") -> str:
    lines = [f"Name;{columns}", *([units] if units else [])]
    for i, (nominal, actual) in enumerate(zip(LEDS, ACTUAL, strict=True), 1):
        named = {f"n{axis}": round(nominal["xyz".index(axis)]) for axis in "xyz"}
        named |= {axis: f"{actual['xyz'.index(axis)]:.4f}" for axis in "xyz"}
        lines.append(f"LED{i};" + values.format(**named).replace(".", ","))
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(
    ("columns", "values", "units"),
    [
        (
            "X_nom;X_act;Y_nom;Y_act;Z_nom;Z_act",
            "{nx};{x};{ny};{y};{nz};{z}",
            ";mm;mm;mm;mm;mm;mm",
        ),
        ("x_act_mm;y_act_mm;z_act_mm", "{x};{y};{z}", ""),
        (
            "x_nom_mm;y_nom_mm;z_nom_mm;x_act_mm;y_act_mm;z_act_mm",
            "{nx};{ny};{nz};{x};{y};{z}",
            "",
        ),
        ("X actual [mm];Y actual [mm];Z actual [mm]", "{x};{y};{z}", ""),
        ("X;Y;Z", "{x};{y};{z}", ";[mm];[mm];[mm]"),
        (
            "X nominal;X actual;Y nominal;Y actual;Z nominal;Z actual",
            "{nx};{x};{ny};{y};{nz};{z}",
            ";mm;mm;mm;mm;mm;mm",
        ),
        (
            "Measured X (mm);Nominal X (mm);Istwert Y (mm);Sollwert Y (mm);Z (mm)",
            "{x};{nx};{y};{ny};{z}",
            "",
        ),
        ("Axis X;Centre Y;Center Z", "{x};{y};{z}", ";mm;mm;mm"),
        ("X-Koordinate;Y-Koordinate;Z-Koordinate", "{x};{y};{z}", ";mm;mm;mm"),
        ("X-Wert;Y-Wert;Z-Wert", "{x};{y};{z}", ";mm;mm;mm"),
        (
            "X-Soll;X-Ist;Y-Soll;Y-Ist;Z-Soll;Z-Ist",
            "{nx};{x};{ny};{y};{nz};{z}",
            ";mm;mm;mm;mm;mm;mm",
        ),
    ],
)
def test_the_actual_coordinates_of_a_report_are_taken(
    tmp_path: Path, columns: str, values: str, units: str
) -> None:
    path = saved(tmp_path, cmm(columns, values, units))

    np.testing.assert_allclose(read_pen(path).leds, ACTUAL, atol=6e-5)


def test_nominal_coordinates_beside_others_are_not_taken(tmp_path: Path) -> None:
    columns = "X nominal;X best fit;Y nominal;Y best fit;Z nominal;Z best fit"
    text = cmm(columns, "{nx};{x};{ny};{y};{nz};{z}", ";mm;mm;mm;mm;mm;mm")
    with pytest.raises(FileError, match="has no column x"):
        read_pen(saved(tmp_path, text), units="mm")


def test_deviations_after_coordinates_are_no_normals(tmp_path: Path) -> None:
    points = enumerate(LEDS.tolist(), 1)
    text = "".join(f"LED{i} {x} {y} {z} 0.003 0.004 0.005\n" for i, (x, y, z) in points)

    np.testing.assert_array_equal(read_pen(saved(tmp_path, text), "mm").leds, LEDS)


def test_nominal_coordinates_alone_are_taken(tmp_path: Path) -> None:
    text = cmm("X_nom;Y_nom;Z_nom", "{nx};{ny};{nz}")

    found = read_pen(saved(tmp_path, text), units="mm")

    np.testing.assert_array_equal(found.leds, LEDS.round())
    assert "does not state the unit" in refusal(tmp_path, text)


@pytest.mark.parametrize(
    ("names", "fault"),
    [
        ([f"P{i}" for i in range(10)], ""),
        ([f"Pen:Marker {i}" for i in range(1, 11)], ""),
        (list("ABCDEFGHIJ"), ""),
        ([f"LED{i}" for i in (1, 3, 2, 4, 5, 6, 7, 8, 9, 11)], "LED 11 stands"),
        (["LED1", *[f"LED{i}" for i in range(1, 10)]], "listed already"),
        (["A", "A", *"CDEFGHIJ"], "not a number"),
        (["A", "LED2", *"CDEFGHIJ"], '"A" is the name of no LED'),
        ([*(f"LED{i}" for i in range(1, 10)), "mean"], "Remove the line"),
    ],
)
def test_names_of_leds_are_their_order(
    tmp_path: Path, names: list[str], fault: str
) -> None:
    rows = zip(names, LEDS.tolist(), strict=True)
    lines = [f"{name},{x!r},{y!r},{z!r}" for name, (x, y, z) in rows]
    text = "\n".join(["name,x_mm,y_mm,z_mm", *lines, ""])
    if fault:
        assert fault in refusal(tmp_path, text)
    else:
        leds = read_pen(saved(tmp_path, text)).leds
        np.testing.assert_array_equal(leds, LEDS)


POINTS = LEDS.tolist()
MAPPINGS = [dict(zip("xyz", point, strict=True)) for point in POINTS]


@pytest.mark.parametrize(
    "document",
    [
        {"units": "mm", "markers": POINTS},
        {"unit": "mm", "Markers": MAPPINGS},
        {"units": "mm", "RigidBody": {"Markers": MAPPINGS}},
        {"Units": "mm", "RigidBodies": [{"Markers": [{"Pos": m} for m in MAPPINGS]}]},
        {
            "units": "mm",
            "TrackedObject": {
                "FlsFormatVersion": "1.0.10",
                "ModelPoints": {
                    f"Point{i}": [*point, 0, 0, 1, 0, 0, 0]
                    for i, point in reversed([*enumerate(POINTS)])
                },
            },
        },
        {"units": "mm", "points": [{"position": point} for point in POINTS]},
        {"units": "mm", "count": 10, "fiducials": [{"position": p} for p in POINTS]},
        {
            "units": "mm",
            "points": [
                {"id": i, "position": point}
                for i, point in reversed([*enumerate(POINTS, 1)])
            ],
        },
    ],
)
def test_lists_of_markers_are_read(tmp_path: Path, document: dict[str, Any]) -> None:
    path = saved(tmp_path, json.dumps(document), "leds.json")

    found = read_pen(path)

    np.testing.assert_array_equal(found.leds, LEDS)
    np.testing.assert_array_equal(found.normals, np.tile([0, 0, 1.0], (10, 1)))


def test_a_list_without_unit_needs_one(tmp_path: Path) -> None:
    path = saved(tmp_path, json.dumps({"markers": (LEDS / 1e3).tolist()}), "a.json")

    with pytest.raises(UsageError, match="does not state the unit"):
        read_pen(path)
    np.testing.assert_allclose(read_pen(path, "m").leds, LEDS, rtol=1e-14)


def test_marker_positions_of_rpg_are_in_metres(tmp_path: Path) -> None:
    text = "marker_positions:\n" + "".join(
        f"  - x: {x / 1e3}\n    y: {y / 1e3}\n    z: {z / 1e3}\n" for x, y, z in POINTS
    )
    leds = read_pen(saved(tmp_path, text, "marker_positions.yaml")).leds

    np.testing.assert_allclose(leds, LEDS, rtol=1e-14)


@pytest.mark.parametrize(
    ("points", "fault"),
    [
        ([[1.0, 2.0]], "LED 1 of leds.csv has 2 numbers"),
        ([*POINTS, [1, 2, 3, 0, 0, 1]], "LED 11 of leds.csv has 6 numbers"),
        ([*POINTS[:3], ["a", 1, 2]], "LED 4 of leds.csv cannot be read"),
        ([*POINTS[:3], {"a": 1}], "LED 4 of leds.csv has no position"),
    ],
)
def test_a_flaw_of_a_list_is_named(
    tmp_path: Path, points: list[Any], fault: str
) -> None:
    text = json.dumps({"units": "mm", "markers": points})

    assert fault in refusal(tmp_path, text)


def test_lists_for_each_axis_are_told_the_form(tmp_path: Path) -> None:
    text = json.dumps({"unit": "mm", **dict(zip("xyz", LEDS.T.tolist(), strict=True))})

    assert "is no list of LEDs. Write it as" in refusal(tmp_path, text)


def test_a_tool_definition_of_ndi_is_named(tmp_path: Path) -> None:
    path = tmp_path / "8700339.rom"
    path.write_bytes(b"NDI\x00\x92\x1e\x00\x00\x01" + bytes(743))

    with pytest.raises(FileError, match=r"8700339\.rom is a tool definition of NDI"):
        read_pen(path)


@pytest.mark.parametrize(
    ("text", "program"),
    [
        ("<?xml version='1.0'?>\n<RigidBodies><Marker X='1'/></RigidBodies>", "XML"),
        ("Format Version,1.23,Length Units,Millimeters\n\n,,Marker\n", "Motive"),
        ("[geometry]\ncount=4\nid=5\n[fiducial0]\nx=1\n", "Atracsys"),
        ("[geometry]\n[fiducial0]\nx=1\ny=2\nz=3\n", "Atracsys"),
        ("ply\nformat ascii 1.0\nelement vertex 4\n", "PLY"),
        ("solid pen\n facet normal 0 0 1\n", "STL"),
        ("DIM LOC1= LOCATION OF CIRCLE LED1  UNITS=MM\nAX NOMINAL\n", "PC-DMIS"),
        ("planid\tpartnb\tid\ttype\tactual\n1\t1\tLED1\tx\t2\nEND\n", "Calypso"),
        ("% mm\nleds = [ ...\n 1 2 3; ...\n];\n", "MATLAB"),
        ('unit = "mm"\n[markers]\nLED1 = [1, 2, 3]\n', "TOML"),
        ("!MKR#2\n[Autolabel]\n$Pen_LED1_X = 3\n", "Vicon"),
        ("K0100 30\nK2002/1 LED1 X\n", "Q-DAS"),
        ("Punkt;R (mm);Phi (°);Z (mm)\n1;2;3;4\n", "polar"),
        ("# .PCD v0.7\nFIELDS x y z\n", "PCD"),
        ("<html><table><tr><td>LED1</td></tr></table></html>", "a web page"),
        ("# Markups fiducial file version = 4.11\n1,2,3,4\n", "3D Slicer"),
    ],
)
def test_lists_that_cannot_be_read_are_named(
    text: str, program: str, tmp_path: Path
) -> None:
    path = tmp_path / "leds.txt"
    path.write_text(text)

    with pytest.raises(FileError, match=rf"{program}.*led,x_mm,y_mm,z_mm"):
        read_pen(path)


@pytest.mark.parametrize(
    "tree",
    [
        LEDS.tolist(),
        {f"P{i}": led for i, led in enumerate(LEDS.tolist())},
        [
            {"id": i, **dict(zip("xyz", led, strict=True))}
            for i, led in enumerate(LEDS.tolist())
        ],
    ],
)
def test_a_document_of_points_alone_is_a_list(tree: object, tmp_path: Path) -> None:
    path = tmp_path / "points.json"
    path.write_text(json.dumps(tree))

    np.testing.assert_array_equal(read_pen(path, units="mm").leds, LEDS)


@pytest.mark.parametrize(
    ("head", "names"),
    [
        ("Merkmal;x_mm;y_mm;z_mm", "Kreis_{}"),
        ("// Sammlung;Gruppe;Punkt;x_mm;y_mm;z_mm", "A;LEDs;LED{}"),
        ("Stift 3;Datum;1.5.;HK\nMerkmal;x;y;z\n-;mm;mm;mm", "Kreis_{}"),
    ],
)
def test_the_first_column_of_names_tells_the_points_whatever_its_title(
    tmp_path: Path, head: str, names: str
) -> None:
    path = tmp_path / "bericht.csv"
    rows = [f"{names.format(i)};{x};{y};{z}\n" for i, (x, y, z) in enumerate(LEDS, 1)]
    path.write_text(head + "\n" + "".join(rows))

    np.testing.assert_array_equal(read_pen(path).leds, LEDS)


@pytest.mark.parametrize(
    ("encoding", "header"),
    [
        ("gbk", "编号,X坐标(mm),Y坐标(mm),Z坐标(mm)"),
        ("utf-8-sig", "灯号，X（毫米），Y（毫米），Z（毫米）"),  # noqa: RUF001
        ("utf-16", "LED,X轴,Y轴,Z轴\n,毫米,毫米,毫米"),
        ("ascii", "LED,X in mm,Y in mm,Z in mm"),
        ("ascii", "LED,Pos_X[mm],Pos_Y[mm],Pos_Z[mm]"),
        ("cp1252", "Größe öß,X [mm],Y [mm],Z [mm]"),
    ],
)
def test_headers_in_other_languages_are_read(
    tmp_path: Path, encoding: str, header: str
) -> None:
    rows = [f"{i},{x},{y},{z}\n" for i, (x, y, z) in enumerate(LEDS, 1)]
    path = tmp_path / "leds.csv"
    path.write_bytes((header + "\n" + "".join(rows)).encode(encoding))

    np.testing.assert_array_equal(read_pen(path).leds, LEDS)


def test_a_table_of_words_is_refused_by_the_names_on_its_top(tmp_path: Path) -> None:
    text = "Element;Axis;Actual\n" + "".join(f"LED {a};{a};3 mm\n" for a in "XYZ")

    assert 'header is "element,axis,actual"' in refusal(tmp_path, text)


@pytest.mark.parametrize("head", ["# x_mm y_mm z_mm", "//X Y Z\n10"])
def test_the_head_of_a_point_cloud_is_no_row(tmp_path: Path, head: str) -> None:
    rows = [f"{x} {y} {z}\n" for x, y, z in LEDS]
    path = saved(tmp_path, f"{head}\n" + "".join(rows))
    units = None if "mm" in head else "mm"

    np.testing.assert_array_equal(read_pen(path, units=units).leds, LEDS)


@pytest.mark.parametrize(("head", "unit"), [("x,y,z\nmm,mm,mm\n", None), ("", "mm")])
def test_coordinates_alone_are_leds_in_their_order(
    tmp_path: Path, head: str, unit: str | None
) -> None:
    rows = [f"{x},{y},{z}\n" for x, y, z in LEDS]
    path = saved(tmp_path, head + "".join(rows))

    np.testing.assert_array_equal(read_pen(path, unit).leds, LEDS)


def test_numbers_and_two_coordinates_are_no_leds(tmp_path: Path) -> None:
    text = "".join(f"{i} {x} {y}\n" for i, (x, y, _) in enumerate(LEDS, 1))
    assert "no header and 3 columns" in refusal(tmp_path, text)


def test_a_report_with_a_line_for_each_coordinate_is_told_the_columns(
    tmp_path: Path,
) -> None:
    rows = [f"LED{i},{axis},1\n" for i in (1, 2) for axis in "XYZ"]
    text = "Element,Feature,Actual\n" + "".join(rows)

    assert "led,x,y,z, with a line for each" in refusal(tmp_path, text)
