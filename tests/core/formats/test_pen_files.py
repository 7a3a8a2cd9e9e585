"""Tests of reading and writing pen files."""

import contextlib
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lightpen.arrays import FloatArray
from lightpen.errors import FileError, LightpenError, UsageError
from lightpen.formats.pen_files import (
    read_pen,
    read_raw_pen,
    read_unchecked_pen,
    write_pen,
)
from lightpen.model.pen import DISC_DIAMETER, Pen
from lightpen.model.rigid import rotation_from_vector
from lightpen.model.self_calibration import FoundPen

LEDS = np.array(
    [
        *([0.0, 0.0, -30.0], [-0.2, 60.1, -29.7], [0.3, 120.3, -30.2]),
        [0.0, 180.0, -30.1],
        *([-25.0, 20.0, 0.0], [-25.1, 90.0, 0.0], [-25.4, 160.0, 0.0]),
        *([25.1, 35.0, 0.0], [25.2, 105.0, 0.0], [24.9, 170.0, 0.0]),
    ]
)
FACING = np.tile([0.0, 0.0, 1.0], (10, 1))
FLAT = np.array([[0.0, 0, 0], [100, 0, 0], [0, 80, 0], [100, 80, 5]])


def table(leds: FloatArray = LEDS, header: str = "led,x_mm,y_mm,z_mm") -> str:
    rows = [f"{n},{x!r},{y!r},{z!r}" for n, (x, y, z) in enumerate(leds.tolist(), 1)]
    return "\n".join([*([header] if header else []), *rows, ""])


def document(**changes: Any) -> str:
    leds = [
        {"led": n, "x": x, "y": y, "z": z}
        for n, (x, y, z) in enumerate(LEDS.tolist(), 1)
    ]
    return json.dumps({"units": "mm", "leds": leds} | changes)


def saved(folder: Path, text: str, name: str = "leds.csv") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def refusal(folder: Path, text: str, **options: Any) -> str:
    path = saved(folder, text)
    with pytest.raises(LightpenError) as info:
        read_pen(path, **options)
    return str(info.value)


def sigmas(pen: Pen) -> tuple[float | None, ...]:
    return pen.led_sigma, pen.scale_sigma, pen.diameter_sigma


def assert_same(found: Pen, expected: Pen) -> None:
    np.testing.assert_array_equal(found.leds, expected.leds)
    np.testing.assert_array_equal(found.normals, expected.normals)
    assert found.diameter == expected.diameter
    assert found.name == expected.name
    assert sigmas(found) == sigmas(expected)
    if expected.nominal_tip is None:
        assert found.nominal_tip is None
    else:
        np.testing.assert_array_equal(found.nominal_tip, expected.nominal_tip)


@pytest.mark.parametrize(
    "text", [table(), document(), table().replace(",", ";").replace(".", ",")]
)
def test_leds_alone_have_the_usual_normals_and_diameter(
    tmp_path: Path, text: str
) -> None:
    assert_same(read_pen(saved(tmp_path, text)), Pen(LEDS, FACING, DISC_DIAMETER))


@pytest.mark.parametrize(
    ("header", "millimetres"),
    [
        ("led,x_mm,y_mm,z_mm", 1.0),
        ("LED, X [mm], Y [mm], Z [mm]", 1.0),
        ("nr,x (m),y (m),z (m)", 1000.0),
        ("id,x/inch,y/inch,z/inch", 25.4),
        ('No.,x in,y in,"z in"', 25.4),
        ("led,x_um,y_µm,z (microns)", 0.001),
        ("led,x[cm],y[cm],z", 10.0),
    ],
)
def test_units_in_the_header_are_followed(
    tmp_path: Path, header: str, millimetres: float
) -> None:
    found = read_pen(saved(tmp_path, table(LEDS / millimetres, header)))
    np.testing.assert_array_equal(found.leds, LEDS / millimetres * millimetres)


@pytest.mark.parametrize("header", ["", "led,x,y,z"])
def test_units_that_are_not_stated_are_asked_for(tmp_path: Path, header: str) -> None:
    text = table(LEDS / 1000, header)
    assert "does not state the unit of its coordinates." in refusal(tmp_path, text)
    found = read_pen(saved(tmp_path, text), units="m")
    np.testing.assert_array_equal(found.leds, LEDS / 1000 * 1000)


def test_units_that_contradict_the_file_are_refused(tmp_path: Path) -> None:
    assert "states its lengths in mm, but the unit m" in refusal(
        tmp_path, table(), units="m"
    )
    assert "states its lengths in mm, but the unit m" in refusal(
        tmp_path, document(), units="m"
    )


