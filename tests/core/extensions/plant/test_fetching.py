"""A data folder is restored from the server: its entries, and the files they are of."""

import shutil
from collections.abc import Callable
from contextlib import closing
from datetime import timedelta
from pathlib import Path

import pytest
from benchmarks.postgres_server import Postgres
from tests.core.archive.conftest import NOON, Station
from tests.core.archive.test_logbook import result

from lightpen.archive.checks import check_file
from lightpen.archive.logbook import Logbook
from lightpen.archive.store import Database, open_file
from lightpen.errors import ArchiveError
from lightpen.model.limits import StationLimits
from lightpen.record.library.entered_files import ARCHIVE, add_numbered
from lightpen.record.library.library_changes import Author, add_item
from lightpen.record.library.supervision import Signature, save_limits
from lightpen.record.library.tip_library import ListedCone, read_library
from lightpen.record.results.result_folder import RECORDS, FolderArchive
from lightpen_extensions.plant.copies import entries_of
from lightpen_extensions.plant.server import FetchResult, deliver, fetch, open_server


@pytest.fixture
def data(tmp_path: Path, swung: Callable[..., Path]) -> Path:
    """A data folder with a result, a taking back, another result and a cone."""
    data = tmp_path / "data"
    shutil.copytree(swung(), data / RECORDS / "swing")
    results = FolderArchive(data)
    results.store(result(data, 0))
    results.revoke(result(data, 0), "Ben", NOON + timedelta(minutes=1))
    results.store(result(data, 1))
    add_item(data, ListedCone(id="C-1"), Author("Hall 2", "Ann"), NOON)
    return data


@pytest.fixture
def address(postgres: Postgres) -> str:
    return postgres.new_database()


def deliver_all(data: Path, address: str) -> int:
    with closing(Logbook(data)) as logbook, closing(open_server(address)) as server:
        logbook.enter_owed()
        return deliver(logbook.database, logbook.chain, server).n_new


def fetch_all(data: Path, address: str, chain: str = "") -> FetchResult:
    with (
        closing(open_file(data / ARCHIVE)) as database,
        closing(open_server(address)) as server,
    ):
        return fetch(database, data, server, chain)


def findings(data: Path) -> list[str]:
    checked = check_file(data / ARCHIVE, data, lambda fraction: None)
    return list(map(str, checked.findings))


@pytest.mark.slow
def test_an_empty_folder_gets_entries_and_files_byte_by_byte(
    data: Path, address: str, tmp_path: Path
) -> None:
    deliver_all(data, address)
    new = tmp_path / "new"
    fetched = fetch_all(new, address)

    assert fetched == FetchResult(4, 4, ())
    for old in (*(data / "results").iterdir(), *(data / "library").iterdir()):
        assert (new / old.relative_to(data)).read_bytes() == old.read_bytes()
    found = FolderArchive(new).in_force("LP-04", "T-10")
    assert found is not None
    assert found.tip_pen[0] == 1.0
    assert list(read_library(new).cones) == ["C-1"]
    assert all("swing" in each for each in findings(new))


@pytest.mark.slow
def test_a_rolled_back_folder_is_as_before_and_goes_on(
    data: Path, address: str, tmp_path: Path
) -> None:
    deliver_all(data, address)
    shutil.copytree(data, tmp_path / "before")
    FolderArchive(data).store(result(data, 2))
    assert deliver_all(data, address) == 1
    shutil.rmtree(data)
    (tmp_path / "before").rename(data)
    with pytest.raises(ArchiveError, match="Fetch the missing entries"):
        deliver_all(data, address)

    assert fetch_all(data, address) == FetchResult(1, 1, ())
    FolderArchive(data).store(result(data, 3))
    assert deliver_all(data, address) == 1
    assert findings(data) == []
    assert len(FolderArchive(data).all_files()) == 5


@pytest.mark.slow
def test_the_number_of_a_file_that_is_lost_is_not_given_again(
    data: Path, address: str, tmp_path: Path
) -> None:
    """Nothing of limits is on the server: they may have the hash of a password."""
    signature = Signature("Eve", "correct horse")
    save_limits(data, "Hall 2", StationLimits(), signature, "", NOON)
    deliver_all(data, address)
    new = tmp_path / "new"

    lost = ("limits/000001.json", "limits/000002.json")
    assert fetch_all(new, address).lost == lost
    assert add_numbered(new, new / "limits", b"{}").name == "000003.json"


def test_a_file_that_is_here_is_left_as_it_is(data: Path, address: str) -> None:
    deliver_all(data, address)
    file = data / "results" / "000001.json"
    file.write_bytes(b"{}")
    (data / "results" / "000003.json").unlink()

    assert fetch_all(data, address) == FetchResult(0, 1, ())
    assert file.read_bytes() == b"{}"


def test_a_folder_with_other_entries_is_left_as_it_is(
    data: Path, address: str, tmp_path: Path
) -> None:
    shutil.copytree(data, tmp_path / "copy")
    deliver_all(data, address)
    FolderArchive(data).store(result(data, 2))
    deliver_all(data, address)
    shutil.copy(data / ARCHIVE, tmp_path / "copy")
    shutil.rmtree(data)
    (tmp_path / "copy").rename(data)
    with closing(open_server(address)) as server:
        change_last(server)

    with pytest.raises(ArchiveError, match="is not the same here and on the server"):
        fetch_all(data, address)


def change_last(server: Database) -> None:
    with server.writing() as connection:
        connection.exec_driver_sql(
            "ALTER TABLE archive_entries DROP CONSTRAINT entry_hash;"
            "UPDATE archive_entries SET sha256 = repeat('0', 64) WHERE number = 5"
        )


def test_of_several_chains_one_is_chosen(
    make_station: Callable[[str], Station], address: str, tmp_path: Path
) -> None:
    first, second = make_station("Hall 2"), make_station("Hall 3")
    with closing(open_server(address)) as server:
        for n, each in enumerate((first, second)):
            each.enter(2, first=10 * n)
            deliver(each.database, each.chain, server)

    with pytest.raises(ArchiveError, match=r"\(Hall 3\).* Choose one\."):
        fetch_all(tmp_path / "new", address)
    fetched = fetch_all(tmp_path / "new", address, second.chain[:8])
    assert fetched.n_entries == 2
    with closing(open_file(tmp_path / "new" / ARCHIVE)) as database:
        assert list(entries_of(database, second.chain)) == list(
            entries_of(second.database, second.chain)
        )


def test_a_server_without_entries_of_the_station_says_so(
    data: Path, address: str
) -> None:
    with pytest.raises(ArchiveError, match="has no entries of this station"):
        fetch_all(data, address)
