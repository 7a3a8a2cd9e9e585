"""A number that was moved in a row ends no program in a loop."""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
from sqlalchemy import text
from tests.core.archive.conftest import Station
from tests.entering import entries_of

from lightpen.archive.checks import check_archive
from lightpen.errors import ArchiveError

MOVE = text(
    "UPDATE archive_entries SET number = number + 1"
    " WHERE number = (SELECT max(number) FROM archive_entries)"
)


@pytest.fixture
def moved(make_station: Callable[[str], Station]) -> Station:
    station = make_station("Hall 2")
    station.enter(3)
    with station.database.writing() as connection:
        connection.execute(MOVE)
    return station


@pytest.mark.timeout(60)
def test_a_check_names_the_entry_and_ends(moved: Station, tmp_path: Path) -> None:
    checked = check_archive(moved.database, tmp_path)
    assert {"archive.entry-missing", "archive.entry-changed"} <= {
        each.code for each in checked.findings
    }


@pytest.mark.timeout(60)
def test_entries_are_read_up_to_it(moved: Station, tmp_path: Path) -> None:
    with pytest.raises(ArchiveError, match="Entry 4"):
        entries_of(moved.database, moved.chain)


@pytest.mark.timeout(60)
def test_neither_delivery_nor_fetching_follows_it(
    moved: Station, make_station: Callable[[str], Station], tmp_path: Path
) -> None:
    from lightpen_extensions.plant.server import deliver, fetch

    other = make_station("other")
    with pytest.raises(ArchiveError, match="Entry 4"):
        deliver(moved.database, moved.chain, other.database)
    with pytest.raises(ArchiveError):
        fetch(other.database, tmp_path, moved.database, moved.chain)
    with suppress(ArchiveError):
        fetch(moved.database, tmp_path, other.database, moved.chain)
