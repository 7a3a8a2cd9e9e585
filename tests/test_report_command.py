"""``lightpen report`` as a user runs it."""

from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import pytest

from lightpen.errors import FileError
from lightpen.formats.json_records import record_bytes
from lightpen_app.reporting import write_paper

UNSEEN = {"QT_QPA_PLATFORM": "", "DISPLAY": "", "WAYLAND_DISPLAY": ""}


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


def test_a_tampered_record_is_not_put_on_paper(
    stated: dict[str, Any], tmp_path: Path
) -> None:
    record, out = tmp_path / "tip.json", tmp_path / "tip.pdf"
    record.write_bytes(record_bytes(stated).replace(b'"recorded"', b'"live camera"'))

    with pytest.raises(FileError, match="was modified or damaged after it was written"):
        write_paper(record, out, "en")

    assert not out.exists()
