"""The self-test as a user runs it: the whole program, in a process of its own."""

import json
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import numpy as np
import pytest

Run = Callable[..., CompletedProcess[str]]
SEEN_NOWHERE = {"QT_QPA_PLATFORM": "offscreen"}


@pytest.mark.slow
def test_the_program_finds_itself_whole_and_the_tip_of_a_rendered_swing(
    script: Run, tmp_path: Path
) -> None:
    homes = {name: str(tmp_path) for name in ("XDG_CONFIG_HOME", "XDG_DATA_HOME")}
    file = tmp_path / "report 1.json"

    outcome = script(
        "--self-test", str(file), environment=SEEN_NOWHERE | homes, timeout=280
    )

    assert outcome.returncode == 0, outcome.stderr + file.read_text(encoding="utf-8")
    report = json.loads(file.read_text(encoding="utf-8"))
    assert report["ok"] is True
    found, true = (np.array(report["tip"][key]) for key in ("found_mm", "true_mm"))
    assert np.linalg.norm(found - true) <= np.linalg.norm(
        report["tip"]["expanded_uncertainty_mm"]
    )
    assert any("verdict: pass: U" in line for line in report["log"])
    # Nothing of the user's is touched.
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "report 1.json",
        "report 1.png",
    ]
