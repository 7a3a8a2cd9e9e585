"""Whatever becomes of a swing is entered once, also what a crash left out."""

import errno
import shutil
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import pytest
from benchmarks.small_records import small_record
from msgspec import structs
from tests.core.archive.conftest import NOON
from tests.entering import entries_of, records_in

from lightpen.archive.chains import Entry, Kind
from lightpen.archive.checks import ArchiveCheckResult, check_archive
from lightpen.archive.logbook import Logbook
from lightpen.archive.store import look_into
from lightpen.errors import ArchiveError
from lightpen.estimation.reports.verdict import Grade
from lightpen.model.names import Origin
from lightpen.record.library.entered_files import ARCHIVE
from lightpen.record.library.signing import OwedFile, owe, owed_files
from lightpen.record.results.result_folder import RECORDS, FolderArchive
from lightpen.record.results.results import Result
from lightpen.record.swings.header import Names
from lightpen.record.swings.interrupted import discard_damaged, discard_swing
from lightpen.record.swings.reading import open_record

NAMES = Names("Hall 2", "Ann", "LP-04", "T-10", "C-1", 10.0)


@pytest.fixture
def data(tmp_path: Path, swung: Callable[..., Path]) -> Path:
    """A data folder with an interrupted swing, and nothing in force."""
    shutil.copytree(swung(), tmp_path / "data" / RECORDS / "swing")
    return tmp_path / "data"


@pytest.fixture
def logbook(data: Path) -> Iterator[Logbook]:
    book = Logbook(data)
    yield book
    book.database.close()


def result(data: Path, n: int = 0, **changes: object) -> Result:
    """Return an accepted tip of the swing."""
    record = open_record(data / RECORDS / "swing")
    calibration = structs.replace(
        small_record(),
        tip_pen_mm=(float(n), 2.0, 3.0),
        expanded_uncertainty_mm=(0.1, 0.1, 0.1),
    )
    whole = Result(
        names=NAMES,
        accepted=NOON + timedelta(hours=n),
        grade=Grade.PASS,
        record=record.folder,
        images=tuple(record.numbers.tolist()),
        calibration=calibration,
        origin=Origin.LIVE,
    )
    return replace(whole, **changes)  # type: ignore[arg-type]


def entered(logbook: Logbook) -> list[Entry]:
    return [each.entry for each in entries_of(logbook.database, logbook.chain)]


def checked(data: Path) -> ArchiveCheckResult:
    with closing(look_into(data / ARCHIVE)) as database:
        return check_archive(database, data)


def test_an_accepted_tip_is_entered_with_all_that_it_was_made_from(
    data: Path, logbook: Logbook
) -> None:
    FolderArchive(data).store(result(data))
    assert logbook.enter_owed() == ()

    (entry,) = entered(logbook)
    event = entry.event
    assert (event.kind, event.names, event.grade) == (Kind.ACCEPTED, NAMES, "pass")
    assert (event.at, event.program) == (NOON, "lightpen 0.0.1")
    assert (event.swing, event.origin) == ("records/swing", Origin.LIVE)
    assert event.result is not None
    assert event.result.place == "results/000001.json"
    assert [Path(file.place).name for file in event.files] == [
        *("header.json", "journal.jsonl", "camera.yaml", "pen.json")
    ]
    assert event.settings["min_images"] == 20
    (record,) = records_in(logbook.database).values()
    assert '"tip_pen_mm": [0.0, 2.0, 3.0]' in record


@pytest.mark.parametrize("is_entered", [False, True])
def test_a_note_of_a_file_that_was_never_written_is_forgotten(
    data: Path, logbook: Logbook, *, is_entered: bool
) -> None:
    stale = OwedFile("results/000001.json", "0" * 64)
    if not is_entered:
        owe(logbook.chain, stale)
    FolderArchive(data).store(result(data))
    if is_entered:
        assert logbook.enter_owed() == ()
        owe(logbook.chain, stale)

    assert logbook.enter_owed() == ()
    assert (len(entered(logbook)), owed_files(logbook.chain)) == (1, ())


