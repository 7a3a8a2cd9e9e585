"""The wizard on a data folder that cannot be written, mounted read-only."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
TESTS = str(HERE / "in_read_only_folder.py")
LONGEST_S = 200  # on a machine that does other things besides
UNSHARED = ("unshare", "--map-root-user", "--mount")


@pytest.mark.slow
def test_on_a_read_only_folder() -> None:
    if shutil.which("unshare") is None:
        pytest.skip("unshare is not installed, without which nothing can be mounted")
    if subprocess.run([*UNSHARED, "true"], check=False).returncode:
        pytest.skip("nobody may have a name space of their own here")
    command = (sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-q", TESTS)
    outcome = subprocess.run(
        [*UNSHARED, *command],
        cwd=HERE.parents[1],
        env=os.environ | {"QT_QPA_PLATFORM": "offscreen"},
        capture_output=True,
        encoding="utf-8",
        timeout=LONGEST_S,
        check=False,
    )

    assert outcome.returncode == 0, outcome.stdout[-6000:] + outcome.stderr[-2000:]
    assert "1 passed" in outcome.stdout
