"""`lightpen export` writes the tip for who reads it."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import pytest

Run = Callable[..., CompletedProcess[str]]


@pytest.fixture
def record(
    swung: Callable[..., Path], calibration_of: Callable[..., Path], tmp_path: Path
) -> Path:
    """The record of a swing as JSON."""
    made = calibration_of(swung()) / "calibration.json"
    return Path(shutil.copy(made, tmp_path / "tip.json"))


def test_the_tip_of_a_record_is_written(
    lightpen: Run, record: Path, tmp_path: Path
) -> None:
    out = tmp_path / "tip.txt"
    outcome = lightpen("export", record, out, "--for", "text")

    assert outcome.stdout == f"The tip is in {out}.\n"
    tip = json.loads(record.read_bytes())["tip_pen_mm"]
    assert list(map(float, out.read_text().splitlines()[0].split())) == tip


def test_a_record_is_not_replaced_by_its_tip(lightpen: Run, record: Path) -> None:
    before = record.read_bytes()
    outcome = lightpen("export", record, record, "--for", "csv")

    assert outcome.returncode == 2
    assert "would replace its input" in outcome.stderr
    assert record.read_bytes() == before


def test_a_certificate_names_who_calibrated(
    lightpen: Run, record: Path, tmp_path: Path
) -> None:
    out = tmp_path / "tip.xml"
    words = ("export", record, out, "--for", "dcc", "--laboratory", "Hall 2")
    outcome = lightpen(*words, "--email", "hall2@example.com")
    assert outcome.returncode == 2
    assert "--city, --country are missing" in outcome.stderr

    where = ("--email", "hall2@example.com", "--city", "Berlin", "--country")
    assert "is not a country code" in lightpen(*words, *where, "Germany").stderr
    assert not out.exists()
    assert lightpen(*words, *where, "DE").returncode == 0
    assert "<dcc:city>Berlin</dcc:city>" in out.read_text("utf-8")
