"""Each kind of tampering and rollback is found, here or on the server."""

import shutil
import sqlite3
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import psycopg
import pytest
from benchmarks.postgres_server import Postgres
from msgspec import structs
from tests.core.archive.conftest import NOON
from tests.core.archive.test_logbook import result
from tests.entering import enter_in

from lightpen.archive.chains import (
    ChainHead,
    StoredEntry,
    chain_names,
    chained,
    columns_of,
)
from lightpen.archive.checks import check_file
from lightpen.archive.logbook import Logbook
from lightpen.archive.store import look_into, open_file
from lightpen.errors import ArchiveError, FileError
from lightpen.model.limits import StationLimits
from lightpen.record.library.entered_files import ARCHIVE
from lightpen.record.library.library_changes import Author, add_item
from lightpen.record.library.supervision import Signature, save_limits
from lightpen.record.library.tip_library import ListedCone
from lightpen.record.results.result_folder import RECORDS, FolderArchive
from lightpen_extensions.plant.copies import entries_of
from lightpen_extensions.plant.server import check_server, deliver, fetch, open_server

N_RESULTS, N_ENTRIES = 3, 6  # with a cone, a password and limits
SWING = f"{RECORDS}/swing"


@dataclass(frozen=True)
class Plant:
    """A data folder, and its server as its administrator calls it.

    Attributes
    ----------
    before : Path
        The data folder as it was before its last result.
    """

    data: Path
    before: Path
    server: str

    def findings(self) -> list[str]:
        archive = self.data / ARCHIVE
        checked = check_file(archive, self.data, lambda fraction: None)
        with (
            closing(look_into(archive)) as database,
            closing(open_server(self.server)) as server,
        ):
            there = check_server(database, server)
        return list(map(str, checked.findings + there.findings))


@pytest.fixture(scope="module")
def address(postgres: Postgres) -> str:
    """A database for all tests of this file, as each takes a second to make."""
    return postgres.new_database()


@pytest.fixture
def plant(tmp_path: Path, swung: Callable[..., Path], address: str) -> Plant:
    made = Plant(tmp_path / "data", tmp_path / "before", address)
    with psycopg.connect(address) as connection:
        connection.execute("TRUNCATE archive_entries, archive_records, archive_writers")
    shutil.copytree(swung(), made.data / SWING)
    add_item(made.data, ListedCone(id="C-1"), Author("Hall 2", "Ann"), NOON)
    signature = Signature("Eve", "correct horse")
    save_limits(made.data, "Hall 2", StationLimits(), signature, "", NOON)
    for n in range(N_RESULTS):
        if n == N_RESULTS - 1:
            with closing(Logbook(made.data)) as logbook:
                logbook.enter_owed()
            shutil.copytree(made.data, made.before)
        FolderArchive(made.data).store(result(made.data, n))
    with closing(Logbook(made.data)) as logbook:
        assert logbook.enter_owed() == ()
        with closing(open_server(made.server)) as server:
            copied = deliver(logbook.database, logbook.chain, server)
    assert copied.n_new == N_ENTRIES
    return made


