"""Tests of `lightpen_extensions.comparisons.pen_health` on a data folder."""

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest
from tests.accepted_tip import accept_tip

from lightpen.estimation.reports.verdict import Grade
from lightpen.formats.files import mark_simulated
from lightpen.formats.opened_files import PenFile
from lightpen.formats.pen_files import write_pen
from lightpen.record.results.result_folder import FolderArchive
from lightpen.swing.preparation import Preparation
from lightpen_extensions.comparisons.pen_health import read_pen_over_time

NOON = datetime(2031, 5, 1, 12, tzinfo=UTC)
LED_ERROR = 0.01  # mm


@pytest.fixture
def off_file(tmp_path: Path, prepared: Preparation) -> Preparation:
    """What is prepared with LEDs of which each may be off by so much."""
    assert prepared.pen is not None
    files = tmp_path / "files"
    files.mkdir()
    mark_simulated(files)
    file = files / "leds.json"
    write_pen(replace(prepared.pen, led_sigma=LED_ERROR), file)
    return replace(prepared, pen_file=PenFile.read(file))


def test_accepted_swings_with_the_led_file_tell_of_the_pen(
    tmp_path: Path, prepared: Preparation, off_file: Preparation
) -> None:
    for seed in (1, 2):
        accept_tip(tmp_path, off_file, seed, LED_ERROR)
    accept_tip(tmp_path, prepared, 3)  # with another file
    reported: list[float] = []
    found = read_pen_over_time(FolderArchive(tmp_path), off_file, reported.append)

    assert reported == [1 / 3, 2 / 3, 1.0]
    assert (len(found.swings), found.n_left_out) == (2, 1)
    assert found.health is not None
    assert found.health.assessment.grade is Grade.STEADY
