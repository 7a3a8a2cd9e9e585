"""What ``lightpen archive`` prints, and the exit status it ends with."""

import csv
import io
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from subprocess import CompletedProcess

import pytest
from tests.core.archive.conftest import accepted

from lightpen.archive.chains import append, own_chain
from lightpen.archive.logbook import Logbook
from lightpen.archive.store import open_file
from lightpen.commands.arguments import PASSWORD
from lightpen.local_time import local_now
from lightpen.record.library.entered_files import ARCHIVE, entered_files
from lightpen.record.library.signing import key_folder
from lightpen.record.library.supervision import (
    Signature,
    read_supervision,
    set_password,
)
from lightpen_extensions.plant.server import SERVER

Run = Callable[..., CompletedProcess[str]]


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """A data folder with three entries."""
    folder = tmp_path / "data"
    database = open_file(folder / ARCHIVE)
    chain = own_chain(database)
    for n in range(3):
        append(database, chain, *accepted(n))
    database.close()
    return folder


def test_check_says_that_nothing_was_changed(lightpen: Run, data: Path) -> None:
    result = lightpen("archive", "check", "--data", data)

    assert result.stdout == "No change was found: 3 entries, 0 files.\n"
    assert result.returncode == 0


def test_check_names_what_was_changed_and_ends_with_status_1(
    lightpen: Run, data: Path
) -> None:
    with closing(sqlite3.connect(data / ARCHIVE)) as connection, connection:
        connection.execute("DELETE FROM archive_entries WHERE number = 2")

    result = lightpen("archive", "check", "--data", data)
    assert "Entry 2 of chain" in result.stdout
    assert result.stdout.endswith("Something was changed: 2 entries, 0 files.\n")
    assert result.returncode == 1


def test_check_of_a_folder_without_an_archive_is_refused(
    lightpen: Run, tmp_path: Path
) -> None:
    result = lightpen("archive", "check", "--data", tmp_path)

    assert result.returncode == 2
    assert "does not exist or is empty" in result.stderr
    assert list(tmp_path.iterdir()) == []


def test_the_newest_entries_are_listed_first(lightpen: Run, data: Path) -> None:
    result = lightpen("archive", "list", "--most", "2", "--data", data)

    first, second = result.stdout.splitlines()
    assert "Hall 2  LP-04  T-10  accepted  pass  2.0000 0.0000 -1.5000" in first
    assert " 1.0000 0.0000 -1.5000" in second


def test_an_entry_that_was_changed_is_marked_and_not_passed_on(
    lightpen: Run, data: Path, tmp_path: Path
) -> None:
    with closing(sqlite3.connect(data / ARCHIVE)) as connection, connection:
        connection.execute(
            "UPDATE archive_entries SET text = replace(text, 'Ann', 'Bob')"
            " WHERE number = 2"
        )

    listed = lightpen("archive", "list", "--data", data).stdout.splitlines()
    assert [line.endswith("CHANGED") for line in listed] == [False, True, False]
    refused = lightpen("archive", "list", "--csv", "--data", data)
    assert refused.returncode == 2
    assert "Entry 2 of the archive" in refused.stderr


def test_entries_are_listed_as_a_table(lightpen: Run, data: Path) -> None:
    result = lightpen("archive", "list", "--pen", "lp-04", "--csv", "--data", data)

    rows = list(csv.DictReader(io.StringIO(result.stdout)))
    assert [row["tip_x_mm"] for row in rows] == ["2.0", "1.0", "0.0"]
    assert {row["operator"] for row in rows} == {"Ann"}


def test_entries_of_other_pens_are_left_out(lightpen: Run, data: Path) -> None:
    other = lightpen("archive", "list", "--pen", "LP-05", "--data", data)

    assert other.stdout.strip() == ""


def test_delivering_needs_a_server(
    lightpen: Run, data: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(SERVER, raising=False)

    result = lightpen("archive", "deliver", "--data", data)
    assert result.returncode == 2
    assert f"Set the variable {SERVER}" in result.stderr


EVE = Signature("Eve", "correct horse")


@pytest.fixture
def moved(tmp_path: Path) -> Path:
    """A data folder with a supervisor password whose station key is lost."""
    folder = tmp_path / "moved"
    set_password(folder, EVE, EVE.password, local_now())
    with closing(Logbook(folder)) as logbook:
        assert logbook.enter_owed() == ()
        (key_folder() / f"{logbook.chain}.key").unlink()
    return folder


def test_a_lost_station_key_is_replaced_with_the_approval_of_a_supervisor(
    lightpen: Run, moved: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(PASSWORD, EVE.password)
    result = lightpen("archive", "new-key", "--supervisor", "Eve", "--data", moved)

    assert (result.stderr, result.returncode) == ("", 0)
    public = entered_files(moved).station_key
    assert result.stdout == f"The station key is {public} from now on.\n"
    checked = lightpen("archive", "check", "--data", moved)
    assert (checked.returncode, "Note" in checked.stdout) == (0, False)


@pytest.mark.parametrize(
    ("words", "password", "why"),
    [
        ((), "", "supervisor"),
        (("--supervisor", "Eve"), "wrong", "password"),
        (("--supervisor", " "), EVE.password, "name"),
    ],
)
def test_a_new_station_key_without_approval_is_refused(
    lightpen: Run,
    moved: Path,
    monkeypatch: pytest.MonkeyPatch,
    words: tuple[str, ...],
    password: str,
    why: str,
) -> None:
    before = read_supervision(moved)
    monkeypatch.setenv(PASSWORD, password)
    result = lightpen("archive", "new-key", *words, "--data", moved)

    assert result.returncode == 2
    assert why in result.stderr
    assert read_supervision(moved) == before
