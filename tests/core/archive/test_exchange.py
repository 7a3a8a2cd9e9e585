"""Entries travel by a file, and what is there already is passed over."""

import json
import os
from collections.abc import Callable
from contextlib import closing
from hashlib import sha256
from pathlib import Path

import pytest
from msgspec import structs
from sqlalchemy import text
from tests.core.archive.conftest import Station, accepted

from lightpen.archive.chains.chains import entries_of, heads, records_of
from lightpen.archive.chains.entries import FileHash
from lightpen.archive.chains.growth import append, own_chain
from lightpen.archive.chains.seal import close_sealed
from lightpen.archive.checks.check import check_archive, check_file
from lightpen.archive.logbook.logbook import ARCHIVE
from lightpen.archive.replication.exchange import (
    LONGEST_LINE,
    deliver,
    export_entries,
    import_entries,
)
from lightpen.archive.store.database import open_file
from lightpen.errors import ArchiveError, FileError, NameTakenError


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


def test_an_export_is_on_the_disk_whole(
    station: Station, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    station.enter(3)
    lengths: list[int] = []
    monkeypatch.setattr(
        "os.fsync", lambda descriptor: lengths.append(os.fstat(descriptor).st_size)
    )

    export_entries(station.database, tmp_path / "all.jsonl")

    assert lengths == [(tmp_path / "all.jsonl").stat().st_size]


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
        (lambda lines: ['{"lightpen_archive": 2}\n', *lines[1:]], 2),
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


def test_nothing_is_taken_up_of_the_chains_before_a_damaged_one(
    make_station: Callable[[str], Station], tmp_path: Path
) -> None:
    first, second, third = map(make_station, ("Hall 2", "Hall 3", "Hall 4"))
    file = tmp_path / "first"
    for station in (first, second):
        station.enter(1)
    export_entries(first.database, file)
    import_entries(second.database, file)
    export_entries(second.database, tmp_path / "both")
    lines = (tmp_path / "both").read_text().splitlines(keepends=True)
    (tmp_path / "both").write_text("".join([*lines[:-1], "Regards\n"]))

    with pytest.raises(FileError, match="line 4"):
        import_entries(third.database, tmp_path / "both")
    assert [head.number for head in heads(third.database)] == [0]


def test_a_server_with_another_last_entry_is_reported_though_nothing_is_new(
    make_station: Callable[[str], Station],
) -> None:
    here, server = make_station("Hall 2"), make_station("server")
    here.enter(2)
    assert deliver(here.database, here.chain, server.database).n_new == 2
    other = text("UPDATE archive_entries SET sha256 = 'another' WHERE number = 2")
    with server.database.writing() as connection:
        connection.execute(other)

    with pytest.raises(ArchiveError, match="Entry 2"):
        deliver(here.database, here.chain, server.database)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs pipes")
def test_a_check_reads_no_pipe_and_no_device(data_of_pipes: Path) -> None:
    findings = check_file(
        data_of_pipes / ARCHIVE, data_of_pipes, lambda _: None
    ).findings
    assert [each.code for each in findings] == ["read.device"] * 2


@pytest.fixture
def data_of_pipes(tmp_path: Path) -> Path:
    """A data folder whose entries vouch for a pipe and a device."""
    data = tmp_path / "data"
    database = open_file(data / ARCHIVE)
    chain = own_chain(database)
    os.mkfifo(data / "pipe")
    for n, place in enumerate((data / "pipe", Path("/dev/zero"))):
        event, record = accepted(n)
        file = FileHash(str(place), "0" * 64)
        append(database, chain, structs.replace(event, result=file), record)
    close_sealed(database)
    return data


def test_an_import_takes_no_line_without_end(station: Station, tmp_path: Path) -> None:
    file = tmp_path / "long.jsonl"
    with file.open("wb") as stream:
        stream.write(b'{"lightpen_archive": 1}\n{"entry": "')
        stream.seek(LONGEST_LINE, os.SEEK_CUR)
        stream.write(b'"}\n')
    with pytest.raises(FileError, match="line 2"):
        import_entries(station.database, file)


@pytest.mark.parametrize("part", ["entry", "record", "signature"])
def test_half_of_a_character_is_refused(
    station: Station, tmp_path: Path, part: str
) -> None:
    station.enter(1)
    export_entries(station.database, tmp_path / "all.jsonl")
    first, line, _ = (tmp_path / "all.jsonl").read_bytes().splitlines(keepends=True)
    entry = json.loads(line)
    entry[part] += "\ud800"
    body = first + json.dumps(entry).encode() + b"\n"
    end = {"n_entries": 1, "sha256": sha256(body).hexdigest()}
    file = tmp_path / "half.jsonl"
    file.write_bytes(body + json.dumps(end).encode() + b"\n")
    with (
        closing(open_file(tmp_path / "other" / ARCHIVE)) as other,
        pytest.raises((FileError, ArchiveError)),
    ):
        import_entries(other, file)
