"""Tests of `lightpen measure`."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import pytest

TOLERANCE = re.compile(r"tolerance: [0-9.]+")

Run = Callable[..., CompletedProcess[str]]
PLAN = """\
name: Two runs of one ring
features:
  - {name: run_01, kind: circle, touches: 8}
  - {name: run_02, kind: circle}
characteristics:
  - {quantity: radius, of: [run_01], nominal: 31.751, tolerance: 0.1}
  - {quantity: distance, of: [run_01, run_02], nominal: 0}
  - {quantity: roundness, of: [run_02], tolerance: 0.2}
"""


@pytest.fixture
def plan(tmp_path: Path) -> Path:
    file = tmp_path / "plan.yaml"
    file.write_text(PLAN, encoding="utf-8")
    return file


@pytest.fixture
def files(shared_data: Path, swing_full: Path) -> list[str | Path]:
    folder = shared_data / "circle"
    return [
        *("--camera", folder / "camera.yaml", "--pen", folder / "leds.csv"),
        *("--tip", swing_full / "calibration.json", "--frames", "1"),
    ]


@pytest.mark.slow
def test_recorded_touches_are_measured_by_a_plan(
    shared_data: Path,
    lightpen: Run,
    plan: Path,
    files: list[str | Path],
    tmp_path: Path,
) -> None:
    json_file = tmp_path / "part.json"
    csv, qif = tmp_path / "part.csv", tmp_path / "part.qif"
    exports = "--export", csv, "--export", qif
    words = "measure", plan, shared_data / "circle", *files, "--json", json_file

    outcome = lightpen(*words, *exports)

    assert outcome.returncode == 0, outcome.stderr
    assert "radius run_01" in outcome.stdout
    assert "radius run_01" in csv.read_text(encoding="utf-8")
    assert qif.read_text(encoding="utf-8").count("CharacteristicMeasurement id") == 3
    radius, distance, roundness = json.loads(json_file.read_bytes())["characteristics"]
    assert radius["deviation"] == pytest.approx(0, abs=0.02)
    assert radius["decision"] == roundness["decision"] == "accepted"
    assert radius["probability_of_conformity"] > 0.99
    assert 0 < distance["expanded_uncertainty"] < 0.1
    first = json_file.read_bytes()
    lightpen(*words)
    again = json.loads(json_file.read_bytes())
    assert again["features"] == json.loads(first)["features"]


@pytest.mark.parametrize(
    ("options", "rule", "is_open"),
    [
        ((), "simple acceptance", False),
        (("--decision-rule", "guard-band"), "guard band", True),
        (("--decision-rule", "risk", "--max-risk", "10"), "at most 10 %", True),
    ],
)
def test_a_plan_without_a_rule_is_judged_by_the_one_given(
    shared_data: Path,
    lightpen: Run,
    plan: Path,
    files: list[str | Path],
    tmp_path: Path,
    options: tuple[str, ...],
    rule: str,
    is_open: bool,
) -> None:
    narrow = TOLERANCE.sub("tolerance: 0.0005", PLAN)  # U is larger
    plan.write_text(narrow, encoding="utf-8")
    json_file = tmp_path / "part.json"

    words = ("measure", plan, shared_data / "circle", *files, "--json", json_file)
    outcome = lightpen(*words, *options)

    assert rule in outcome.stdout
    record = json.loads(json_file.read_bytes())
    decisions = {each["decision"] for each in record["characteristics"]}
    assert ("open" in decisions) == is_open
    assert rule in record["verdict"]["decision_rule"]


@pytest.mark.parametrize(
    ("old", "new", "reported"),
    [
        ("kind: circle}", "kind: ring}", "'ring' is no word that the plan knows there"),
        ("touches: 8", "touches: 2", "a circle needs 3 touches"),
        ("of: [run_02]", "of: [run_03]", "there is no feature 'run_03'"),
        ("name: run_02", "name: run_01", "'run_01' is defined twice"),
        ("features:", "featured:", "the entry 'featured' is unknown"),
        ("touches: 8", "touches: 800", "has 20 probed points; the plan needs 800"),
        ("quantity: radius", "quantity: cone angle", "is not defined for run_01"),
    ],
)
def test_a_bad_plan_is_refused_in_a_sentence(
    shared_data: Path,
    lightpen: Run,
    plan: Path,
    files: list[str | Path],
    old: str,
    new: str,
    reported: str,
) -> None:
    plan.write_text(PLAN.replace(old, new), encoding="utf-8")

    outcome = lightpen("measure", plan, shared_data / "circle", *files)

    assert outcome.returncode in {1, 2}
    assert reported in outcome.stderr
    assert outcome.stdout == ""


def test_touches_of_an_unknown_feature_are_refused(
    shared_data: Path, lightpen: Run, plan: Path, files: list[str | Path]
) -> None:
    place = f"hole={shared_data / 'circle' / 'run_01'}"

    outcome = lightpen("measure", plan, place, *files)

    assert outcome.returncode == 2
    assert "Its features are: run_01, run_02." in outcome.stderr
