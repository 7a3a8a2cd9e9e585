"""What is put on paper is what the file states, and no other file passes for one."""

import json
from datetime import UTC, datetime
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest
from benchmarks.small_records import record_of

from lightpen.errors import FileError, LightpenError, UsageError
from lightpen.estimation.reports.verdict import Grade
from lightpen.formats.own_json import StoredMessage, record_bytes
from lightpen.model.names import Origin
from lightpen.record.calibrations import read_calibration
from lightpen.record.results.results import Result, result_bytes
from lightpen.record.swings.header import Names

NOON = datetime(2026, 1, 2, 12, tzinfo=UTC)
WHY = StoredMessage("verdict.tip-changed", "The tip lies elsewhere.", {})


@pytest.fixture
def result(stated: dict[str, Any]) -> Result:
    """Return an accepted result whose grade is not that of its calibration alone."""
    return Result(
        names=Names("Hall 3", "Ann", "LP-04", "T-10", "C-1", 3.0),
        accepted=NOON,
        grade=Grade.CHECK,
        record=Path("records", "1"),
        images=(1, 2),
        calibration=record_of(stated),
        origin=Origin.LIVE,
        reason="It was exchanged.",
        why=WHY,
    )


def test_a_result_states_what_was_known_when_it_was_accepted(
    result: Result, tmp_path: Path
) -> None:
    path = tmp_path / "000001.json"
    path.write_bytes(result_bytes(result, "records/1"))

    calibration_file = read_calibration(path)

    assert calibration_file.sha256 == sha256(path.read_bytes()).hexdigest()
    assert (calibration_file.grade, calibration_file.why) == (Grade.CHECK, WHY)
    assert calibration_file.calibration.verdict.grade is Grade.PASS
    assert (calibration_file.names, calibration_file.when) == (result.names, NOON)
    assert (calibration_file.reason, calibration_file.origin) == (
        "It was exchanged.",
        Origin.LIVE,
    )


def test_a_record_that_nobody_accepted_states_its_own_verdict(
    stated: dict[str, Any], tmp_path: Path
) -> None:
    path = tmp_path / "tip.json"
    path.write_bytes(record_bytes(stated))

    calibration_file = read_calibration(path)

    assert (calibration_file.accepted, calibration_file.names) == (None, Names())
    assert calibration_file.grade is Grade.PASS
    assert calibration_file.calibration.tip_pen_mm == tuple(stated["tip_pen_mm"])
    assert len(calibration_file.calibration.frames) == stated["images"]["total"]


@pytest.mark.parametrize("figure", ["tip_pen_mm", "expanded_uncertainty_mm"])
@pytest.mark.parametrize("is_accepted", [True, False])
def test_a_file_that_was_changed_is_refused(
    result: Result,
    stated: dict[str, Any],
    tmp_path: Path,
    figure: str,
    is_accepted: bool,
) -> None:
    path = tmp_path / "000001.json"
    written = result_bytes(result, "1") if is_accepted else record_bytes(stated)
    before = json.dumps(stated[figure])
    assert before.encode() in written
    digit = next(d for d in before if d in "12345678")
    after = before.replace(digit, str(int(digit) + 1), 1)
    path.write_bytes(written.replace(before.encode(), after.encode(), 1))

    with pytest.raises(FileError, match="damaged"):
        read_calibration(path)


@pytest.mark.parametrize("data", [b"", b"%PDF-1.4", b"[1, 2]", b'{"tip": 1}'])
def test_what_is_no_calibration_is_refused(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "other.json"
    path.write_bytes(data)

    with pytest.raises(LightpenError, match=r"other\.json"):
        read_calibration(path)


@pytest.mark.parametrize(
    "missing", ["verdict", "uncertainty", "coverage", "frames", "inputs"]
)
def test_a_record_that_lacks_what_is_put_on_paper_is_refused(
    stated: dict[str, Any], tmp_path: Path, missing: str
) -> None:
    path = tmp_path / "tip.json"
    path.write_bytes(record_bytes({k: v for k, v in stated.items() if k != missing}))

    with pytest.raises(UsageError, match="not a calibration record"):
        read_calibration(path)


def test_an_led_that_the_pen_does_not_have_is_refused(
    stated: dict[str, Any], tmp_path: Path
) -> None:
    path = tmp_path / "tip.json"
    spot = {"led": 99, "x_px": 1.0, "y_px": 1.0, "area_px2": 1.0, "used": True}
    frames = [{**stated["frames"][0], "leds": [spot]}, *stated["frames"][1:]]
    path.write_bytes(record_bytes({**stated, "frames": frames}))

    with pytest.raises(UsageError, match="not a calibration record"):
        read_calibration(path)