def test_units_nobody_knows_are_refused(tmp_path: Path) -> None:
    assert '"parsec" is not a supported unit of length.' in refusal(
        tmp_path, table(), units="parsec"
    )
    assert 'unit "parsec"' in refusal(tmp_path, document(units="parsec"))


def test_coordinates_in_different_units_are_refused(tmp_path: Path) -> None:
    text = refusal(tmp_path, table(header="led,x_mm,y_mm,z_m"))
    assert "coordinates in m and in mm" in text


def test_a_json_file_in_other_units_is_in_mm_throughout(tmp_path: Path) -> None:
    entries = json.loads(document(units="cm", diameter=0.8, nominal_tip=[0, -9, -2.5]))
    for led in entries["leds"]:
        led.update({axis: led[axis] / 10 for axis in "xyz"}, normal=[0, 0, 1])
    pen = read_pen(saved(tmp_path, json.dumps(entries)))
    np.testing.assert_allclose(pen.leds, LEDS, atol=1e-12)
    np.testing.assert_array_equal(pen.normals, FACING)
    assert pen.nominal_tip is not None
    np.testing.assert_array_equal(pen.nominal_tip, [0, -90, -25])
    assert pen.diameter == 8


def test_options_take_the_place_of_what_the_file_says(tmp_path: Path) -> None:
    path = saved(tmp_path, document(diameter=8, nominal_tip=[0, -9, -2]))
    pen = read_pen(path, diameter=6.0, nominal_tip=np.array([1.0, 2.0, 3.0]))
    assert pen.diameter == 6
    assert pen.nominal_tip is not None
    np.testing.assert_array_equal(pen.nominal_tip, [1, 2, 3])


@pytest.mark.parametrize("diameter", [0.0, -1.0, float("nan"), 1e9])
def test_discs_of_an_impossible_diameter_are_refused(
    tmp_path: Path, diameter: float
) -> None:
    with pytest.raises(UsageError, match=r"LED disc diameter .* is not valid"):
        read_pen(saved(tmp_path, table()), diameter=diameter)


def test_normals_and_diameter_of_a_table_are_read(tmp_path: Path) -> None:
    lines = ["diameter_mm,nz,ny,nx,z_m,y_m,x_m,led"]
    for n, (x, y, z) in enumerate((LEDS / 1000).tolist(), 1):
        lines.append(f"8,0.8,0,-0.6,{z!r},{y!r},{x!r},{n}")
    pen = read_pen(saved(tmp_path, "\n".join(lines)))
    np.testing.assert_array_equal(pen.normals, np.tile([-0.6, 0, 0.8], (10, 1)))
    assert pen.diameter == 8


def test_seven_columns_without_header_hold_normals(tmp_path: Path) -> None:
    text = "".join(f"{line},0,0.6,0.8\n" for line in table(header="").splitlines())
    pen = read_pen(saved(tmp_path, text), units="mm")
    np.testing.assert_array_equal(pen.normals, np.tile([0, 0.6, 0.8], (10, 1)))


def test_normals_in_few_digits_get_unit_length(tmp_path: Path) -> None:
    text = "".join(f"{line},0,.71,.71\n" for line in table(header="").splitlines())
    pen = read_pen(saved(tmp_path, text), units="mm")
    np.testing.assert_allclose(np.linalg.norm(pen.normals, axis=1), 1, atol=1e-15)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("2,-0.2", "3,-0.2", "Line 4 of leds.csv: LED 3 is listed already on line 3"),
        ("\n3,", "\n2,", "Line 4 of leds.csv: LED 2 is listed already on line 3"),
        ("\n1,", "\n0,", "Line 2 of leds.csv: LED 0 stands where LED 1 is expect"),
        ("\n3,", "\n2.5,", 'Line 4 of leds.csv: "2.5" is not a whole number'),
        ("10,24.9", "11,24.9", "LED 11 stands where LED 10 is expected. Number the"),
        ("60.1", "6O.1", 'Line 3 of leds.csv: "6O.1" is not a number'),
        ("60.1", "nan", 'Line 3 of leds.csv: "nan" is not a finite number'),
        ("60.1", "1e400", 'Line 3 of leds.csv: "1e400" is too large'),
        ("60.1", "", "Line 3 of leds.csv: a cell is empty"),
        (",60.1", "", "Line 3 of leds.csv has 3 cells where line 1 has 4"),
        ("x_mm", "w_mm", "leds.csv has no column x"),
        ("y_mm", "x_mm", 'duplicate column "x_mm" in the header.'),
        ("y_mm", "x [mm]", "leds.csv has no column y"),
    ],
)
def test_a_flaw_of_a_table_is_named(
    tmp_path: Path, old: str, new: str, sentence: str
) -> None:
    assert old in table()
    assert sentence in refusal(tmp_path, table().replace(old, new, 1))


