"""The record of a calibration is defined once, and keeps its schema."""

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import pytest
from benchmarks.small_records import SMALL, entries_of, record_of, small_record

from lightpen.formats.own_json import DamagedError, record_bytes

if TYPE_CHECKING:
    from jsonschema import Draft202012Validator


def test_what_is_written_keeps_the_schema_and_is_read_back(
    stated: Mapping[str, Any], validator: "Draft202012Validator"
) -> None:
    record = record_of(stated)

    validator.validate(json.loads(record_bytes(record)))
    assert entries_of(record) == stated


def without(path: str) -> Mapping[str, Any]:
    """Return a record that lacks an entry."""
    entries = json.loads(json.dumps(dict(SMALL)))
    *parents, name = path.split(".")
    inner = entries
    for parent in parents:
        inner = inner[int(parent) if parent.isdecimal() else parent]
    del inner[name]
    return entries  # type: ignore[no-any-return]


@pytest.mark.parametrize(
    "path",
    [
        *("tip_pen_mm", "verdict", "verdict.values", "verdict.limits.min_images"),
        *("uncertainty.shares", "instrument", "frames.0.leds", "inputs.pen.sha256"),
    ],
)
def test_a_record_that_lacks_an_entry_is_refused_by_reader_and_schema(
    path: str, validator: "Draft202012Validator"
) -> None:
    with pytest.raises(DamagedError):
        record_of(without(path))
    assert not validator.is_valid(without(path))
    assert validator.is_valid(SMALL)


def seen(*leds: int) -> dict[str, Any]:
    spot = {"x_px": 1.0, "y_px": 1.0, "area_px2": 1.0, "fit": True, "used": True}
    frame, other = SMALL["frames"]
    return {"frames": [{**frame, "leds": [{"led": j, **spot} for j in leds]}, other]}


def lamps(n: int) -> dict[str, Any]:
    frame, other = SMALL["frames"]
    return {"frames": [{**frame, "lamps_px": n * [[1.0, None]]}, other]}


@pytest.mark.parametrize(
    ("entries", "problem"),
    [
        (seen(1, 2), "LED is seen that the pen does not have"),
        (lamps(1), "different numbers of fixed lamps"),
        ({"leds": []}, "instrument is of another pen"),
        (
            {"instrument": {**SMALL["instrument"], "covariance": [[1.0]]}},
            "covariance is of another instrument",
        ),
        ({"method": "third"}, "enum"),
    ],
)
def test_a_record_that_contradicts_itself_is_refused(
    entries: Mapping[str, Any], problem: str
) -> None:
    small_record(seen(1))
    with pytest.raises(DamagedError, match=problem):
        small_record(entries)
