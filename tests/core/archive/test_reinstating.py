"""An older tip is put in force again as a new entry, and notes are entries."""

import shutil
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import pytest
from benchmarks.postgres_server import Postgres
from msgspec import structs
from tests.core.archive.test_logbook import NAMES, checked, result

from lightpen.archive.chains.chains import entries_of, records_of
from lightpen.archive.chains.entries import (
    ChainHead,
    Event,
    Kind,
    StoredEntry,
    chained,
    text_sha256,
)
from lightpen.archive.chains.growth import append, copy_entries
from lightpen.archive.history.due import due_tips
from lightpen.archive.history.history import lines, messages_on
from lightpen.archive.history.queries import EntryFilter, last_accepted
from lightpen.archive.logbook.logbook import Logbook
from lightpen.archive.replication.server import open_server
from lightpen.errors import AcceptanceError, ArchiveError, FileError
from lightpen.local_time import local_now
from lightpen.model.limits import DueRule
from lightpen.record.calibrations.calibrations import read_calibration
from lightpen.record.library.guard_files import LIMITS_FOLDER
from lightpen.record.library.library_changes import Author, add_item, retire_item
from lightpen.record.library.signing.keys import SigningKey, key_folder, station_key
from lightpen.record.library.supervision import (
    Signature,
    Supervision,
    read_supervision,
    require_supervisor,
)
from lightpen.record.library.supervision_changes import renew_station_key, set_password
from lightpen.record.library.tip_library import ItemKind, ListedTip
from lightpen.record.results.result_folder import RECORDS, FolderArchive
from lightpen.record.results.results import result_bytes
from lightpen.record.swings.names import Names

BEA = Names("Hall 7", "Bea")


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


def test_an_older_tip_is_in_force_again_and_all_results_are_kept(
    data: Path, logbook: Logbook
) -> None:
    first, second = entries(logbook)
    archive = FolderArchive(data)
    before = [file.read_bytes() for file in archive.all_files()]
    logbook.restore(first, BEA, "The new one is bent.")

    found = archive.in_force("LP-04", "T-10")
    assert found is not None
    assert found.tip_pen.tolist() == [0.0, 2.0, 3.0]
    assert (found.names.station, found.names.operator) == ("Hall 7", "Bea")
    assert found.change is not None
    assert found.change.difference_mm == (-1.0, 0.0, 0.0)
    assert [file.read_bytes() for file in archive.all_files()[:2]] == before
    event = entries(logbook)[-1].entry.event
    assert (event.kind, event.concerns) == (Kind.RESTORED, first.sha256)
    assert event.reason == "The new one is bent."
    states = [line.state for line in lines(logbook.database, EntryFilter(), 0, 9)]
    assert states == ["in force", "replaced", "replaced"]
    assert checked(data).findings == ()
    last = last_accepted(logbook.database, "LP-04", "T-10")
    assert last is not None
    assert last.sha256 == entries(logbook)[-1].sha256 != second.sha256


def test_a_restored_tip_is_as_old_as_its_calibration(
    data: Path, logbook: Logbook
) -> None:
    first, _ = entries(logbook)
    restored = logbook.restore(first, BEA, "The new one is bent.")
    again = logbook.restore(entries(logbook)[1], BEA, "By mistake.")
    logbook.restore(entries(logbook)[2], BEA, "No, it is bent.")

    assert restored.accepted <= again.accepted
    (tip,) = due_tips(logbook.database, logbook.chain, DueRule(30))
    assert tip.entry == entries(logbook)[-1]
    assert tip.calibrated == first.entry.event.at
    assert tip.due == first.entry.event.at + timedelta(days=30)
    assert tip.n_swings == 1  # that of the second calibration


def test_a_tip_that_was_retired_is_not_restored(data: Path, logbook: Logbook) -> None:
    now, by = entries(logbook)[0].entry.event.at, Author()
    add_item(data, ListedTip(id="T-10"), by, now)
    retire_item(data, ItemKind.TIP, "T-10", by, now)

    with pytest.raises(AcceptanceError, match="T-10 is retired"):
        logbook.restore(entries(logbook)[0], BEA, "The new one is bent.")
    assert len(FolderArchive(data).all_files()) == 2


def test_a_restored_tip_can_be_taken_back(data: Path, logbook: Logbook) -> None:
    archive = FolderArchive(data)
    restored = logbook.restore(entries(logbook)[0], BEA, "By mistake.")
    archive.revoke(restored, "Bea", restored.accepted)
    logbook.enter_owed()

    found = archive.in_force("LP-04", "T-10")
    assert found is not None
    assert found.tip_pen[0] == 1.0
    back = entries(logbook)[-1].entry.event
    assert (back.kind, back.concerns) == (Kind.TAKEN_BACK, entries(logbook)[2].sha256)


