"""A check notes what may be honest: no seal, files without entries, times, keys."""

import shutil
from collections.abc import Callable
from contextlib import closing
from datetime import timedelta
from pathlib import Path

import pytest
from msgspec import structs
from tests.core.archive.conftest import accepted
from tests.core.archive.test_logbook import result

from lightpen.archive.chains import append
from lightpen.archive.check import check_file
from lightpen.archive.entries import text_sha256
from lightpen.archive.logbook import ARCHIVE, Logbook
from lightpen.archive.seal import seal_of
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
    with closing(Logbook(data)) as logbook:
        event, _ = accepted(3)
        early = event.at - timedelta(days=4000)
        record = f'{{"created": "{event.at.isoformat()}", "inputs": {{}}}}'
        digest = text_sha256(record)
        event = structs.replace(event, at=early, record_sha256=digest)
        append(logbook.database, logbook.chain, event, record)
    assert notes(data) == {"archive.clock-back", "archive.accepted-too-early"}
