"""A tip as other programs read it says the same tip in each of their languages."""

import csv
import io
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml

from lightpen.model.assumptions import USUAL
from lightpen.record.calibrations import CalibrationFile
from lightpen.record.interchange import (
    TEXT_OF,
    offset_csv,
    offset_text,
    plus_transform,
    qdas_file,
    ros_transform,
    slicer_transform,
)

TIP, U = [-1.5, -90.25, -23.875], [0.001, 0.0025, 0.002]
# Slicer's axes point right, to the front and up, ITK's left, to the back and up.
RAS_FROM_LPS = np.diag([-1.0, -1.0, 1.0, 1.0])


@pytest.fixture
def calibration() -> CalibrationFile:
    return made()


def made(pen: str = "LP-04", tip: str = "T-10") -> CalibrationFile:
    none: Any = None
    return CalibrationFile(
        path=Path("result.json"),
        pen=pen,
        tip=tip,
        grade="pass",
        when=datetime(2026, 8, 14, 9, 30, tzinfo=UTC),
        method="joint",
        tip_pen=np.array(TIP),
        cone_cam=np.zeros(3),
        covariance=np.eye(6),
        uncertainty=np.array(U),
        sigma=0.02,
        nominal_tip=None,
        camera_sha256="",
        seen_by=("",),
        pen_sha256="",
        pen_file="",
        displacements=none,
        instrument=None,
        frames=(),
        used=none,
        pixels=none,
        areas=none,
        edge_widths=none,
        assumptions=USUAL,
        lamps=none,
        is_of_rig=False,
        has_checksum=True,
    )


def test_slicer_finds_the_tip_where_it_is(calibration: CalibrationFile) -> None:
    """Slicer inverts what it reads, and turns it into its own axes."""
    fields = dict(
        line.split(": ")
        for line in slicer_transform(calibration).splitlines()
        if ": " in line
    )
    assert fields["Transform"] == "AffineTransform_double_3_3"
    numbers = np.array(fields["Parameters"].split(), dtype=float)
    from_parent = np.eye(4)
    from_parent[:3, :3] = numbers[:9].reshape(3, 3)
    from_parent[:3, 3] = numbers[9:]
    to_parent = np.linalg.inv(RAS_FROM_LPS @ from_parent @ RAS_FROM_LPS)

    np.testing.assert_array_equal(to_parent[:3, 3], TIP)


def test_plus_reads_a_transform_of_tip_to_stylus(calibration: CalibrationFile) -> None:
    element = ElementTree.fromstring(plus_transform(calibration))
    matrix = np.array(element.attrib["Matrix"].split(), dtype=float).reshape(4, 4)

    assert (element.attrib["From"], element.attrib["To"]) == ("StylusTip", "Stylus")
    np.testing.assert_array_equal(matrix[:, 3], [*TIP, 1.0])


def test_ros_reads_metres(calibration: CalibrationFile) -> None:
    message = yaml.safe_load(ros_transform(calibration))
    shift = message["transform"]["translation"]

    np.testing.assert_allclose([shift[a] for a in "xyz"], np.array(TIP) / 1000)
    assert message["transform"]["rotation"]["w"] == 1.0
    assert message["header"]["stamp"]["sec"] == calibration.when.timestamp()
    later = replace(calibration, when=calibration.when + timedelta(seconds=0.25))
    stamp = yaml.safe_load(ros_transform(later))["header"]["stamp"]
    assert stamp == {**message["header"]["stamp"], "nanosec": 250_000_000}


def test_statistics_get_each_axis_and_its_uncertainty(
    calibration: CalibrationFile,
) -> None:
    fields = dict(line.split(" ", 1) for line in qdas_file(calibration).splitlines())

    n_characteristics = int(fields["K0100"])
    values = [float(fields[f"K0001/{i + 1}"]) for i in range(n_characteristics)]
    np.testing.assert_allclose(values, [*TIP, *U], atol=5e-7)  # as many decimals
    assert (fields["K1001"], fields["K1003"]) == ("LP-04", "T-10")
    assert {fields[f"K2142/{i + 1}"] for i in range(n_characteristics)} == {"mm"}


def test_names_cannot_break_the_lines_of_a_file() -> None:
    text = qdas_file(made(pen="LP\nK0001/1 9", tip="T\0"))

    assert [line[:5] for line in text.splitlines()].count("K0001") == 6
    assert "\0" not in text


def test_text_and_table_hold_the_tip(calibration: CalibrationFile) -> None:
    (row,) = csv.DictReader(io.StringIO(offset_csv(calibration)))

    assert list(map(float, offset_text(calibration).split("\t"))) == TIP
    assert [float(row[f"tip_{axis}_mm"]) for axis in "xyz"] == TIP
    assert [float(row[f"expanded_uncertainty_{axis}_mm"]) for axis in "xyz"] == U
    assert (row["pen"], row["tip"]) == ("LP-04", "T-10")


@pytest.mark.parametrize("reader", TEXT_OF)
def test_every_text_ends_with_a_line(calibration: CalibrationFile, reader: str) -> None:
    assert TEXT_OF[reader](calibration).endswith("\n")