def test_what_put_no_tip_in_force_is_not_restored(data: Path, logbook: Logbook) -> None:
    event = structs.replace(
        entries(logbook)[0].entry.event, kind=Kind.REFUSED, result=None
    )
    refused = append(logbook.database, logbook.chain, event)
    assert refused is not None

    with pytest.raises(ArchiveError, match="Entry 3 is not an accepted tip"):
        logbook.restore(refused, BEA, "I like it.")
    assert len(FolderArchive(data).all_files()) == 2


@pytest.mark.parametrize("record", [None, '{"tip_pen_mm": [1.0, 2.0, 3.0]}'])
def test_a_tip_of_which_too_little_is_kept_is_not_restored(
    data: Path, logbook: Logbook, record: str | None
) -> None:
    event = Event(
        kind=Kind.ACCEPTED,
        at=entries(logbook)[0].entry.event.at,
        names=NAMES,
        program="lightpen 0.1",
        grade="pass",
    )
    if record is not None:
        event = structs.replace(event, record_sha256=text_sha256(record))
    bare = append(logbook.database, logbook.chain, event, record)
    assert bare is not None

    with pytest.raises(
        ArchiveError, match="Entry 3 has no complete calibration record"
    ):
        logbook.restore(bare, BEA, "The old one.")
    assert len(FolderArchive(data).all_files()) == 2


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
def test_where_there_is_a_password_a_supervisor_reinstates_a_tip(
    data: Path, logbook: Logbook
) -> None:
    set_password(data, EVE, EVE.password, local_now())
    first, _ = entries(logbook)
    wrong = Signature("Eve", "wrong horse")
    for signature in (None, wrong):
        with pytest.raises(AcceptanceError):
            logbook.restore(first, BEA, "The new one is bent.", signature)
    assert len(FolderArchive(data).all_files()) == 2

    restored = logbook.restore(first, BEA, "The new one is bent.", EVE)
    assert restored.supervisor == "Eve"
    found = FolderArchive(data).in_force("LP-04", "T-10")
    assert found is not None
    assert found.supervisor == "Eve"
    assert any(each.code == "doubt.calibration-overdue" for each in found.doubts)
    assert checked(data).findings == ()


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


def test_a_tip_is_reinstated_with_a_reason_only(data: Path, logbook: Logbook) -> None:
    with pytest.raises(AcceptanceError, match="Enter the reason"):
        logbook.restore(entries(logbook)[0], BEA, " ")


def test_a_tip_whose_file_was_changed_is_not_reinstated(
    data: Path, logbook: Logbook
) -> None:
    first = entries(logbook)[0]
    assert first.entry.event.result is not None
    file = data / first.entry.event.result.place
    file.write_bytes(file.read_bytes() + b" ")
    with pytest.raises(ArchiveError, match="was modified"):
        logbook.restore(first, BEA, "It was better.")


def test_limits_that_are_missing_stop_every_acceptance(
    data: Path, logbook: Logbook
) -> None:
    set_password(data, EVE, EVE.password, local_now())
    logbook.enter_owed()
    shutil.rmtree(data / LIMITS_FOLDER)
    with pytest.raises(FileError, match="Nothing is accepted until"):
        FolderArchive(data).supervision()
    with pytest.raises(FileError, match="Nothing is accepted until"):
        logbook.restore(entries(logbook)[0], BEA, "It was better.")


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
    old = station_key(logbook.chain)
    assert old is not None
    renew_station_key(data, logbook.chain, None, local_now())
    logbook.enter_owed()
    *_, last = known = entries(logbook)
    records = records_of(logbook.database, known)
    head = ChainHead(logbook.chain, len(known), last.sha256, last.entry.since)
    entry = chained(head, structs.replace(last.entry.event, kind=Kind.NOTE))
    signature = old.public + old.sign(b"lightpen entry\n" + entry.sha256.encode())
    forged = replace(entry, signature=signature)

    role = postgres.new_role(postgres.new_database(), "lightpen_station")
    with closing(open_server(role)) as server:
        copy_entries(server, logbook.chain, known, records)
        with pytest.raises(ArchiveError, match="signed by a key that is not the stat"):
            copy_entries(server, logbook.chain, [forged], records)


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
