"""Swings as far as a test needs them."""

import json
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from tests.core.conftest import Station


@pytest.fixture
def solved(
    station: "Station", interrupted: Path, rewrite_header: Callable[..., None]
) -> "Station":
    """A swing that was solved, whose tip can be accepted."""
    rewrite_header(interrupted, limits={"max_uncertainty": 1.0})
    station.go_on(interrupted)
    station.solve()
    return station


@pytest.fixture
def in_force(solved: "Station") -> "Station":
    """A swing whose tip was accepted."""
    solved.accept()
    return solved


@pytest.fixture
def present(station: "Station") -> "Station":
    """Somebody is at the swing, and all is chosen; no image has come yet."""
    station.runner.ask(lambda workflow: workflow.choose(station.preparation))
    station.runner.ask(lambda workflow: workflow.note_arrival())
    return station


@pytest.fixture
def command(
    lightpen: Callable[..., CompletedProcess[str]], tmp_path: Path
) -> Callable[[Path], dict[str, Any]]:
    """Return a function that runs `lightpen calibrate RECORD --json`."""

    def run(folder: Path) -> dict[str, Any]:
        file = tmp_path / "result.json"
        outcome = lightpen("calibrate", folder, "--json", file)
        assert outcome.returncode == 0, outcome.stderr
        fields: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        for own in ("created", "checksum"):
            fields.pop(own)
        return fields

    return run