def overwrite(name: str, plant: Plant) -> None:
    """Change a byte of a file."""
    content = bytearray((plant.data / name).read_bytes())
    content[len(content) // 2] ^= 1
    (plant.data / name).write_bytes(content)


def remove(name: str, plant: Plant) -> None:
    (plant.data / name).unlink()


def swap_images(plant: Plant) -> None:
    images = plant.data / SWING / "images"
    (images / "000003.png").rename(images / "kept.png")
    (images / "000004.png").rename(images / "000003.png")
    (images / "kept.png").rename(images / "000004.png")


def cut_journal(plant: Plant) -> None:
    journal = plant.data / SWING / "journal.jsonl"
    journal.write_bytes(b"".join(journal.read_bytes().splitlines(keepends=True)[:-2]))


def exchange_results(plant: Plant) -> None:
    """Let an older result be the newest."""
    results = plant.data / "results"
    shutil.copy(results / "000001.json", results / f"{N_RESULTS:06d}.json")


DROP_LAST = f"DELETE FROM archive_entries WHERE number = {N_ENTRIES}"


def roll_back_archive(plant: Plant) -> None:
    """Replace the archive by an older copy."""
    shutil.copy(plant.before / ARCHIVE, plant.data / ARCHIVE)


def roll_back_folder(plant: Plant) -> None:
    """Replace the whole data folder by an older copy."""
    shutil.rmtree(plant.data)
    shutil.copytree(plant.before, plant.data)


def empty(plant: Plant) -> None:
    """Begin the archive anew, with what the files tell of."""
    (plant.data / ARCHIVE).unlink()
    with closing(Logbook(plant.data)) as logbook:
        logbook.enter_owed()


def forged(entries: list[StoredEntry]) -> list[StoredEntry]:
    """Return a chain whose third entry says something else, each hash being right."""
    head, written = ChainHead(entries[0].entry.chain), []
    for n, each in enumerate(entries):
        event = each.entry.event
        if n == N_ENTRIES - 2:
            event = structs.replace(event, reason="Nothing to be seen here.")
        new = chained(head, event)
        head = ChainHead(head.chain, n + 1, new.sha256, new.entry.since)
        written.append(new)
    return written


def rewrite(plant: Plant) -> None:
    """Write the end of a chain anew with the right hashes."""
    archive = plant.data / ARCHIVE
    with closing(look_into(archive)) as database:
        (chain,) = chain_names(database)
        new = forged(list(entries_of(database, chain)))
    with closing(sqlite3.connect(archive)) as connection, connection:
        for each in new:
            connection.execute(*_update(each, "?"))


def rewrite_server(plant: Plant) -> None:
    with closing(open_server(plant.server)) as server:
        (chain,) = chain_names(server)
        new = forged(list(entries_of(server, chain)))
    with psycopg.connect(plant.server) as connection:
        for each in new:
            connection.execute(*_update(each, "%s"))


def _update(entry: StoredEntry, mark: str) -> tuple[str, tuple[object, ...]]:
    columns = columns_of(entry)
    kept = {name: columns[name] for name in ("sha256", "text", "since_us")}
    values = ", ".join(f"{name} = {mark}" for name in kept)
    statement = f"UPDATE archive_entries SET {values} WHERE number = {mark}"
    return statement, (*kept.values(), entry.entry.number)


def at_server(*statements: str) -> Callable[[Plant], None]:
    """Return what the administrator of a server may do."""

    def change(plant: Plant) -> None:
        with psycopg.connect(plant.server) as connection:
            connection.execute(
                "ALTER TABLE archive_entries DROP CONSTRAINT IF EXISTS entry_hash;"
                "ALTER TABLE archive_records DROP CONSTRAINT IF EXISTS record_hash"
            )
            for statement in statements:
                assert connection.execute(statement).rowcount > 0

    return change


KINDS: dict[str, Callable[[Plant], None]] = {
    "a result was modified": partial(overwrite, "results/000002.json"),
    "a result was removed": partial(remove, "results/000002.json"),
    "an old result was put in place of the newest": exchange_results,
    "the header of a swing was modified": partial(overwrite, f"{SWING}/header.json"),
    "the journal of a swing was modified": partial(overwrite, f"{SWING}/journal.jsonl"),
    "the journal of a swing was cut": cut_journal,
    "the pen file of a swing was modified": partial(overwrite, f"{SWING}/pen.json"),
    "an image was modified": partial(overwrite, f"{SWING}/images/000005.png"),
    "an image was removed": partial(remove, f"{SWING}/images/000005.png"),
    "two images were swapped": swap_images,
    "a change of the library was modified": partial(overwrite, "library/000001.json"),
    "limits were removed": partial(remove, "limits/000002.json"),
    "the chain was written anew with right hashes": rewrite,
    "the archive was begun anew": empty,
    "the archive was replaced by an older copy": roll_back_archive,
    "the data folder was replaced by an older copy": roll_back_folder,
    "on the server, an entry was modified": at_server(
        "UPDATE archive_entries SET text = replace(text, 'lightpen', 'lightpin')"
        " WHERE number = 4"
    ),
    "on the server, a searched column was modified": at_server(
        "UPDATE archive_entries SET kind = 'refused' WHERE number = 4"
    ),
    "on the server, an entry was removed": at_server(
        "DELETE FROM archive_entries WHERE number = 4"
    ),
    "on the server, a record was modified": at_server(
        "UPDATE archive_records SET text = replace(text, '2.0', '2.5')"
    ),
    "on the server, a record was removed": at_server("DELETE FROM archive_records"),
    "on the server, the chain was written anew with right hashes": rewrite_server,
}


@pytest.mark.slow
def test_a_plant_as_it_was_left_has_no_finding(plant: Plant) -> None:
    assert plant.findings() == []


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_it_is_found_that(kind: str, plant: Plant) -> None:
    KINDS[kind](plant)

    assert plant.findings()


@pytest.mark.parametrize("statement", [DROP_LAST, "DELETE FROM archive_entries"])
def test_last_entries_that_were_removed_on_the_server_are_delivered_again(
    plant: Plant, statement: str
) -> None:
    at_server(statement)(plant)
    with (
        closing(Logbook(plant.data)) as logbook,
        closing(open_server(plant.server)) as server,
    ):
        n_waiting = check_server(logbook.database, server).n_waiting
        assert n_waiting > 0
        assert deliver(logbook.database, logbook.chain, server).n_new == n_waiting
    assert plant.findings() == []


def test_a_rolled_back_folder_delivers_nothing_and_says_what_to_do(
    plant: Plant,
) -> None:
    roll_back_folder(plant)
    with (
        closing(Logbook(plant.data)) as logbook,
        closing(open_server(plant.server)) as server,
        pytest.raises(ArchiveError, match="Fetch the missing entries"),
    ):
        deliver(logbook.database, logbook.chain, server)


def test_a_rolled_back_folder_does_not_go_on(plant: Plant) -> None:
    roll_back_folder(plant)
    with pytest.raises(FileError, match=f"lacks entry {N_ENTRIES}"):
        FolderArchive(plant.data).store(result(plant.data, 9))


def test_a_rolled_back_folder_is_fetched_and_goes_on(plant: Plant) -> None:
    roll_back_folder(plant)
    with (
        closing(open_file(plant.data / ARCHIVE)) as database,
        closing(open_server(plant.server)) as server,
    ):
        assert fetch(database, plant.data, server).n_files == 1
    FolderArchive(plant.data).store(result(plant.data, 9))
    enter_in(plant.data)
    assert check_file(plant.data / ARCHIVE, plant.data, lambda _: None).findings == ()
