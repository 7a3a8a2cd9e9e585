"""A database is looked at before it is written to, and said to be what it is."""

import sqlite3
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path
from threading import Event
from time import sleep

import pytest
from tests.core.archive.conftest import Station

from lightpen.archive import store as database
from lightpen.archive.store import VERSION_TABLE, Database, look_into, open_file
from lightpen.errors import ArchiveError, NoArchiveError


def test_an_archive_is_safe_against_a_power_cut(station: Station) -> None:
    with station.database.reading() as connection:
        mode = connection.exec_driver_sql("PRAGMA journal_mode").scalar_one()
        synchronous = connection.exec_driver_sql("PRAGMA synchronous").scalar_one()

    assert (mode, synchronous) == ("wal", 2)  # 2 is FULL


def test_an_archive_of_a_later_version_is_refused_and_untouched(tmp_path: Path) -> None:
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


def test_a_database_of_another_program_is_refused_and_untouched(tmp_path: Path) -> None:
    file = tmp_path / "archive.sqlite"
    with closing(sqlite3.connect(file)) as connection, connection:
        connection.execute("CREATE TABLE songs (name TEXT)")
    before = file.read_bytes()

    with pytest.raises(ArchiveError, match="contains the tables of another program"):
        open_file(file)
    assert file.read_bytes() == before


def test_a_file_that_is_no_database_is_refused_and_untouched(tmp_path: Path) -> None:
    file = tmp_path / "archive.sqlite"
    file.write_bytes(b"Dear archive, " * 100)

    with pytest.raises(ArchiveError, match="file is not a database"):
        open_file(file)
    assert file.read_bytes() == b"Dear archive, " * 100


def test_an_archive_that_is_not_there_is_said_to_be_missing(tmp_path: Path) -> None:
    with pytest.raises(NoArchiveError, match=r"The archive .* does not exist"):
        look_into(tmp_path / "archive.sqlite")


@pytest.mark.parametrize("opening", [look_into, open_file])
def test_an_archive_that_may_not_be_looked_at_is_reported(
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

    with pytest.raises(NoArchiveError, match="does not exist or is empty"):
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
            pytest.raises(ArchiveError, match="has been locked by another program"),
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


def test_an_archive_of_which_sqlite_speaks_in_no_text_is_reported_to_be_damaged(
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
