"""Supervisors approve what goes beyond limits, and keys; comments are entries."""

import shutil
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest
from benchmarks.postgres_server import Postgres
from msgspec import structs
from tests.core.archive.test_logbook import checked, result
from tests.entering import entries_of, records_in

from lightpen.archive.chains import ChainHead, Kind, StoredEntry, chained
from lightpen.archive.history import messages_on
from lightpen.archive.logbook import Logbook
from lightpen.errors import AcceptanceError, ArchiveError, FileError
from lightpen.local_time import local_now
from lightpen.record.calibrations import read_calibration
from lightpen.record.library.signing import SigningKey, key_folder, station_key
from lightpen.record.library.supervision import (
    LIMITS_FOLDER,
    Signature,
    Supervision,
    read_supervision,
    renew_station_key,
    require_supervisor,
    set_password,
)
from lightpen.record.results.result_folder import RECORDS, FolderArchive
from lightpen.record.results.results import result_bytes


@pytest.fixture
def data(tmp_path: Path, swung: Callable[..., Path]) -> Path:
    """A data folder in which a tip was calibrated twice."""
    shutil.copytree(swung(), tmp_path / "data" / RECORDS / "swing")
    for n in range(2):
        FolderArchive(tmp_path / "data").store(result(tmp_path / "data", n))
    return tmp_path / "data"


@pytest.fixture
def logbook(data: Path) -> Iterator[Logbook]:
    with closing(Logbook(data)) as book:
        book.enter_owed()
        yield book


def entries(logbook: Logbook) -> list[StoredEntry]:
    return list(entries_of(logbook.database, logbook.chain))


def test_a_note_is_an_entry_on_another(data: Path, logbook: Logbook) -> None:
    first, _ = entries(logbook)
    logbook.enter_note(first, "Dropped on the floor. 掉在地上了", "Bea")

    (note,) = messages_on(logbook.database, first)
    event = note.entry.event
    assert (event.kind, event.names.operator) == (Kind.NOTE, "Bea")
    assert event.reason == "Dropped on the floor. 掉在地上了"
    assert (event.names.pen, event.names.tip) == ("LP-04", "T-10")
    assert checked(data).findings == ()


EVE = Signature("Eve", "correct horse")


@pytest.mark.slow
def test_where_there_is_a_password_a_supervisor_takes_a_tip_back(
    data: Path, logbook: Logbook
) -> None:
    set_password(data, EVE, EVE.password, local_now())
    archive, now = FolderArchive(data), local_now()
    last = archive.in_force("LP-04", "T-10")
    assert last is not None
    for reason, signature in (
        ("Bent.", None),
        ("", EVE),
        ("Bent.", replace(EVE, password="no")),
    ):
        with pytest.raises(AcceptanceError):
            archive.revoke(last, "Bea", now, reason, signature)
    assert len(archive.all_files()) == 2

    archive.revoke(last, "Bea", now, "Bent.", EVE)
    logbook.enter_owed()
    found = archive.in_force("LP-04", "T-10")
    assert found is not None
    assert found.tip_pen[0] == 0.0
    event = entries(logbook)[-1].entry.event
    assert (event.reason, event.settings["supervisor"]) == ("Bent.", "Eve")


def test_limits_that_are_missing_stop_every_acceptance(
    data: Path, logbook: Logbook
) -> None:
    set_password(data, EVE, EVE.password, local_now())
    logbook.enter_owed()
    shutil.rmtree(data / LIMITS_FOLDER)
    with pytest.raises(FileError, match="Nothing is accepted until"):
        FolderArchive(data).supervision()
    with pytest.raises(FileError, match="Nothing is accepted until"):
        FolderArchive(data).in_force("LP-04", "T-10")


def test_a_result_that_was_written_by_hand_is_neither_in_force_nor_entered(
    data: Path, logbook: Logbook
) -> None:
    archive = FolderArchive(data)
    set_password(data, EVE, EVE.password, local_now())
    logbook.enter_owed()
    n_entries, before = len(entries(logbook)), archive.in_force("LP-04", "T-10")
    assert before is not None
    chef = replace(result(data, 2), supervisor="Chef")
    (archive.folder / "000003.json").write_bytes(result_bytes(chef, "records/swing"))
    shutil.copy(archive.folder / "000001.json", archive.folder / "000004.json")
    assert logbook.enter_owed() == ()
    found = archive.in_force("LP-04", "T-10")
    assert found is not None
    assert found.accepted == before.accepted
    assert len(entries(logbook)) == n_entries


