"""A server is called by its address, encrypted, and each role has its rights alone."""

from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import psycopg
import pytest
from benchmarks.postgres_server import PASSWORD, Postgres
from tests.core.archive.conftest import Station

from lightpen.archive.chains import chain_names
from lightpen.archive.checks import check_archive
from lightpen.errors import ArchiveError
from lightpen_extensions.plant.copies import entries_of, records_of
from lightpen_extensions.plant.server import deliver, open_server


@pytest.mark.parametrize("address", ["", "sqlite:///x", "no address", "http://h/d"])
def test_an_address_that_is_none_is_refused(address: str) -> None:
    with pytest.raises(ArchiveError, match="It has the form postgresql://"):
        open_server(address)


def test_wrong_credentials_are_said_without_the_password(postgres: Postgres) -> None:
    wrong = f"not-{PASSWORD}"
    with pytest.raises(ArchiveError) as caught:
        open_server(postgres.address("postgres", wrong))

    reported = str(caught.value.message)
    assert "password authentication failed" in reported
    assert PASSWORD not in reported


@pytest.mark.parametrize(
    "address",
    [
        f"postgresql://plant:{PASSWORD}@127.0.0.1:1/plant",
        f"postgresql://plant:it-is@{PASSWORD}@127.0.0.1:1/plant",
        f"postgresql://127.0.0.1:1/plant?user=plant&password={PASSWORD}",
    ],
)
def test_no_way_of_giving_a_password_reveals_it(address: str) -> None:
    with pytest.raises(ArchiveError) as caught:
        open_server(address)

    assert PASSWORD not in str(caught.value.message)


def test_a_server_that_is_no_postgresql_is_said_to_be_unusable(gopher: int) -> None:
    with pytest.raises(ArchiveError, match="is not available"):
        open_server(f"postgresql://plant:{PASSWORD}@127.0.0.1:{gopher}/plant")


def test_tables_of_another_program_on_a_server_are_left_alone(
    postgres: Postgres,
) -> None:
    address = postgres.new_database("CREATE TABLE songs (name TEXT)")

    with pytest.raises(ArchiveError, match="contains the tables of another program"):
        open_server(address)


def test_an_empty_database_names_the_command_that_sets_it_up(
    postgres: Postgres,
) -> None:
    with pytest.raises(ArchiveError, match="Its administrator must set it up"):
        open_server(postgres.new_database(""))


def test_a_line_is_encrypted_and_the_server_verified_unless_the_address_says_otherwise(
    postgres: Postgres,
) -> None:
    open_address = postgres.new_database()
    address = open_address.removesuffix("?sslmode=disable")
    by_name = address.replace("@127.0.0.1:", "@localhost:")
    trusting = f"?sslrootcert={postgres.certificate}"
    is_encrypted = "SELECT ssl FROM pg_stat_ssl WHERE pid = pg_backend_pid()"
    with closing(open_server(by_name + trusting)) as server, server.reading() as line:
        assert line.exec_driver_sql(is_encrypted).scalar_one()
    with closing(open_server(open_address)) as server, server.reading() as line:
        assert not line.exec_driver_sql(is_encrypted).scalar_one()
    with pytest.raises(ArchiveError, match="root certificate file"):
        open_server(by_name)
    with pytest.raises(ArchiveError, match="does not match host name"):
        open_server(address + trusting)


def test_the_password_may_be_in_a_file(postgres: Postgres, tmp_path: Path) -> None:
    file = tmp_path / "password"
    file.write_text(f"127.0.0.1:*:*:plant:{PASSWORD}\n")
    file.chmod(0o600)
    address = postgres.new_database().replace(f":{PASSWORD}@", "@")

    open_server(f"{address}&passfile={file}").close()


@pytest.fixture(scope="module")
def address(postgres: Postgres) -> str:
    """The address of a server, for its administrator."""
    return postgres.new_database()


@pytest.mark.parametrize(
    "statement",
    [
        "UPDATE archive_entries SET text = replace(text, 'Ann', 'Bob')",
        "DELETE FROM archive_entries",
        "TRUNCATE archive_entries",
        "UPDATE archive_records SET text = '{}'",
        "DELETE FROM archive_records",
        "UPDATE archive_writers SET writer = 'another'",
        "DELETE FROM archive_writers",
        "DROP TABLE archive_entries",
        "ALTER TABLE archive_entries DISABLE ROW LEVEL SECURITY",
    ],
)
def test_a_station_adds_entries_and_can_change_none(
    postgres: Postgres, address: str, station: Station, statement: str
) -> None:
    own = postgres.new_role(address, "lightpen_station")
    entries = station.enter(3)
    with closing(open_server(own)) as server:
        assert deliver(station.database, station.chain, server).n_new == 3
        assert list(entries_of(server, station.chain)) == entries
        assert check_archive(server).findings == ()
    with (
        psycopg.connect(own) as connection,
        pytest.raises(psycopg.errors.InsufficientPrivilege),
    ):
        connection.execute(statement)


def test_a_station_sees_and_continues_its_own_chain_alone(
    postgres: Postgres, make_station: Callable[[str], Station]
) -> None:
    address = postgres.new_database()
    here, there = make_station("Hall 2"), make_station("Hall 3")
    entries = here.enter(2)
    there.enter(3, first=10)
    with closing(open_server(postgres.new_role(address, "lightpen_station"))) as server:
        deliver(here.database, here.chain, server)
    with closing(open_server(postgres.new_role(address, "lightpen_station"))) as server:
        deliver(there.database, there.chain, server)
        assert chain_names(server) == (there.chain,)
        assert records_of(server, entries) == {}
        with pytest.raises(ArchiveError, match="duplicate key"):
            deliver(here.database, here.chain, server)
    with closing(open_server(postgres.new_role(address, "lightpen_auditor"))) as server:
        assert set(chain_names(server)) == {here.chain, there.chain}
        assert check_archive(server).n_entries == 5
        here.enter(1, first=3)
        with pytest.raises(ArchiveError, match="permission denied"):
            deliver(here.database, here.chain, server)


def test_what_does_not_have_its_hash_is_not_taken(
    postgres: Postgres, address: str, station: Station
) -> None:
    own = postgres.new_role(address, "lightpen_station")
    with psycopg.connect(own) as connection:
        for put in (
            "INSERT INTO archive_records VALUES (repeat('0', 64), '{}')",
            "INSERT INTO archive_entries (chain, number, sha256, since_us, kind,"
            " station, pen, tip, is_simulated, swing, result, concerns,"
            " record_sha256, text, at_us, signature) VALUES ('c', 1, repeat('0', 64),"
            " 0, '', '', '', '', false, '', '', '', '', '{}', 0, '')",
        ):
            with pytest.raises(psycopg.Error), connection.transaction():
                connection.execute(put)
