"""What an accepted calibration holds, and how it is written."""

import json
from collections.abc import Callable
from dataclasses import fields, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from lightpen.formats.json_records import json_bytes
from lightpen.formats.own_json import with_checksum
from lightpen.model.origin import Origin
from lightpen.record.names import Names
from lightpen.record.results import (
    CALIBRATION,
    Result,
    Since,
    Why,
    has_head,
    parse_heading,
    parse_result,
    result_bytes,
)

NOON = datetime(2026, 1, 2, 12, tzinfo=UTC)
FILE = Path("000001.json")
RESULT = Result(
    names=Names("Halle 3", "Jörg", "LP-04", "T-10", "C-1", 3.0005),
    accepted=NOON,
    grade="pass",
    record=Path("records", "1"),
    images=(1, 2, 4),
    calibration={
        "tip_pen_mm": [1.0, -90.0, -25.0],
        "expanded_uncertainty_mm": [0.003, 0.004, 0.005],
        "cone_cam_mm": [0.0, 200.0, 1000.0],
        "covariance": [[0.25] * 6] * 6,
        "frames": [{"file": "1.png"}, {"file": "2.png"}],
    },
    origin=Origin.LIVE,
    reason="The tip was exchanged.",
    why=Why("verdict.tip-changed", "The tip lies elsewhere."),
    doubts=(Why("warning.drift", "The cone moved."),),
    change=Since(NOON - timedelta(days=1), (0.1, 0.2, 0.3), (0.01, 0.01, 0.01)),
)


def test_the_head_tells_whose_it_is_and_needs_no_more_of_the_file() -> None:
    written = result_bytes(RESULT, "records/1")
    length = written.index(CALIBRATION) + len(CALIBRATION)

    assert has_head(written[:length])
    assert not has_head(written[: length - 1])
    heading = parse_heading(written[:length], FILE)
    assert (heading.format, heading.pen, heading.tip) == (4, "LP-04", "T-10")
    assert heading.record == "records/1"
    assert list(json.loads(written))[-2:] == ["checksum", "calibration"]


@pytest.mark.parametrize(
    "text", [',\n  "calibration": ', '"calibration": {', ', "checksum": "']
)
def test_a_name_like_the_end_of_the_head_is_no_end(text: str) -> None:
    named = replace(RESULT, names=replace(RESULT.names, pen=text))

    assert parse_heading(result_bytes(named, "records/1"), FILE).pen == text


def test_each_image_has_a_line_of_its_own_to_be_read_by_people() -> None:
    lines = result_bytes(RESULT, "records/1").decode().splitlines()

    assert '    {"file": "1.png"},' in lines
    assert '    {"file": "2.png"}' in lines


def test_what_is_written_is_read_back() -> None:
    locate: Callable[[str], Path] = {"here": Path("there")}.__getitem__

    found = parse_result(result_bytes(RESULT, "here"), FILE, locate)

    assert found.record == Path("there")
    assert found.calibration == RESULT.calibration
    for each in fields(RESULT):
        if each.name not in ("record", "calibration"):
            assert getattr(found, each.name) == getattr(RESULT, each.name), each.name


def test_a_result_of_format_3_does_not_say_what_its_images_are_of() -> None:
    data = result_bytes(RESULT, "records/1")
    head, calibration, rest = data.partition(CALIBRATION)
    entries = json.loads(head + b"}")
    for name in ("checksum", "origin", "reason", "why", "doubts", "change"):
        del entries[name]
    old = with_checksum(json_bytes({**entries, "format": 3})).removesuffix(b"}")

    found = parse_result(old + calibration + rest, FILE, Path)

    assert (found.origin, found.reason, found.why) == (None, "", None)
    assert found.tip_pen.tolist() == RESULT.tip_pen.tolist()