def test_results_of_earlier_versions_are_taken_over_once_and_stay(data: Path) -> None:
    archive = FolderArchive(data)
    for n in range(3):
        archive.store(result(data, n))
    archive.store(result(data, 3, origin=Origin.SIMULATED))
    before = [file.read_bytes() for file in archive.all_files()]

    for _ in range(2):
        with closing(Logbook(data)) as logbook:
            logbook.enter_owed()
            tips = [each.event.tip_pen_mm for each in entered(logbook)]

    assert [tip and tip[0] for tip in tips] == [0.0, 1.0, 2.0, 3.0]
    assert [file.read_bytes() for file in archive.all_files()] == before


def test_what_is_revoked_names_the_entry_of_its_result(
    data: Path, logbook: Logbook
) -> None:
    archive = FolderArchive(data)
    archive.store(result(data))
    archive.revoke(result(data), "Ben", NOON + timedelta(days=1))
    logbook.enter_owed()

    accepted, back = entries_of(logbook.database, logbook.chain)
    event = back.entry.event
    assert (event.kind, event.concerns) == (Kind.REVOKED, accepted.sha256)
    assert event.names == replace(NAMES, operator="Ben")
    assert event.at == NOON + timedelta(days=1)


def test_a_swing_is_entered_that_was_set_aside_after_its_result_was_taken_back(
    data: Path, logbook: Logbook
) -> None:
    archive = FolderArchive(data)
    archive.store(result(data))
    archive.revoke(result(data), "Ben", NOON)
    logbook.enter_owed()
    discard_swing(data / RECORDS / "swing")
    for _ in range(2):
        logbook.enter_owed()

    assert [entry.event.kind for entry in entered(logbook)] == [
        *(Kind.ACCEPTED, Kind.REVOKED, Kind.ABANDONED)
    ]


def test_a_swing_that_was_set_aside_is_entered_with_its_images(
    data: Path, logbook: Logbook
) -> None:
    logbook.enter_owed()
    assert entered(logbook) == []  # it can be gone on with

    discard_swing(data / RECORDS / "swing")
    for _ in range(2):
        logbook.enter_owed()

    (entry,) = entered(logbook)
    assert (entry.event.kind, entry.event.swing) == (Kind.ABANDONED, "records/swing")
    assert entry.event.names.pen == "LP-04"
    assert checked(data).n_files == 4 + 20


def test_a_swing_that_cannot_be_read_is_entered_with_the_reason(
    data: Path, logbook: Logbook
) -> None:
    folder = data / RECORDS / "swing"
    (folder / "header.json").write_bytes(b"{}")
    discard_damaged(folder)
    logbook.enter_owed()

    (entry,) = entered(logbook)
    assert entry.event.kind is Kind.ABANDONED
    assert entry.event.why is not None
    assert "header.json is damaged" in entry.event.why.text


def test_a_damaged_result_stays_owed_and_the_others_are_entered(
    data: Path, logbook: Logbook
) -> None:
    archive = FolderArchive(data)
    for n in range(2):
        archive.store(result(data, n))
    first = archive.all_files()[0]
    whole = first.read_bytes()
    first.write_bytes(whole[:-50])

    (fault,) = logbook.enter_owed()
    assert "000001.json is damaged" in str(fault)
    first.write_bytes(whole)
    assert logbook.enter_owed() == ()
    assert [each.event.tip_pen_mm[0] for each in entered(logbook)] == [1.0, 0.0]  # type: ignore[index]


@pytest.mark.parametrize(
    "name",
    [
        "results/000001.json",
        "records/swing/header.json",
        "records/swing/journal.jsonl",
        "records/swing/camera.yaml",
        "records/swing/images/000007.png",
    ],
)
def test_a_file_that_was_changed_is_named(data: Path, name: str) -> None:
    FolderArchive(data).store(result(data))
    with closing(Logbook(data)) as logbook:
        logbook.enter_owed()
    assert checked(data).findings == ()

    file = data / name
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.write_bytes(content)
    assert any(f"The file {name}" in str(each) for each in checked(data).findings)
    file.unlink()
    findings = [str(each) for each in checked(data).findings]
    assert f"The file {name} of entry 1 is missing." in findings


