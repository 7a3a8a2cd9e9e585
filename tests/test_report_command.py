"""``lightpen report`` as a user runs it."""

from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import pytest

from lightpen.errors import FileError
from lightpen.estimation.reports.verdict import Grade
from lightpen.formats.own_json import record_bytes, record_heading
from lightpen.local_time import local_now
from lightpen_app_extensions.report.command import write_report
from lightpen_app_extensions.report.content import print_report_of, read_content
from lightpen_extensions.comparisons.assessment import (
    USE_TIP,
    VERIFY_AGAIN,
    VerificationAssessment,
    verification_record,
)
from lightpen_program.extensions import main

UNSEEN = {"QT_QPA_PLATFORM": "", "DISPLAY": "", "WAYLAND_DISPLAY": ""}


@pytest.mark.slow
def test_a_record_is_put_on_paper_without_a_display(
    script: Callable[..., CompletedProcess[str]], stated: dict[str, Any], tmp_path: Path
) -> None:
    record, out = tmp_path / "tip.json", tmp_path / "tip.pdf"
    record.write_bytes(record_bytes(stated))

    words = ("report", record, "--out", out, "--language", "zh_CN")
    outcome = script(*words, environment=UNSEEN)

    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert "tip.pdf" in outcome.stdout
    assert out.read_bytes().startswith(b"%PDF-1.4")


def test_a_result_is_not_replaced_by_its_record_on_paper(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["report", "tip.json", "--out", "./tip.json"]) == 2
    assert "would replace its input" in capsys.readouterr().err


@pytest.fixture
def verification(tmp_path: Path) -> Path:
    """A verification with all kinds of figures."""
    verdict = VerificationAssessment(Grade.CHECK, USE_TIP, VERIFY_AGAIN)
    entries = {
        "pen": "LP-04",
        "tip": "T-10",
        "origin": "simulated",
        "moved_mm": [0.001, 0.002, 0.003],
        "wants_other_tip": False,
        "runs": [{"name": "before", "radius_mm": 31.751, "points": [1.0] * 5}],
        "calibrated": {"points_cam_mm": [[1.0, 2.0, 3.0]] * 4},
    }
    record = verification_record("drift", entries, verdict, {"drift": 0.02}, {})
    file = tmp_path / "drift.json"
    file.write_bytes(record_bytes(record))
    return file


@pytest.mark.slow
@pytest.mark.usefixtures("qapp")  # text is measured by the fonts of an application
def test_a_verification_is_put_on_paper(
    script: Callable[..., CompletedProcess[str]], verification: Path, tmp_path: Path
) -> None:
    out = tmp_path / "drift.pdf"
    outcome = script("report", verification, "--out", out, environment=UNSEEN)

    assert outcome.returncode == 0, outcome.stderr
    assert out.read_bytes().startswith(b"%PDF-1.4")
    report = print_report_of(read_content(verification, None))
    assert report.margins.badges == ("SIMULATED", "CHECK")
    assert report.margins.subject == "Pen LP-04, tip T-10, drift"


def test_a_tampered_verification_is_not_put_on_paper(
    verification: Path, tmp_path: Path
) -> None:
    verification.write_bytes(verification.read_bytes().replace(b"0.003", b"0.001"))

    with pytest.raises(FileError, match="damaged"):
        write_report(verification, tmp_path / "drift.pdf", "en")


def test_a_tampered_record_is_not_put_on_paper(
    stated: dict[str, Any], tmp_path: Path
) -> None:
    record, out = tmp_path / "tip.json", tmp_path / "tip.pdf"
    record.write_bytes(record_bytes(stated).replace(b'"recorded"', b'"live camera"'))

    with pytest.raises(FileError, match="was modified or damaged after it was written"):
        write_report(record, out, "en")

    assert not out.exists()


@pytest.mark.slow
def test_a_measured_part_is_put_on_paper(
    script: Callable[..., CompletedProcess[str]], tmp_path: Path
) -> None:
    touch = {"feature": "hole", "deviation_cam_mm": [0.001, 0.0, 0.0]}
    characteristic = {
        "name": "diameter hole",
        "nominal": 20.0,
        "lower_limit": 19.95,
        "upper_limit": 20.05,
        "actual": 20.01,
        "deviation": 0.01,
        "expanded_uncertainty": 0.004,
        "independent_expanded_uncertainty": 0.006,
        "probability_of_conformity": 0.9,
        "decision": "accepted",
    }
    feature = {
        "name": "hole",
        "kind": "circle",
        "side": "inside",
        "side_by": "approach",
        "origin_mm": [0.0, 1.0, 2.0],
        "expanded_uncertainty": [0.1] * 7,
        "sizes": {"radius": 10.005},
        "form_error_mm": 0.002,
        "n_touches": 3,
    }
    refinement = {
        "features": ["hole"],
        "is_used": True,
        "tip_shift_pen_mm": [0.001, 0.002, 0.003],
        "tip_expanded_uncertainty_before_mm": [0.01, 0.01, 0.01],
        "tip_expanded_uncertainty_after_mm": [0.005, 0.005, 0.005],
        "chi_square": 8.5,
        "degrees_of_freedom": 9,
    }
    again = {**touch, "feature": "hole", "point_cam_mm": [5.0, 6.0, 900.0]}
    record = {
        **record_heading(local_now()),
        "verification": "part",
        "refinement": refinement,
        "pen": "LP-04",
        "tip": "T-10",
        "alignment": None,
        "characteristics": [characteristic],
        "features": [feature],
        "plan": {"features": [{"name": "hole", "kind": "circle"}]},
        "touches": [
            {**touch, "point_cam_mm": [float(i), float(i * i), 900.0]} for i in range(3)
        ]
        + [again],
        "inputs": {},
    }
    file, out = tmp_path / "part.json", tmp_path / "part.pdf"
    file.write_bytes(record_bytes(record))

    outcome = script("report", file, "--out", out, environment=UNSEEN)

    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert out.read_bytes().startswith(b"%PDF-1.4")
