"""A database is looked at before it is written to, and said to be what it is."""

import sqlite3
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from datetime import timedelta
from pathlib import Path
from threading import Event
from time import sleep

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from benchmarks.postgres_server import PASSWORD, Postgres
from msgspec import structs
from tests.core.archive.conftest import NOON, Station, accepted

from lightpen.archive import database
from lightpen.archive.chains import append
from lightpen.archive.check import check_archive
from lightpen.archive.database import (
    MIGRATIONS,
    VERSION,
    VERSION_TABLE,
    Database,
    look_into,
    open_file,
    open_server,
)
from lightpen.archive.exchange import deliver
from lightpen.archive.history import lines
from lightpen.archive.queries import Wanted, n_wanted
from lightpen.archive.seal import close_sealed
from lightpen.archive.tables import METADATA
from lightpen.errors import ArchiveError, NoArchiveError


def differences(database: Database) -> list[object]:
    """Return in what the tables of a database are not those that are used."""
    options = {"version_table": VERSION_TABLE}
    with database.reading() as connection:
        context = MigrationContext.configure(connection, opts=options)
        return list(compare_metadata(context, METADATA))


def test_a_new_archive_has_the_tables_that_the_migrations_lead_to(
    station: Station,
) -> None:
    assert ScriptDirectory(str(MIGRATIONS)).get_current_head() == VERSION
    assert differences(station.database) == []


def test_an_archive_is_safe_against_a_power_cut(station: Station) -> None:
    with station.database.reading() as connection:
        mode = connection.exec_driver_sql("PRAGMA journal_mode").scalar_one()
        synchronous = connection.exec_driver_sql("PRAGMA synchronous").scalar_one()

    assert (mode, synchronous) == ("wal", 2)  # 2 is FULL


def test_an_archive_of_a_later_version_is_refused_and_untouched(
    tmp_path: Path,
) -> None:
    file = tmp_path / "archive.sqlite"
    open_file(file).close()
    with closing(sqlite3.connect(file)) as connection, connection:
        connection.execute(f"UPDATE {VERSION_TABLE} SET version_num = '99'")
    before = file.read_bytes()

    for opening in (open_file, look_into):
        with pytest.raises(ArchiveError, match="by a later version of the program"):
            opening(file)
    assert file.read_bytes() == before
    assert [path.name for path in tmp_path.iterdir()] == ["archive.sqlite"]


OF_VERSION_1 = (
    "DROP INDEX archive_by_clock",
    "ALTER TABLE archive_entries DROP COLUMN at_us",
    f"UPDATE {VERSION_TABLE} SET version_num = '1'",
)


def test_an_archive_of_version_1_is_read_as_it_is_and_brought_up_to_date(
    station: Station, make_station: Callable[[str], Station]
) -> None:
    ahead = structs.replace(accepted(0)[0], at=NOON + timedelta(days=9000))
    append(station.database, station.chain, ahead)
    station.enter(3)
    close_sealed(station.database)
    file = station.database.file
    assert file is not None
    with closing(sqlite3.connect(file)) as connection, connection:
        connection.execute(
            "UPDATE archive_entries SET text = 'lost' WHERE number = 4"
        )  # fmt: skip
        for statement in OF_VERSION_1:
            connection.execute(statement)
    before = file.read_bytes()

    def listed(database: Database) -> list[int]:
        found = lines(database, Wanted(end=NOON + timedelta(days=1)), 0, 9)
        return [line.number for line in found if line.entry]

    with closing(look_into(file)) as database:
        told = check_archive(database).findings
        assert listed(database) == [3, 2]
    assert file.read_bytes() == before
    assert sorted(path.suffix for path in file.parent.iterdir()) == [".seal", ".sqlite"]

    again = make_station(station.name)
    assert differences(again.database) == []
    assert listed(again.database) == [3, 2]
    assert told[-1] in check_archive(again.database).findings


def test_a_server_of_version_1_is_brought_up_to_date(
    station: Station, postgres: Postgres
) -> None:
    import psycopg

    station.enter(2)
    address = postgres.new_database()
    with closing(open_server(address)) as server:
        deliver(station.database, station.chain, server)
    with psycopg.connect(address) as connection:
        for statement in OF_VERSION_1:
            connection.execute(statement)

    station.enter(1, first=2)
    with closing(open_server(address)) as server:
        assert differences(server) == []
        deliver(station.database, station.chain, server)
        assert n_wanted(server, Wanted(begin=NOON + timedelta(minutes=1))) == 2
        assert check_archive(server).findings == ()


def test_a_database_of_another_program_is_refused_and_untouched(
    tmp_path: Path,
) -> None:
    file = tmp_path / "archive.sqlite"
    with closing(sqlite3.connect(file)) as connection, connection:
        connection.execute("CREATE TABLE songs (name TEXT)")
    before = file.read_bytes()

    with pytest.raises(ArchiveError, match="holds the tables of another program"):
        open_file(file)
    assert file.read_bytes() == before


def test_a_file_that_is_no_database_is_refused_and_untouched(tmp_path: Path) -> None:
    file = tmp_path / "archive.sqlite"
    file.write_bytes(b"Dear archive, " * 100)

    with pytest.raises(ArchiveError, match="file is not a database"):
        open_file(file)
    assert file.read_bytes() == b"Dear archive, " * 100