def test_a_result_that_names_a_supervisor_needs_the_approval(
    data: Path, logbook: Logbook
) -> None:
    """Whoever has the key of a station, and no password, approves nothing."""
    set_password(data, EVE, EVE.password, local_now())
    logbook.enter_owed()
    archive = FolderArchive(data)
    archive.store(replace(result(data, 2), supervisor="Eve"))
    file = archive.all_files()[-1]
    logbook.enter_owed()
    with pytest.raises(FileError, match="did not approve"):
        archive.in_force("LP-04", "T-10")
    with pytest.raises(FileError, match="did not approve"):
        read_calibration(file)
    guard = read_supervision(data)
    archive.store(replace(result(data, 3), supervisor="Eve"), guard_key(guard))
    assert archive.in_force("LP-04", "T-10") is not None
    logbook.enter_owed()
    assert archive.in_force("LP-04", "T-10") is not None


def guard_key(guard: Supervision) -> SigningKey:
    return require_supervisor(guard, EVE)


def test_files_from_before_the_password_count_as_they_were(
    data: Path, logbook: Logbook
) -> None:
    archive = FolderArchive(data)
    set_password(data, EVE, EVE.password, local_now())
    logbook.enter_owed()
    assert archive.in_force("LP-04", "T-10") is not None

    other = result_bytes(result(data, 7), "records/swing")
    (archive.folder / "000002.json").write_bytes(other)
    with pytest.raises(FileError, match="was changed after it was entered"):
        archive.in_force("LP-04", "T-10")


def lost_key(logbook: Logbook) -> None:
    (key_folder() / f"{logbook.chain}.key").unlink()


def test_a_key_that_a_supervisor_approves_continues_the_chain(
    data: Path, logbook: Logbook
) -> None:
    set_password(data, EVE, EVE.password, local_now())
    logbook.enter_owed()
    lost_key(logbook)
    with closing(Logbook(data)) as moved:
        with pytest.raises(ArchiveError, match="not in this user account"):
            moved.enter_note(entries(moved)[0], "Moved.", "Bea")
        renew_station_key(data, moved.chain, EVE, local_now())
        assert moved.enter_owed() == ()
        moved.enter_note(entries(moved)[0], "Moved.", "Bea")
    assert checked(data).findings == ()


def test_a_key_that_was_replaced_signs_nothing_more(
    data: Path, logbook: Logbook, postgres: Postgres
) -> None:
    from lightpen_extensions.plant.copies import copy_entries
    from lightpen_extensions.plant.server import open_server

    old = station_key(logbook.chain)
    assert old is not None
    renew_station_key(data, logbook.chain, None, local_now())
    logbook.enter_owed()
    *_, last = known = entries(logbook)
    head = ChainHead(logbook.chain, len(known), last.sha256, last.entry.since)
    entry = chained(head, structs.replace(last.entry.event, kind=Kind.NOTE))
    signature = old.public + old.sign(b"lightpen entry\n" + entry.sha256.encode())
    forged = replace(entry, signature=signature)

    role = postgres.new_role(postgres.new_database(), "lightpen_station")
    with closing(open_server(role)) as server:
        copy_entries(server, logbook.chain, known, records_in(logbook.database))
        with pytest.raises(ArchiveError, match="signed by a key that is not the stat"):
            copy_entries(server, logbook.chain, [forged], {})


def test_no_new_key_begins_where_the_limits_of_the_archive_are_gone(
    data: Path, logbook: Logbook
) -> None:
    set_password(data, EVE, EVE.password, local_now())
    logbook.enter_owed()
    shutil.rmtree(data / LIMITS_FOLDER)
    shutil.rmtree(key_folder())  # as in another account
    with closing(Logbook(data)):
        assert not (data / LIMITS_FOLDER).exists()


def test_without_a_password_a_moved_folder_goes_on_with_a_new_key_and_a_finding(
    data: Path, logbook: Logbook
) -> None:
    lost_key(logbook)
    with closing(Logbook(data)) as moved:
        assert moved.enter_owed() == ()
        moved.enter_note(entries(moved)[0], "Moved.", "Bea")
    assert checked(data).findings == ()
    assert "archive.key-unapproved" in {each.code for each in checked(data).notes}
