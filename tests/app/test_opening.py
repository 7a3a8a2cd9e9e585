"""A recorded swing that is opened from outside, as by a double click."""

import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from lightpen.record.results.result_folder import RECORDS
from lightpen.record.swings.reading import OPENER, open_record
from lightpen.record.swings.writing import RecordWriter

if TYPE_CHECKING:
    from tests.app.conftest import OpenWizard


@pytest.fixture
def record(tmp_path: Path, swung: Callable[..., Path]) -> Path:
    folder = tmp_path / "data" / RECORDS / "swing"
    shutil.copytree(swung(), folder)
    return folder


@pytest.mark.slow
def test_a_swing_with_a_verdict_is_shown_at_the_step_review(
    open_wizard: "OpenWizard", record: Path
) -> None:
    with RecordWriter.resume(open_record(record)) as writer:
        writer.conclude("check")
    walker = open_wizard()

    walker.workbench.run.open_requested.emit(record / OPENER)

    walker.until(lambda: walker.window.page().key == "review")
    assert walker.workbench.run.status.record_folder == record
    assert len(open_record(record).images) == 20


@pytest.mark.slow
def test_an_interrupted_swing_goes_on_at_the_step_swing(
    open_wizard: "OpenWizard", record: Path
) -> None:
    walker = open_wizard()

    walker.workbench.run.open_requested.emit(record)

    walker.until(lambda: walker.window.page().key == "swing")
    assert walker.workbench.run.status.is_capturing


def test_what_is_no_swing_is_reported_in_a_sentence(
    open_wizard: "OpenWizard", tmp_path: Path
) -> None:
    walker = open_wizard()

    walker.workbench.run.open_requested.emit(tmp_path / "thesis.docx")

    walker.until(
        lambda: any("neither a recorded swing" in text for text in walker.texts())
    )
    assert walker.window.page().key == "start"


APPLICATION = """
import os
from lightpen_app.application import make_application
application = make_application(["lightpen", "open", os.fsdecode(b"swing\\xff")])
print(application.arguments()[-1])
"""


@pytest.mark.slow
def test_a_path_that_is_no_utf_8_does_not_end_the_program() -> None:
    outcome = subprocess.run(
        [sys.executable, "-c", APPLICATION], capture_output=True, text=True, check=True
    )

    assert outcome.stdout == "swing\\udcff\n"