def test_an_archive_that_is_not_there_is_said_to_be_missing(tmp_path: Path) -> None:
    with pytest.raises(NoArchiveError, match="There is no archive"):
        look_into(tmp_path / "archive.sqlite")


@pytest.mark.parametrize("opening", [look_into, open_file])
def test_an_archive_that_may_not_be_looked_at_is_told(
    tmp_path: Path, opening: Callable[[Path], Database]
) -> None:
    path = tmp_path / (300 * "x") / "archive.sqlite"  # no system has names so long
    with pytest.raises(ArchiveError, match="xxx"):
        opening(path)


def test_an_archive_that_was_cut_off_while_it_was_made_is_empty_and_made_anew(
    tmp_path: Path,
) -> None:
    file = tmp_path / "archive.sqlite"
    file.touch()

    with pytest.raises(NoArchiveError, match="nothing was entered in it yet"):
        look_into(file)
    open_file(file).close()
    look_into(file).close()


def test_an_archive_that_another_program_holds_is_said_to_be_held(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(database, "LONGEST_WAIT_S", 0.05)
    file = tmp_path / "archive.sqlite"
    with (
        closing(open_file(file)) as archive,
        closing(sqlite3.connect(file, isolation_level=None)) as other,
    ):
        other.execute("BEGIN IMMEDIATE")
        with (
            pytest.raises(ArchiveError, match="is held by another program"),
            archive.writing(),
        ):
            pass


def test_an_archive_that_another_program_is_making_is_opened_when_that_is_done(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "archive.sqlite"
    with closing(sqlite3.connect(file, isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")
        monkeypatch.setattr(database, "sleep", lambda _: other.rollback())

        open_file(file).close()

    look_into(file).close()


@pytest.mark.parametrize("address", ["", "sqlite:///x", "no address", "http://h/d"])
def test_an_address_that_is_none_is_refused(address: str) -> None:
    with pytest.raises(ArchiveError, match="It has the form postgresql://"):
        open_server(address)


def test_wrong_credentials_are_said_without_the_password(postgres: Postgres) -> None:
    wrong = f"not-{PASSWORD}"
    with pytest.raises(ArchiveError) as caught:
        open_server(postgres.address("postgres", wrong))

    told = str(caught.value.sentence)
    assert "password authentication failed" in told
    assert PASSWORD not in told


@pytest.mark.parametrize(
    "address",
    [
        f"postgresql://plant:{PASSWORD}@127.0.0.1:1/plant",
        f"postgresql://plant:it-is@{PASSWORD}@127.0.0.1:1/plant",
        f"postgresql://127.0.0.1:1/plant?user=plant&password={PASSWORD}",
    ],
)
def test_no_way_of_giving_a_password_has_it_told(address: str) -> None:
    with pytest.raises(ArchiveError) as caught:
        open_server(address)

    assert PASSWORD not in str(caught.value.sentence)


def test_a_server_that_is_no_postgresql_is_said_to_be_unusable(gopher: int) -> None:
    with pytest.raises(ArchiveError, match="cannot be used"):
        open_server(f"postgresql://plant:{PASSWORD}@127.0.0.1:{gopher}/plant")


def test_tables_of_another_program_on_a_server_are_left_alone(
    postgres: Postgres,
) -> None:
    import psycopg

    address = postgres.new_database()
    with psycopg.connect(address) as connection:
        connection.execute("CREATE TABLE songs (name TEXT)")

    with pytest.raises(ArchiveError, match="holds the tables of another program"):
        open_server(address)


def test_an_archive_closes_after_those_who_use_it(tmp_path: Path) -> None:
    database = open_file(tmp_path / "archive.sqlite")
    is_read, may_end = Event(), Event()

    def read() -> None:
        with database.reading():
            is_read.set()
            may_end.wait()

    with ThreadPoolExecutor() as pool:
        reading = pool.submit(read)
        is_read.wait()
        closing_it = pool.submit(database.close)
        while not _is_refused(database):
            sleep(0.001)
        assert not closing_it.done()
        may_end.set()
        reading.result()
        closing_it.result()

    # The last connection takes the journal along.
    assert [file.name for file in tmp_path.iterdir()] == ["archive.sqlite"]


def _is_refused(database: Database) -> bool:
    try:
        with database.reading():
            return False
    except ArchiveError:
        return True


def test_what_is_read_while_the_archive_is_closed_is_let_go_of_after(
    tmp_path: Path,
) -> None:
    file = tmp_path / "archive.sqlite"
    database = open_file(file)
    with database.reading() as connection:
        used = connection.connection.dbapi_connection
        database.close()
        connection.exec_driver_sql("SELECT 1")

    assert isinstance(used, sqlite3.Connection)
    with pytest.raises(sqlite3.ProgrammingError, match="closed"):
        used.execute("SELECT 1")
    assert [path.name for path in tmp_path.iterdir()] == ["archive.sqlite"]


def test_an_archive_of_which_sqlite_speaks_in_no_text_is_told_to_be_damaged(
    tmp_path: Path,
) -> None:
    file = tmp_path / "archive.sqlite"
    open_file(file).close()
    data = file.read_bytes()
    damaged = data.replace(b"tablearchive_entries", b"table\x8brchive_entries")
    file.write_bytes(damaged.replace(b"CREATE TABLE archive_entries", b"?" * 28))

    for opening in (open_file, look_into):
        with pytest.raises(ArchiveError, match="disk image is malformed"):
            opening(file)
