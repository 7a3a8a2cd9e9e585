"""A check notes what may be honest: no seal, files without entries, times, keys."""

import shutil
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import pytest
from msgspec import structs
from tests.core.archive.test_logbook import result

from lightpen.archive.chains.seal import seal_of
from lightpen.archive.checks.check import check_file
from lightpen.archive.logbook.logbook import ARCHIVE, Logbook
from lightpen.record.results.result_folder import RECORDS, FolderArchive


@pytest.fixture
def data(tmp_path: Path, swung: Callable[..., Path]) -> Path:
    """A data folder with two accepted tips, closed."""
    folder = tmp_path / "data"
    shutil.copytree(swung(), folder / RECORDS / "swing")
    for n in range(2):
        FolderArchive(folder).store(result(folder, n))
    with closing(Logbook(folder)) as logbook:
        logbook.enter_owed()
    return folder


def notes(data: Path) -> set[str]:
    checked = check_file(data / ARCHIVE, data, lambda fraction: None)
    assert checked.findings == ()
    return {each.code for each in checked.notes}


@pytest.mark.slow
def test_of_an_honest_history_nothing_is_noted(data: Path) -> None:
    assert notes(data) == set()


def test_a_missing_seal_is_noted(data: Path) -> None:
    seal_of(data / ARCHIVE).unlink()
    assert notes(data) == {"archive.no-seal"}


def test_a_file_without_an_entry_is_noted(data: Path) -> None:
    FolderArchive(data).store(result(data, 2))
    assert notes(data) == {"archive.file-not-entered"}


def test_impossible_times_are_noted(data: Path) -> None:
    usual = result(data, 2)
    early = usual.accepted - timedelta(days=1)
    calibration = structs.replace(usual.calibration, created=usual.accepted)
    FolderArchive(data).store(replace(usual, accepted=early, calibration=calibration))
    with closing(Logbook(data)) as logbook:
        assert logbook.enter_owed() == ()
    assert notes(data) == {"archive.clock-back", "archive.accepted-too-early"}
