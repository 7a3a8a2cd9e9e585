"""Entries are delivered and exported."""

import os
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest
from benchmarks.postgres_server import Postgres
from msgspec import structs
from sqlalchemy import text
from tests.core.archive.conftest import Station, accepted

from lightpen.archive.chains import FileHash, append, chain_names, own_chain
from lightpen.archive.checks import check_file
from lightpen.archive.store import Database, open_file
from lightpen.errors import ArchiveError
from lightpen.record.library.entered_files import ARCHIVE
from lightpen_extensions.plant.copies import copy_entries, entries_of, records_of
from lightpen_extensions.plant.server import deliver, open_server


@pytest.fixture
def server(postgres: Postgres) -> Iterator[Database]:
    """A server as a station sees it."""
    role = postgres.new_role(postgres.new_database(), "lightpen_station")
    with closing(open_server(role)) as database:
        yield database


def test_a_copy_takes_each_entry_once(station: Station, server: Database) -> None:
    entries = station.enter(4)
    records = records_of(station.database, entries)

    first = copy_entries(server, station.chain, entries[:3], records)
    again = copy_entries(server, station.chain, entries, records)

    assert (first, again) == (3, 1)
    assert list(entries_of(server, station.chain)) == entries
    assert records_of(server, entries) == records


def test_a_copy_does_not_go_on_with_another_history(
    make_station: Callable[[str], Station], server: Database
) -> None:
    here, nameless = make_station("Hall 2"), make_station("")
    first, second, third = here.enter(3)
    records = records_of(here.database, [first, second, third])
    copy_entries(server, here.chain, [first, second], records)

    torn = replace(third, entry=structs.replace(third.entry, previous="0" * 64))
    with pytest.raises(
        ArchiveError, match="not continue with entry 3 of the station Hall 2"
    ):
        copy_entries(server, here.chain, [torn], records)

    (_, second) = nameless.enter(2)
    records = records_of(nameless.database, [second])
    reported = f"not continue with entry 2 of chain {nameless.chain[:8]}"
    with pytest.raises(ArchiveError, match=reported):
        copy_entries(server, nameless.chain, [second], records)


def test_a_copy_refuses_a_record_that_is_not_the_one(
    station: Station, server: Database
) -> None:
    entries = station.enter(1)
    changed = dict.fromkeys(records_of(station.database, entries), "{}")

    with pytest.raises(ArchiveError, match="is missing or was modified"):
        copy_entries(server, station.chain, entries, changed)
    assert chain_names(server) == ()


def test_a_server_with_another_last_entry_is_reported_though_nothing_is_new(
    station: Station, server: Database
) -> None:
    station.enter(2)
    assert deliver(station.database, station.chain, server).n_new == 2
    other = text("UPDATE archive_entries SET sha256 = 'another' WHERE number = 2")
    with station.database.writing() as connection:
        connection.execute(other)

    with pytest.raises(ArchiveError, match="Entry 2"):
        deliver(station.database, station.chain, server)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs pipes")
def test_a_check_reads_no_pipe_and_no_device(data_of_pipes: Path) -> None:
    findings = check_file(
        data_of_pipes / ARCHIVE, data_of_pipes, lambda _: None
    ).findings
    assert [each.code for each in findings] == ["read.device"] * 2


@pytest.fixture
def data_of_pipes(tmp_path: Path) -> Path:
    """A data folder whose entries vouch for a pipe and a device."""
    data = tmp_path / "data"
    database = open_file(data / ARCHIVE)
    chain = own_chain(database)
    os.mkfifo(data / "pipe")
    for n, place in enumerate((data / "pipe", Path("/dev/zero"))):
        event, record = accepted(n)
        file = FileHash(str(place), "0" * 64)
        append(database, chain, structs.replace(event, result=file), record)
    database.close()
    return data
