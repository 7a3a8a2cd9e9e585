"""Whatever is changed in an archive is found, and named."""

import random
import re
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest
from tests.core.archive.conftest import Station
from tests.entering import entries_of, records_in

from lightpen.archive.chains import chain_names
from lightpen.archive.checks import check_archive, check_file
from lightpen.archive.store import look_into
from lightpen.errors import ArchiveError

N_FLIPS = 60


@pytest.fixture
def archive(station: Station) -> Path:
    """The file of an archive of five entries, closed."""
    station.enter(5)
    station.database.close()
    assert station.database.file is not None
    return station.database.file


def findings(archive: Path) -> list[str]:
    """Return what a check finds, or why it cannot look."""
    try:
        with closing(look_into(archive)) as database:
            found = check_archive(database, archive.parent).findings
            return [str(each) for each in found]
    except ArchiveError as error:
        return [str(error.message)]


def change(archive: Path, *statements: str) -> None:
    """Change an archive with tools that know SQL."""
    with closing(sqlite3.connect(archive)) as connection, connection:
        for statement in statements:
            assert connection.execute(statement).rowcount > 0


def test_an_archive_as_it_was_entered_passes(archive: Path) -> None:
    with closing(look_into(archive)) as database:
        checked = check_archive(database)

    assert (checked.n_entries, checked.findings) == (5, ())


def test_what_is_entered_during_a_check_is_no_change(station: Station) -> None:
    station.enter(2)
    left = [3]

    def enter(fraction: float) -> None:
        if left:
            station.enter(left.pop(), first=2)

    assert check_archive(station.database, None, enter).findings == ()
    assert not left


def test_a_file_that_a_program_writes_during_a_check_is_looked_at_again(
    archive: Path,
) -> None:
    whole = archive.read_bytes()
    archive.write_bytes(whole.replace(b"Ann", b"Bob"))  # as if read half written
    left = [whole]

    def write(fraction: float) -> None:
        if left:
            archive.write_bytes(left.pop())

    assert check_file(archive, archive.parent, write).findings == ()


@pytest.mark.parametrize(
    ("column", "value"),
    [
        ("text", "replace(text, 'Ann', 'Bob')"),
        ("text", "CAST(text AS BLOB)"),
        ("signature", "CAST(signature AS BLOB)"),
        ("station", "'Hall 9'"),
        ("since_us", "since_us + 1"),
        ("sha256", f"'{'0' * 64}'"),
        ("kind", "'refused'"),
        ("number", "'three'"),
    ],
)
def test_a_changed_row_is_named(archive: Path, column: str, value: str) -> None:
    change(archive, f"UPDATE archive_entries SET {column} = {value} WHERE number = 3")

    assert any("Entry 3 of chain" in each for each in findings(archive))


ROW = "archive_entries WHERE number"
RECORD = "WHERE text LIKE '%\"n\": 3%'"


@pytest.mark.parametrize(
    ("statement", "named"),
    [
        (f"DELETE FROM {ROW} = 2", "Entry 2 .*missing"),
        (f"DELETE FROM {ROW} > 3", "lacks entry 5"),
        (
            f"UPDATE archive_records SET text = replace(text, '3', '4') {RECORD}",
            "entry 4 of chain.*changed",
        ),
        ("UPDATE archive_records SET text = CAST(text AS BLOB)", "entry 4 of chain"),
        (f"DELETE FROM archive_records {RECORD}", "The record of entry 4"),
        (
            "UPDATE archive_entries SET chain = 'other' WHERE number = 5",
            "The archive contains entries of another chain, other",
        ),
    ],
)
def test_what_was_removed_or_changed_is_named_by_its_entry(
    archive: Path, statement: str, named: str
) -> None:
    change(archive, statement)

    assert any(re.match(f".*{named}", each) for each in findings(archive))


def test_a_row_rewritten_with_a_right_hash_breaks_the_chain(
    archive: Path, make_station: Callable[[str], Station]
) -> None:
    other = make_station("Hall 3")
    entries = other.enter(3)
    with closing(sqlite3.connect(archive)) as connection, connection:
        (chain,) = connection.execute(
            "SELECT DISTINCT chain FROM archive_entries"
        ).fetchone()
        text = entries[2].text.replace(other.chain, chain)
        from lightpen.archive.chains import text_sha256

        connection.execute(
            "UPDATE archive_entries SET text = ?, sha256 = ?, station = 'Hall 3',"
            " since_us = (SELECT since_us FROM archive_entries WHERE number = 3)"
            " WHERE number = 3",
            (text, text_sha256(text)),
        )

    assert any(
        "Entry 3 " in each and "does not match its predecessor" in each
        for each in findings(archive)
    )


@pytest.mark.slow
def test_a_byte_changed_anywhere_in_the_file_is_found_or_changes_nothing(
    archive: Path, tmp_path: Path
) -> None:
    data, before = archive.read_bytes(), content(archive)
    rng, copy = random.Random(1), tmp_path / archive.name
    for _ in range(N_FLIPS):
        place = rng.randrange(len(data))
        changed = bytearray(data)
        changed[place] ^= rng.randrange(1, 256)
        copy.write_bytes(changed)
        assert findings(copy) or content(copy) == before, f"byte {place}"


def content(archive: Path) -> list[object]:
    with closing(look_into(archive)) as database:
        (chain,) = chain_names(database)
        return [*entries_of(database, chain), records_in(database)]


def test_last_entries_that_were_taken_out_with_all_that_tells_of_them_are_named(
    archive: Path, make_station: Callable[[str], Station]
) -> None:
    with closing(sqlite3.connect(archive)) as connection, connection:
        connection.execute("DELETE FROM archive_entries WHERE number > 3")
        connection.execute("DELETE FROM archive_records WHERE text LIKE '%: 4%'")

    (found,) = findings(archive)
    assert "lacks entry 5, which was entered in this user account" in found
    with pytest.raises(ArchiveError, match="lacks entry 5"):  # which would hide it
        make_station(archive.parent.name).enter(4, first=10)


def test_an_archive_that_was_emptied_and_begun_anew_is_found(
    archive: Path, make_station: Callable[[str], Station]
) -> None:
    archive.write_bytes(b"")
    assert "does not exist or is empty." in findings(archive)[0]

    with pytest.raises(ArchiveError, match="lacks entry 5"):
        make_station(archive.parent.name).enter(7, first=10)
    (found,) = findings(archive)
    assert "lacks entry 5" in found
