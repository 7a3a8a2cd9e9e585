"""What an accepted calibration holds, and how it is written."""

import json
from collections.abc import Callable
from dataclasses import fields, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from benchmarks.small_records import small_record

from lightpen.estimation.reports.verdict import Grade
from lightpen.formats.own_json import FORMAT, StoredMessage
from lightpen.model.names import Origin
from lightpen.record.results.results import (
    Result,
    TipChange,
    parse_heading,
    parse_result,
    result_bytes,
)
from lightpen.record.swings.header import Names

NOON = datetime(2026, 1, 2, 12, tzinfo=UTC)
FILE = Path("000001.json")
RESULT = Result(
    names=Names("Halle 3", "Jörg", "LP-04", "T-10", "C-1", 3.0005),
    accepted=NOON,
    grade=Grade.PASS,
    record=Path("records", "1"),
    images=(1, 2, 4),
    calibration=small_record(
        {
            "tip_pen_mm": [1.0, -90.0, -25.0],
            "expanded_uncertainty_mm": [0.003, 0.004, 0.005],
            "cone_cam_mm": [0.0, 200.0, 1000.0],
            "covariance": [[0.25] * 6] * 6,
        }
    ),
    origin=Origin.LIVE,
    reason="The tip was exchanged.",
    why=StoredMessage("verdict.tip-changed", "The tip lies elsewhere.", {}),
    doubts=(StoredMessage("warning.drift", "The cone moved.", {"distance": 0.1}),),
    change=TipChange(
        accepted=NOON - timedelta(days=1),
        difference_mm=(0.1, 0.2, 0.3),
        expanded_uncertainty_mm=(0.01, 0.01, 0.01),
        as_found_mm=(0.9, -90.2, -25.3),
        as_found_expanded_uncertainty_mm=(0.01, 0.01, 0.01),
    ),
)


def test_the_head_tells_whose_it_is() -> None:
    written = result_bytes(RESULT, "records/1")

    heading = parse_heading(written, FILE)
    assert heading.format == FORMAT
    assert heading.names == RESULT.names
    assert heading.record == "records/1"
    assert list(json.loads(written))[-2:] == ["checksum", "calibration"]


@pytest.mark.parametrize(
    "text", [',\n  "calibration": ', '"calibration": {', ', "checksum": "']
)
def test_a_name_like_the_end_of_the_head_is_no_end(text: str) -> None:
    named = replace(RESULT, names=replace(RESULT.names, pen=text))

    assert parse_heading(result_bytes(named, "records/1"), FILE).names == named.names


def test_each_image_has_a_line_of_its_own_to_be_read_by_people() -> None:
    lines = result_bytes(RESULT, "records/1").decode().splitlines()

    frames = [line for line in lines if line.startswith('    {"file": ')]
    assert [json.loads(line.rstrip(","))["file"] for line in frames] == [
        "1.png",
        "2.png",
    ]


def test_what_is_written_is_read_back() -> None:
    locate: Callable[[str], Path] = {"here": Path("there")}.__getitem__

    found = parse_result(result_bytes(RESULT, "here"), FILE, locate)

    assert found.record == Path("there")
    assert found.calibration == RESULT.calibration
    for each in fields(RESULT):
        if each.name not in ("record", "calibration"):
            assert getattr(found, each.name) == getattr(RESULT, each.name), each.name
