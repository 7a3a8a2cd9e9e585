"""A chain grows by whole entries, in one order, and is copied without doubling."""

from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import replace
from datetime import timedelta
from itertools import pairwise
from pathlib import Path

from msgspec import structs
from tests.core.archive.conftest import NOON, Station, accepted
from tests.entering import entries_of

from lightpen.archive.chains import (
    FileHash,
    Kind,
    append,
    chain_head,
    chain_names,
    own_chain,
)
from lightpen.archive.history import EntryFilter, last_accepted, n_wanted, newest
from lightpen.archive.store import open_file
from lightpen.record.library.entered_files import NOTHING_BEFORE

N_EACH = 20


def test_each_entry_carries_the_hash_of_the_one_before(station: Station) -> None:
    entries = station.enter(3)

    assert [each.entry.number for each in entries] == [1, 2, 3]
    assert [each.entry.previous for each in entries] == [
        NOTHING_BEFORE,
        entries[0].sha256,
        entries[1].sha256,
    ]
    assert list(entries_of(station.database, station.chain)) == entries


def test_a_data_folder_keeps_its_chain(station: Station) -> None:
    assert own_chain(station.database) == station.chain


def test_order_holds_though_the_clock_was_set_back(station: Station) -> None:
    first, record = accepted(5)
    early = structs.replace(first, at=NOON - timedelta(days=400))
    append(station.database, station.chain, first, record)
    second = append(station.database, station.chain, early, record)

    assert second is not None
    assert second.entry.event.at == early.at
    assert second.entry.since > first.at
    assert last_accepted(station.database, "LP-04", "T-10") == second


def test_the_same_result_is_entered_once(station: Station) -> None:
    event, record = accepted(1)
    event = structs.replace(event, result=FileHash("results/000001.json", "0" * 64))

    assert append(station.database, station.chain, event, record) is not None
    assert append(station.database, station.chain, event, record) is None
    assert chain_head(station.database, station.chain).number == 1


def test_what_was_taken_back_is_not_the_last_accepted(station: Station) -> None:
    first, second = station.enter(2)
    back = structs.replace(
        second.entry.event,
        kind=Kind.REVOKED,
        record_sha256=None,
        concerns=second.sha256,
    )
    append(station.database, station.chain, back)

    assert last_accepted(station.database, "LP-04", "T-10") == first
    assert last_accepted(station.database, "LP-04", "T-10", is_simulated=True) is None


def test_two_programs_of_one_folder_share_a_chain(tmp_path: Path) -> None:
    file = tmp_path / "archive.sqlite"

    def enter_some(name: str) -> None:
        with closing(open_file(file)) as database:
            Station(database, own_chain(database), name).enter(N_EACH)

    with ThreadPoolExecutor() as executor:
        list(executor.map(enter_some, ("one", "other")))

    database = open_file(file)
    (chain,) = chain_names(database)
    entries = list(entries_of(database, chain))
    database.close()
    assert len(entries) == 2 * N_EACH
    assert all(
        later.entry.previous == earlier.sha256 for earlier, later in pairwise(entries)
    )


def test_entries_are_found_by_pen_station_and_time(station: Station) -> None:
    database, entries = station.database, station.enter(5)
    foreign = Station(database, station.chain, "Hall 3").enter(3, first=10)

    assert newest(database, EntryFilter(pen="LP-04"), 3) == tuple(reversed(foreign))
    assert newest(database, EntryFilter(station="Hall 2"), 9) == tuple(
        reversed(entries)
    )
    assert n_wanted(database, EntryFilter(tip="T-11")) == 0
    begin, end = NOON + timedelta(minutes=1), NOON + timedelta(minutes=3)
    assert newest(database, EntryFilter(begin=begin, end=end), 9) == (
        entries[2],
        entries[1],
    )
    page = newest(database, EntryFilter(), 2)
    assert newest(database, EntryFilter(), 2, page[-1].entry) == (
        foreign[0],
        entries[4],
    )


def test_names_of_any_characters_are_kept_and_found(station: Station) -> None:
    event, record = accepted(1)
    odd = replace(event.names, pen="笔\udcff\0'%")
    append(station.database, station.chain, structs.replace(event, names=odd), record)

    (found,) = newest(station.database, EntryFilter(pen=odd.pen), 9)
    assert found.entry.event.names == odd
