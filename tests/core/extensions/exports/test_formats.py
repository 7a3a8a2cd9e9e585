"""A tip as other programs read it says the same tip in each of their languages."""

import csv
import io
import shutil
from collections.abc import Callable, Mapping
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml
from msgspec import structs
from tests.aqdef import read_aqdef
from tests.entering import retire_item

from lightpen.estimation.reports.verdict import Grade
from lightpen.formats.own_json import record_bytes
from lightpen.model.names import Laboratory, Origin
from lightpen.record.calibrations import (
    OVERDUE,
    RETIRED,
    CalibrationFile,
    read_calibration,
    status_of,
    with_status,
)
from lightpen.record.library.library_changes import Author, add_item
from lightpen.record.library.tip_library import ItemKind, ListedTip
from lightpen.record.results.result_folder import FolderArchive
from lightpen.record.results.results import Result, TipChange
from lightpen.record.swings.header import Names
from lightpen.record.swings.reading import open_record
from lightpen_extensions.exports.formats import FORMATS

ACCEPTED = datetime(2026, 8, 14, 9, 30, tzinfo=UTC)
TIP, U = [-1.5, -90.25, -23.875], [0.001, 0.0025, 0.002]
# Slicer's axes point right, to the front and up, ITK's left, to the back and up.
RAS_FROM_LPS = np.diag([-1.0, -1.0, 1.0, 1.0])


@pytest.fixture(scope="module")
def exported(
    stated: Mapping[str, Any], tmp_path_factory: pytest.TempPathFactory
) -> CalibrationFile:
    record = {**stated, "tip_pen_mm": TIP, "expanded_uncertainty_mm": U}
    file = tmp_path_factory.mktemp("exported") / "tip.json"
    file.write_bytes(record_bytes(record))
    return named(read_calibration(file))


def named(
    file: CalibrationFile, pen: str = "LP-04", tip: str = "T-10"
) -> CalibrationFile:
    return replace(file, names=Names(pen=pen, tip=tip), accepted=ACCEPTED)


def text(name: str, file: CalibrationFile, laboratory: Laboratory | None = None) -> str:
    (found,) = [each for each in FORMATS if each.name == name]
    return found.content(file, laboratory).decode()


def test_slicer_finds_the_tip_where_it_is(exported: CalibrationFile) -> None:
    """Slicer inverts what it reads, and turns it into its own axes."""
    fields = dict(
        line.split(": ")
        for line in text("slicer", exported).splitlines()
        if ": " in line and not line.startswith("#")
    )
    assert fields["Transform"] == "AffineTransform_double_3_3"
    numbers = np.array(fields["Parameters"].split(), dtype=float)
    from_parent = np.eye(4)
    from_parent[:3, :3] = numbers[:9].reshape(3, 3)
    from_parent[:3, 3] = numbers[9:]
    to_parent = np.linalg.inv(RAS_FROM_LPS @ from_parent @ RAS_FROM_LPS)

    np.testing.assert_array_equal(to_parent[:3, 3], TIP)


def test_itk_maps_the_origin_of_the_tip_to_the_pen(exported: CalibrationFile) -> None:
    lines = text("itk", exported).splitlines()
    (parameters,) = [each for each in lines if each.startswith("Parameters: ")]
    numbers = np.array(parameters.split()[1:], dtype=float)

    np.testing.assert_array_equal(numbers[:9].reshape(3, 3), np.eye(3))
    np.testing.assert_array_equal(numbers[9:], TIP)


def test_plus_reads_a_transform_of_tip_to_stylus(exported: CalibrationFile) -> None:
    definitions = ElementTree.fromstring(text("plus", exported))
    assert definitions.tag == "CoordinateDefinitions"
    (element,) = definitions
    assert float(element.attrib["Error"]) == pytest.approx(
        exported.calibration.rms_mm, abs=5e-7
    )
    matrix = np.array(element.attrib["Matrix"].split(), dtype=float).reshape(4, 4)

    assert (element.attrib["From"], element.attrib["To"]) == ("StylusTip", "Stylus")
    np.testing.assert_array_equal(matrix[:, 3], [*TIP, 1.0])


def test_ros_reads_metres(exported: CalibrationFile) -> None:
    message = yaml.safe_load(text("ros", exported))
    shift = message["transform"]["translation"]

    np.testing.assert_allclose([shift[a] for a in "xyz"], np.array(TIP) / 1000)
    assert message["transform"]["rotation"]["w"] == 1.0
    assert message["header"]["stamp"]["sec"] == ACCEPTED.timestamp()
    after = ACCEPTED + timedelta(seconds=0.25)
    later = replace(exported, accepted=after)
    stamp = yaml.safe_load(text("ros", later))["header"]["stamp"]
    assert stamp == {**message["header"]["stamp"], "nanosec": 250_000_000}


def test_statistics_get_each_axis_and_its_uncertainty(
    exported: CalibrationFile,
) -> None:
    read = read_aqdef(text("qdas", exported))

    values = [each["K0001"] for each in read.values]
    np.testing.assert_allclose(values, [*TIP, *U], atol=5e-7)  # as many decimals
    assert (read.part["K1001"], read.part["K1003"]) == ("LP-04", "T-10")
    assert {each["K2142"] for each in read.characteristics} == {"mm"}


