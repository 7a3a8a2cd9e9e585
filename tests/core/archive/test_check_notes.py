"""A check notes what may be honest: files without entries, and keys."""

import shutil
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest
from tests.core.archive.test_logbook import result

from lightpen.archive.checks import check_file
from lightpen.archive.logbook import Logbook
from lightpen.record.library.entered_files import ARCHIVE
from lightpen.record.library.signing import KEYS
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


def test_a_file_without_an_entry_is_noted(data: Path) -> None:
    FolderArchive(data).store(result(data, 2))
    assert notes(data) == {"archive.file-owed"}


def test_a_file_that_the_program_did_not_write_is_noted(data: Path) -> None:
    results = data / "results"
    shutil.copy(results / "000002.json", results / "000003.json")
    assert notes(data) == {"archive.file-not-entered"}


def test_an_archive_of_another_account_is_noted(
    data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(KEYS, str(tmp_path / "other keys"))
    assert notes(data) == {"archive.unknown-here"}
