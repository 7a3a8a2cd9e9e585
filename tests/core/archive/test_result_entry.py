"""Where a result is entered, by the archive beside it."""

from collections.abc import Callable
from datetime import UTC, datetime
from hashlib import sha256
from pathlib import Path

import pytest
from benchmarks.small_records import small_record

from lightpen.archive.logbook import Logbook, entry_of_file
from lightpen.errors import FileError
from lightpen.estimation.reports.verdict import Grade
from lightpen.record.library.entered_files import ARCHIVE
from lightpen.record.library.signing import known_station_name
from lightpen.record.results.result_folder import FolderArchive
from lightpen.record.results.results import Result
from lightpen.record.swings.header import Names

NOON = datetime(2026, 1, 2, 12, tzinfo=UTC)


def digest(file: Path) -> str:
    return sha256(file.read_bytes()).hexdigest()


@pytest.fixture
def results(tmp_path: Path) -> list[Path]:
    """Return the files of two results, both entered."""
    archive = FolderArchive(tmp_path)
    for n in (1, 2):
        archive.store(
            Result(
                names=Names("Hall 3", "Ann", "LP-04", "T-10"),
                accepted=NOON.replace(hour=n),
                grade=Grade.PASS,
                record=tmp_path / "records" / str(n),
                images=(1,),
                calibration=small_record(
                    {
                        "tip_pen_mm": [1.0, -90.0, -25.0],
                        "expanded_uncertainty_mm": [0.003, 0.004, 0.005],
                        "cone_cam_mm": [0.0, 200.0, 1000.0],
                        "covariance": [[0.25] * 6] * 6,
                    }
                ),
            )
        )
    logbook = Logbook(tmp_path)
    assert logbook.enter_owed() == ()
    logbook.close()
    return sorted(archive.folder.glob("*.json"))


def test_an_entry_is_reported_with_its_chain(results: list[Path]) -> None:
    first, second = (entry_of_file(file, digest(file)) for file in results)

    assert first is not None
    assert second is not None
    chain = known_station_name(results[0].parents[1])
    assert (first.chain, first.number) == (chain, 1)
    assert (second.chain, second.number) == (chain, 2)


def test_a_result_that_was_changed_since_is_reported(results: list[Path]) -> None:
    with pytest.raises(FileError, match="is not the one that was entered"):
        entry_of_file(results[0], 64 * "0")


def test_what_is_in_no_archive_has_no_entry(results: list[Path]) -> None:
    elsewhere = results[0].parents[1] / "000001.json"
    elsewhere.write_bytes(results[0].read_bytes())
    new = results[0].with_name("000009.json")
    new.write_bytes(results[0].read_bytes())

    assert entry_of_file(elsewhere, digest(elsewhere)) is None
    assert entry_of_file(new, digest(new)) is None


def test_an_archive_that_cannot_be_read_is_reported(results: list[Path]) -> None:
    (results[0].parents[1] / ARCHIVE).write_bytes(b"precious" * 100)

    with pytest.raises(FileError, match="is not available"):
        entry_of_file(results[0], digest(results[0]))


def test_an_archive_that_was_removed_is_reported(results: list[Path]) -> None:
    (results[0].parents[1] / ARCHIVE).unlink()

    with pytest.raises(FileError, match="lacks entry 2"):
        entry_of_file(results[0], digest(results[0]))


def test_an_export_says_that_a_result_has_no_entry(
    results: list[Path], tmp_path: Path, lightpen: Callable[..., object]
) -> None:
    pytest.importorskip("lightpen_extensions.exports")
    copied, out = tmp_path / "copied.json", tmp_path / "tip.txt"
    copied.write_bytes(results[0].read_bytes())

    for file, is_entered in ((results[0], True), (copied, False)):
        lightpen("export", file, out, "--for", "text")
        assert ("NOT ENTERED" not in out.read_text("utf-8")) is is_entered