def test_rows_out_of_order_are_put_in_order(tmp_path: Path) -> None:
    lines = table().splitlines()
    turned = "\n".join([lines[0], *reversed(lines[1:])])
    (tmp_path / "turned").mkdir()
    leds = read_pen(saved(tmp_path, table())).leds
    np.testing.assert_array_equal(
        read_pen(saved(tmp_path / "turned", turned)).leds, leds
    )


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"leds": []}, "leds in leds.csv is no list of LEDs"),
        ({"leds": {"x": 1}}, "leds in leds.csv is no list of LEDs"),
        ({"leds": [5]}, "LED 1 of leds.csv is not a mapping"),
        ({"leds": [{"led": 1, "x": 0, "y": 0}]}, "LED 1 of leds.csv has no z"),
        ({"leds": [{"led": 2}]}, "Entry 1 of leds in leds.csv is LED 2"),
        ({"leds": [{"led": 1, "x": 0, "y": 0, "z": "far"}]}, '"far" is not a number'),
        ({"leds": [{"led": 1, "x": 0, "y": 0, "z": True}]}, "z in LED 1 of leds.csv"),
        ({"leds": [{"led": 1, "w": 0}]}, 'LED 1 of leds.csv has the unknown key "w"'),
        ({"diamter": 8}, 'leds.csv has the unknown key "diamter"'),
        ({"diameter": -8}, "leds.csv has LED discs -8 mm wide"),
        ({"diameter": "wide"}, '"wide" is not a number'),
        ({"nominal_tip": [1, 2]}, "nominal_tip in leds.csv has 2 numbers where 3"),
        ({"units": None}, "does not state the unit of its coordinates."),
    ],
)
def test_a_flaw_of_a_json_file_is_named(
    tmp_path: Path, changes: dict[str, Any], sentence: str
) -> None:
    assert sentence in refusal(tmp_path, document(**changes))


def test_a_normal_for_some_leds_only_is_refused(tmp_path: Path) -> None:
    entries = json.loads(document())
    entries["leds"][0]["normal"] = [0, 0, 1]
    assert "LED 2 of leds.csv has no normal" in refusal(tmp_path, json.dumps(entries))


@pytest.mark.parametrize("normal", ["0,0,0", "0,0,2", "1,1,1", "0,0,1e200"])
def test_a_normal_of_another_length_is_refused(tmp_path: Path, normal: str) -> None:
    text = "".join(f"{line},{normal}\n" for line in table(header="").splitlines())
    sentence = "Line 1 of leds.csv: the normal .* does not have the length 1"
    with pytest.raises(FileError, match=sentence):
        read_pen(saved(tmp_path, text), units="mm")


def test_discs_of_different_width_are_refused(tmp_path: Path) -> None:
    lines = table(header="led,x_mm,y_mm,z_mm,diameter_mm").splitlines()
    rows = [f"{line},{9 if n == 4 else 10}" for n, line in enumerate(lines[1:])]
    text = refusal(tmp_path, "\n".join([lines[0], *rows]))
    assert "Line 6 of leds.csv: the diameter is 9 where the first LED has 10" in text


SIGMAS = "led_sigma_mm,scale_sigma,diameter_sigma_mm"


def with_columns(header: str, *cells: str) -> str:
    """Return a table with further columns, filled row by row or all alike."""
    lines = table(header=f"led,x_mm,y_mm,z_mm,{header}").splitlines()
    rows = cells if len(cells) > 1 else cells * (len(lines) - 1)
    added = [f"{line},{cell}" for line, cell in zip(lines[1:], rows, strict=True)]
    return "\n".join([lines[0], *added, ""])


def test_uncertainties_that_a_file_does_not_state_are_unknown(tmp_path: Path) -> None:
    assert sigmas(read_pen(saved(tmp_path, table()))) == (None, None, None)
    assert sigmas(read_pen(saved(tmp_path, document()))) == (None, None, None)


