"""Entries are signed by their station, and nobody else can continue its chain."""

from contextlib import closing
from dataclasses import replace

import pytest
from benchmarks.postgres_server import Postgres
from sqlalchemy import update
from tests.core.archive.conftest import Station, accepted
from tests.entering import entries_of, records_in

from lightpen.archive.chains import ChainHead, StoredEntry, chained
from lightpen.archive.checks import check_archive
from lightpen.archive.store import ENTRIES
from lightpen.errors import ArchiveError
from lightpen.record.library.signing import key_folder, make_station_key


def head_of(station: Station) -> ChainHead:
    last = entries_of(station.database, station.chain)[-1]
    entry = last.entry
    return ChainHead(entry.chain, entry.number, last.sha256, entry.since)


def forged(station: Station, n: int) -> tuple[StoredEntry, dict[str, str]]:
    """Return an entry that continues a chain without its key, and its record."""
    event, record = accepted(n)
    entry = chained(head_of(station), event)
    key = make_station_key()
    signature = key.public + key.sign(b"lightpen entry\n" + entry.sha256.encode())
    return replace(entry, signature=signature), {event.record_sha256 or "": record}


def test_nobody_else_continues_the_chain_of_a_station(
    station: Station, postgres: Postgres
) -> None:
    from lightpen_extensions.plant.copies import copy_entries
    from lightpen_extensions.plant.server import open_server

    known = station.enter(3)
    role = postgres.new_role(postgres.new_database(), "lightpen_station")
    entry, records = forged(station, 3)
    unsigned = replace(entry, signature="")
    with closing(open_server(role)) as there:
        copy_entries(there, station.chain, known, records_in(station.database))
        with pytest.raises(ArchiveError, match="signed by a key that is not the stat"):
            copy_entries(there, station.chain, [entry], records)
        with pytest.raises(ArchiveError, match="missing or wrong"):
            copy_entries(there, station.chain, [unsigned], records)
        assert check_archive(there).findings == ()


def test_a_signature_that_was_changed_is_found(station: Station) -> None:
    entry = station.enter(2)[0]
    other = ("0" if entry.signature[-1] != "0" else "1").join(
        [entry.signature[:-1], ""]
    )
    with station.database.writing() as connection:
        connection.execute(
            update(ENTRIES).where(ENTRIES.c.number == 1).values(signature=other)
        )
    (finding,) = check_archive(station.database).findings
    assert finding.code == "archive.signature-wrong"


def test_the_private_key_is_readable_by_its_account_alone(station: Station) -> None:
    file = key_folder() / f"{station.chain}.key"
    assert file.stat().st_mode & 0o077 == 0


def test_nothing_is_entered_without_the_key_of_the_station(station: Station) -> None:
    station.enter(1)
    (key_folder() / f"{station.chain}.key").unlink()
    with pytest.raises(ArchiveError, match="not in this user account"):
        station.enter(1, 1)
    assert len(entries_of(station.database, station.chain)) == 1
