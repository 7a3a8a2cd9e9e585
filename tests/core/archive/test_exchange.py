"""Entries travel by a file, and what is there already is passed over."""

from collections.abc import Callable
from pathlib import Path

import pytest
from tests.core.archive.conftest import Station

from lightpen.archive.chains import entries_of, heads, records_of
from lightpen.archive.check import check_archive
from lightpen.archive.exchange import export_entries, import_entries
from lightpen.errors import FileError, NameTakenError


def test_what_is_exported_is_taken_up_once(
    make_station: Callable[[str], Station], tmp_path: Path
) -> None:
    here, there = make_station("Hall 2"), make_station("Hall 3")
    entries = here.enter(3)
    there.enter(2)
    file = tmp_path / "all.jsonl"

    assert export_entries(here.database, file) == 3
    assert import_entries(there.database, file).n_new == 3
    again = import_entries(there.database, file)

    assert (again.n_new, again.n_known) == (0, 3)
    assert list(entries_of(there.database, here.chain)) == entries
    assert records_of(there.database, entries) == records_of(here.database, entries)
    assert check_archive(there.database).findings == ()


def test_all_chains_travel_on(
    make_station: Callable[[str], Station], tmp_path: Path
) -> None:
    first, second, third = map(make_station, ("Hall 2", "Hall 3", "Hall 4"))
    first.enter(1)
    second.enter(2)
    export_entries(first.database, tmp_path / "first")
    import_entries(second.database, tmp_path / "first")
    export_entries(second.database, tmp_path / "both")

    assert import_entries(third.database, tmp_path / "both").n_new == 3
    assert {head.chain for head in heads(third.database)} == {
        first.chain,
        second.chain,
        third.chain,
    }


def test_an_export_replaces_no_file(station: Station, tmp_path: Path) -> None:
    file = tmp_path / "all.jsonl"
    file.write_text("mine")

    with pytest.raises(NameTakenError, match="Give the export another name"):
        export_entries(station.database, file)
    assert file.read_text() == "mine"


@pytest.mark.parametrize(
    ("spoil", "line"),
    [
        (lambda lines: lines[:-1], 5),  # its end is missing
        (lambda lines: [*lines[:2], *lines[3:]], 4),  # an entry is missing
        (lambda lines: [*lines[:2], lines[2][:-40] + "\n", *lines[3:]], 3),
        (lambda lines: [*lines[:3], lines[3].replace("T-10", "T-11"), lines[4]], 5),
        (lambda lines: ['{"lightpen_archive": 1}\n', *lines[1:]], 2),
        (lambda lines: ["Dear archive\n"], 2),
    ],
)
def test_nothing_is_taken_up_of_a_file_that_is_not_whole(
    make_station: Callable[[str], Station],
    tmp_path: Path,
    spoil: Callable[[list[str]], list[str]],
    line: int,
) -> None:
    here, there = make_station("Hall 2"), make_station("Hall 3")
    here.enter(3)
    file = tmp_path / "all.jsonl"
    export_entries(here.database, file)
    file.write_text("".join(spoil(file.read_text().splitlines(keepends=True))))

    with pytest.raises(FileError, match=f"line {line}"):
        import_entries(there.database, file)
    assert [head.number for head in heads(there.database)] == [0]