@pytest.mark.parametrize(
    ("header", "cells"),
    [
        (SIGMAS, "0.003,1e-5,0.02"),
        ("LED_sigma [um],Scale_Sigma,Diameter_sigma (um)", "3,1e-5,20"),
        ("diameter_sigma,scale_sigma,led_sigma", "0.02,1e-5,0.003"),
    ],
)
def test_uncertainties_of_a_table_are_read_in_their_units(
    tmp_path: Path, header: str, cells: str
) -> None:
    pen = read_pen(saved(tmp_path, with_columns(header, cells)))
    assert sigmas(pen) == pytest.approx((0.003, 1e-5, 0.02))


def test_uncertainties_of_a_json_file_are_in_its_units_but_that_of_the_scale(
    tmp_path: Path,
) -> None:
    entries = json.loads(
        document(units="cm", led_sigma=3e-4, scale_sigma=1e-5, diameter_sigma=2e-3)
    )
    for led in entries["leds"]:
        led.update({axis: led[axis] / 10 for axis in "xyz"})
    pen = read_pen(saved(tmp_path, json.dumps(entries)))
    assert sigmas(pen) == pytest.approx((0.003, 1e-5, 0.02))


@pytest.mark.parametrize("suffix", ["csv", "json"])
def test_only_uncertainties_that_are_known_are_written(
    tmp_path: Path, suffix: str
) -> None:
    path = tmp_path / f"pen.{suffix}"
    write_pen(Pen(LEDS, FACING, scale_sigma=2e-5), path)
    text = path.read_text("utf-8")
    assert "scale_sigma" in text
    assert "led_sigma" not in text
    assert "diameter_sigma" not in text


def test_how_a_pen_grows_with_warmth_is_read_from_tables_and_json(
    tmp_path: Path,
) -> None:
    numbers = {"expansion": 2.3e-5, "expansion_sigma": 1e-6, "temperature_c": 20.5}
    columns = with_columns(",".join(numbers), ",".join(map(str, numbers.values())))
    for text in (columns, document(**numbers)):
        pen = read_pen(saved(tmp_path, text))
        assert (pen.expansion, pen.expansion_sigma) == (2.3e-5, 1e-6)
        assert pen.temperature_c == 20.5


@pytest.mark.parametrize(
    ("what", "value"), [("expansion", "0.002"), ("temperature_c", "293.15")]
)
def test_other_units_of_warmth_are_refused(
    tmp_path: Path, what: str, value: str
) -> None:
    assert f"has the {what} {value}." in refusal(tmp_path, with_columns(what, value))


@pytest.mark.parametrize("what", ["led_sigma", "scale_sigma", "diameter_sigma"])
@pytest.mark.parametrize("value", ["0", "-0.001", "11"])
def test_what_is_no_standard_uncertainty_is_refused(
    tmp_path: Path, what: str, value: str
) -> None:
    for text in (with_columns(what, value), document(**{what: float(value)})):
        sentence = refusal(tmp_path, text)
        assert f"leds.csv has the {what} {value}." in sentence
        assert ", or omit it if unknown." in sentence


def test_a_scale_that_may_be_off_by_more_than_a_hundredth_is_refused(
    tmp_path: Path,
) -> None:
    assert "up to 0.01, or omit it" in refusal(
        tmp_path, with_columns("scale_sigma", "0.02")
    )


@pytest.mark.parametrize("what", ["led_sigma", "scale_sigma", "diameter_sigma"])
def test_an_uncertainty_that_differs_from_led_to_led_is_refused(
    tmp_path: Path, what: str
) -> None:
    cells = ["0.003"] * 4 + ["0.004"] + ["0.003"] * 5
    sentence = refusal(tmp_path, with_columns(what, *cells))
    assert f"Line 6 of leds.csv: the {what} is 0.004 where the first" in sentence


@pytest.mark.parametrize("value", ["", "small", "nan"])
def test_an_uncertainty_that_is_no_number_is_refused(
    tmp_path: Path, value: str
) -> None:
    cells = ["0.003"] * 4 + [value] + ["0.003"] * 5
    assert "Line 6 of leds.csv" in refusal(tmp_path, with_columns("led_sigma", *cells))


@pytest.mark.parametrize(
    ("leds", "sentence"),
    [
        (LEDS / 1000, "leds.csv: The LEDs span only 0.18 mm"),
        (LEDS * [1, 1, -1], "leds.csv: The LEDs are a mirror image of the pen"),
        (LEDS[[0, 2, 1, *range(3, 10)]], "leds.csv: LEDs 2 and 3 are swapped"),
        (LEDS + np.array([0, 0, 500]), "The LEDs are not in the pen frame"),
    ],
)
def test_wrong_geometry_is_refused_with_the_name_of_the_file(
    tmp_path: Path, leds: FloatArray, sentence: str
) -> None:
    assert sentence in refusal(tmp_path, table(leds))


