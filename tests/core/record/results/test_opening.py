"""Which swing is meant by what is opened from outside the program."""

import shutil
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import pytest
from benchmarks.small_records import small_record

from lightpen.errors import FileError
from lightpen.estimation.reports.verdict import Grade
from lightpen.record.results.result_folder import RECORDS, FolderArchive, swing_folder
from lightpen.record.results.results import Result
from lightpen.record.swings.header import Names
from lightpen.record.swings.reading import OPENER


@pytest.fixture
def record(tmp_path: Path, swung: Callable[..., Path]) -> Path:
    folder = tmp_path / RECORDS / "swing ä 一"
    shutil.copytree(swung(), folder)
    return folder


@pytest.fixture
def result(tmp_path: Path, record: Path) -> Path:
    archive = FolderArchive(tmp_path)
    archive.store(
        Result(
            names=Names("Hall 2", "Ann", "LP-04", "T-10", "C-1", 10.0),
            accepted=datetime(2026, 8, 14, 9, 5, tzinfo=UTC),
            grade=Grade.PASS,
            record=record,
            images=(),
            calibration=small_record(),
        )
    )
    (file,) = archive.folder.iterdir()
    return file


@pytest.mark.parametrize("name", ["", OPENER, "header.json", "journal.jsonl"])
def test_a_swing_is_opened_by_its_folder_or_any_file_in_it(
    record: Path, name: str
) -> None:
    assert (record / name).exists()
    assert swing_folder(record / name) == record


def test_a_result_leads_to_the_swing_that_it_comes_from(
    record: Path, result: Path
) -> None:
    assert swing_folder(result) == record


def test_a_result_whose_swing_is_gone_says_where_it_was(
    record: Path, result: Path
) -> None:
    shutil.rmtree(record)

    with pytest.raises(FileError, match=r"is not in .*swing ä 一\. Copy it back"):
        swing_folder(result)


def test_a_damaged_result_is_refused_by_its_name(result: Path) -> None:
    result.write_bytes(result.read_bytes().replace(b"Ann", b"Bob"))

    with pytest.raises(FileError, match=r"000001\.json is damaged"):
        swing_folder(result)


def test_another_file_is_refused_with_what_can_be_opened(tmp_path: Path) -> None:
    file = tmp_path / "thesis.docx"
    file.touch()

    with pytest.raises(FileError, match="neither a recorded swing nor a result"):
        swing_folder(file)