def test_statistics_get_operator_station_pen_nominal_and_limits(
    exported: CalibrationFile,
) -> None:
    names = Names("Hall 2", "Ann", "LP-04", "T-10")
    as_found = (-1.4, -90.3, -23.8)
    change = TipChange(ACCEPTED, (0.0,) * 3, (0.0,) * 3, as_found, (0.0,) * 3, 0.2)
    nominal = structs.replace(exported.calibration, nominal_tip_mm=(0.0, -90.0, -25.0))
    whole = replace(exported, names=names, change=change, calibration=nominal)
    read = read_aqdef(text("qdas", whole))

    assert read.catalogues["K4092", 1] == "Ann"
    assert read.catalogues["K4062", 1] == "Hall 2"
    assert read.catalogues["K4072", 1] == "LP-04"
    tip, of_tip = read.characteristics[:3], read.characteristics[3:]
    np.testing.assert_allclose([each["K2101"] for each in tip], [0.0, -90.0, -25.0])
    lower, upper = ([each[key] for each in tip] for key in ("K2110", "K2111"))
    np.testing.assert_allclose(lower, np.array(as_found) - 0.2)
    np.testing.assert_allclose(upper, np.array(as_found) + 0.2)
    largest = nominal.verdict.limits.max_uncertainty_mm
    assert {(each["K2110"], each["K2111"]) for each in of_tip} == {(0.0, largest)}


def test_names_cannot_break_the_lines_of_a_file(exported: CalibrationFile) -> None:
    written = text("qdas", named(exported, pen="LP\nK0001/1 9", tip="T\0"))

    assert [line[:5] for line in written.splitlines()].count("K0001") == 6
    assert "\0" not in written


def test_text_and_table_hold_the_tip(exported: CalibrationFile) -> None:
    (row,) = csv.DictReader(io.StringIO(text("csv", exported)))

    line = text("text", exported).splitlines()[0]
    assert list(map(float, line.split("\t"))) == TIP
    assert [float(row[f"tip_{axis}_mm"]) for axis in "xyz"] == TIP
    assert [float(row[f"expanded_uncertainty_{axis}_mm"]) for axis in "xyz"] == U
    assert (row["pen"], row["tip"]) == ("LP-04", "T-10")


@pytest.mark.parametrize("name", [each.name for each in FORMATS])
def test_every_format_states_origin_and_grade(
    exported: CalibrationFile, name: str, stated: Mapping[str, Any]
) -> None:
    laboratory = Laboratory("Hall 2", "hall2@example.com", "Berlin", "DE")
    written = text(name, exported, laboratory)

    assert written.endswith("\n")
    assert stated["origin"] in written
    assert stated["verdict"]["grade"] in written


@pytest.mark.parametrize("name", [each.name for each in FORMATS if each.has_status])
def test_every_format_states_that_a_tip_is_not_valid(
    exported: CalibrationFile, name: str
) -> None:
    laboratory = Laboratory("Hall 2", "hall2@example.com", "Berlin", "DE")
    bad = replace(
        exported,
        origin=Origin.SIMULATED,
        grade=Grade.CHECK,
        library_status=(RETIRED, OVERDUE),
    )
    good = replace(exported, origin=Origin.LIVE, grade=Grade.PASS)

    assert "SIMULATED, CHECK, RETIRED, OVERDUE" in text(name, bad, laboratory)
    for word in ("SIMULATED", RETIRED, OVERDUE):
        assert word not in text(name, good, laboratory)


def test_retired_and_overdue_tips_are_known_by_their_data_folder(
    stated: Mapping[str, Any], tmp_path: Path
) -> None:
    from benchmarks.small_records import small_record

    names = Names("Hall 2", "Ann", "LP-04", "T-10", "C-1")
    results = FolderArchive(tmp_path)
    calibration = small_record()
    results.store(
        Result(
            names=names,
            accepted=ACCEPTED,
            grade=Grade.PASS,
            record=tmp_path / "records" / "swing",
            images=(),
            calibration=calibration,
            origin=Origin.LIVE,
        )
    )
    (path,) = results.all_files()
    file, now = read_calibration(path), calibration.created + timedelta(days=1)

    assert status_of(with_status(file, now)) == ()
    assert status_of(with_status(file, now + timedelta(days=5000))) == (OVERDUE,)
    by = Author("Hall 2", "Ann")
    add_item(tmp_path, ListedTip(id="T-10"), by, now)
    retire_item(tmp_path, ItemKind.TIP, "T-10", by, now)
    assert status_of(with_status(file, now)) == (RETIRED,)


def test_images_are_a_table_with_a_row_each(
    exported: CalibrationFile, stated: Mapping[str, Any]
) -> None:
    rows = list(csv.DictReader(io.StringIO(text("images", exported))))

    assert [int(row["image"]) for row in rows] == list(range(1, len(rows) + 1))
    assert [row["file"] for row in rows] == [each["file"] for each in stated["frames"]]
    assert [row["reason"] for row in rows].count("") == stated["images"]["used"]


def test_a_result_states_when_it_was_measured_and_when_it_is_due(
    swung: Callable[..., Path], tmp_path: Path
) -> None:
    from benchmarks.small_records import small_record

    swing = Path(shutil.copytree(swung(), tmp_path / "records" / "swing"))
    names = Names("Hall 2", "Ann", "LP-04", "T-10", "C-1")
    results, calibration = FolderArchive(tmp_path), small_record()
    results.store(
        Result(
            names=names,
            accepted=ACCEPTED,
            grade=Grade.PASS,
            record=swing,
            images=(),
            calibration=calibration,
            origin=Origin.LIVE,
        )
    )
    (path,) = results.all_files()
    file = with_status(read_calibration(path), calibration.created)

    assert file.measured == open_record(swing).header.created
    assert file.due is not None
    laboratory = Laboratory("Hall 2", "hall2@example.com", "Berlin", "DE")
    begun = f"<dcc:beginPerformanceDate>{file.measured:%Y-%m-%d}<"
    assert begun in text("dcc", file, laboratory)