@pytest.mark.parametrize("units", ["mm", "m"])
def test_raw_coordinates_are_put_into_the_pen_frame(tmp_path: Path, units: str) -> None:
    R = rotation_from_vector(np.array([0.3, 2.0, -1.0]))
    raw = LEDS @ R.T + [400, 300, -100]
    scale = {"mm": 1, "m": 1000}[units]
    path = saved(tmp_path, table(raw / scale, header=""))
    pen = read_raw_pen(path, units)
    np.testing.assert_allclose(pen.leds, LEDS, atol=1e-9)
    np.testing.assert_array_equal(pen.normals, FACING)


def test_normals_and_tip_in_raw_coordinates_are_turned_too(tmp_path: Path) -> None:
    R = rotation_from_vector(np.array([0.3, 2.0, -1.0]))
    tip = np.array([0.0, -90.0, -24.0])
    leds = [
        {"led": n, "x": p[0], "y": p[1], "z": p[2], "normal": R[:, 2].tolist()}
        for n, p in enumerate((LEDS @ R.T).tolist(), 1)
    ]
    text = document(leds=leds, nominal_tip=(R @ tip).tolist())
    pen = read_raw_pen(saved(tmp_path, text))
    np.testing.assert_allclose(pen.normals, FACING, atol=1e-12)
    assert pen.nominal_tip is not None
    np.testing.assert_allclose(pen.nominal_tip, tip, atol=1e-9)


def test_raw_coordinates_of_another_layout_are_refused(tmp_path: Path) -> None:
    with pytest.raises(FileError, match=r"leds\.csv: .* does not define the pen frame"):
        read_raw_pen(saved(tmp_path, table(FLAT)))


def test_a_pen_of_another_layout_is_read(tmp_path: Path) -> None:
    np.testing.assert_array_equal(read_pen(saved(tmp_path, table(FLAT))).leds, FLAT)


def test_a_pen_is_written_as_csv_or_json_only(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"pen\.xlsx does not end in"):
        write_pen(Pen(LEDS, FACING), tmp_path / "pen.xlsx")


@pytest.mark.parametrize(
    "pen",
    [
        Pen(LEDS, FACING, name="LP04"),
        Pen(LEDS, FACING, nominal_tip=np.zeros(3)),
        Pen(LEDS, FACING, led_covariance=np.eye(3 * len(LEDS))),
    ],
)
def test_what_a_table_has_no_place_for_is_not_dropped(tmp_path: Path, pen: Pen) -> None:
    with pytest.raises(UsageError, match="cannot store name, nominal tip"):
        write_pen(pen, tmp_path / "pen.csv")


@st.composite
def pens(draw: st.DrawFn) -> Pen:
    rng = np.random.default_rng(draw(st.integers(0, 10_000)))
    if draw(st.booleans()):
        leds = LEDS + rng.uniform(-0.2, 0.2, LEDS.shape)
        leds -= [leds[0, 0], leds[0, 1], 0]
    else:
        corners = np.array([[0.0, 0, 0], [300, 0, 0], [0, 200, 0], [300, 200, 100]])
        leds = corners + rng.normal(size=(4, 3))
    normals = rng.normal(size=leds.shape)
    normals[:, 2] = np.abs(normals[:, 2]) + 0.1
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Pen(
        leds,
        normals,
        float(rng.uniform(1, 20)),
        led_sigma=draw(st.none() | st.floats(1e-6, 10.0)),
        scale_sigma=draw(st.none() | st.floats(1e-9, 0.01)),
        diameter_sigma=draw(st.none() | st.floats(1e-6, 10.0)),
        expansion=draw(st.none() | st.floats(-9e-6, 1e-4)),
        expansion_sigma=draw(st.none() | st.floats(1e-9, 1e-4)),
        temperature_c=draw(st.none() | st.floats(-49.0, 100.0)),
    )


@pytest.mark.slow
@given(pens(), st.sampled_from(["csv", "json"]))
def test_any_pen_is_read_back_to_the_last_digit(
    tmp_path_factory: pytest.TempPathFactory, pen: Pen, suffix: str
) -> None:
    path = tmp_path_factory.getbasetemp() / f"round_trip.{suffix}"
    write_pen(pen, path)
    assert_same(read_pen(path), pen)


