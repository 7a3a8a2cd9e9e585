"""Tests of `lightpen.comparisons.pen_over_time`."""

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest
from tests.accepted_tip import accept_tip

from lightpen.comparisons.pen_over_time import adjust_together, read_pen_over_time
from lightpen.errors import CalibrationError
from lightpen.estimation.reports.verdict import Grade
from lightpen.formats.files import is_simulated, mark_simulated, sha256
from lightpen.formats.opened_files import PenFile
from lightpen.formats.pen_files import read_pen, write_pen
from lightpen.record.results.result_folder import SIMULATED, FolderArchive
from lightpen.swing.preparation import Preparation

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


@pytest.mark.slow
def test_a_better_led_file_is_a_new_one_and_names_its_parent(
    tmp_path: Path, off_file: Preparation
) -> None:
    files = [accept_tip(tmp_path, off_file, seed, LED_ERROR) for seed in (1, 2, 3, 4)]
    assert off_file.pen_file is not None
    old = off_file.pen_file.path
    before = old.read_bytes()
    mark_simulated(tmp_path / SIMULATED)
    archive = FolderArchive(tmp_path)
    reported: list[float] = []
    first = adjust_together(archive, off_file, files, NOON, reported.append)
    second = adjust_together(archive, off_file, files, NOON)

    assert first.path != second.path
    assert old.read_bytes() == before
    assert sha256(old) in first.path.read_text()
    assert is_simulated(first.path)
    better = read_pen(first.path)
    assert better.led_covariance is not None
    assert first.improved.sigma_after < first.improved.sigma_before
    assert reported[-1] == 1.0


def test_only_the_chosen_swings_are_adjusted_together(
    tmp_path: Path, prepared: Preparation
) -> None:
    files = [accept_tip(tmp_path, prepared, seed) for seed in (1, 2)]
    archive = FolderArchive(tmp_path)

    with pytest.raises(CalibrationError, match="Swings given: 1"):
        adjust_together(archive, prepared, files[:1], NOON)

    assert not list(tmp_path.rglob("led files/*"))
