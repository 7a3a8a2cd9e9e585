"""A plant's server gets what each station enters: all of it, once, and in its order."""

import time
from collections.abc import Callable
from contextlib import closing
from threading import Thread

import pytest
from benchmarks.postgres_server import Postgres
from tests.core.archive.conftest import Station

from lightpen.archive.checks import check_archive
from lightpen.archive.history import EntryFilter, last_accepted, newest
from lightpen_extensions.plant import server as replication
from lightpen_extensions.plant.copies import entries_of
from lightpen_extensions.plant.server import Replicator, deliver, open_server

PATIENCE_S = 60.0
N_EACH = 30


def await_all(station: Station, address: str) -> None:
    """Wait until a server has what a station entered."""
    wanted = list(entries_of(station.database, station.chain))
    deadline = time.monotonic() + PATIENCE_S
    with closing(open_server(address)) as server:
        while list(entries_of(server, station.chain)) != wanted:
            assert time.monotonic() < deadline
            time.sleep(0.05)


@pytest.mark.slow
def test_two_stations_deliver_at_once_while_the_server_restarts(
    postgres: Postgres,
    make_station: Callable[[str], Station],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(replication, "AGAIN_S", 0.1)
    address = postgres.new_database()
    stations = [make_station("Hall 2"), make_station("Hall 3")]
    replicators = [Replicator(s.database, s.chain, address) for s in stations]

    def work(station: Station, carrying: Replicator) -> None:
        for n in range(N_EACH):
            station.enter(1, first=n)
            carrying.wake()

    threads = [
        Thread(target=work, args=each)
        for each in zip(stations, replicators, strict=True)
    ]
    for thread in threads:
        thread.start()
    postgres.stop()
    for thread in threads:
        thread.join()
    postgres.start()

    for station, carrying in zip(stations, replicators, strict=True):
        await_all(station, address)
        carrying.close(PATIENCE_S)
    with closing(open_server(address)) as server:
        checked = check_archive(server)
    assert (checked.n_entries, checked.findings) == (2 * N_EACH, ())


def test_a_station_goes_on_while_its_server_is_away(station: Station) -> None:
    away = "postgresql://plant:secret@127.0.0.1:1/plant"
    carrying = Replicator(station.database, station.chain, away)
    station.enter(3)
    carrying.close(PATIENCE_S)

    assert carrying.fault is not None
    assert "secret" not in str(carrying.fault)
    assert len(list(entries_of(station.database, station.chain))) == 3


def test_what_was_delivered_is_delivered_once(
    postgres: Postgres, station: Station
) -> None:
    station.enter(3)
    with closing(open_server(postgres.new_database())) as server:
        first = deliver(station.database, station.chain, server)
        station.enter(2, first=3)
        second = deliver(station.database, station.chain, server)
        again = deliver(station.database, station.chain, server)

        assert [each.n_new for each in (first, second, again)] == [3, 2, 0]
        assert (
            last_accepted(server, "LP-04", "T-10")
            == newest(server, EntryFilter(), 1)[0]
        )


def test_a_row_that_was_changed_on_the_server_is_named(
    postgres: Postgres, station: Station
) -> None:
    import psycopg

    address = postgres.new_database()
    station.enter(3)
    with closing(open_server(address)) as server:
        deliver(station.database, station.chain, server)
        with psycopg.connect(address) as connection:
            connection.execute("ALTER TABLE archive_entries DROP CONSTRAINT entry_hash")
            connection.execute(
                "UPDATE archive_entries SET text = replace(text, 'Ann', 'Bob')"
                " WHERE number = 2"
            )
        findings = [str(each) for each in check_archive(server).findings]

    assert findings[0] == f"Entry 2 of chain {station.chain[:8]} was modified."