@pytest.mark.slow
@given(
    pens(),
    st.lists(st.floats(-1e5, 1e5), min_size=3, max_size=3),
    st.text(st.characters(categories=["L", "N", "P", "S"]), max_size=30),
)
def test_name_and_tip_are_read_back_from_json(
    tmp_path_factory: pytest.TempPathFactory, pen: Pen, tip: list[float], name: str
) -> None:
    path = tmp_path_factory.getbasetemp() / "round_trip.json"
    pen = replace(pen, nominal_tip=np.array(tip), name=name)
    write_pen(pen, path)
    assert_same(read_pen(path), pen)


@given(st.binary(max_size=300) | st.text(max_size=300).map(str.encode))
def test_any_content_is_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, data: bytes
) -> None:
    path = tmp_path_factory.getbasetemp() / "any.csv"
    path.write_bytes(data)
    with contextlib.suppress(LightpenError):
        read_pen(path, units="mm")


def test_the_shared_pen_is_read(shared_data: Path) -> None:
    pen = read_pen(shared_data / "swing-clean" / "leds.csv")
    np.testing.assert_array_equal(pen.leds[1], [-0.04485, 60.13565, -29.86272])
    assert pen.n_leds == 10


def test_leds_that_stand_anywhere_can_be_read_to_be_mended(tmp_path: Path) -> None:
    path = tmp_path / "leds.csv"
    path.write_text("led,x_mm,y_mm,z_mm\n1,0,0,0\n2,1,0,0\n")

    np.testing.assert_array_equal(
        read_unchecked_pen(path).leds, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
    )


def test_what_is_no_number_cannot_be_read_to_be_mended_either(tmp_path: Path) -> None:
    path = tmp_path / "leds.csv"
    path.write_text("led,x_mm,y_mm,z_mm\n1,0,0,0\n2,12.4O,0,0\n")

    with pytest.raises(FileError, match=r"Line 3 of leds\.csv"):
        read_unchecked_pen(path)


def test_a_covariance_that_is_none_is_refused(tmp_path: Path) -> None:
    lopsided = np.eye(3 * len(LEDS))
    lopsided[0, 1] = 0.5
    negative = np.eye(3 * len(LEDS))
    negative[2, 2] = -1.0
    for matrix in (lopsided, negative):
        write_pen(Pen(LEDS, FACING, led_covariance=matrix), tmp_path / "pen.json")
        with pytest.raises(
            FileError,
            match=r"The led_covariance of pen\.json is not a covariance matrix:",
        ):
            read_pen(tmp_path / "pen.json")


def test_what_was_known_of_a_pen_found_from_images_is_read_back(tmp_path: Path) -> None:
    rng, path = np.random.default_rng(1), tmp_path / "pen.json"
    root = rng.normal(size=(3 * len(LEDS), 3 * len(LEDS)))
    marks = rng.uniform(0, 2000, (60, 2)).round(3)
    pen = Pen(LEDS, FACING, 8.0, found=FoundPen(marks, 9.5, root @ root.T))
    write_pen(pen, path)

    for diameter in None, 7.0:
        read = read_pen(path, diameter=diameter).found
        assert read is not None
        np.testing.assert_array_equal(read.marks, marks)
        np.testing.assert_array_equal(read.led_covariance, root @ root.T)
        assert read.diameter == (diameter or 9.5)


@pytest.mark.parametrize(
    ("line", "other", "reported"),
    [
        ('"diameter": 9.5', '"width": 9.5', 'unknown key "width"'),
        ('"diameter": 9.5', '"diameter": -9.5', "discs"),
        ("[1.0, 2.0]", "[1.0, 2.0, 3.0]", "3 numbers"),
        ("[[1.0, 0.0, ", "[[1.0, 1.0, ", "not a covariance matrix"),
    ],
)
def test_a_flaw_of_what_was_known_of_a_pen_is_named(
    tmp_path: Path, line: str, other: str, reported: str
) -> None:
    path = tmp_path / "pen.json"
    found = FoundPen(np.array([[1.0, 2.0]]), 9.5, np.eye(3 * len(LEDS)))
    write_pen(Pen(LEDS, FACING, found=found), path)
    text = path.read_text().replace("[\n    [", "[[")
    assert line in text
    path.write_text(text.replace(line, other))

    with pytest.raises(FileError, match=reported):
        read_pen(path)
