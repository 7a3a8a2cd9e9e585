"""The self-test as a user runs it: the whole program, in a process of its own."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import numpy as np
import pytest

Run = Callable[..., CompletedProcess[str]]
# Ends the program where its Python turns to the network; names of files are none.
WATCHED = """
import os, sys
NETWORK = {"socket." + name for name in ("bind", "connect", "sendto", "getaddrinfo")}

def watch(event, arguments):
    if event in NETWORK and not isinstance(arguments[-1], (str, bytes)):
        os.write(2, f"{event} {arguments}".encode())
        os._exit(9)

sys.addaudithook(watch)
from lightpen_program.__main__ import main
sys.exit(main())
"""
CONNECTS = "import socket; socket.create_connection(('127.0.0.1', 9)); sys.exit(main"
SEEN_NOWHERE = {"QT_QPA_PLATFORM": "offscreen"}


@pytest.mark.slow
def test_the_whole_program_does_without_the_network(tmp_path: Path) -> None:
    homes = {name: str(tmp_path) for name in ("XDG_CONFIG_HOME", "XDG_DATA_HOME")}
    environment = os.environ | SEEN_NOWHERE | homes
    environment.pop("LIGHTPEN_ARCHIVE", None)

    outcomes = [
        subprocess.run(
            [sys.executable, "-c", code, "--self-test", str(tmp_path / "report.json")],
            env=environment,
            capture_output=True,
            encoding="utf-8",
            check=False,
        )
        for code in (WATCHED, WATCHED.replace("sys.exit(main", CONNECTS))
    ]

    assert outcomes[0].returncode == 0, outcomes[0].stderr
    assert outcomes[1].returncode == 9, "a connection was not noticed"


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
    assert report["log"]
    # Nothing of the user's is touched.
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "report 1.json",
        "report 1.png",
    ]
