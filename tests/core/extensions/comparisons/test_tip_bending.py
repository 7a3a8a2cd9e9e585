"""The bending of a tip is stored with it in the library, and counts until it is due."""

from dataclasses import replace
from datetime import UTC, date, datetime, timedelta
from pathlib import Path

import pytest
from benchmarks.small_records import small_record

from lightpen.formats.own_json import record_bytes
from lightpen.local_time import local_now
from lightpen.model.bending import ASSUMED_BENDING, measured_on
from lightpen.model.names import Origin
from lightpen.record.calibrations import CalibrationFile, read_calibration
from lightpen.record.library.library_changes import Author, add_item
from lightpen.record.library.tip_library import ListedTip, item_entries, read_library
from lightpen.record.swings.header import Names
from lightpen_extensions.comparisons.press_test import keep_bending
from lightpen_extensions.measure.probing.current_tip import bending_of

NOW = datetime(2025, 11, 3, 12, tzinfo=UTC)
TODAY = local_now().date()


@pytest.fixture
def calibration(tmp_path: Path) -> CalibrationFile:
    """A calibration of tip T-7."""
    path = tmp_path / "tip.json"
    path.write_bytes(record_bytes(small_record()))
    found = read_calibration(path)
    return replace(found, names=Names(pen="P-1", tip="T-7"), origin=Origin.LIVE)


def test_a_press_test_counts_for_its_tip_and_no_other(
    tmp_path: Path, calibration: CalibrationFile
) -> None:
    measured = measured_on(TODAY, 0.003, 0.002)
    keep_bending(tmp_path, "T-7", measured, Author(), NOW)

    found = bending_of(calibration, tmp_path)
    assert found.measured == measured
    assert found.sigma == pytest.approx((0.003**2 + 0.001**2) ** 0.5)
    other = replace(calibration, names=Names(tip="T-8"))
    for each in (other, replace(calibration, origin=Origin.SIMULATED)):
        assert bending_of(each, tmp_path) == ASSUMED_BENDING
    assert bending_of(calibration) == ASSUMED_BENDING  # of no data folder


def test_a_press_test_leaves_the_other_entries_of_a_tip(tmp_path: Path) -> None:
    add_item(tmp_path, ListedTip(id="T-7", ball_diameter_mm=6.0), Author(), NOW)

    keep_bending(tmp_path, "T-7", measured_on(TODAY, -0.003, 0.002), Author(), NOW)

    tip = read_library(tmp_path).tips["T-7"]
    assert tip.ball_diameter_mm == 6.0
    assert item_entries(tip)["bending"] == "-0.003 0.002"


def test_an_overdue_press_test_counts_as_at_least_the_assumed_bending(
    tmp_path: Path, calibration: CalibrationFile
) -> None:
    day = date(2020, 1, 1)
    keep_bending(tmp_path, "T-7", measured_on(day, 0.001, 0.001), Author(), NOW)

    found = bending_of(calibration, tmp_path)

    assert day + timedelta(days=365) < TODAY
    assert found.sigma == ASSUMED_BENDING.sigma
    assert "overdue" in str(found.words)
