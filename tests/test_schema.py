"""Records are as their published schema says, and the schema is of use."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator


@pytest.fixture(scope="module")
def fields(
    swung: Callable[..., Path], calibration_of: Callable[..., Path]
) -> dict[str, Any]:
    """The record of a recorded swing."""
    file = calibration_of(swung()) / "calibration.json"
    written: dict[str, Any] = json.loads(file.read_bytes())
    return written


def test_a_record_is_as_the_schema_says(
    validator: Draft202012Validator, fields: dict[str, Any]
) -> None:
    assert [error.message for error in validator.iter_errors(fields)] == []


@pytest.mark.parametrize(
    "change",
    [
        {"tip_pen_mm": [1.0, 2.0]},
        {"tip_pen_mm": None},
        {"origin": "moon"},
        {"images": {"total": 1}},
        {"an_entry_more": 1},
    ],
)
def test_a_record_that_is_otherwise_is_refused(
    validator: Draft202012Validator, fields: dict[str, Any], change: dict[str, object]
) -> None:
    assert not validator.is_valid(fields | change)


@pytest.mark.slow
def test_an_entry_cannot_be_left_out(
    validator: Draft202012Validator, fields: dict[str, Any]
) -> None:
    for name in set(fields) - {"checksum"}:  # which a result keeps elsewhere
        assert not validator.is_valid({k: v for k, v in fields.items() if k != name})