@pytest.fixture
def data_of_two(tmp_path: Path, swung: Callable[..., Path]) -> Path:
    """A data folder with a recorded swing before two cameras, accepted and entered."""
    data = tmp_path / "two"
    shutil.copytree(swung(14, by_two=True), data / RECORDS / "swing")
    FolderArchive(data).store(result(data))
    with closing(Logbook(data)) as logbook:
        logbook.enter_owed()
    return data


@pytest.mark.slow
def test_an_untouched_swing_of_two_cameras_is_checked_without_a_finding(
    data_of_two: Path,
) -> None:
    found = checked(data_of_two)

    assert found.findings == ()
    # Result, header, journal, pen, rig, two cameras, and two images of each moment.
    assert found.n_files == 7 + 2 * 14


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["images/000002.png", "images-2/000002.png", "camera-2.yaml", "rig.json"]
)
def test_a_changed_file_of_either_camera_is_named(data_of_two: Path, name: str) -> None:
    file = data_of_two / RECORDS / "swing" / name
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.write_bytes(content)

    findings = [str(each) for each in checked(data_of_two).findings]
    assert findings[-1] == (
        f"The file records/swing/{name} of entry 1 was modified after it was entered."
    )


def test_images_of_two_cameras_that_were_swapped_are_named(data_of_two: Path) -> None:
    swing = data_of_two / RECORDS / "swing"
    first, second = swing / "images/000005.png", swing / "images-2/000005.png"
    first.rename(swing / "kept.png")
    second.rename(first)
    (swing / "kept.png").rename(second)

    assert len(checked(data_of_two).findings) == 2


def test_images_that_were_swapped_are_named(data: Path) -> None:
    FolderArchive(data).store(result(data))
    with closing(Logbook(data)) as logbook:
        logbook.enter_owed()
    images = data / RECORDS / "swing" / "images"
    (images / "000003.png").rename(images / "kept.png")
    (images / "000004.png").rename(images / "000003.png")
    (images / "kept.png").rename(images / "000004.png")

    assert len(checked(data).findings) == 2


def test_a_swing_that_goes_on_after_its_entry_is_no_change(data: Path) -> None:
    FolderArchive(data).store(result(data))
    with closing(Logbook(data)) as logbook:
        logbook.enter_owed()
    discard_swing(data / RECORDS / "swing")  # a line more

    assert checked(data).findings == ()


def test_a_full_disk_leaves_an_entry_owed_and_the_archive_whole(
    data: Path, logbook: Logbook
) -> None:
    archive = FolderArchive(data)
    archive.store(result(data, 0))
    logbook.enter_owed()
    archive.store(result(data, 1))
    with logbook.database.reading() as connection:
        n_pages = connection.exec_driver_sql("PRAGMA page_count").scalar_one()
        connection.exec_driver_sql(f"PRAGMA max_page_count = {n_pages}")

    for n in range(2, 12):
        archive.store(result(data, n))
    with pytest.raises(ArchiveError, match="disk is full"):
        logbook.enter_owed()
    with logbook.database.reading() as connection:
        connection.exec_driver_sql("PRAGMA max_page_count = 1000000")
    logbook.enter_owed()

    assert len(entered(logbook)) == len(archive.all_files())
    assert checked(data).findings == ()


def test_a_data_folder_that_was_moved_is_whole(data: Path, tmp_path: Path) -> None:
    FolderArchive(data).store(result(data))
    with closing(Logbook(data)) as logbook:
        logbook.enter_owed()
    moved = tmp_path / "moved"
    data.rename(moved)
    with closing(Logbook(moved)) as logbook:
        logbook.enter_owed()

    assert checked(moved).findings == ()
    assert checked(moved).n_entries == 1


def test_a_note_that_cannot_be_removed_is_removed_at_the_next_start(
    data: Path, logbook: Logbook, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(path: Path, missing_ok: bool = False) -> None:
        raise OSError(errno.EIO, "Input/output error")

    FolderArchive(data).store(result(data))
    with monkeypatch.context() as disk:
        disk.setattr(Path, "unlink", fail)
        assert logbook.enter_owed() == ()
    assert len(owed_files(logbook.chain)) == 1
    assert logbook.enter_owed() == ()
    assert owed_files(logbook.chain) == ()
    assert len(entered(logbook)) == 1
